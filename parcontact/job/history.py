"""The history of a job as steps, given or chosen.

Given steps have a constant length or grow by a constant factor. They follow from the job and their number, so that a
restart needs only the number of the last step. In stages with `time_step: auto` the run chooses the steps: the length
of the next step is decided after a step has been made, between a shortest and a longest length (`march.controller`).
The ends of chosen steps are stored, so that a run can restart. Future steps are estimated: their length doubles from
the shortest to the longest length and then stays constant.
"""

import math
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice, takewhile
from typing import Any, NamedTuple

from .advice import Sections, one_cell
from .calculation import Grid
from .limits import estimate_steps, first_step
from .parts import AUTO
from .stages import PARTS_OF_CYCLE, GeometricStep, Stage
from .surfaces import Flat, Indenter, Rough, Wave

SAME_TIME = 1e-9  # accuracy: relative deviation of a duration from a whole number of steps that is ignored
HALVINGS = 10  # tuning: halvings of a cell in the shortest step of a slide
LEAST_SHARE = 2.0**-20  # tuning: shortest step of a stage over its duration
MOST_CELLS = 4  # tuning: largest number of cells slid in a step
WAVE_STEPS = 4  # accuracy: least number of steps in which the shortest wave passes
RAMP_STEPS = 16  # accuracy: least number of steps while a load changes
CYCLE_STEPS = 32  # accuracy: least number of steps in a cycle of an oscillation


def reached(time: float, until: float) -> bool:
    """Return True if a time equals `until` or is later, up to rounding."""
    return time >= until * (1.0 - SAME_TIME)


@dataclass(frozen=True)
class Bounds:
    """The shortest and the longest length of a chosen step [s]."""

    least: float
    most: float


def most_cells(job: Sections) -> int:
    """Return the largest number of cells by which the surface may slide in a step. This is the largest power of two for
    which the surface slides by at most a quarter of the shortest wave. It is 1 if a quarter of this wave is shorter
    than a cell, or if the waves are not known, for example because the heights come from a file."""
    grid, waves = job.grid, [2.0 * MOST_CELLS * WAVE_STEPS]
    cells = [one_cell(stage, grid) * stage.speed for stage in job.history if stage.speed]
    for shape in job.surface:
        if isinstance(shape, Wave):
            waves += [n / abs(count) for n, count in zip(grid.points, shape.waves, strict=True) if count]
        elif isinstance(shape, Rough):
            waves.append(shape.short_wavelength / max(cells, default=max(grid.dx, grid.dy)))
        elif not isinstance(shape, Indenter | Flat):
            return 1
    return int(min(MOST_CELLS, 2 ** max(0, math.floor(math.log2(min(waves) / WAVE_STEPS * (1.0 + SAME_TIME))))))


def longest_change(stage: Stage) -> float:
    """Return the longest step [s] in which a ramp of the load, or the phase of an oscillation, changes little enough.
    Return the length of the stage if its load is constant."""
    if stage.frequency:
        return 1.0 / (CYCLE_STEPS * stage.frequency)
    return stage.seconds if stage.constant else stage.seconds / RAMP_STEPS


def bounds(stage: Stage, grid: Grid, cells: int = 1) -> Bounds:
    """Return the limits on the steps of a stage. The longest step is at most the whole stage. If the surface slides, it
    is also at most the time in which the surface slides by `cells` cells."""
    most = longest_change(stage)
    if not stage.speed:
        return Bounds(min(LEAST_SHARE * stage.seconds, most), most)
    cell = one_cell(stage, grid)
    most = min(cells * cell, most)
    halvings = max(HALVINGS, math.ceil(math.log2(cell / (LEAST_SHARE * stage.seconds))))
    return Bounds(min(cell / 2.0**halvings, most), most)


