"""A band of the spectrum on its own grid, and its ladder: the mean pressures at which the band is solved.

Each pressure p_j of a ladder is a rung. A result f(p) of a band is known at the rungs. Between them f(p)/p is the cubic
in log p through the four nearest rungs, `f(p) = p sum_j psi_j(p) f(p_j)/p_j`. Below the first and above the last rung
f(p)/p is constant. A distribution P(p) is represented by `W_j = int P(p) p psi_j(p) dp/p_j`. As the psi_j add up to 1,

    int P(p) f(p) dp = sum_j W_j f(p_j),    sum_j W_j p_j = int P(p) p dp:

the load is conserved. With psi_j linear in p the load would be conserved, too, but a concave f would be underestimated.

In a history each stage of the job becomes stages whose steps follow the cell and the waves of the band. After a change
of velocity the steps of a slide grow from a small part of a cell to half a cell. Each later step is a slip of exactly
half a cell, so that its solve starts from the pressures of two steps before, moved by a cell (`march.laws`). After a
slip of SETTLED times its longest wave a band counts as steady, and makes no steps until the next stage: fine bands
settle within micrometres. So a band's own history is shorter than the history of the job. The place of a step is given
by the number of the job's stage and by the time since this stage began.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ..contact import kernels
from ..contact.certificate import Judge
from ..contact.problem import Constraint, Contact, MeanPressure
from ..contact.splitting import Splitting
from ..effects.branches import relaxation_of
from ..errors import RunError
from ..job import Grid, HeightArray, Job
from ..job.history import Step, Timeline
from ..job.listing import answers
from ..job.stages import GeometricStep, Stage
from ..job.surfaces import GivenHeights
from ..march.budget import ErrorBudget
from ..march.choices import choices
from ..march.scene import Setup, set_up
from ..march.steady import branch_powers, direction_of, judge_state, tolerance_of
from ..march.time_error import properties_of
from ..parallel.fft import FFT, Spectrum
from ..parallel.slab import Array, Slab
from ..physics.convolution import Convolution, wavenumbers
from ..physics.roughness import Roughness
from .choice import Cut

RUNGS, LOWEST = 14, 5e-4  # accuracy: number of rungs, and the first one over the last
NODES = 4  # accuracy: rungs per interpolation
ROUNDING = 1e-9  # rounding: of the position of a pressure on the ladder, and of a number of steps
ABOVE = 4.0  # accuracy: last rung above the mean, over the rms pressure
BELOW = 4.5  # accuracy: first rung below the mean, over the rms pressure, near full contact


@dataclass(frozen=True)
class PressureLadder:
    """The mean pressures at which a band is solved, its `rungs`: rising [Pa], shape (n,)."""

    rungs: Array

    @classmethod
    def over(cls, mean: float, rms: float) -> PressureLadder:
        """Return the pressures (rungs) at which a band is solved, for the mean pressure and the rms deviation [Pa] that
        coarser bands give in full contact. They are equally spaced in the logarithm, up to the mean pressure and
        `ABOVE` deviations. Without a deviation the mean pressure is the only rung."""
        if not rms > 0.0:
            return cls(np.array([mean]))
        top = mean + ABOVE * rms
        bottom = max(LOWEST * top, mean - BELOW * rms)
        count = max(NODES, int(np.ceil(1 + (RUNGS - 1) * np.log(top / bottom) / -np.log(LOWEST) - 1e-9)))
        return cls(np.geomspace(bottom, top, count))

    def weights_of_rungs(self, pressures: Array) -> tuple[Array, float]:
        """Return the weights W_j of the module, with which results at the rungs are added for a map of pressures [Pa].
        Also return the share of the load that is above all rungs."""
        p, rungs = pressures[pressures > 0.0], self.rungs
        count = len(rungs)
        if count == 1 or not p.size:
            return np.full(count, float(p.sum()) / rungs[-1] / pressures.size), 0.0
        steps = np.log(p / rungs[0]) / np.log(rungs[1] / rungs[0])
        place = np.clip(steps, 0.0, count - 1.0)
        first = np.clip(np.floor(place).astype(np.intp) - 1, 0, count - NODES)
        sums = np.zeros(count)
        for node in range(NODES):
            others = [other for other in range(NODES) if other != node]
            psi = np.prod([(place - first - other) / (node - other) for other in others], axis=0)
            sums += np.bincount(first + node, p * psi, count)
        beyond = float(p[steps > count - 1 + ROUNDING].sum())
        return sums / rungs / pressures.size, beyond / float(p.sum())


PARTS = 6  # accuracy: parts of a cell of wavenumbers, along each side, for sums of the spectrum
MOST_STEPS = 20000  # tuning: limit on the steps of the splitting for one contact
Vector = tuple[float, float]


@dataclass(frozen=True)
class Rung:
    """Results of one band under one mean `pressure` [Pa]: of a steady state, or of a history. Then the numbers are
    arrays over its instants, a track (`road_history.track_of`).

    `friction` [-] of the band's waves follows from the dissipated power, and `friction_slopes` from the pressures on
    slopes. Contact areas are shares of the nominal area. `Cascade.climb` adds the approach of finer bands to the
    `approach` [m]. The pressures of this contact load the next finer band: `weights` are the weights of its rungs, and
    `load_lost` is the share of the load above the highest of these rungs. `powers` [W/m^2] are lost in each branch.
    `found` has the arrays of effects by name (`Probe`).
    """

    pressure: float
    friction: float
    friction_slopes: float
    contact_area: float
    contact_area_corrected: float
    approach: float
    max_pressure: float
    weights: Array
    load_lost: float
    powers: Array
    found: Mapping[str, Array]
    errors: Array  # friction by solver, time steps and grid, and the same of area
    residual: float
    penetration: float
    operator_calls: float


Means = Mapping[str, Callable[[Any], Array]]  # weights of rungs in the mean of an array, by its name: `cascade.by_load`


class Probe(Protocol):
    """Part of an effect that measures arrays in each contact of a band. All methods are local.

    The function `probes(job, cut)` in the module `steady` of an effect yields its probes for the bands `cut` of a job.
    """

    means: ClassVar[Means]

    def slide(self, setup: Setup, velocity: Vector) -> None:
        """Prepare for contacts that slide at a velocity [m/s]."""

    def measure(self, setup: Setup, contact: Contact, velocity: Vector) -> Mapping[str, Array]:
        """Return the arrays measured in a contact, by name."""


def probes_of(job: Job, cut: Cut) -> list[Probe]:
    """Return new probes of all effects of a job."""
    return [probe for made in answers("steady", "probes", job) for probe in made(job, cut)]


class Band:
    """A surface with the waves of one band, on this rank alone. Methods solve contacts of the surface.

    `number` counts bands from the coarsest; each `sample` is another surface with the same spectrum. All waves have
    the amplitude of the spectrum, so that surfaces differ in their phases only.
    """

    def __init__(self, job: Job, cut: Cut, number: int, sample: int) -> None:
        if cut.measured is not None and number == 0:
            grid, heights = cut.measured.grid, cut.measured.heights
        else:
            (nx, ny), side = cut.points, cut.waves * cut.wavelengths(number)[0]
            grid = Grid(points=cut.points, size=(side, side if ny > 1 else side / nx))
            fft = FFT(Slab.alone(nx, ny), measured=False)
            waves = _make_waves(cut, number, _seed(job, number, sample), fft, side)
            heights = fft.backward(waves, fft.slab.empty())
        slab = Slab.alone(*grid.points)
        surface = (HeightArray(heights=GivenHeights(np.asarray(heights))),)
        self.parts = parts_of_history(job, grid, cut.wavelengths(number)[0])
        history = tuple(stage for stage, _ in self.parts)
        own = job.model_copy(update={"grid": grid, "surface": surface, "bands": None, "history": history})
        self.probes = probes_of(job, cut)
        self._set_up(set_up(own, slab, measured=False))  # the same digits in every run, on any number of ranks
        self.heights = self.setup.surface.heights((0.0, 0.0), slab.empty())

    def _set_up(self, setup: Setup) -> None:
        self.setup = setup
        self.probe = replace(setup.probe(), shears=())
        self._known = properties_of(setup.job, setup.shortest)
        self._velocity: Vector = (math.nan, math.nan)

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature [deg C] of the material. Raises InputError if the material has no shift."""
        self._set_up(replace(self.setup, choices=choices(self.setup.job.at_temperature(temperature))))

    def set_factors(self, factors: Any) -> None:
        """Set the function that returns factors of the moduli for all waves (`physics.halfspace.HalfSpace.factors`)."""
        self._set_up(replace(self.setup, factors=factors))

    def slide(self, velocity: Vector) -> None:
        """Set the velocity [m/s]."""
        if velocity != self._velocity:
            body, moved = self.setup.half_space, (self.setup.fft, self.setup.in_units(velocity), self.setup.prony)
            self.operator: Convolution = body.sliding_operator(*moved)
            self._inverse = body.sliding_inverse(*moved)
            self._full = float(np.std(self._inverse.apply(self.heights, self.setup.slab.empty())))
            for probe in self.probes:
                probe.slide(self.setup, velocity)
            self._velocity = velocity

    @property
    def full_contact_rms(self) -> float:
        """Rms pressure [Pa] of the band's waves in full contact."""
        return self._full * self.setup.units.pressure

    def contact(self, pressure: float, law: Constraint) -> Contact:
        """Return the contact in steady sliding under a mean pressure [Pa], with the `law` of the interface."""
        setup, units = self.setup, self.setup.units
        judge = Judge(setup.slab, setup.height / units.height)
        tolerance = tolerance_of(setup.choices.numerics.tolerance)
        solver = Splitting(judge, self.operator, self._inverse, tolerance, MOST_STEPS)
        given = MeanPressure(pressure / units.pressure), law.in_units(units.pressure, units.height)
        contact = solver.solve(self.heights, *given, setup.slab.zeros())
        if contact.failure:
            raise RunError(f"a band of {max(setup.grid.size):.3g} m under {pressure:.3g} Pa {contact.failure}")
        return contact

    def solve(self, pressure: float, law: Constraint, below: PressureLadder | None) -> Rung:
        """Return the steady state under a mean pressure [Pa]. It includes how the pressures of the contact load the
        rungs `below`, which are the mean pressures at which the next finer band is solved. `law` states by which length
        [m] a pressure [Pa] closes the gap that all finer bands leave. Raises RunError if no state is found."""
        setup, velocity, contact = self.setup, self._velocity, self.contact(pressure, law)
        units = setup.units
        seen = contact.u, self.heights, contact.d, law.touches(contact.p)
        measures = self.probe.measure(contact.p, 1.0, *seen, (0.0, 0.0), velocity)
        lost = self.operator.loss(contact.p, setup.size, direction_of(velocity)) / kernels.sum_of(contact.p)
        by_energy = lost * units.height / units.length
        friction, budget = judge_state(setup, self._known, contact.certificate, by_energy, velocity, measures)
        weights, above = (np.zeros(0), 0.0) if below is None else below.weights_of_rungs(contact.p * units.pressure)
        area, along = setup.grid.lx * setup.grid.ly, direction_of(velocity)
        return Rung(
            pressure,
            friction,
            -(measures.force_x * along[0] + measures.force_y * along[1]) / (pressure * area),
            measures.contact_area,
            measures.contact_area_corrected,
            measures.approach,
            measures.max_pressure,
            weights,
            above,
            branch_powers(setup, contact, velocity).sum(axis=1) / area,
            {name: array for probe in self.probes for name, array in probe.measure(setup, contact, velocity).items()},
            rung_errors(budget),
            contact.certificate.worst,
            contact.certificate.penetration,
            float(contact.iterations),
        )


