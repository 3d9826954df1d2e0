"""Steady sliding of a surface in bands: points of a friction curve with the columns of those on one grid."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..columns import BANDS, names_of
from ..doubts import Doubt
from ..effects.relaxation import feeds_back, highest_temperature_of, temperature_of
from ..errors import InputError, RunError, UnsolvedError
from ..job import Job
from ..march.budget import ErrorBudget, ErrorParts
from ..march.choices import choices
from ..march.curve import States, on_one_grid
from ..march.point import Point
from ..march.scene import Setup
from ..parallel.slab import Array, Slab
from ..physics.measures import Certificate, Measures
from .band import Rung, Vector, direction_of
from .cascade import BandResult, Cascade, Results, Solved, mean_rungs
from .choice import FEWEST, MOST, SAMPLE_SHARE, STRAIN, cut_bands, describe_cut, doubts_of_bands

MOST_ROUNDS = 20  # tuning: limit on rounds of the temperatures
LEAST_ERROR, RELATIVE = 0.1, 0.02  # accuracy: error of the rise of a band [K], and relative
HARD_SHARE = 0.25  # fitted: error of the method over the difference to hard walls; 1 for profiles
LEAST_METHOD = 0.03  # fitted: least relative error of the method (`scripts/band_errors.py`)
LEAST_OF_AREA = 0.09  # fitted: the same of a small area; it falls with the open share (`scripts/band_errors.py`)
NEARLY_ALL = 0.1  # accuracy: open area below which errors fall to 0 with it
SURE = 2.0  # accuracy: error by the scatter of surfaces over its standard error
ROUND_SHARE = 0.2  # accuracy: change of friction in a round of strains over the accuracy of the job
TINY = 1e-300  # rounding: least square of a change, to avoid division by 0
TABLE = "bands.csv"


@dataclass(frozen=True)
class BandOutcome:
    """Results of all bands.

    `results` with laws from all samples; friction and area of the first sample with laws, and without (`hard`);
    standard errors of friction and area by the `scatter` of surfaces; the rungs of each band; `line`: these are
    profiles.
    """

    results: Results
    with_laws: tuple[float, float]
    hard: tuple[float, float]
    scatter: tuple[float, float]
    rungs: Sequence[Sequence[Rung]]
    line: bool = False

    @property
    def friction(self) -> float:
        return sum(result.friction for result in self.results)

    @property
    def method(self) -> list[float]:
        """Error of the method in friction and in the corrected area: a share of the difference between hard walls and
        laws, at least LEAST_METHOD, or LEAST_OF_AREA, less near full contact; 0 for one band."""
        if len(self.results) == 1:
            return [0.0, 0.0]
        open_share = 1.0 - self.results[-1].contact_area_corrected
        least = LEAST_METHOD * min(1.0, open_share / NEARLY_ALL)
        ends = zip(self.hard, self.with_laws, (least, max(least, LEAST_OF_AREA * open_share)), strict=True)
        share = 1.0 if self.line else HARD_SHARE
        return [max(share * abs(hard - law), lowest * law) for hard, law, lowest in ends]


@dataclass(frozen=True)
class BandSearch:
    """Search for the temperatures and the strains of bands: the number of `rounds`, friction of cold rubber, and the
    relative `changes` of friction and area in the last round."""

    rounds: int = 1
    friction_cold: float = math.nan
    changes: tuple[float, float] = (0.0, 0.0)


class RoadSliding:
    """Steady states of a job in bands, on the ranks of `slab`; the constructor and the methods are collective.

    It has the interface of `march.steady.SteadySliding` for friction curves.
    """

    table: tuple[str, Sequence[str]] | None = (TABLE, names_of(BANDS))

    def __init__(self, job: Job, slab: Slab) -> None:
        self.job, self.slab, self.cut = job, slab, cut_bands(job)
        self.table = None if job.history else RoadSliding.table  # of a history it has the history
        self._cascade = Cascade(job, self.cut, slab)
        self.setup: Setup = replace(self._cascade.band(0, 0).setup, slab=slab)
        self.temperature, self._own_temperature = math.nan, temperature_of(job.material)
        self._point: Point | None = None
        self._results: Results = ()
        self._rises: list[float] = []
        section = job.section("softening")
        self._table: Any = section and section.made
        self._strains = np.full(self.cut.count, self._table.start if section else math.nan)

    def doubts(self, temperatures: Sequence[float]) -> list[Doubt]:
        """Return warnings about the job."""
        return doubts_of_bands(self.job, self.cut, temperatures)

    def notes(self) -> list[str]:
        """Return sentences on the chosen bands."""
        return describe_cut(self.cut, self.job)

    def keep_in(self, directory: Path) -> None:
        """Store contacts in a file of this directory until their point is written; raises RunError."""
        self._cascade.store.keep_in(directory, self.job)

    def forget(self) -> None:
        """Remove the contacts of the last point."""
        self._cascade.store.clear()

    def set_temperature(self, temperature: float) -> None:
        """Set the temperature [deg C] of further solves; raises InputError if the material has no shift."""
        if temperature != self.temperature:
            self.setup = replace(self.setup, choices=choices(self.setup.job.at_temperature(temperature)))
            self._cascade.set_temperatures([temperature] * self.cut.count)
            self.temperature = temperature

    def field(self, name: str) -> Array:
        raise RunError(f"a job in bands has no map of {name}")

    def solve(self, velocity: Vector, pressure: float) -> Point:
        """Return the steady state at a velocity [m/s] under a mean pressure [Pa]; raises RunError."""
        began = time.perf_counter()
        self._cascade.press(velocity, pressure)
        search = self._solve_fixed_point() if feeds_back(self.job) or self._table else BandSearch()
        outcome = self._solve()
        self._results = outcome.results
        point = self._to_point(outcome, velocity, pressure, time.perf_counter() - began)
        if self.job.section("thermal") is not None:
            from ..effects.heat.steady import flash_of_bands

            self._rises = self._rises_of(outcome.results, point.measures.force_interface)
            heats = [result.friction for result in outcome.results]
            heats[-1] += point.measures.friction_interface
            flash = flash_of_bands(self._rises, heats)
            point = replace(point, flash=flash, rounds=search.rounds, friction_cold=search.friction_cold)
        if self._table:
            errors = point.errors.with_rounds(*search.changes)
            point = replace(point, errors=errors, strain_amplitude=self._amplitude(outcome.results))
        self._point = point
        return point

    def rows(self, velocity: Vector) -> list[list[float]]:
        """Return the lines of bands.csv for the last state."""
        assert self._point is not None
        return self._rows(self._point, [self._point.speed])

    def _rows(self, point: Point, instant: Sequence[float]) -> list[list[float]]:
        """Return the lines of bands.csv for a state; `instant` has its first columns."""
        cut, rows = self.cut, []
        for number, result in enumerate(self._results):
            last = number + 1 == cut.count
            friction = result.friction + (point.measures.friction_interface if last else 0.0)
            slope_to = cut.rms_slope(number, 0)
            place = *instant, point.measures.pressure, point.temperature, float(number)
            rise = self._rises[number] if self._rises else math.nan
            found = friction, result.contact_area, cut.rms_slope(number), rise, result.load_lost
            strains = slope_to, STRAIN * slope_to, self._strains_of(self._results)[number] if self._table else math.nan
            rows.append([*place, *cut.wavelengths(number), *found, *strains])
        return rows

    # -- temperatures -------------------------------------------------------------------------------------------------

    def _rises_of(self, results: Results, rubbing: float) -> list[float]:
        """Return the rises [K] of all bands; `rubbing` [N] is the force of the interface on the coarsest box."""
        from ..effects.heat.steady import rises_of, uniform, waves_along_depth

        cascade, section = self._cascade, self.job.section("thermal")
        speed, box = math.hypot(*cascade.velocity), self.setup.grid.lx * self.setup.grid.ly
        heats = [result.friction * cascade.pressure * speed for result in results]
        m, weights = waves_along_depth(float(self.cut.edges[0]), float(self.cut.edges[-1]))
        whole = uniform(section.conductor, m, cascade.seconds)
        shares, warmings = [result.depths for result in results], [result.warming for result in results]
        return rises_of(weights, whole, shares, warmings, heats, rubbing / box * speed)

    def _solve_fixed_point(self) -> BandSearch:
        """Find the fixed point of the temperatures and the strains of all bands, with one surface per band, and set
        them in the cascade. Raises RunError if it is not found.

        Rounds use Aitken's relaxation for temperatures, and a power mean for strains; the first is for cold bands. No
        temperature above the range of the material's shift is tried.
        """
        cold = self._own_temperature if math.isnan(self.temperature) else self.temperature
        warms = feeds_back(self.job)
        highest = highest_temperature_of(self.job.material) if warms else math.inf
        place, most = (*self._place(), cold), highest - cold if warms else math.inf
        enough = ROUND_SHARE * self.job.numerics.asked.both[0]
        rises: Array = np.zeros(self.cut.count)
        last: Array = np.zeros(0)
        relax, friction_cold, seen = 1.0, math.nan, list[tuple[float, float]]()
        for rounds in range(1, MOST_ROUNDS + 1):
            self._set_state(np.minimum(cold + rises, highest))
            rungs = self._cascade.climb([0])
            results = self._cascade.fall(lambda band, _: rungs[band, 0])  # noqa: B023
            seen.append(_sums(results))
            changes = _changes(seen[-2], seen[-1]) if rounds > 1 else (math.inf, math.inf)
            over = self._rises_beyond(rises, results)
            softened = not self._table or changes[0] <= enough
            if math.isnan(friction_cold):  # no heat before the strains of cold rubber are found
                over, friction_cold = (over, seen[-1][0]) if softened else (0.0 * over, math.nan)
            settled = np.abs(over) <= np.maximum(LEAST_ERROR, RELATIVE * rises)
            if np.all(settled) and softened:
                return BandSearch(rounds, friction_cold, changes)
            if not np.all(settled) and np.all(settled | ((rises == most) & (over > 0.0))):
                from ..effects.heat.steady import beyond_shift

                raise beyond_shift(*place, most, most + float(over[rises == most].max()))
            if last.any():
                change = over - last
                relax = float(np.clip(-relax * float(last @ change) / max(float(change @ change), TINY), 0.1, 1.0))
            rises, last = np.clip(rises + relax * over, 0.0, most), over
            if self._table:
                self._strains = self._table.mixed(self._strains_of(results), self._strains)
        at = "" if math.isnan(cold) else f" and {cold:.4g} C"
        raise UnsolvedError(
            f"steady sliding at {place[0]:.4g} m/s under {place[1]:.4g} Pa{at}",
            f"temperatures and strains of bands did not settle in {MOST_ROUNDS} rounds. Try feedback: none",
        )

    def _place(self) -> tuple[float, float]:
        """Return the velocity [m/s] and the pressure [Pa] of the state."""
        return math.hypot(*self._cascade.velocity), self._cascade.pressure

    def _rises_beyond(self, rises: Array, results: Results) -> Array:
        """Return the rises [K] of all bands that results cause, over these rises; 0 without feedback."""
        if not feeds_back(self.job):
            return np.zeros(self.cut.count)
        rubbing = self._rub(results) * self.setup.grid.lx * self.setup.grid.ly
        return np.array(self._rises_of(results, rubbing)) - rises

    def _set_state(self, temperatures: Array) -> None:
        """Set the temperatures [deg C] and the strains of the bands, as far as the job has them."""
        if self._table:
            self._cascade.soften(self._table, self._strains.tolist())
        if feeds_back(self.job):
            self._set_temperatures(temperatures)
        self._cascade.press(self._cascade.velocity, self._cascade.pressure)

    def _amplitude(self, results: Results) -> float:
        """Return the root of the mean square strain of all bands, weighted by friction; NaN without friction."""
        weights = np.maximum([result.friction for result in results], 0.0)
        return math.sqrt(np.average(self._strains_of(results) ** 2, weights=weights)) if weights.any() else math.nan

    def _strains_of(self, results: Results) -> Array:
        """Return the strain of each band, by the waves of all bands."""
        squares = np.sum([result.squares for result in results], axis=0)
        return np.sqrt([result.strain_weights @ squares for result in results])

    def _set_temperatures(self, temperatures: Array) -> None:
        """Set the temperatures [deg C] of the bands; raises RunError outside the range of the material's shift."""
        try:
            self._cascade.set_temperatures(temperatures.tolist())
            finest = self.setup.job.at_temperature(float(temperatures[-1]))
            self.setup = replace(self.setup, choices=choices(finest))
        except InputError as error:
            from ..effects.heat.steady import describe_cold_state

            place = describe_cold_state(*self._place(), self.temperature)
            raise UnsolvedError(place, f"no material at the flash temperature: {error}") from None

    def _rub(self, results: Results) -> float:
        """Return the shear stress [Pa] of the interface, averaged over the nominal area."""
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
        box, rubbed = self.setup.grid.lx * self.setup.grid.ly, self._rub(results)
        slopes = sum(result.friction_slopes for result in results) + rubbed / pressure
        friction = outcome.friction + rubbed / pressure
        direction = direction_of(velocity) if any(velocity) else (1.0, 0.0)
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
        method, scatter = outcome.method, [SURE * error for error in outcome.scatter]
        parts = [
            ErrorParts(
                solver / whole,
                steps / whole,
                0.0,
                mesh / whole,
                method=method[k] / whole + lost,
                scatter=scatter[k] / whole,
            )
            for k, (whole, (solver, steps, mesh)) in enumerate(((friction or 1.0, of_bands), (area or 1.0, of_area)))
        ]
        own = self._interface_share(outcome, friction)
        with_interface = parts[0]._replace(method=parts[0].method + own * parts[1].method)
        return ErrorBudget(with_interface if friction > 0.0 else None, parts[1])

    def _interface_share(self, outcome: BandOutcome, friction: float) -> float:
        return 1.0 - outcome.friction / friction if friction > 0.0 else 0.0


def make_states(job: Job, slab: Slab) -> States:
    """Return the steady states of a job, in bands or on its grid; collective."""
    return on_one_grid(job, slab) if job.bands is None else RoadSliding(job, slab)


def _changes(before: tuple[float, float], now: tuple[float, float]) -> tuple[float, float]:
    """Return relative changes of friction and area."""
    friction, area = (abs(b - a) / b if b > 0.0 else 0.0 for a, b in zip(before, now, strict=True))
    return friction, area


def _sums(results: Sequence[BandResult]) -> tuple[float, float]:
    """Return friction of all bands, and the corrected area of the finest."""
    return sum(result.friction for result in results), results[-1].contact_area_corrected