@dataclass(frozen=True)
class StepLadder:
    """Steps whose length doubles from `first` to `most` [s] and then stays constant. The last step ends after `seconds`
    [s]."""

    first: float
    most: float
    seconds: float

    @property
    def doublings(self) -> int:
        return max(0, math.ceil(math.log2(self.most / self.first) * (1.0 - SAME_TIME)))

    @property
    def count(self) -> int:
        if self.seconds <= 0.0:
            return 0
        top = self.first * 2.0**self.doublings
        if self.seconds <= top:
            return 1 + max(0, math.ceil(math.log2(self.seconds / self.first) * (1.0 - SAME_TIME)))
        return self.doublings + math.ceil(self.seconds / top * (1.0 - SAME_TIME))

    def end(self, index: int) -> float:
        """Return the end of step `index` [s after the first step began]. Steps are counted from 1."""
        if index <= 0:
            return 0.0
        doubled = min(index - 1, self.doublings)
        return min(self.first * 2.0**doubled * (1 + max(0, index - 1 - self.doublings)), self.seconds)


@dataclass(frozen=True)
class ChosenEnds:
    """Ends of the steps of a stage whose steps are chosen. The first steps have been made, with the ends `made` [s
    after the start of the stage]; the further steps are estimated by `ladder`.

    `stops` [s after the start of the stage] are the end of the stage and, if the run continues beyond it, the end of
    the run. If the load or the velocity oscillates, a step ends also after each `part` of a cycle [s]; `part` is 0
    without oscillation. `limits` are the shortest and the longest length of a step.
    """

    made: Sequence[float]
    stops: tuple[float, ...]
    ladder: StepLadder
    limits: Bounds
    part: float = 0.0

    def next_stop(self, now: float) -> float:
        """Return the first instant after `now` at which a step has to end [s]."""
        stop = next(stop for stop in self.stops if not reached(now, stop))
        if not self.part:
            return stop
        part = (math.floor(now / self.part * (1.0 + SAME_TIME)) + 1) * self.part
        return stop if reached(part, stop) else part

    @property
    def count(self) -> int:
        return len(self.made) + self.ladder.count

    def elapsed(self, index: int) -> float:
        """Return the end of step `index` [s after the start of the stage]."""
        if index <= len(self.made):
            return self.made[index - 1] if index > 0 else 0.0
        now = self.made[-1] if self.made else 0.0
        return self.stops[-1] if index >= self.count else now + self.ladder.end(index - len(self.made))

    def interval(self, index: int, since: int | None = None) -> float:
        """Return the length of step `index` [s], or the length of all steps after step `since` up to the end of step
        `index`."""
        return self.elapsed(index) - self.elapsed(index - 1 if since is None else since)

    def __getitem__(self, index: int) -> float:
        """Return the end of step `index` as a fraction of the stage."""
        return self.elapsed(index) / self.stops[0]


class MadeStep(NamedTuple):
    """An accepted step whose length was chosen: the number of the stage, the time at the end of the step [s since the
    stage began], and the length of the next step [s]."""

    stage: int
    end: float
    next: float


@dataclass
class ChosenSteps:
    """The steps chosen so far. `ends` maps the number of a stage to the ends of its steps [s after the start of the
    stage]. `next` is the length of the next step [s], 0 as long as it is not decided. In a step the surface slides by
    at most `cells` cells."""

    cells: int = 1
    ends: dict[int, list[float]] = field(default_factory=dict)
    next: float = 0.0

    @classmethod
    def from_job(cls, job: Sections, saved: Mapping[str, Any] | None = None) -> "ChosenSteps":
        """Return the chosen steps of a job, including the steps in the arrays `saved` of a checkpoint."""
        found = cls(most_cells(job))
        if saved is not None and "ends" in saved:
            ends = iter(saved["ends"].tolist())
            for stage, count in zip(saved["stages"], saved["counts"], strict=True):
                found.ends[int(stage)] = list(islice(ends, int(count)))
            found.next = float(saved["next"])
        return found

    def add(self, step: "MadeStep") -> None:
        """Add a step that has been made."""
        self.ends.setdefault(step.stage, []).append(step.end)
        self.next = step.next

    @property
    def count(self) -> int:
        return sum(map(len, self.ends.values()))

    def of_stage(self, index: int, stage: Stage, grid: Grid, until: float = 0.0) -> ChosenEnds:
        """Return the steps of the `stage` with the number `index`. A run may continue this stage beyond its end, until
        `until` [s after the start of the stage]."""
        made, limits = self.ends.get(index, []), bounds(stage, grid, self.cells)
        stops = (stage.seconds, *([until] if not reached(stage.seconds, until) else []))
        now = made[-1] if made else 0.0
        left = 0.0 if reached(now, stops[-1]) else stops[-1] - now
        first = min(self.next if made and self.next else limits.least, limits.most)
        longest = min(limits.most, one_cell(stage, grid)) if stage.speed else limits.most
        part = 1.0 / (PARTS_OF_CYCLE * stage.frequency) if stage.frequency else 0.0
        return ChosenEnds(made, stops, StepLadder(first, max(first, longest), left), limits, part)

    def numbers(self) -> dict[str, tuple[list[float] | float, str]]:
        """Return the data that a checkpoint stores about chosen steps: the numbers of each data set and their unit, by
        the name of the data set."""
        stages = sorted(self.ends)
        return {
            "stages": ([float(stage) for stage in stages], "1"),
            "counts": ([float(len(self.ends[stage])) for stage in stages], "1"),
            "ends": ([end for stage in stages for end in self.ends[stage]], "s"),
            "next": (self.next, "s"),
        }


