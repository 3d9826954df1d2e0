"""Steady sliding of a job's surface, solved directly: points of a friction curve, and where a march may start from."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..march.errors import properties_of
from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab, deal
from ..physics.budget import ErrorBudget, estimate_steady
from ..physics.convolution import PARTS, Convolution, wavenumbers
from ..physics.loops import slope_under
from ..physics.measures import Measures
from ..physics.prony import Prony
from ..physics.time_error import StepObservation
from ..scene import Setup, choices
from ..solve import kernels, nested
from ..solve.certificate import Certificate
from ..solve.nonsymmetric import proximal
from ..solve.nonsymmetric.proximal import Proximal
from ..solve.nonsymmetric.steady import SteadyContact, SteadySolver

COARSE_TOLERANCE = 0.02  # of the certificate on all grids but the finest
LOOSE, SHARE = 1e-3, 0.6  # so much of a tolerance above LOOSE leaves the contact area as right as in a march
NEAR = 1.1  # a velocity this many times the last one, or less, is near it
Vector = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A steady state: velocity [m/s], pressure [Pa], temperature [deg C] (NaN where none was asked for), by what factor
    relaxation times are longer than at the reference, what it measures, its certificate, and what it took.

    `friction` is the power that the body dissipates, over load and velocity, and what an interface adds; that of
    `measures` is by the slopes of the rigid surface. They differ by the mesh, and `errors` is the budget of the former.
    `operator_calls` are in applications on the finest grid; `sets` is 0 where projected steps did.
    `dissipated` is the power [W] of each branch (empty for a free scene, whose wake goes on outside the box).
    """

    velocity: Vector
    pressure: float
    temperature: float
    shift_factor: float
    measures: Measures
    friction: float
    errors: ErrorBudget
    certificate: Certificate
    operator_calls: float
    sets: int
    seconds: float
    dissipated: tuple[float, ...]

    @property
    def error_friction(self) -> float:
        """The relative error of friction; NaN where there is none."""
        return self.errors.friction.total if self.errors.friction else math.nan


@dataclass(frozen=True)
class Level:
    """One grid: who owns which rows, its transform, and the heights."""

    slab: Slab
    fft: FFT
    heights: Array


Make = Callable[[Level, Vector], tuple[SteadySolver | Proximal, Convolution]]


