"""Steady sliding of a job's surface, solved directly, for points of a friction curve and for starts of marches.

A march that starts from steady sliding gets contact, displacement and branches of a surface that has always slid.

A wave of amplitude u^ loses the power `|u^|^2/A |w| G_k''(|w|)` in branch k, per unit of area. w [rad/s] is the
frequency with which the wave passes a point, and A is the ratio of its displacement to its pressure for the modulus 1.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..contact import kernels, starts
from ..contact.certificate import Judge, Lines
from ..contact.preconditioner import grids_for
from ..contact.problem import Box, Contact, reachable_certificate
from ..contact.projected import FreeSteadySolver
from ..contact.splitting import SteadySolver
from ..errors import Doubt, InputError, UnsolvedError
from ..files.checkpoint import Contents
from ..job import Job
from ..job.listing import answers
from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab, deal
from ..physics.convolution import PARTS, Convolution, wavenumbers
from ..physics.prony import Prony, complex_modulus
from ..physics.records import Certificate, Measures
from . import sanity
from .budget import ErrorBudget, estimate_steady
from .choices import choices
from .controller import tolerance_before
from .loop import March
from .scene import Scene, Setup, build_on, set_up
from .state import first_state, pressed_state
from .time_error import RunProperties, StepObservation, properties_of

Vector = tuple[float, float]


@dataclass(frozen=True)
class Point:
    """A steady state of sliding, with its measures, errors and cost.

    The conditions of the state are `velocity` [m/s], mean `pressure` [Pa] and `temperature` [deg C], which is NaN if
    none is given. `shift_factor` is the ratio of relaxation times at this temperature to relaxation times at the
    reference temperature. `friction` is the dissipated power divided by load and speed, plus the friction of an
    interface. `errors` is the error budget of friction and area. `measures` includes friction by the slopes of the
    rigid surface, which differs from `friction` by a mesh error. `operator_calls` are counted as applications on the
    finest grid. `dissipated` is the power [W] lost in each branch. It is empty for a free box, whose wake continues
    outside of the box. `effects` maps sections of the job to the results of their effects.
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
    seconds: float
    dissipated: tuple[float, ...]
    effects: Mapping[str, Any] = field(default_factory=dict)

    @property
    def speed(self) -> float:
        """Magnitude of the velocity [m/s]."""
        return math.hypot(*self.velocity)

    @property
    def error_friction(self) -> float:
        """Relative error of friction, 1 or more if the error exceeds friction itself. NaN without friction, or if spots
        may be smaller than a cell."""
        return self.errors.friction.of_friction if self.errors.friction and self.errors.resolved else math.nan

    @property
    def error_area(self) -> float:
        """Relative error of the corrected area; NaN if spots may be smaller than a cell."""
        return self.errors.area.total if self.errors.resolved else math.nan

    def with_effect(self, section: str, found: Any) -> Point:
        """Return the point with `found`, the result of the effect that has this `section` in the job."""
        return replace(self, effects={**self.effects, section: found})


def in_rounds(points: Sequence[Point]) -> Point:
    """Return the last of several points, which were solved one after the other in the iterations of a fixed point. Its
    cost is the cost of all iterations. The relative changes of friction and area in the last one are added to its
    errors."""
    *_, before, last = [*points[-1:], *points]
    friction, area = (
        abs(one - other) / one if one > 0.0 else 0.0
        for one, other in (
            (last.friction, before.friction),
            (last.measures.contact_area_corrected, before.measures.contact_area_corrected),
        )
    )
    calls, seconds = (sum(getattr(point, name) for point in points) for name in ("operator_calls", "seconds"))
    return replace(last, errors=last.errors.with_rounds(friction, area), operator_calls=calls, seconds=seconds)


ROUNDING = 1e-9  # accuracy: relative rounding of wavelengths at the limits of octaves