def rung_errors(budget: ErrorBudget | None) -> Array:
    """Return the relative errors of friction by solver, time steps and grid, followed by the relative errors of area,
    shape (6,), from the error budget of a contact."""
    both = (budget.friction, budget.area) if budget else (None, None)
    return np.array([(p.solver + p.folded, p.time, p.mesh) if p else (0.0, 0.0, 0.0) for p in both]).ravel()


def _make_waves(cut: Cut, number: int, seed: int, fft: FFT, side: float) -> Spectrum:
    """Return the transform of the heights [m] of a band on a box with this side [m].

    Each wave of the box has the mean square slope of the spectrum in its cell of wavenumbers, as far as the cell is
    within the band; phases are random, as in `physics.roughness`.
    """
    step, line = 2.0 * np.pi / side, fft.my == 1
    low, high = float(cut.edges[number]), float(cut.edges[number + 1])
    widest = 2.0 * np.pi / (low - step), 2.0 * np.pi / (high + step)
    unit = Roughness(1.0, widest[0], *widest, seed, False, rms_height=1.0, measured=np.ones_like)
    waves = unit.spectrum(fft, (side, side))
    parts = step * ((np.arange(PARTS) + 0.5) / PARTS - 0.5)
    qx, qy = wavenumbers(fft, (side, side))
    slopes = np.zeros(waves.shape)
    for dx, dy in product(parts, parts[:1] * 0.0 if line else parts):
        q = np.hypot(qx + dx, qy + dy)
        slopes += cut.spectrum.density_of_slopes(q, low, high)
    share = step / (2.0 * np.pi * PARTS)
    area = share / 2.0 if line else share**2  # a line has each wavenumber twice, k and -k
    q = np.hypot(qx, qy)
    heights = np.divide(slopes * area, q**2, out=np.zeros_like(q), where=q > 0.0)
    sizes = np.abs(waves)
    return np.divide(waves, sizes, out=waves, where=sizes > 0.0) * np.sqrt(heights) * (fft.mx * fft.my)