def describe_steps(job: Sections) -> str:
    """Return a text that names the stages with chosen time steps, and what determines these steps, or '' if there are
    none."""
    names = ", ".join(stage.name for stage in job.history if stage.chooses)
    if not names:
        return ""
    if not job.remembers:
        return f"{names}, one cell of sliding per step and one step at rest, as an elastic body has no error of time"
    cells = most_cells(job)
    slides = any(stage.chooses and stage.speed for stage in job.history)
    turns = any(stage.chooses and stage.frequency for stage in job.history)
    limits = f", at most {cells} cell{'s' * (cells > 1)} of sliding" * slides
    limits += f", at least {CYCLE_STEPS} in a cycle" * turns
    return f"{names}, by their estimated error, for numerics.accuracy {job.numerics.asked.of_steps:g}{limits}"


@dataclass(frozen=True)
class GivenEnds:
    """Ends of the steps of a stage with `count` given steps, which lasts `seconds` [s]. Each step is `growth` times as
    long as the step before it.

    An index returns the end of a step as a fraction of the stage: the last step ends at 1. Steps beyond the end of the
    stage are as long as its last step.
    """

    count: int
    growth: float
    seconds: float

    def __getitem__(self, index: int) -> float:
        """Return the end of step `index`, counted from 1; 0 is the start of the stage."""
        if index > self.count:
            return 1.0 + (index - self.count) * self._last
        if self.growth == 1.0 or index == self.count:
            return index / self.count
        return math.expm1(index * math.log(self.growth)) / math.expm1(self.count * math.log(self.growth))

    @property
    def _last(self) -> float:
        """Length of the last step as a fraction of the stage."""
        return 1.0 - self[self.count - 1]

    def elapsed(self, index: int) -> float:
        """Return the end of step `index` [s after the start of the stage]."""
        return self[index] * self.seconds if index else 0.0

    def interval(self, index: int, since: int | None = None) -> float:
        """Return the length of step `index` [s], or the length of all steps after step `since` up to the end of step
        `index`. Equal steps have exactly equal lengths."""
        if since is None and self.growth == 1.0:
            return self.seconds / self.count
        return (self[index] - self[index - 1 if since is None else since]) * self.seconds

    def beyond(self, until: float) -> int:
        """Return the number of further steps to reach the time `until` [s after the start of the stage]."""
        fraction = until / self.seconds
        more = max(0, math.ceil((fraction * (1.0 - SAME_TIME) - 1.0) / self._last) - 1)
        while not reached(self[self.count + more], fraction):
            more += 1
        return more


def divide(stage: Stage, grid: Grid) -> GivenEnds:
    """Return the steps of a stage, none of which is longer than the job requests. A stage without duration has no
    steps.

    Stages with `time_step: auto` are divided here if the body has no memory: the surface slides by one cell in a step,
    a rest is one step, and a ramp has `RAMP_STEPS` steps. A cycle of an oscillation consists of equal steps, some of
    which end at the highest and at the lowest load.
    """
    if stage.seconds == 0.0:
        return GivenEnds(0, 1.0, 0.0)
    if stage.cycles is not None and not isinstance(stage.time_step, GeometricStep):
        return GivenEnds(stage.cycles * _steps_of_cycle(stage, grid), 1.0, stage.seconds)
    if stage.time_step == AUTO and not stage.constant and not stage.speed:
        return GivenEnds(RAMP_STEPS, 1.0, stage.seconds)
    steps = estimate_steps(stage, grid)
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    return GivenEnds(max(1, math.ceil(steps * (1.0 - SAME_TIME))), growth, stage.seconds)