def branch_powers(setup: Setup, contact: Contact, velocity: Vector) -> Array:
    """Return the power [W] that waves of each octave of wavelengths lose in each branch, shape (branches, octaves);
    collective.

    The first octave is from the longer side of the box to half of it. The box must be periodic, so that waves are
    independent.
    """
    fft, prony, grid, half_space = setup.fft, setup.prony, setup.grid, setup.half_space
    spectrum, speed, longest = fft.forward(contact.u), setup.in_units(velocity), max(grid.size)
    powers = np.zeros((prony.moduli.size, count_octaves(setup)))
    for rows in deal(fft.my, PARTS):
        omega = np.abs(half_space.frequencies(fft, speed, rows))
        compliance = half_space.symbol(fft, rows)
        waves = fft.multiplicity * np.abs(spectrum[rows]) ** 2
        waves = np.divide(waves, compliance, out=np.zeros_like(waves), where=compliance > 0.0)
        q = np.hypot(*wavenumbers(fft, grid.size, rows))
        if half_space.factors is not None:
            waves *= half_space.factors(q * setup.units.length)[1]
        octave = np.floor(np.log2(np.maximum(q * longest / (2 * np.pi), 1.0) * (1 + ROUNDING))).astype(np.int64)
        for branch, modulus, tau in zip(powers, prony.moduli, prony.relaxation_times, strict=True):
            loss = waves * omega * modulus * omega * tau / (1.0 + (omega * tau) ** 2)
            branch += np.bincount(octave.ravel(), loss.ravel(), branch.size)
    unit = setup.units.pressure * setup.units.height * grid.lx * grid.ly / (grid.nx * grid.ny) ** 2
    return np.array(setup.slab.sum(*powers.ravel())).reshape(powers.shape) * unit


def count_octaves(setup: Setup) -> int:
    """Return the number of octaves of wavelengths from the longer side of the box to the shortest waves of the grid."""
    cells = max(setup.grid.size) / min(setup.grid.dx, setup.grid.dy)  # along the longer side, of the smaller length
    return 2 + int(np.log2(cells * (1 + ROUNDING)))


def branch_maps(setup: Setup, contact: Contact, velocity: Vector, out: Array) -> Iterator[Array]:
    """Yield the map h_k of each branch in steady sliding at a velocity [m/s]; collective. Each map overwrites the map
    before in the array `out`."""
    fft, half_space, speed = setup.fft, setup.half_space, setup.in_units(velocity)
    if half_space.free:
        for k in range(setup.prony.moduli.size):
            yield half_space.branch_operator(fft, speed, setup.prony, k).apply(contact.p, out)
        return
    u = fft.forward(contact.u).copy()
    for modulus, tau in zip(setup.prony.moduli, setup.prony.relaxation_times, strict=True):
        moduli = half_space.sliding_moduli(fft, speed, Prony(0.0, np.array([modulus]), np.array([tau])))
        for rows in deal(fft.my, PARTS):
            np.multiply(moduli(rows), u[rows], out=fft.spectrum[rows])
        yield fft.backward(fft.spectrum, out)


COARSE_TOLERANCE = 0.04  # tuning: tolerance on the certificate on all grids but the finest
# accuracy: factors on tolerances above LOOSE, in periodic and in free boxes, by `scripts/random_steady.py --exact`:
# friction and areas as accurate as in marches
LOOSE, AS_RIGHT, AS_RIGHT_FREE = 1e-3, 0.3, 0.6
STEPS_RATIO = 20  # tuning: limit on steps of the splitting over max_iterations
NEAR = 1.1  # tuning: largest ratio of a velocity to the last one for a start from the last state
HIGHEST = 1e3  # rounding: largest contrast of lines, as larger displacements between them have rounding errors


@dataclass(frozen=True)
class SteadyLevel:
    """One grid of a steady solve: the rows of each rank, the transform, and the heights."""

    slab: Slab
    fft: FFT
    heights: Array


