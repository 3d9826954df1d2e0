"""Steady sliding of a surface in bands: points of a friction curve with the columns of points on one grid."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..columns import BANDS, choose_columns, names_of
from ..contact.problem import Box
from ..effects.branches import relaxation_of, temperature_of
from ..errors import Doubt, RunError, UnsolvedError
from ..files import outputs
from ..job import Job
from ..job.listing import answers
from ..march.budget import ErrorBudget, ErrorParts
from ..march.choices import choices
from ..march.curve import States, on_one_grid, request
from ..march.scene import Setup
from ..march.steady import Point, direction_of
from ..parallel.slab import Array, Slab
from ..physics.records import Certificate, Measures
from .band import Rung, Vector
from .cascade import BandResult, Cascade, Results, Solved, Task, mean_rungs
from .choice import FEWEST, MOST, SAMPLE_SHARE, STRAIN, cut_bands, describe_cut, doubts_of_bands

MOST_ROUNDS = 20  # tuning: limit on rounds of the loops of effects
HARD_SHARE = (
    0.25  # fitted: error of the method over the difference to hard walls, 1 for profiles (`scripts/band_errors.py`)
)
LEAST_METHOD = 0.03  # fitted: least relative error of the method (`scripts/band_errors.py`)
LEAST_OF_AREA = 0.09  # fitted: the same of a small area; it falls with the open share (`scripts/band_errors.py`)
NEARLY_ALL = 0.1  # accuracy: open area below which errors fall to 0 with it
SURE = 2.0  # accuracy: error by the scatter of surfaces over its standard error


@dataclass(frozen=True)
class BandOutcome:
    """Results of all bands.

    `results` are the mean results of all samples; under pressure finer bands are squeezed. `with_laws` has friction and
    corrected area of the first sample with this effect, and `hard` has both without it. `scatter` has the standard
    errors of friction and area, from the differences between surfaces. `rungs` has the results of each band at its mean
    pressures, averaged over samples. `line` is True if the surfaces are profiles. `memory` is the error of friction
    because these pressures are constant through a history.
    """

    results: Results
    with_laws: tuple[float, float]
    hard: tuple[float, float]
    scatter: tuple[float, float]
    rungs: Sequence[Sequence[Rung]]
    line: bool = False
    memory: float = 0.0

    @property
    def friction(self) -> float:
        return sum(result.friction for result in self.results)

    @property
    def method(self) -> list[float]:
        """Absolute errors of the method in friction and in the corrected area; 0 if there is only one band.

        Each is a share of the difference between the results with finer bands that are squeezed, and without. The least
        relative error of friction is LEAST_METHOD, and falls to 0 near full contact. The least relative error of the
        area is the same, or LEAST_OF_AREA times the open share of the area if this is larger. `memory` is added to the
        error of friction.
        """
        if len(self.results) == 1:
            return [0.0, 0.0]
        open_share = 1.0 - self.results[-1].contact_area_corrected
        least = LEAST_METHOD * min(1.0, open_share / NEARLY_ALL)
        ends = zip(self.hard, self.with_laws, (least, max(least, LEAST_OF_AREA * open_share)), strict=True)
        share = 1.0 if self.line else HARD_SHARE
        friction, area = (max(share * abs(hard - law), lowest * law) for hard, law, lowest in ends)
        return [friction + self.memory, area]


class BandLoop(Protocol):
    """Iteration by which an effect changes the bands and finds its results. In each round all bands are solved. Its
    methods are collective.

    The function `band_loops(job, cut)` in the module `steady` of an effect yields its loops. Loops that change the
    bands have `moves` = True and share the rounds of one fixed point.
    """

    moves: bool  # False if the effect only finds something in a state
    words: tuple[str, str]  # what it changes, and what to try if that does not settle

    def begin(self, road: "RoadSliding") -> None:
        """Prepare the iteration for a new steady state."""

    def act(self, road: "RoadSliding") -> None:
        """Set what the effect changes in the bands before they are solved again."""

    def settles(self, road: "RoadSliding", results: Results, changes: tuple[float, float], others: bool) -> bool:
        """Return True if the next round (solve of all bands) would change nothing for the effect. `changes` are the
        relative changes of friction and area in this round; `others` is True if all loops before this one settle."""

    def move(self, road: "RoadSliding", results: Results) -> None:
        """Choose what the effect changes before the bands are solved again; raises RunError."""

    def found(self, road: "RoadSliding", point: Point, results: Results, changes: tuple[float, float]) -> Point:
        """Return the point of a steady state with the results of the effect added."""

    def values(self, results: Results) -> Mapping[str, Sequence[float]]:
        """Return the values of the effect's columns of bands.csv, one for each band."""