def _steps_of_cycle(stage: Stage, grid: Grid) -> int:
    """Return the number of equal steps in a cycle."""
    longest = first_step(stage, grid)
    if stage.time_step == AUTO:
        longest = min(longest, longest_change(stage))
    part = 1.0 / (PARTS_OF_CYCLE * stage.frequency)
    return PARTS_OF_CYCLE * max(1, math.ceil(part / longest * (1.0 - SAME_TIME)))


ROUNDINGS = 4.0  # accuracy: rounding units between two equal instants
SAME_PLACE = 1e-6  # accuracy: deviation from a displacement of whole cells that is ignored [cells]


class Step(NamedTuple):
    """A time step. The contact is solved once, at the end of the step: at the `time` [s], with the surface at
    `position` [m]. The step begins `dt` [s] earlier; a step with dt = 0 is a jump of the load.

    `control` is the kind of the `load`: pressure [Pa], force [N] or approach [m]. `velocity` is the mean velocity in
    the step [m/s]. `growth` is dt divided by the dt of the step before, and 0 after a jump: results are extrapolated by
    this factor. `passed` is the number of further steps that this step replaces.

    A step that may be too long has a function `decide`. The arguments of this function are the error of the step and,
    if surfaces attract each other, the motion of the edge of the contact divided by half the width of the zone in which
    surfaces separate. The function returns a shorter step to be made instead, or the record of the accepted step.
    """

    number: int
    stage: int
    time: float
    dt: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    control: str
    load: float
    growth: float
    passed: int = 0
    decide: Callable[..., "Step | MadeStep"] | None = None

    @property
    def jump(self) -> bool:
        return self.dt == 0.0


@dataclass(frozen=True)
class Span:
    """The steps of one stage: a jump of the load if `jumps` is True, then `count` steps with a duration.

    `before` is the number of steps of the history before the stage. The stage starts at `start` [s], with the surface
    at `origin` [m].
    """

    index: int
    stage: Stage
    before: int
    jumps: bool
    count: int
    ends: GivenEnds | ChosenEnds
    start: float
    origin: tuple[float, float]

    @property
    def last(self) -> int:
        return self.before + self.jumps + self.count

    @property
    def moves(self) -> bool:
        """Return True if the surface slides."""
        return self.count > 0 and any(self.stage.velocity)

    @cached_property
    def rests(self) -> bool:
        """Return True if the surface rests under a constant load, in steps whose lengths may differ."""
        free = self.stage.chooses or isinstance(self.stage.time_step, GeometricStep)
        return free and not any(self.stage.velocity) and self.stage.constant

    @property
    def extremes(self) -> tuple[float, float]:
        """Return the lengths [s] of the first and of the last step with a duration. If steps are chosen, return the
        shortest and the longest length that is allowed."""
        if isinstance(self.ends, ChosenEnds):
            return self.ends.limits.least, self.ends.limits.most
        return self.ends.interval(1), self.ends.interval(self.count)

    def time(self, index: int) -> float:
        """Return the end [s] of step `index`, counted among the steps with a duration."""
        return self.start + self.ends.elapsed(index)

    def position(self, index: int) -> tuple[float, float]:
        """Return the position of the surface [m] at the end of step `index`, counted among the steps with a
        duration."""
        slid = self.stage.moving(self.ends.elapsed(index))
        (x, y), (along_x, along_y) = self.origin, self.stage.velocity
        return x + along_x * slid, y + along_y * slid

    def place(self, number: int) -> int:
        """Return the index of a step among those steps of the stage that have a duration, counted from 1. Return 0 for
        the jump of the load. `number` is the number of the step in the history."""
        return number - self.before - self.jumps

    def leap(self, number: int, target: int) -> Step:
        """Return one step that replaces the steps from `number` to `target`."""
        dt = self.ends.interval(self.place(target), since=self.place(number) - 1)
        return self.step(target)._replace(dt=dt, growth=0.0, passed=target - number)

    def step(self, number: int) -> Step:
        """Return the step with this number in the history."""
        index, stage = self.place(number), self.stage
        if index == 0:
            facts = self.origin, stage.velocity, stage.control
            return Step(number, self.index, self.start, 0.0, *facts, stage.load.start, 0.0)
        dt = self.ends.interval(index)
        growth = dt / self.ends.interval(index - 1) if index > 1 else 0.0
        end = self.ends.elapsed(index)
        facts = self.position(index), self.mean_velocity(end, dt), stage.control
        return Step(number, self.index, self.time(index), dt, *facts, stage.load.at(self.ends[index], end), growth)

    def mean_velocity(self, end: float, dt: float) -> tuple[float, float]:
        """Return the mean velocity [m/s] in a step of length dt that ends at `end` [s after the start of the stage]."""
        x, y = self.stage.velocity
        if self.stage.slides or not (x or y):
            return self.stage.velocity
        share = (self.stage.moving(end) - self.stage.moving(end - dt)) / dt
        return x * share, y * share


