"""History of a surface in bands: friction and area as functions of time, from rest and after changes of velocity.

Every band is marched through the whole history at every rung of its ladder, from the finest band to the coarsest, with
the closing of all finer bands at each instant as the law of its interface (`BandMarch`). Then the load is distributed
over the bands at each instant as in steady sliding (`cascade`, `road_sliding`). For the error of the method, half of
the rungs are marched without the closing of finer bands, too.

The nominal pressure is constant, and rungs keep their pressures. But the mean pressure on a fine band rises when the
rubber stiffens, as smaller contacts carry the load. A rung of higher pressure then has a larger weight. Such a rung was
marched under its pressure from the start, when the pressure on the rubber was lower, so that it has a wrong memory of
the start. This error is a part of the error of the method (`RoadHistory._error_by_memory`).
"""

import copy
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..contact.problem import Box, Constraint, InterfaceLaw
from ..effects.branches import relaxation_of
from ..errors import RunError
from ..files import outputs
from ..files.recorder import StepRow
from ..job import Job
from ..job.history import Step
from ..march.laws import ClosingLaw
from ..march.loop import March, run_steps
from ..march.scene import build_on
from ..march.steady import Point, start_march
from ..parallel.slab import Array, Slab
from ..physics.records import Measures
from .band import BEFORE, NODES, SETTLED, Band, BandClock, Place, PressureLadder, Rung, rest_step, rung_errors
from .cascade import Cascade, Results, mean_rungs
from .choice import FEWEST
from .road_sliding import BandOutcome, RoadSliding, _sums

LawAt = Callable[[Place], Constraint]
NOTHING: Array = np.zeros(0)
NONE: Array = np.zeros(1)  # of what only steady states have


class BandMarch:
    """Marches of one band: calculations step by step through the history of the band.

    Each march is under a constant mean pressure. Its result is a track: a `Rung` whose numbers are arrays with a first
    axis over the instants `BandClock.places`. The friction of a track is along +x, from the pressures on slopes.
    """

    def __init__(self, band: Band) -> None:
        self.band = band
        self.scene = build_on(band.setup)
        self.scene.probe = band.probe

    def march(
        self, pressure: float, law: LawAt | None, place: Callable[[Step], Place], below: PressureLadder | None
    ) -> Rung:
        """Return the results at all instants of the history under a mean pressure [Pa]. They include how the pressures
        of the contact load the rungs `below`, the mean pressures at which the next finer band is solved. Without a
        `law` finer bands are absent. Raises RunError if a step fails."""
        scene, rows = self.scene, list[Rung]()
        scene.law = ClosingLaw(scene, lambda step: law(place(step))) if law is not None else None
        march = self._begin(pressure, law)
        if self.band.setup.job.initial.state == "steady":
            rows.append(self._measure(march, pressure, below))
        steps = (step._replace(load=pressure) for step in march.timeline())  # all: the clock has a place for each
        run_steps(march, [lambda march: rows.append(self._measure(march, pressure, below))], steps)
        return track_of(rows)

    def _begin(self, pressure: float, law: LawAt | None) -> March:
        scene, band, initial = self.scene, self.band, self.band.setup.job.initial
        if initial.state == "virgin":
            return start_march(scene)
        band.slide(initial.velocity)
        contact = band.contact(pressure, law(Place(0, BEFORE)) if law is not None else Box())
        seen = contact.p, 1.0, contact.u, band.heights, contact.d, contact.p > 0.0
        measures = scene.probe.measure(*seen, (0.0, 0.0), initial.velocity)
        facts = {"certificate": contact.certificate, "operator_calls": contact.iterations}
        return start_march(scene, contact, measures=measures, **facts)

    def _measure(self, march: March, pressure: float, below: PressureLadder | None) -> Rung:
        row, last, units, grid = march.row, march.state.contact.last, self.scene.units, self.scene.choices.grid
        m, pressures = row.measures, last.pressure * (last.alpha * units.pressure)
        weights, lost = below.weights_of_rungs(pressures) if below is not None else (NOTHING, 0.0)
        friction = -m.force_x / (pressure * grid.lx * grid.ly)
        values: Any = (
            *(pressure, friction, friction, m.contact_area, m.contact_area_corrected, m.approach, m.max_pressure),
            *(weights, lost, NONE, {}, rung_errors(row.errors)),
            *(row.certificate.worst, row.certificate.penetration, float(row.operator_calls)),
        )
        return Rung(*values)