class RoadSliding:
    """Steady states of a job in bands, on the ranks of `slab`; the constructor and the methods are collective.

    For friction curves it has the same methods as `march.steady.SteadySliding`.
    """

    table: tuple[str, Sequence[str]] | None

    def __init__(self, job: Job, slab: Slab) -> None:
        self.job, self.slab, self.cut = job, slab, cut_bands(job)
        asked = answers("steady", "band_loops", job)
        self.loops: list[BandLoop] = [loop for loops in asked for loop in loops(job, self.cut)]
        options = [option for asked in job.asked("curve_options") for option in asked(job)]
        self._columns = names_of(choose_columns(BANDS, when=options))
        self.table = None if job.history else (outputs.BANDS, self._columns)  # of a history it has the history
        self._cascade = Cascade(job, self.cut, slab)
        self.setup: Setup = replace(self._cascade.band(0, 0).setup, slab=slab)
        self.temperature, self._own_temperature = math.nan, temperature_of(job.material)
        self._point: Point | None = None
        self._results: Results = ()

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]:
        """Return warnings about the job, and about frequencies at which the material was not measured at these
        temperatures [deg C]."""
        return doubts_of_bands(self.job, self.cut, temperatures)

    def notes(self) -> list[str]:
        """Return sentences on the chosen bands."""
        return describe_cut(self.cut, self.job)

    def plan(self) -> Iterator[str]:
        """Yield lines on the bands, and on the number of contacts and their time, which a short trial measures."""
        yield from self.notes()
        wanted, cascade = request(self.job), self._cascade
        began, contacts = time.perf_counter(), 0
        cascade.press(wanted.velocity(max(wanted.velocities)), wanted.pressures[0])
        for number in sorted({0, self.cut.count // 2, self.cut.count - 1}):
            rungs = range(len(cascade.ladders[number].rungs))
            cascade.solve_tasks([Task(number, 0, rung, Box()) for rung in rungs])
            contacts += len(rungs)
        each = self.slab.agree((time.perf_counter() - began) / contacts)
        samples = self.cut.samples or FEWEST
        of_point = (samples + 1) * sum(len(ladder.rungs) for ladder in cascade.ladders)
        points, size = len(wanted.points), self.slab.comm.size
        yield f"parcontact steady: {points} steady states of {of_point} contacts or more, {each * 1e3:.3g} ms each"
        yield f"on {size} rank{'s' * (size > 1)}: {points * of_point * each:.3g} s or more in all"

    def keep_in(self, directory: Path) -> str:
        """Store contacts in a file of this directory until their point of the curve is written. Return, on root, a
        sentence on a removed file of another program, or ''. Raises RunError if the file cannot be read or written."""
        return self._cascade.store.keep_in(directory, self.job)

    def forget(self) -> None:
        """Remove the stored contacts of the last point, which is written."""
        self._cascade.store.clear()

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature [deg C] for all further solves; raises InputError if the material has no shift."""
        if temperature != self.temperature:
            self.set_temperatures([temperature] * self.cut.count)
            self.temperature = temperature

    def field(self, name: str) -> Array:
        raise RunError(f"a job in bands has no map of {name}")

    def solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at a velocity [m/s] under a mean pressure [Pa]; raises RunError."""
        began = time.perf_counter()
        self._cascade.press(velocity, pressure)
        moving = [loop for loop in self.loops if loop.moves]
        changes = self._solve_fixed_point(moving) if moving else (0.0, 0.0)
        outcome = self._solve()
        self._results = outcome.results
        point = self._to_point(outcome, velocity, pressure, time.perf_counter() - began)
        for loop in self.loops:
            point = loop.found(self, point, outcome.results, changes)
        self._point = point
        return point

    def rows(self, velocity: Vector) -> list[list[float]]:
        """Return the lines of bands.csv for the last steady state."""
        assert self._point is not None
        return self._rows(self._point, [self._point.speed])

    def _rows(self, point: Point, instant: Sequence[float]) -> list[list[float]]:
        """Return the lines of bands.csv for a state; `instant` has its first columns."""
        cut, rows = self.cut, []
        values = {name: each for loop in self.loops for name, each in loop.values(self._results).items()}
        added = [values[name] for name in self._columns if name in values]
        for number, result in enumerate(self._results):
            last = number + 1 == cut.count
            friction = result.friction + (point.measures.friction_interface if last else 0.0)
            slope_to = cut.rms_slope(number, 0)
            place = *instant, point.measures.pressure, point.temperature, float(number)
            found = friction, result.contact_area, cut.rms_slope(number), result.load_lost
            strains = slope_to, STRAIN * slope_to
            rows.append([*place, *cut.wavelengths(number), *found, *strains, *(each[number] for each in added)])
        return rows

    # -- loops of effects ---------------------------------------------------------------------------------------------

    def _solve_fixed_point(self, moving: Sequence["BandLoop"]) -> tuple[float, float]:
        """Find the fixed point of all effects that change the bands, with one surface per band, and set it in the
        cascade. Return the relative changes of friction and area in the last round. Raises RunError if it is not
        found."""
        seen = list[tuple[float, float]]()
        for loop in moving:
            loop.begin(self)
        for _ in range(MOST_ROUNDS):
            for loop in moving:
                loop.act(self)
            self._cascade.press(*self.place)
            rungs = self._cascade.climb([0])
            results = self._cascade.fall(lambda band, _: rungs[band, 0])  # noqa: B023
            seen.append(_sums(results))
            changes = _changes(*seen[-2:]) if len(seen) > 1 else (math.inf, math.inf)
            settled = True
            for loop in moving:
                settled = loop.settles(self, results, changes, settled) and settled
            if settled:
                return changes
            for loop in moving:
                loop.move(self, results)
        what, advice = (" and ".join(filter(None, each)) for each in zip(*(loop.words for loop in moving), strict=True))
        at = "" if math.isnan(self.own_temperature) else f" and {self.own_temperature:.4g} C"
        raise UnsolvedError(
            f"steady sliding at {self.speed:.4g} m/s under {self.place[1]:.4g} Pa{at}",
            f"{what} of bands did not settle in {MOST_ROUNDS} rounds{advice and f'. Try {advice}'}",
        )

    @property
    def place(self) -> tuple[Vector, float]:
        """The velocity [m/s] and the pressure [Pa] of the present steady state."""
        return self._cascade.velocity, self._cascade.pressure

    @property
    def speed(self) -> float:
        """The magnitude of the present velocity [m/s]."""
        return math.hypot(*self._cascade.velocity)

    @property
    def own_temperature(self) -> float:
        """The temperature of the rubber [deg C] without heat of friction; NaN if the material has no shift."""
        return self._own_temperature if math.isnan(self.temperature) else self.temperature

    def set_factors(self, at: Callable[[float], Any], values: Sequence[float]) -> None:
        """Multiply the moduli by factors. For each wave of a band, `at` returns the factors for the band's entry in
        `values`."""
        self._cascade.set_factors(at, values)

    def set_temperatures(self, temperatures: Sequence[float]) -> None:
        """Set the temperature [deg C] of each band; raises InputError outside the range of the material's shift."""
        self._cascade.set_temperatures(temperatures)
        self.setup = replace(self.setup, choices=choices(self.setup.job.at_temperature(temperatures[-1])))

    def rub(self, results: Results) -> float:
        """Return the magnitude of the shear stress [Pa] of the interface over the nominal area, for the contact area in
        `results` and the present velocity."""
        area, shears = results[-1].contact_area_corrected, self.setup.choices.shears
        forces = [shear.force(area, self._cascade.velocity) for shear in shears]
        return math.hypot(*(sum(force[axis] for force in forces) for axis in (0, 1)))

    # -- samples and errors -------------------------------------------------------------------------------------------

    def _solve(self) -> BandOutcome:
        """Solve surfaces until their scatter is below its share of the requested accuracy."""
        asked, fixed = self.job.numerics.asked, self.cut.samples
        samples = list(range(fixed or FEWEST))
        rungs: dict[tuple[int, int], list[Rung]] = dict(self._cascade.climb(samples))
        alone = self.cut.count == 1
        first = self._cascade.fall(lambda band, _: rungs[band, 0]) if alone else self._cascade.hard(0)
        hard = _sums(first)
        while True:
            outcome = self._outcome(rungs, samples, hard)
            found = zip(outcome.scatter, _sums(outcome.results), asked.both, strict=True)
            enough = all(SURE * error <= SAMPLE_SHARE * share * whole for error, whole, share in found)
            if fixed or enough or len(samples) >= MOST:
                return outcome
            samples.append(len(samples))
            rungs.update(self._cascade.climb(samples[-1:]))

    def _outcome(self, rungs: Solved, samples: Sequence[int], hard: tuple[float, float]) -> BandOutcome:
        means = [mean_rungs(rungs, band, samples) for band in range(self.cut.count)]
        results = self._cascade.fall(lambda band, _: means[band])
        first = self._cascade.fall(lambda band, _: rungs[band, 0])
        variances = np.zeros(2)
        if len(samples) > 1:
            for changed in range(self.cut.count):
                each = [
                    _sums(self._cascade.fall(lambda band, _: rungs[band, s] if band == changed else means[band]))  # noqa: B023
                    for s in samples
                ]
                variances += np.var(each, axis=0, ddof=1) / len(samples)
        scatter = np.sqrt(variances)
        return BandOutcome(results, _sums(first), hard, (float(scatter[0]), float(scatter[1])), means, self.cut.line)

    def _to_point(self, outcome: BandOutcome, velocity: Vector, pressure: float, seconds: float) -> Point:
        results, finest, coarsest = outcome.results, outcome.results[-1], outcome.rungs[0][0]
        box, rubbed = self.setup.grid.lx * self.setup.grid.ly, self.rub(results)
        slopes = sum(result.friction_slopes for result in results) + rubbed / pressure
        friction = outcome.friction + rubbed / pressure
        direction = direction_of(velocity)
        pressed = [rung for rung, weight in zip(outcome.rungs[-1], finest.weights, strict=True) if weight > 0.0]
        measures = Measures(
            pressure=finest.load,
            force_x=-slopes * pressure * box * direction[0],
            force_y=-slopes * pressure * box * direction[1],
            friction=slopes,
            contact_area=finest.contact_area,
            approach=coarsest.approach,
            mean_gap=-coarsest.approach,
            max_pressure=max(rung.max_pressure for rung in pressed),
            contact_area_corrected=finest.contact_area_corrected,
            normal_force=pressure * box,
            friction_interface=rubbed / pressure,
            force_interface=rubbed * box,
        )
        worst = max((rung for each in outcome.rungs for rung in each), key=lambda rung: rung.residual)
        certificate = Certificate(worst.residual, worst.penetration, abs(finest.load / pressure - 1.0))
        powers = np.sum([result.powers for result in results], axis=0) * box
        calls = sum(rung.operator_calls for each in outcome.rungs for rung in each)
        factor = self.setup.choices.time_factor
        errors = self._errors(outcome, friction)
        return Point(
            *(velocity, pressure, self.temperature, factor, measures, friction, errors, certificate, calls, seconds),
            tuple(powers.tolist()),
        )

    def _errors(self, outcome: BandOutcome, friction: float) -> ErrorBudget:
        """Return relative errors; those of grids and of loads beyond ladders are added over bands. Each band divides
        the area that coarser bands leave, so that relative errors of areas by their grids add up."""
        area = outcome.results[-1].contact_area_corrected
        lost = sum(result.load_lost for result in outcome.results)
        of_bands = np.sum([result.errors for result in outcome.results], axis=0)[:3]
        shares = [result.errors[4:] / (result.contact_area_corrected or 1.0) for result in outcome.results]
        of_area = outcome.results[-1].errors[3], *(np.sum(shares, axis=0) * area)
        wholes = friction or 1.0, area or 1.0
        by_samples = outcome.method, [SURE * error for error in outcome.scatter]
        parts = [
            ErrorParts(
                solver / whole, steps / whole, 0.0, mesh / whole, method=by / whole + lost, scatter=spread / whole
            )
            for whole, (solver, steps, mesh), by, spread in zip(wholes, (of_bands, of_area), *by_samples, strict=True)
        ]
        own = 1.0 - outcome.friction / friction if friction > 0.0 else 0.0  # share of the interface
        with_interface = parts[0]._replace(method=parts[0].method + own * parts[1].method)
        rubs = self.loses or own > 0.0
        return ErrorBudget(with_interface if friction > 0.0 and rubs else None, parts[1])

    @property
    def loses(self) -> bool:
        """True if the material has branches. Without branches the waves cause no friction, and what is calculated as
        their friction is an error of the mesh."""
        return len(relaxation_of(self.job.material)[2]) > 0


def make_states(job: Job, slab: Slab) -> States:
    """Return the solver of the steady states of a job: in bands if the job has `bands`, otherwise on one grid.
    Collective."""
    return on_one_grid(job, slab) if job.bands is None else RoadSliding(job, slab)


def _changes(before: tuple[float, float], now: tuple[float, float]) -> tuple[float, float]:
    """Return relative changes of friction and area."""
    friction, area = (abs(b - a) / b if b > 0.0 else 0.0 for a, b in zip(before, now, strict=True))
    return friction, area


def _sums(results: Sequence[BandResult]) -> tuple[float, float]:
    """Return friction of all bands, and the corrected area of the finest."""
    return sum(result.friction for result in results), results[-1].contact_area_corrected
