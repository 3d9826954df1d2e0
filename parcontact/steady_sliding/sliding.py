"""Steady sliding of a job's surface, solved directly: points of a friction curve, and starts of marches."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..accuracy.budget import ErrorBudget, estimate_steady
from ..accuracy.observation import RunProperties, StepObservation, properties_of
from ..doubts import Doubt
from ..effects.heat.flash import Flash
from ..effects.heat.heating import Feedback, describe_cold_state, find_temperatures
from ..effects.relaxation import highest_temperature_of, temperature_of
from ..errors import InputError, RunError
from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab
from ..physics.convolution import Convolution
from ..physics.measures import Measures
from ..scene import Setup, choices, sanity
from ..solve import kernels, nested
from ..solve.certificate import Certificate
from ..solve.local_load import LEAST_CUT
from ..solve.nonsymmetric import proximal
from ..solve.nonsymmetric.proximal import Proximal
from ..solve.nonsymmetric.steady import SteadyContact, SteadySolver
from ..solve.precision import reachable_certificate
from ..solve.preconditioner.extension import pairs_for
from .losses import branch_powers
from .point import Point
from .stiffness import loses_most, soft_stripes, stiffer_lines

COARSE_TOLERANCE = 0.02  # tuning: tolerance on the certificate on all grids but the finest
LOOSE, AS_RIGHT = 1e-3, 0.6  # accuracy: factor AS_RIGHT on tolerances above LOOSE, for areas as accurate as in marches
GIVE_UP = 250  # tuning: limit on linear steps of the usual solver on a grid with stripes
NEAR = 1.1  # tuning: largest ratio of a velocity to the last one for a start from the last state
Vector = tuple[float, float]


@dataclass(frozen=True)
class SteadyLevel:
    """One grid: the rows of each rank, its transform, and the heights."""

    slab: Slab
    fft: FFT
    heights: Array


Make = Callable[[SteadyLevel, Vector], tuple[SteadySolver | Proximal, Convolution]]


class SteadySliding:
    """Steady states of one job's surface and body; the constructor and the methods are collective.

    Solves start from coarser grids, or from the last state if its velocity is nearly the same. The tolerance on
    certificates follows from the tolerance of the job and is at most `most`.
    """

    def __init__(self, setup: Setup, most: float = math.inf) -> None:
        self.setup = setup
        self._tolerance = min(tolerance_of(setup.choices.numerics.tolerance), most)
        self.probe = setup.probe()
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty())
        finest, *coarser = nested.coarser_levels(setup.slab, heights)
        self.levels = [SteadyLevel(setup.slab, setup.fft, finest.heights)]
        self.levels += [SteadyLevel(level.slab, FFT(level.slab), level.heights) for level in coarser]
        self._known = properties_of(setup.job, setup.shortest)
        self.contact: SteadyContact | None = None
        self._rise: Array | None = None
        self._speed = self._pressure = 0.0  # speed times shift factor, on which a state depends
        self.temperature, self._own_temperature = math.nan, temperature_of(setup.job.material)
        self._feedback = Feedback()

    def hold(self, velocity: Vector, sets: bool) -> tuple[Array, SteadySolver, Convolution]:
        """Allocate what a solve at a velocity [m/s] holds on the finest grid, with or without active `sets`."""
        p, (solver, operator) = self.setup.slab.empty(), self._solver(self.levels[0], velocity)
        if sets:
            solver.hold_all()
        return p, solver, operator

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature [deg C] of further solves; raises InputError if the material has no shift."""
        if temperature != self.temperature:
            self._set_material(temperature)
            self.temperature = temperature

    def _set_material(self, temperature: float) -> None:
        """Set the material at this temperature [deg C] for the next solve."""
        self.setup = replace(self.setup, choices=choices(self.setup.job.at_temperature(temperature)))
        self.probe = self.setup.probe()

    def solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at a velocity [m/s] of the surface under a mean pressure [Pa].

        With feedback from heat all rubber has the flash temperature. Raises RunError, with the certificate reached,
        if no start leads to a solution, or if no fixed point of the temperature is found.
        """
        section = self.setup.job.section("thermal")
        if section is None or section.feedback == "none":
            return self._solve(velocity, pressure)

        cold = self._own_temperature if math.isnan(self.temperature) else self.temperature
        highest, speed = highest_temperature_of(self.setup.job.material), math.hypot(*velocity)

        def warmed(rise: float) -> Point:
            try:
                self._set_material(min(cold + rise, highest))
            except InputError as error:
                place = describe_cold_state(speed, pressure, cold)
                raise RunError(f"{place}: no material at the flash temperature: {error}") from None
            return self._solve(velocity, pressure)

        tolerance = self.setup.choices.numerics.tolerance
        return self._feedback.solve_fixed_point(warmed, speed, (pressure, cold), tolerance, highest - cold)

    def _solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at the temperature that was set."""
        began, calls, speed = time.perf_counter(), 0.0, math.hypot(*velocity)
        what, factor = f"steady sliding at {speed:.4g} m/s under {pressure:.4g} Pa", self.setup.choices.time_factor
        for start, solver in self._starts(velocity, pressure):
            contact, more, by_energy = self._descend(velocity, pressure / self.setup.units.pressure, start, solver)
            calls += more
            if contact.converged:
                break
        else:
            raise RunError(f"{what}: {contact.failure}{self._advise(contact)}")
        self.contact, self._speed, self._pressure = contact, factor * speed, pressure
        heights = self.levels[0].heights
        touching = SteadySolver.constraint.touches(contact.p)
        measures = self.probe.measure(contact.p, 1.0, contact.u, heights, contact.d, touching, (0.0, 0.0), velocity)
        if not measures.finite:
            raise RunError(f"{what}: its results would not be finite")
        powers = None if self.setup.half_space.free else branch_powers(self.setup, contact, velocity)
        lost = () if powers is None else tuple(powers.sum(axis=1).tolist())
        judged = self._known, contact.certificate, by_energy, velocity, measures
        friction, errors = judge_state(self.setup, *judged)
        flash = self._find_temperatures(contact, by_energy, velocity, measures)
        seconds, place = time.perf_counter() - began, (velocity, pressure, self.temperature, factor)
        return Point(*place, measures, friction, errors, contact.certificate, calls, contact.sets, seconds, lost, flash)

    def _advise(self, contact: SteadyContact) -> str:
        """Return advice for a contact that was not solved; collective."""
        compliance, length = self.setup.half_space.largest_compliance, contact.certificate.length
        reach = reachable_certificate(self.setup.slab, [contact.u], contact.p, compliance, length)
        if self.setup.choices.numerics.tolerance < reach:
            what = "look for loads or moduli of very different magnitude"
            return f"; double precision reaches only about {reach:.1g} here: {what}"
        return ". Try a velocity nearer to one that works, a finer grid, or another numerics.tolerance."

    def _find_temperatures(
        self, contact: SteadyContact, friction: float, velocity: Vector, measures: Measures
    ) -> Flash | None:
        """Return the temperatures of the contact; None without a thermal section; collective."""
        section = self.setup.job.section("thermal")
        if section is None:
            return None
        touching = SteadySolver.constraint.touches(contact.p)
        flash, self._rise = find_temperatures(self.setup, section, contact.p, touching, measures, friction, velocity)
        return flash

    def field(self, name: str) -> Array:
        """Return this rank's rows of `pressure` [Pa], `displacement`, `gap` or `height` [m], or the rise of
        `temperature` [K] in the last state."""
        assert self.contact is not None
        if name == "temperature":
            assert self._rise is not None
            return self._rise
        contact, setup, heights = self.contact, self.setup, self.levels[0].heights
        if name == "pressure":
            return contact.p * setup.units.pressure
        if name == "height":
            return heights * setup.units.height + setup.surface.datum
        return (contact.u if name == "displacement" else contact.u - heights - contact.d) * setup.units.height

    table: tuple[str, Sequence[str]] | None = None

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]:
        """Return warnings about the job, also at these temperatures [deg C]; collective."""
        return sanity.find_doubts(self.setup, temperatures)

    def notes(self) -> list[str]:
        return []

    def keep_in(self, directory: Path) -> None:
        """Do nothing: a point is one solve."""

    def forget(self) -> None:
        """Do nothing."""

    def rows(self, velocity: Vector) -> list[list[float]]:
        """Return the lines of steady_waves.csv for the last state; collective."""
        assert self.contact is not None
        place = math.hypot(*velocity), self._pressure
        return [[*place, *pair] for pair in zip(*map(np.ndarray.tolist, self.shares(velocity)), strict=True)]

    def shares(self, velocity: Vector) -> tuple[Array, Array]:
        """Return the wavelengths [m] of `branch_powers`, and the share of the friction power in the octave of each;
        collective."""
        assert self.contact is not None
        power = branch_powers(self.setup, self.contact, velocity)
        total = power.sum()
        wavelengths = max(self.setup.grid.size) / 2.0 ** np.arange(power.shape[1])
        return wavelengths, power.sum(axis=0) / (total if total > 0.0 else 1.0)

    # -- starts and levels --------------------------------------------------------------------------------------------

    def _starts(self, velocity: Vector, pressure: float) -> Iterator[tuple[Array | None, Make]]:
        """Yield pressures on the finest grid to start from, None for coarser grids from a uniform pressure, each with
        the function that makes its solver.

        The usual solver comes first, the solver of proximal points last, or first for a body with a very large loss
        tangent. The last state is the better start only at nearly the same velocity. Extrapolating it is no better,
        as contact spots appear and vanish.
        """
        speed = self.setup.choices.time_factor * math.hypot(*velocity)
        lossy = loses_most(self.setup, velocity)
        if lossy:
            yield None, self._proximal
        if self.contact is None:
            yield None, self._solver
        elif pressure == self._pressure and max(speed, self._speed) <= NEAR * min(speed, self._speed):
            yield from ((self.contact.p, self._solver), (None, self._solver))
        else:
            yield from ((None, self._solver), (self.contact.p, self._solver))
        if not lossy:
            yield None, self._proximal

    def _descend(
        self, velocity: Vector, mean: float, start: Array | None, make: Make
    ) -> tuple[SteadyContact, float, float]:
        """Solve on all grids, the coarsest first, or on the finest from `start`. Return the contact, the operator
        calls, and friction by energy without an interface.

        If the usual solver fails where the body is soft along stripes, proximal points continue on this and all
        finer grids.
        """
        tally, calls = self.setup.slab.tally, 0.0

        def solve(level: SteadyLevel, p: Array) -> tuple[SteadyContact, Convolution]:
            nonlocal calls, make
            before = tally["operator"]
            solver, operator = make(level, velocity)
            contact = solver.solve(level.heights, mean, p)
            if contact.failure and make == self._solver and soft_stripes(self.setup, velocity) is not None:
                del solver, operator  # frees their maps before others are made
                make = self._proximal
                solver, operator = make(level, velocity)
                contact = solver.solve(level.heights, mean, p)
            calls += (tally["operator"] - before) * level.slab.points / self.setup.slab.points
            return contact, operator

        p = self.setup.slab.empty()
        if start is None:
            nested.descend(self.levels, lambda level, below: solve(level, below)[0].p, p)
        else:
            p[...] = start
        contact, operator = solve(self.levels[0], p)
        unit, load = self.setup.units.height / self.setup.units.length, kernels.sum_of(p)
        lost = max(operator.loss(p, self.setup.size, _direction(velocity)), 0.0)  # rounding for an elastic body
        return contact, calls, lost / (self.setup.slab.sum(load)[0] or math.nan) * unit

    def _solver(self, level: SteadyLevel, velocity: Vector) -> tuple[SteadySolver, Convolution]:
        operator, inverse = self._operators(level, velocity)
        limit = GIVE_UP if soft_stripes(self.setup, velocity) is not None else math.inf
        return self._solver_for(level, velocity, operator, inverse, LEAST_CUT, limit), operator

    def _proximal(self, level: SteadyLevel, velocity: Vector) -> tuple[Proximal, Convolution]:
        operator, inverse = self._operators(level, velocity)
        kind = self.setup.fft.complex
        nearer, nearer_inverse = operator.mapped(proximal.nearer, kind), inverse.mapped(proximal.nearer_inverse, kind)
        solver = self._solver_for(level, velocity, nearer, nearer_inverse, proximal.LEAST_CUT)
        pull = operator.mapped(proximal.pull, np.float64)
        return Proximal(solver, operator, pull), operator

    def _solver_for(
        self,
        level: SteadyLevel,
        velocity: Vector,
        operator: Convolution,
        preconditioner: Convolution,
        least_cut: float,
        limit: float = math.inf,
    ) -> SteadySolver:
        numerics, height = self.setup.choices.numerics, self.setup.height / self.setup.units.height
        finest = level is self.levels[0]
        tolerance = max(self._tolerance, 0.0 if finest else COARSE_TOLERANCE)
        most, along = int(min(limit, 20 * numerics.max_iterations)), soft_stripes(self.setup, velocity)
        slab, grid = level.slab, self.setup.grid
        pairs = pairs_for(grid.lx / slab.nx, grid.ly / slab.ny)
        what = slab, operator, preconditioner, height, tolerance, most
        lines = stiffer_lines(self.setup, velocity) if finest else None  # coarse grids only give starts
        return SteadySolver(*what, along=along, pairs=pairs, least_cut=least_cut, lines=lines)

    def _operators(self, level: SteadyLevel, velocity: Vector) -> tuple[Convolution, Convolution]:
        """Return the operator at a velocity [m/s], and its inverse, approximate for a free body."""
        body, moved = self.setup.half_space, (level.fft, self.setup.in_units(velocity), self.setup.prony)
        return body.sliding_operator(*moved), body.sliding_inverse(*moved)


def judge_state(
    setup: Setup, known: RunProperties, certificate: Certificate, by_energy: float, velocity: Vector, measures: Measures
) -> tuple[float, ErrorBudget]:
    """Return friction by energy, including an interface, and the errors of friction and area."""
    friction = by_energy + measures.friction_interface
    seen = StepObservation(
        certificate.complementarity,
        friction=friction,
        area=measures.contact_area,
        corrected=measures.contact_area_corrected,
        interface=measures.friction_interface,
        penetrating=max(certificate.members / measures.contact_area - 1.0, 0.0),
        way=velocity,
    )
    return friction, estimate_steady(replace(known, prony=setup.prony), seen)


def tolerance_of(asked: float) -> float:
    """Return the tolerance on the certificate of a steady state for the tolerance of a job."""
    return max(AS_RIGHT * asked, min(LOOSE, asked))


def _direction(velocity: Vector) -> tuple[float, float]:
    """Return the unit vector of a velocity; the unit vector of x at rest."""
    speed = math.hypot(*velocity)
    return (velocity[0] / speed, velocity[1] / speed) if speed > 0.0 else (1.0, 0.0)