def track_of(rows: Sequence[Rung]) -> Rung:
    """Return the results at successive instants of a history as one `Rung`, whose arrays have the instants as first
    axis."""
    values: dict[str, Any] = {name: np.array([getattr(row, name) for row in rows]) for name in NAMES}
    return Rung(**values, found={})


def instant_of(track: Rung, before: int, after: int, share: float, sign: float = 1.0) -> Rung:
    """Return the results of `track` interpolated between two instants; friction is taken along `sign` times x."""

    def between(values: Any) -> Any:
        return (1.0 - share) * values[before] + share * values[after]

    found = Rung(**{name: between(getattr(track, name)) for name in NAMES}, found={})
    return replace(found, friction=sign * found.friction, friction_slopes=sign * found.friction_slopes)


NAMES = tuple(each.name for each in fields(Rung) if each.name != "found")


T = TypeVar("T")
INSTANTS = 50  # accuracy: instants of a stage with a row, equally spaced in the logarithm of slip or time
MEMORY = 0.5  # fitted: remembered share of a change of pressure (`scripts/band_history_errors.py`)
EARLIEST = 0.5  # accuracy: cells of the finest band below which the mesh decides


class RungTask(NamedTuple):
    """One march (a simulation over time) to make: of one `band`, in one `sample` of the surface, under the load with
    the number `rung`. Numbers begin with 0. In a `hard` march finer roughness is not squeezed under pressure."""

    band: int
    sample: int
    rung: int
    hard: bool


class Instant(NamedTuple):
    """An instant that becomes a row: stage and time since its start (`place`), time [s] since the start of the history,
    distance [m], velocity along x [m/s]."""

    place: Place
    time: float
    distance: float
    velocity: float


class ClosingOverTime:
    """Law that gives, at each instant, how much a pressure brings the mean planes closer together by squeezing a band
    and all finer bands. The law follows from the band's `approaches` [m], shape (mean pressures, instants of `clock`),
    and from the law of the `finer` bands."""

    def __init__(
        self, cascade: Cascade, number: int, clock: BandClock, approaches: Array, finer: "ClosingOverTime | None"
    ) -> None:
        self._cascade, self._number, self._clock = cascade, number, clock
        self._approaches, self._finer = approaches, finer
        self._known = dict[Place, tuple[InterfaceLaw, float]]()

    def find(self, place: Place) -> tuple[InterfaceLaw, float]:
        """Return the law c(p) at an instant of the history, and the approach [m] at which c is 0."""
        if place not in self._known:
            before, after, share = self._clock.between(place)
            found = (1.0 - share) * self._approaches[:, before] + share * self._approaches[:, after]
            touching = self._finer.find(place)[1] if self._finer else 0.0
            self._known[place] = self._cascade.closing_of(self._number, found + touching)
        return self._known[place]

    def law(self, place: Place) -> InterfaceLaw:
        return self.find(place)[0]


Closings = dict[int, ClosingOverTime | None]
After = Callable[[RungTask, int, int], None]