class SteadySliding:
    """Steady states of one job's surface and body; making and calling it are collective.

    Started from coarser grids, or from the last state where that is very near. `footprint` says what it holds.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.ledger = setup.ledger()
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty())
        finest, *coarser = nested.levels_of(setup.slab, heights)
        self.levels = [Level(setup.slab, setup.fft, finest.heights)]
        self.levels += [Level(level.slab, FFT(level.slab), level.heights) for level in coarser]
        self._known = properties_of(setup, 0.0, True, None)
        self.contact: SteadyContact | None = None
        self._speed = self._pressure = 0.0  # the speed times the shift factor: that is what a state depends on
        self.temperature = math.nan

    def heat(self, temperature: float) -> None:
        """Solve at this temperature [deg C] from now on; raises InputError where the material has no shift."""
        if temperature != self.temperature:
            self.setup = replace(self.setup, choices=choices(self.setup.job.at_temperature(temperature)))
            self.ledger, self.temperature = self.setup.ledger(), temperature

    def solve(self, velocity: Vector, pressure: float) -> Point:
        """The steady state at a velocity [m/s] of the surface under a mean pressure [Pa].

        Raises RunError, with the certificate reached, when none of the starts leads to one.
        """
        began = time.perf_counter()
        mean = pressure / self.setup.units.pressure
        speed, calls = math.hypot(*velocity), 0.0
        reduced = self.setup.choices.time_factor * speed
        for start, solver in self._starts(reduced, pressure):
            contact, more, by_energy = self._descend(velocity, mean, start, solver)
            calls += more
            if contact.converged:
                break
        else:
            raise RunError(
                f"steady sliding at {speed:g} m/s under {pressure:g} Pa: {contact.failure}. Try a "
                "velocity nearer to one that works, a finer grid, or another numerics.tolerance."
            )
        self._remember(contact, reduced, pressure)
        heights = self.levels[0].heights
        measures = self.ledger.measures(contact.p, 1.0, contact.u, heights, contact.d, (0.0, 0.0), velocity)
        if not measures.finite:
            raise RunError(f"steady sliding at {speed:g} m/s under {pressure:g} Pa: its results would not be finite")
        lost = tuple(self._powers(velocity).sum(axis=1).tolist()) if self.setup.grid.boundary == "periodic" else ()
        friction, errors = self._judge(contact, by_energy, velocity, measures)
        seconds = time.perf_counter() - began
        place = velocity, pressure, self.temperature, self.setup.choices.time_factor
        return Point(*place, measures, friction, errors, contact.certificate, calls, contact.sets, seconds, lost)

    def _judge(
        self, contact: SteadyContact, by_energy: float, velocity: Vector, measures: Measures
    ) -> tuple[float, ErrorBudget]:
        """Return friction from that by energy, with what an interface adds, and how wrong it and the area are;
        collective."""
        setup, speed = self.setup, math.hypot(*velocity)
        load, rise = setup.slab.sum(*slope_under(contact.p, self.levels[0].heights))
        slopes = -(measures.force_x * velocity[0] + measures.force_y * velocity[1]) / (speed * measures.normal_force)
        friction = by_energy + measures.friction_interface
        seen = StepObservation(
            contact.certificate.complementarity,
            difference=0.0,
            order=2.0,
            slope=math.sqrt(rise / load) / (2.0 * setup.grid.dx) * setup.units.height,
            friction=friction,
            area=measures.contact_area,
            corrected=measures.contact_area_corrected,
            penetrating=max(contact.certificate.members / measures.contact_area - 1.0, 0.0),
            views_apart=abs(slopes - friction),
        )
        return friction, estimate_steady(self._known, seen, setup.slab.points)

    def shares(self, velocity: Vector) -> tuple[Array, Array]:
        """Wavelengths [m], and the share of the friction power that waves from each to half of it contribute.

        Of the last state; only for periodic scenes, where waves are independent. Collective.
        """
        longest = max(self.setup.grid.size)
        power = self._powers(velocity)
        total = power.sum()
        return longest / 2.0 ** np.arange(power.shape[1]), power.sum(axis=0) / (total if total > 0.0 else 1.0)

    def _powers(self, velocity: Vector) -> Array:
        """Power [W] lost in each branch to waves from each wavelength of `shares` to half of it; collective.

        A wave u^ loses `|u^|^2/A |w| G_k''(|w|)`, with A its displacement over its pressure for a modulus of 1.
        """
        assert self.contact is not None
        setup, fft, prony, grid = self.setup, self.setup.fft, self.setup.prony, self.setup.grid
        spectrum, speed = fft.forward(self.contact.u), self.setup.in_units(velocity)
        cells = max(max(grid.size) / grid.dx, max(grid.size) / grid.dy)  # along the longer side, of the smaller length
        powers = np.zeros((prony.moduli.size, 2 + int(np.log2(cells * (1 + 1e-9)))))
        for rows in deal(fft.my, PARTS):
            omega = np.abs(setup.half_space.frequencies(fft, speed, rows))
            compliance = setup.half_space.symbol(fft, rows)
            waves = fft.multiplicity * np.abs(spectrum[rows]) ** 2
            waves = np.divide(waves, compliance, out=np.zeros_like(waves), where=compliance > 0.0)
            octave = self._octaves(rows)
            for branch, modulus, tau in zip(powers, prony.moduli, prony.relaxation_times, strict=True):
                loss = waves * omega * modulus * omega * tau / (1.0 + (omega * tau) ** 2)
                branch += np.bincount(octave.ravel(), loss.ravel(), branch.size)
        unit = setup.units.pressure * setup.units.height * grid.lx * grid.ly / (grid.nx * grid.ny) ** 2
        return np.array(setup.slab.sum(*powers.ravel())).reshape(powers.shape) * unit

    def _octaves(self, rows: slice) -> NDArray[np.int64]:
        """How many times the wavelength of each wave, on these rows of a spectrum, can be doubled within the box."""
        size = self.setup.grid.size
        q = np.hypot(*wavenumbers(self.setup.fft, size, rows))
        return np.floor(np.log2(np.maximum(q * max(size) / (2 * np.pi), 1.0) * (1 + 1e-9))).astype(np.int64)

    # -- starts and levels --------------------------------------------------------------------------------------------

    def _starts(self, speed: float, pressure: float) -> Iterator[tuple[Array | None, Make]]:
        """Pressures on the finest grid to start from; None stands for coarser grids from a uniform pressure. Beside
        each, what makes the solver: as a rule the usual one, then the `narrow` one, which it always is on a line of
        points, and at last the one of proximal points.

        The last state is the better start only very near it, else it is the second choice. To extrapolate it in the
        logarithm of the velocity, or to add what changes on the next coarser grid, brings it no nearer: contact spots
        appear and vanish.
        """
        if self.contact is None:
            yield None, self._solver
        elif pressure == self._pressure and max(speed, self._speed) <= NEAR * min(speed, self._speed):
            yield from ((self.contact.p, self._solver), (None, self._solver))
        else:
            yield from ((None, self._solver), (self.contact.p, self._solver))
        if 1 not in self.setup.grid.points:
            yield None, partial(self._solver, narrow=True)
        yield None, self._proximal

    def _remember(self, contact: SteadyContact, speed: float, pressure: float) -> None:
        self.contact, self._speed, self._pressure = contact, speed, pressure

    def _descend(
        self, velocity: Vector, mean: float, start: Array | None, solver: Make
    ) -> tuple[SteadyContact, float, float]:
        """Solve on all grids, the coarsest first, or on the finest from `start`; also the operator calls it took, and
        friction by energy, without an interface."""
        tally, calls = self.setup.slab.tally, 0.0

        def solve(level: Level, p: Array) -> tuple[SteadyContact, Convolution]:
            nonlocal calls
            before = tally["operator"]
            chosen, operator = solver(level, velocity)
            contact = chosen.solve(level.heights, mean, p)
            calls += (tally["operator"] - before) * level.slab.points / self.setup.slab.points
            return contact, operator

        p = self.setup.slab.empty()
        if start is None:
            nested.descend(self.levels, lambda level, below: solve(level, below)[0].p, p)
        else:
            p[...] = start
        contact, operator = solve(self.levels[0], p)
        speed, unit, load = math.hypot(*velocity), self.setup.units.height / self.setup.units.length, kernels.total(p)
        lost = operator.loss(p, self.setup.size, (velocity[0] / speed, velocity[1] / speed))
        return contact, calls, lost / (self.setup.slab.sum(load)[0] or math.nan) * unit

    def _solver(self, level: Level, velocity: Vector, narrow: bool = False) -> tuple[SteadySolver, Convolution]:
        operator, inverse = self.operators(level, velocity, self.setup.prony)
        return self._solver_for(level, operator, inverse, narrow), operator

    def _proximal(self, level: Level, velocity: Vector) -> tuple[Proximal, Convolution]:
        operator, inverse = self.operators(level, velocity, self.setup.prony)
        kind = self.setup.fft.complex
        nearer, nearer_inverse = operator.mapped(proximal.nearer, kind), inverse.mapped(proximal.nearer_inverse, kind)
        solver = self._solver_for(level, nearer, nearer_inverse, narrow=True)
        pull = operator.mapped(proximal.pull, np.float64)
        return Proximal(solver, operator, pull), operator

    def _solver_for(
        self, level: Level, operator: Convolution, preconditioner: Convolution, narrow: bool
    ) -> SteadySolver:
        setup, numerics = self.setup, self.setup.choices.numerics
        tolerance = tolerance_of(numerics.tolerance)
        return SteadySolver(
            level.slab,
            operator,
            preconditioner,
            setup.height / setup.units.height,
            tolerance if level is self.levels[0] else max(tolerance, COARSE_TOLERANCE),
            20 * numerics.max_iterations,
            narrow=narrow,
        )

    def operators(self, level: Level, velocity: Vector, prony: Prony) -> tuple[Convolution, Convolution]:
        """Pressure -> displacement at a velocity [m/s], and its inverse (roughly, if the body is unbounded)."""
        half_space, speed = self.setup.half_space, self.setup.in_units(velocity)
        return (
            half_space.sliding_operator(level.fft, speed, prony),
            half_space.sliding_inverse(level.fft, speed, prony),
        )


def tolerance_of(asked: float) -> float:
    """On the certificate of a steady state, where a job asks for one."""
    return max(SHARE * asked, min(LOOSE, asked))


def branch_maps(setup: Setup, contact: SteadyContact, velocity: Vector, out: Array) -> Iterator[Array]:
    """The map h_k of each branch in a steady state at a velocity [m/s], each time in `out`; collective."""
    fft, half_space, speed = setup.fft, setup.half_space, setup.in_units(velocity)
    if half_space.free:
        for k in range(setup.prony.moduli.size):
            yield half_space.branch_operator(fft, speed, setup.prony, k).apply(contact.p, out)
        return
    u = fft.forward(contact.u).copy()
    for modulus, tau in zip(setup.prony.moduli, setup.prony.relaxation_times, strict=True):
        own = Prony(0.0, np.array([modulus]), np.array([tau]))
        for rows in deal(fft.my, PARTS):
            np.multiply(half_space.sliding_modulus(fft, speed, own, rows), u[rows], out=fft.spectrum[rows])
        yield fft.backward(fft.spectrum, out)