def _seed(job: Job, number: int, sample: int) -> int:
    """Return the seed of a surface: the seed of the job for the first one of the coarsest band; the others
    follow from it."""
    seed = next((part.seed for part in job.surface if hasattr(part, "seed")), 0)
    if number == sample == 0:
        return int(seed)
    return int(np.random.SeedSequence([seed, number, sample]).generate_state(1, np.uint64)[0])


# -- steps of a history -----------------------------------------------------------------------------------------------

FIRST, GROWTH, LONGEST = 0.02, 1.35, 0.5  # accuracy: cells of the first step of a slide, growth, cells of the longest
SETTLED = 1.5  # accuracy: slip of a stage over the longest wave of a band, after which the band is steady
OF_REST, GROWTH_OF_REST = 1e-6, 2.0  # accuracy: first step of a rest over its duration, and growth
BEFORE = -1.0  # time since the start of a steady state before all steps
OF_FASTEST = 0.1  # accuracy: the same over the shortest relaxation time, if that is longer


class Place(NamedTuple):
    """An instant of a job's history: the number of the stage, and the time since the stage began [s]."""

    stage: int
    elapsed: float


def parts_of_history(job: Job, grid: Grid, longest: float) -> list[tuple[Stage, int]]:
    """Return the stages into which the stages of the job are divided for a band with this grid and `longest` wave [m],
    each with the number of the job's stage to which it belongs."""
    found = list[tuple[Stage, int]]()
    for number, stage in enumerate(job.history):
        found += [(part, number) for part in _parts(job, stage, grid.dx, longest)]
    return found