class SteadySliding:
    """Solver of the steady states of one job's surface and body; the constructor and the methods are collective.

    Solves start from coarser grids, or from the last state if its velocity is nearly the same. The error with which
    solves end follows from the tolerance of the job and is at most `most`. Raises InputError for a body that has a
    memory but no branches.
    """

    def __init__(self, setup: Setup, most: float = math.inf) -> None:
        body = setup.job.material.fitted
        if body.remembers and not body.branches:
            knows = "steady sliding knows a body by its moduli at each frequency, and this body gives none"
            raise InputError(f"material: {knows}; let a run slide at a constant velocity until friction has settled")
        self.setup = setup
        self._tolerance = min(tolerance_of(setup.choices.numerics.tolerance, setup.half_space.free), most)
        self.probe = setup.probe()
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty())
        finest, *coarser = starts.coarser_levels(setup.slab, heights)
        self.levels = [SteadyLevel(setup.slab, setup.fft, finest.heights)]
        self.levels += [SteadyLevel(level.slab, FFT(level.slab), level.heights) for level in coarser]
        self._known = properties_of(setup.job, setup.shortest)
        self.contact: Contact | None = None
        self._speed = self._pressure = 0.0  # speed times shift factor, on which a state depends
        self.temperature = math.nan
        self.loops = [loop for loops in answers("steady", "loops", setup.job) for loop in loops(setup)]

    def hold(self, velocity: Vector) -> tuple[Any, ...]:
        """Allocate and return all arrays that a solve at a velocity [m/s] may hold on the finest grid."""
        p, (solver, operator) = self.setup.slab.empty(), self._solver(self.levels[0], velocity)
        return p, solver, operator, solver.hold_all()

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature [deg C] for all further solves; raises InputError if the material has no shift."""
        if temperature != self.temperature:
            self.set_material(temperature)
            self.temperature = temperature

    def set_material(self, temperature: float) -> None:
        """Set the temperature [deg C] of the material for the next solve only."""
        self.setup = replace(self.setup, choices=choices(self.setup.job.at_temperature(temperature)))
        self.probe = self.setup.probe()

    def solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at a velocity [m/s] of the surface under a mean pressure [Pa].

        An effect may repeat the solve until its own unknowns settle, by a loop in its module `steady`. Raises RunError,
        with the error reached, if no start leads to a solution, or if a loop does not settle.
        """
        solve = self._solve
        for loop in self.loops:
            solve = partial(loop.solve, self, solve)
        return solve(velocity, pressure)

    def _solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at the temperature and with the factors of moduli that were set."""
        began, calls, speed = time.perf_counter(), 0.0, math.hypot(*velocity)
        what, factor = f"steady sliding at {speed:.4g} m/s under {pressure:.4g} Pa", self.setup.choices.time_factor
        for start in self._starts(velocity, pressure):
            contact, more, by_energy = self._descend(velocity, pressure / self.setup.units.pressure, start)
            calls += more
            if contact.converged:
                break
        else:
            raise UnsolvedError(what, f"{contact.failure}{self._advise(contact)}")
        self.contact, self._speed, self._pressure = contact, factor * speed, pressure
        heights = self.levels[0].heights
        touching = Box().touches(contact.p)
        measures = self.probe.measure(contact.p, 1.0, contact.u, heights, contact.d, touching, (0.0, 0.0), velocity)
        if not measures.finite:
            raise UnsolvedError(what, "its results would not be finite")
        powers = None if self.setup.half_space.free else branch_powers(self.setup, contact, velocity)
        lost = () if powers is None else tuple(powers.sum(axis=1).tolist())
        judged = self._known, contact.certificate, by_energy, velocity, measures
        friction, errors = judge_state(self.setup, *judged)
        seconds, place = time.perf_counter() - began, (velocity, pressure, self.temperature, factor)
        return Point(*place, measures, friction, errors, contact.certificate, calls, seconds, lost)

    def _advise(self, contact: Contact) -> str:
        """Return advice for a contact that was not solved; collective."""
        compliance, length = self.setup.half_space.largest_compliance, contact.certificate.length
        reach = reachable_certificate(self.setup.slab, [contact.u], contact.p, compliance, length)
        if self.setup.choices.numerics.tolerance < reach:
            what = "look for loads or moduli of very different magnitude"
            return f"; double precision reaches only about {reach:.1g} here: {what}"
        return ". Try a velocity nearer to one that works, a finer grid, or another numerics.tolerance."

    def field(self, name: str) -> Array:
        """Return this rank's rows of a map of the last state: `pressure` [Pa], `displacement`, `gap` or `height` [m],
        or a map of an effect in its own unit."""
        assert self.contact is not None
        for loop in self.loops:
            if name in loop.fields:
                return np.asarray(loop.fields[name])
        contact, setup, heights = self.contact, self.setup, self.levels[0].heights
        if name == "pressure":
            return contact.p * setup.units.pressure
        if name == "height":
            return heights * setup.units.height + setup.surface.datum
        return (contact.u if name == "displacement" else contact.u - heights - contact.d) * setup.units.height

    table: tuple[str, Sequence[str]] | None = None

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]:
        """Return warnings about the job and its heights, and about frequencies at which the material was not measured
        at the `temperatures` [deg C] of a friction curve; collective."""
        return sanity.find_doubts(self.setup, temperatures)

    def notes(self) -> list[str]:
        return []

    def keep_in(self, directory: Path) -> str:
        """Keep nothing for a continuation: a point is one solve, without intermediate results."""
        return ""

    def forget(self) -> None:
        """Do nothing: no intermediate results are stored."""

    def rows(self, velocity: Vector) -> list[list[float]]:
        """Return the lines of steady_waves.csv for the last state; collective."""
        assert self.contact is not None
        place = math.hypot(*velocity), self._pressure
        return [[*place, *pair] for pair in zip(*map(np.ndarray.tolist, self.shares(velocity)), strict=True)]

    def shares(self, velocity: Vector) -> tuple[Array, Array]:
        """Return two arrays: the longest wavelengths [m] of the octaves of `branch_powers`, and the shares of the
        octaves in the power that friction dissipates; collective."""
        assert self.contact is not None
        power = branch_powers(self.setup, self.contact, velocity)
        total = power.sum()
        wavelengths = max(self.setup.grid.size) / 2.0 ** np.arange(power.shape[1])
        return wavelengths, power.sum(axis=0) / (total if total > 0.0 else 1.0)

    # -- starts and levels --------------------------------------------------------------------------------------------

    def _starts(self, velocity: Vector, pressure: float) -> Iterator[Array | None]:
        """Yield pressures on the finest grid to start from, None for coarser grids from a uniform pressure.

        The last state is the better start only at nearly the same velocity. Extrapolating it is no better, as contact
        spots appear and vanish.
        """
        speed = self.setup.choices.time_factor * math.hypot(*velocity)
        near = max(speed, self._speed) <= NEAR * min(speed, self._speed)
        if self.contact is not None and pressure == self._pressure and near:
            yield self.contact.p
        yield None

    def _descend(self, velocity: Vector, mean: float, start: Array | None) -> tuple[Contact, float, float]:
        """Solve on all grids, the coarsest first, or on the finest from `start`. Return the contact, the operator
        calls, and friction by energy without an interface."""
        tally, calls = self.setup.slab.tally, 0.0

        def solve(level: SteadyLevel, p: Array) -> tuple[Contact, Convolution]:
            nonlocal calls
            before = tally["operator"]
            solver, operator = self._solver(level, velocity)
            contact = solver.solve(level.heights, mean, p)
            calls += (tally["operator"] - before) * level.slab.points / self.setup.slab.points
            return contact, operator

        p = self.setup.slab.empty()
        if start is None:
            starts.descend(self.levels, lambda level, below: solve(level, below)[0].p, p)
        else:
            p[...] = start
        contact, operator = solve(self.levels[0], p)
        unit, load = self.setup.units.height / self.setup.units.length, kernels.sum_of(p)
        lost = max(operator.loss(p, self.setup.size, direction_of(velocity)), 0.0)  # rounding for an elastic body
        return contact, calls, lost / (self.setup.slab.sum(load)[0] or math.nan) * unit

    def _solver(self, level: SteadyLevel, velocity: Vector) -> tuple[SteadySolver | FreeSteadySolver, Convolution]:
        setup, slab, finest = self.setup, level.slab, level is self.levels[0]
        operators = operator, _ = self._operators(level, velocity)
        lines = stiffer_lines(setup, velocity) if finest else None  # coarse grids only give starts
        judge = Judge(slab, setup.height / setup.units.height, lines)
        tolerance = max(self._tolerance, 0.0 if finest else COARSE_TOLERANCE)
        grids = grids_for(setup.grid.lx / slab.nx, setup.grid.ly / slab.ny)
        if setup.half_space.free:
            return FreeSteadySolver(judge, *operators, tolerance, grids), operator
        most = STEPS_RATIO * setup.choices.numerics.max_iterations
        return SteadySolver(judge, *operators, tolerance, most, grids), operator

    def _operators(self, level: SteadyLevel, velocity: Vector) -> tuple[Convolution, Convolution]:
        """Return the operator at a velocity [m/s], and its inverse, approximate for a free body."""
        body, moved = self.setup.half_space, (level.fft, self.setup.in_units(velocity), self.setup.prony)
        return body.sliding_operator(*moved), body.sliding_inverse(*moved)


def judge_state(
    setup: Setup, known: RunProperties, certificate: Certificate, by_energy: float, velocity: Vector, measures: Measures
) -> tuple[float, ErrorBudget]:
    """Return the friction coefficient and the error budget of a steady state. Friction is the sum of `by_energy`, which
    follows from the dissipated power, and the friction of an interface. `known` are the properties of the run."""
    friction = by_energy + measures.friction_interface
    seen = StepObservation(
        certificate.complementarity,
        friction=friction,
        area=measures.contact_area,
        corrected=measures.contact_area_corrected,
        interface=measures.friction_interface,
        penetrating=max(certificate.members / measures.contact_area - 1.0, 0.0),
        straight=measures.straight,
        way=velocity,
    )
    return friction, estimate_steady(replace(known, prony=setup.prony), seen)


def stiffer_lines(setup: Setup, velocity: Vector) -> Lines | None:
    """Return the grid lines along which the body slides, with the contrast |G|/G_inf (`contact.certificate.Lines`).

    G is the modulus for the longest wave along the lines. G_inf is the modulus for waves that do not vary along the
    lines. `velocity` is in m/s. Return None for an elastic body, a line of points, a free box, or an oblique velocity.
    """
    grid = setup.grid
    if setup.half_space.free or 1 in (grid.nx, grid.ny) or np.count_nonzero(velocity) != 1:
        return None
    if not setup.prony.moduli.size:
        return None
    along = 0 if velocity[0] else 1
    frequency = 2.0 * np.pi * abs(velocity[along]) / grid.size[along]
    modulus = float(np.abs(complex_modulus(np.array([frequency]), *setup.prony))[0])
    return Lines(1 - along, min(modulus / setup.prony.modulus_inf, HIGHEST))


def tolerance_of(asked: float, free: bool = False) -> float:
    """Return the largest error (`Certificate`) with which the solve of a steady state ends, for the tolerance `asked`
    of the job. `free` is True for a free box."""
    return max((AS_RIGHT_FREE if free else AS_RIGHT) * asked, min(LOOSE, asked))


def direction_of(velocity: Vector) -> tuple[float, float]:
    """Return the unit vector of a velocity; at rest, the unit vector of x."""
    speed = math.hypot(*velocity)
    return (velocity[0] / speed, velocity[1] / speed) if speed > 0.0 else (1.0, 0.0)


def first(job: Job, slab: Slab, until: float = 0.0, saved: Contents | None = None) -> March:
    """Return a march before the first step of a job, or after the step of a checkpoint `saved`; collective.

    The march can continue to the end of the history or, if later, to `until` [s]. Raises InputError for files that do
    not fit, and for approaches beyond full contact.
    """
    setup = set_up(job, slab, until)
    sanity.refuse_approaches(setup)
    if saved is None and setup.choices.steady_start.on:
        return _from_steady_sliding(setup)
    march = March(build_on(setup))
    if saved is not None:
        march.restore(saved)
    return march


def start_march(scene: Scene, contact: Contact | None = None, **of_row: Any) -> March:
    """Return a march on a scene from rest, or from a `contact` in steady sliding at the velocity of the job's section
    `initial`; collective. `of_row` are values of `StepRow` for the record at time 0."""
    if contact is None:
        return March(scene)
    body, workspace = scene.material.at_rest(), scene.solver.workspace
    maps = branch_maps(scene.setup, contact, scene.job.initial.velocity, workspace.other_displacement)
    scene.material.start_from(body, contact.u, maps)
    state = first_state(scene, body)
    return March(scene, pressed_state(scene, state, replace(state.row, **of_row), contact.p, contact.d))


def _from_steady_sliding(setup: Setup) -> March:
    """Return a march in the steady state of its job's `initial` section; collective. Maps of the scene are made after
    those of the steady solver are freed; meanwhile the pressure is in a map of the workspace."""
    point, contact = _solve(setup)
    scene = build_on(setup)
    workspace, body = scene.solver.workspace, scene.material.at_rest()
    branches = branch_maps(setup, contact, setup.job.initial.velocity, workspace.other_displacement)
    scene.material.start_from(body, contact.u, branches)
    workspace.pressure[...] = contact.p
    iterations, approach = contact.iterations, contact.d
    del contact
    state = first_state(scene, body)
    row = replace(
        state.row,
        measures=point.measures,
        iterations=iterations,
        certificate=point.certificate,
        errors=point.errors if point.errors.resolved else None,
        operator_calls=round(point.operator_calls),
        seconds=point.seconds,
    )
    return March(scene, pressed_state(scene, state, row, workspace.pressure, approach))


def _solve(setup: Setup) -> tuple[Point, Contact]:
    """Return the state and its contact, without the maps of the solver; collective."""
    sliding, initial = (
        SteadySliding(setup, tolerance_before(setup.job, 0, setup.choices.viscoelasticity.on)),
        setup.job.initial,
    )
    point = sliding.solve(initial.velocity, initial.pressure or 0.0)
    assert sliding.contact is not None
    return point, sliding.contact