class Timeline:
    """All steps of a history, numbered from 1; step 0 is the initial state. Only stages are stored, not their steps.

    If the history ends before `until` [s], its last stage continues to the first step that reaches `until`. The time
    step, the velocity and the load then stay as at the end of this stage. A stage without duration cannot continue. If
    the history begins in steady sliding, `pressure` is the pressure of this state [Pa]; for a body at rest it is None.

    `chosen` are the steps that a run has chosen so far in stages with `time_step: auto`; further steps of these stages
    are estimated. The run adds its steps to `chosen`. If `chosen` is None, these stages have the steps of a body
    without memory.
    """

    def __init__(
        self,
        history: tuple[Stage, ...],
        grid: Grid,
        until: float = 0.0,
        pressure: float | None = None,
        chosen: ChosenSteps | None = None,
    ) -> None:
        self.history, self.grid, self.until, self.chosen = history, grid, until, chosen
        self.chooses = chosen is not None and any(stage.chooses for stage in history)
        self._before = None if pressure is None else ("pressure", pressure)
        self._spans: list[Span] = []
        self._open, self._seen = 0, 0  # the stage that chooses its steps, and the number of chosen steps

    @classmethod
    def from_job(cls, job: Sections, until: float = 0.0, chosen: ChosenSteps | None = None) -> "Timeline":
        """Return all steps of a job. If `until` [s] is later than the end of the history, the last stage continues
        until this time. `chosen` are the steps that a run has chosen so far; further steps are estimated."""
        record = (chosen or ChosenSteps.from_job(job)) if job.remembers else None
        return cls(job.history, job.grid, until, job.initial.pressure, record)

    @property
    def spans(self) -> list[Span]:
        """Return the steps of each stage, including the steps chosen so far."""
        chosen = self.chosen.count if self.chosen is not None else 0
        if chosen != self._seen:
            del self._spans[self._open :]
            self._open, self._seen = max(self.chosen.ends) if self.chosen and self.chosen.ends else 0, chosen
        while len(self._spans) < len(self.history):
            self._spans.append(self._next_span())
        return self._spans

    def _next_span(self) -> Span:
        index, last = len(self._spans), self._spans[-1] if self._spans else None
        stage, number, time, position, before = self.history[index], 0, 0.0, (0.0, 0.0), self._before
        if last is not None:
            number, time, position = last.last, last.time(last.ends.count), last.position(last.ends.count)
            before = (last.stage.control, last.stage.load.end)
        until = self.until - time if index == len(self.history) - 1 else 0.0
        ends: GivenEnds | ChosenEnds
        if self.chosen is not None and stage.chooses:
            ends = self.chosen.of_stage(index, stage, self.grid, until)
            count = ends.count
        else:
            ends = divide(stage, self.grid)
            count = ends.count + (ends.beyond(until) if ends.count else 0)
        return Span(index, stage, number, _jumps(stage, before), count, ends, time, position)

    def follow(self, times: Mapping[int, float]) -> "Timeline":
        """Return this timeline with the steps that an earlier run chose. `times` maps the numbers of these steps to
        their ends [s]."""
        for index in range(len(self.history)):
            span = self.spans[index]
            if self.chosen is None or not isinstance(span.ends, ChosenEnds):
                continue
            made, number = list(span.ends.made), span.before + span.jumps + len(span.ends.made) + 1
            while number in times and not (made and reached(made[-1], span.ends.stops[-1])):
                made.append(_elapsed(span.start, span.ends.stops, times[number]))
                number += 1
            if not made:
                break
            self.chosen.ends[index] = made
        return self

    def __len__(self) -> int:
        return self.spans[-1].last if self.history else 0

    @property
    def count(self) -> int:
        return len(self)

    def __getitem__(self, number: int) -> Step:
        """Return the step of this number, counted from 1."""
        if not 1 <= number <= len(self):
            raise IndexError(number)
        return self.span(number).step(number)

    def __iter__(self) -> Iterator[Step]:
        return (self[number] for number in range(1, len(self) + 1))

    def span(self, number: int) -> Span:
        """Return the steps of the stage to which the step with this number belongs."""
        return self.spans[bisect_left(self.spans, number, key=lambda span: span.last)]

    @property
    def end(self) -> float:
        """Return the end of the last step [s]."""
        return self[len(self)].time if len(self) else 0.0

    @property
    def lasts(self) -> bool:
        """Return True if there are steps with a duration."""
        return any(span.count for span in self.spans)

    @property
    def moves(self) -> bool:
        """Return True if the surface moves."""
        return any(span.moves for span in self.spans)

    def first_reaching(self, time: float) -> int:
        """Return the number of the first step whose end reaches a `time` [s]. If no step reaches this time, return the
        number of the last step."""
        return min(1 + bisect_left(range(1, len(self) + 1), True, key=lambda n: reached(self[n].time, time)), len(self))

    def shared(self, other: "Timeline") -> int:
        """Return the number of steps in the first stages, as far as their steps are equal in this timeline and the
        other."""
        same = takewhile(lambda pair: pair[0] == pair[1], zip(self.spans, other.spans, strict=False))
        return max((span.last for span, _ in same), default=0)

    def first_between_cells(self) -> Step | None:
        """Return the first step that ends with the surface between cells, or moved along y. Return None if all steps
        end with the surface moved by a whole number of cells along x only."""
        for span in filter(lambda span: span.moves, self.spans):
            first = span.before + span.jumps + 1
            if isinstance(span.ends, ChosenEnds):
                return span.step(first)
            if span.ends.growth == 1.0 and span.stage.slides and not span.stage.velocity[1]:
                cells, moved = span.origin[0] / self.grid.dx, span.position(span.ends.count)[0] - span.origin[0]
                each = moved / self.grid.dx / span.ends.count
                off, drift = abs(cells - round(cells)), abs(each - round(each))
                if off + drift * (1 + span.count) < SAME_PLACE / 2:
                    continue
                first += max(0, int((SAME_PLACE - off) / drift) - 2) if drift else 0  # earlier steps deviate less
            for step in map(span.step, range(first, span.last + 1)):
                cells = step.position[0] / self.grid.dx
                if step.position[1] != 0.0 or abs(cells - round(cells)) > SAME_PLACE:
                    return step
        return None


def _elapsed(start: float, stops: tuple[float, ...], time: float) -> float:
    """Return the time from the start of a stage to an instant [s]; exactly a stop of the stage if it equals one to
    rounding."""
    for stop in stops:
        if math.isclose(time, start + stop, rel_tol=ROUNDINGS * sys.float_info.epsilon):
            return stop
    return time - start


def _jumps(stage: Stage, before: tuple[str, float] | None) -> bool:
    """Return whether the stage starts with a jump: it is instantaneous, or its load or control differs from the one
    before."""
    if stage.seconds == 0.0:
        return True
    if before is None:
        return stage.control == "approach" or stage.load.start != 0.0
    return before != (stage.control, stage.load.start)