def _parts(job: Job, stage: Stage, cell: float, longest: float) -> Iterator[Stage]:
    if stage.seconds == 0.0:
        yield stage
    elif not stage.speed:
        yield _timed(stage, stage.seconds, rest_step(job, stage), GROWTH_OF_REST)
    else:
        most, first = LONGEST * cell, FIRST * cell
        way = min(stage.seconds * stage.speed, SETTLED * longest)
        growing = min(way, (most - first) / (1.0 - 1.0 / GROWTH))  # steps from `first` to `most`
        steady = math.ceil((way - growing) / most - ROUNDING) * most
        yield _timed(stage, (way - steady) / stage.speed, first / stage.speed, GROWTH)
        if steady:
            yield _timed(stage, steady / stage.speed, most / stage.speed, 1.0)


def rest_step(job: Job, stage: Stage) -> float:
    """Return the length [s] of the first step of a stage at rest."""
    times = relaxation_of(job.material)[2]
    return min(max(OF_REST * stage.seconds, OF_FASTEST * float(min(times, default=0.0))), stage.seconds / 4.0)


def _timed(stage: Stage, seconds: float, first: float, growth: float) -> Stage:
    """Return a stage of this duration [s] with steps that grow from the `first` one [s]."""
    steps = GeometricStep(first=first, growth=growth)
    return stage.model_copy(update={"duration": seconds, "distance": None, "time_step": steps, "cells_per_step": None})


class BandClock:
    """Finds when a step of a band happens in the history of the job; `parts` is the result of `parts_of_history`."""

    def __init__(self, job: Job, parts: list[tuple[Stage, int]]) -> None:
        timeline = Timeline(job.history, job.grid, pressure=job.initial.pressure)
        self._owners = [number for _, number in parts]
        self._slides = {number for stage, number in parts if stage.speed}
        self._starts = dict[int, float]()
        for span, number in zip(timeline.spans, self._owners, strict=True):
            self._starts.setdefault(number, span.start)
        begins = [Place(0, BEFORE)] if job.initial.state == "steady" else []  # before all steps
        self.places = [*begins, *map(self.place, timeline)]

    def place(self, step: Step) -> Place:
        """Return the stage of the job in which a step of the band ends, and the time since this stage began."""
        number = self._owners[step.stage]
        return Place(number, step.time - self._starts[number])

    def between(self, at: Place) -> tuple[int, int, float]:
        """Return the numbers of the steps before and after an instant of the job (`Place`), and the weight of the step
        after in results that are interpolated between the two steps.

        The interpolation is linear in the slip of a slide, and in the logarithm of the time of a rest. Beyond the last
        step of a stage results are constant; before the first step they are the last results of the stage before.
        """
        own = [index for index, place in enumerate(self.places) if place.stage == at.stage]
        after = next((index for index in own if self.places[index].elapsed >= at.elapsed), own[-1])
        before = max(after - 1, 0)
        begin = max(self.places[before].elapsed, 0.0) if before in own else 0.0
        end = self.places[after].elapsed
        if at.elapsed >= end or end <= begin:
            return after, after, 0.0
        if at.stage in self._slides or begin <= 0.0:
            return before, after, (at.elapsed - begin) / (end - begin)
        return before, after, float(np.log(at.elapsed / begin) / np.log(end / begin))