class RoadHistory(RoadSliding):
    """Calculation of the history of a job in bands. The ranks of `slab` share the marches. The constructor and the
    methods are collective."""

    def __init__(self, job: Job, slab: Slab) -> None:
        super().__init__(job, slab)
        self.pressure = job.history[0].load.end
        initial = [job.initial.velocity[0]] if job.initial.state == "steady" else []
        speeds = [*initial, *(stage.velocity[0] for stage in job.history)]
        fastest = max(map(abs, speeds), default=0.0)
        self._cascade.press((fastest, 0.0), self.pressure)
        self._hard = copy.copy(self._cascade)
        self._hard.ladders = [
            PressureLadder(np.array(halved(ladder.rungs.tolist()))) for ladder in self._cascade.ladders
        ]
        bands = [self._cascade.band(number, 0) for number in range(self.cut.count)]
        self._clocks = [BandClock(band.setup.job, band.parts) for band in bands]
        self.samples = range(self.cut.samples or FEWEST)
        self._tracks = dict[tuple[int, int], list[Rung]]()
        self._on_walls = list[list[Rung]]()
        self._closings: Closings = {}
        self._ends = dict[int, tuple[list[float], list[Array]]]()
        self._marches = dict[tuple[int, int], BandMarch]()
        self._cell = bands[-1].setup.grid.dx

    def notes(self) -> list[str]:
        """Return sentences on the chosen bands, and on branches so slow that they remember what was before a slide when
        the march of the slide ends."""
        longest, slowest = self.cut.wavelengths(0)[0], max(relaxation_of(self.job.material)[2], default=0.0)
        cut_short = [stage.speed for stage in self.job.history if stage.seconds * stage.speed > SETTLED * longest]
        left = SETTLED * longest / max(cut_short, default=math.inf)
        said = (
            f"slides are marched for {SETTLED:g} of the longest waves and are steady then: branches slower than "
            f"{left:.3g} s keep the imprint of what was before"
        )
        elastic = "an elastic body has no friction: what rows have is that of the mesh, and has no stated error"
        return [*super().notes(), *([said] if 0.0 < left < slowest else []), *([] if self.loses else [elastic])]

    def keep_in(self, directory: Path) -> str:
        """Store marches in a file of this directory until `forget` is called. Return, on root, a sentence on a removed
        file of another program, or ''. Raises RunError if the file cannot be read or written."""
        return self._cascade.store.keep_in(directory, self.job, outputs.MARCHES)

    def tasks(self) -> list[list[RungTask]]:
        """Return the marches of each band, from the finest band to the coarsest. The marches of a band in which finer
        roughness is not squeezed (`hard`) are the last."""
        found = list[list[RungTask]]()
        for number in reversed(range(self.cut.count)):
            count, half = (len(each.ladders[number].rungs) for each in (self._cascade, self._hard))
            own = [RungTask(number, sample, rung, False) for sample in self.samples for rung in range(count)]
            walls = range(half) if number + 1 < self.cut.count else ()
            found.append([*own, *(RungTask(number, 0, rung, True) for rung in walls)])
        return found

    def steps(self) -> list[int]:
        """Return the number of steps in a march of each band."""
        return [len(clock.places) for clock in self._clocks]

    def track(self, band: int, sample: int) -> list[Rung]:
        """Return the results over time (tracks) of a band, one for each mean pressure."""
        return self._tracks[band, sample]

    def plan(self) -> Iterator[str]:
        """Yield lines on the bands, and on the number of marches and their time. The time of a step is measured in the
        finest band at a mean pressure in the middle of its range."""
        yield from self.notes()
        tasks, steps, last = self.tasks(), self.steps(), self.cut.count - 1
        middle = len(self._hard.ladders[last].rungs) // 2
        began = time.process_time()
        self._march_alone(dict.fromkeys(self.samples), RungTask(last, 0, middle, True))
        each = self.slab.agree((time.process_time() - began) / steps[-1])
        for of_band in tasks:
            number, count = of_band[0].band, len(of_band)
            long, short = self.cut.wavelengths(number)
            yield f"band from {long:.3g} to {short:.3g} m: {count} march{'es' * (count > 1)} of {steps[number]} steps"
        size = self.slab.comm.size
        seconds = each * sum(-(-len(of_band) // size) * steps[of_band[0].band] for of_band in tasks)
        step, ranks = f"{each * 1e3:.3g} ms a step", f"{size} rank{'s' * (size > 1)}"
        yield f"parcontact: {sum(map(len, tasks))} marches, {step}; on {ranks}: {seconds:.3g} s"

    def march(self, after: After) -> None:
        """March all bands in rounds of one march per rank.

        After each round all ranks call `after(task, count, stored)` with the last task of the round, the number of its
        marches, and how many of them were in the store (`keep_in`) and not made again. `after` may raise an error to
        stop.
        """
        laws: Closings = dict.fromkeys(self.samples)
        walls = list[list[Rung]]()
        for tasks in self.tasks():
            number = tasks[0].band
            tracks = iter(self._march(tasks, laws, after))
            for sample in self.samples:
                rungs = self._cascade.ladders[number].rungs
                own = self._tracks[number, sample] = [next(tracks) for _ in rungs]
                approaches = np.array([track.approach for track in own])
                of_band = self._cascade, number, self._clocks[number]
                laws[sample] = ClosingOverTime(*of_band, approaches, laws[sample]) if number else None
            finest = number + 1 == self.cut.count
            walls.append(list(halved(self._tracks[number, 0]) if finest else tracks))
            if number == 1:
                self._closings = dict(laws)
        self._on_walls = walls[::-1]

    def _march(self, tasks: Sequence[RungTask], laws: Closings, after: After) -> list[Rung]:
        """Make marches in rounds, one on each rank."""
        found, size = list[Rung](), self.slab.comm.size
        solve = partial(self._march_alone, laws)
        for first in range(0, len(tasks), size):
            now, self._lacking = tasks[first : first + size], 0
            states = [("history", tuple(task)) for task in now]

            def share(lacking: Sequence[int], now: Sequence[RungTask] = now) -> list[Rung]:
                self._lacking = len(lacking)
                return self._cascade.share([now[number] for number in lacking], solve)

            found += self._cascade.store.find(states, share)
            after(now[-1], len(now), len(now) - self._lacking)
        self._marches.clear()
        return found

    def _march_alone(self, laws: Closings, task: RungTask) -> Rung:
        """Make one march, on this rank alone."""
        key = task.band, task.sample
        if key not in self._marches:
            self._marches[key] = BandMarch(self._cascade.band(*key))
        cascade = self._hard if task.hard else self._cascade
        below = cascade.ladders[task.band + 1] if task.band + 1 < self.cut.count else None
        finer, clock = None if task.hard else laws[task.sample], self._clocks[task.band]
        pressure = float(cascade.ladders[task.band].rungs[task.rung])
        try:
            return self._marches[key].march(pressure, finer.law if finer else None, clock.place, below)
        except RunError as error:
            long, short = self.cut.wavelengths(task.band)
            raise RunError(f"band from {long:.3g} to {short:.3g} m under {pressure:.3g} Pa: {error}") from error

    # -- rows ---------------------------------------------------------------------------------------------------------

    def instants(self) -> Iterator[Instant]:
        """Yield the instants of all rows."""
        start = slid = 0.0
        for number, stage in enumerate(self.job.history):
            velocity = stage.velocity[0]
            steady = number == 0 and self.job.initial.state == "steady"
            if steady:
                yield Instant(Place(0, BEFORE), 0.0, 0.0, self.job.initial.velocity[0])
            if stage.seconds == 0.0 or (number == 0 and not steady):
                yield Instant(Place(number, 0.0), start, slid, velocity)
            if stage.seconds:
                first = EARLIEST * self._cell / abs(velocity) if velocity else rest_step(self.job, stage)
                count = INSTANTS if first < stage.seconds else 1
                for elapsed in np.geomspace(stage.seconds, first, count)[::-1].tolist():
                    yield Instant(Place(number, elapsed), start + elapsed, slid + abs(velocity) * elapsed, velocity)
            start, slid = start + stage.seconds, slid + stage.seconds * abs(velocity)

    def records(self) -> Iterator[tuple[StepRow, list[list[float]]]]:
        """Yield the row of measures.csv and the rows of bands.csv for each instant. `march` must have been called."""
        way, virgin = 1.0, self.job.initial.state == "virgin"
        if virgin:
            yield StepRow(measures=Measures(approach=math.nan, mean_gap=math.nan), added=(0.0, 0.0)), []
        for step, instant in enumerate(self.instants(), int(virgin)):
            way = math.copysign(1.0, instant.velocity) if instant.velocity else way
            point = self._point_at(instant, way)
            whole = point.measures.friction  # along the motion; negative after a reversal
            measures, rubbed = replace(point.measures, friction=abs(whole)), point.measures.friction_interface
            rubbed = math.copysign(rubbed, whole)
            row = StepRow(
                *(step, instant.time, instant.distance, measures),
                certificate=point.certificate,
                operator_calls=round(point.operator_calls),
                seconds=point.seconds,
                errors=point.errors,
                added=(measures.friction - rubbed, rubbed),
            )
            yield row, self._rows(point, [instant.time, instant.distance])

    def _point_at(self, instant: Instant, way: float) -> Point:
        """Return the state at an instant, with friction along `way` times x."""
        began, place = time.perf_counter(), instant.place
        at, rungs = [clock.between(place) for clock in self._clocks], self._rungs_at(place, way)
        for sample, closing in self._closings.items():
            touching = closing.find(place)[1] if closing else 0.0
            rungs[0, sample] = [replace(rung, approach=rung.approach + touching) for rung in rungs[0, sample]]
        walls = [[instant_of(track, *at[k], way) for track in tracks] for k, tracks in enumerate(self._on_walls)]
        self._cascade.velocity = instant.velocity, 0.0
        hard = _sums(self._hard.fall(lambda band, _: walls[band]))
        outcome = self._outcome(rungs, self.samples, hard)
        outcome = replace(outcome, memory=self._error_by_memory(place.stage, outcome, way))
        self._results = outcome.results
        return self._to_point(outcome, (way, 0.0), self.pressure, time.perf_counter() - began)

    def _rungs_at(self, place: Place, way: float) -> dict[tuple[int, int], list[Rung]]:
        """Return the rungs by band and sample at a place, with friction along `way` times x."""
        at = [clock.between(place) for clock in self._clocks]
        return {key: [instant_of(track, *at[key[0]], way) for track in tracks] for key, tracks in self._tracks.items()}

    def _error_by_memory(self, stage: int, outcome: BandOutcome, way: float) -> float:
        """Return the error of friction because rungs keep their pressures through the history, to first order.

        The difference of the friction of a band from its value at the end of the stage is memory of the start, when the
        band had another mean pressure. All friction of a band that does not settle may be memory.
        """
        start, end = self._ends_of(stage)
        error = 0.0
        for number, before in enumerate(start):
            loads, now = self._loads(outcome.results, number)
            remembered = loads @ (np.array([rung.friction for rung in outcome.rungs[number]]) - way * end[number])
            error += MEMORY * (1.0 - min(before, now) / max(before, now)) * abs(float(remembered))
        return error / self.pressure

    def _ends_of(self, stage: int) -> tuple[list[float], list[Array]]:
        """Return the mean pressure [Pa] of each band at the start of a stage, and the friction of its rungs along +x at
        the end, or 0 for a band that does not settle."""
        if stage not in self._ends:
            made, bands = self.job.history[stage], range(self.cut.count)
            start, end = (
                [mean_rungs(self._rungs_at(Place(stage, t), 1.0), band, self.samples) for band in bands]
                for t in (0.0, made.seconds)
            )
            results = self._cascade.fall(lambda band, _: start[band])
            pressures = [self._loads(results, band)[1] for band in bands]
            distance, long = made.seconds * made.speed, [self.cut.wavelengths(band)[0] for band in bands]
            settled = [not made.speed or distance >= SETTLED * longest for longest in long]
            friction = [np.array([rung.friction for rung in of_band]) for of_band in end]
            self._ends[stage] = pressures, [one * last for one, last in zip(settled, friction, strict=True)]
        return self._ends[stage]

    def _loads(self, results: Results, number: int) -> tuple[Array, float]:
        """Return the loads of the rungs of a band [Pa], and their mean pressure [Pa]."""
        rungs = self._cascade.ladders[number].rungs
        loads = results[number].weights * rungs
        return loads, float(loads @ rungs / loads.sum())


def plan_bands(job: Job, slab: Slab) -> Iterator[str]:
    """Yield lines on the bands of a job and on the time of its points or marches; collective: all ranks must take every
    line."""
    yield from (RoadHistory if job.history else RoadSliding)(job, slab).plan()


def halved(rungs: Sequence[T]) -> Sequence[T]:
    """Return every second item including the last, or all items if there are few."""
    return rungs[::-2][::-1] if len(rungs) >= 2 * NODES else rungs
