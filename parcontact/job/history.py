"""The history of a job as steps, given or chosen.

Given steps have a constant length or grow by a constant factor: they follow from the job and their number, so that a
restart needs only the number of the last step. Stages may choose their own steps, within bounds: the next step is
decided after the one before has been made (`march.controller`). Chosen steps are stored, so that steps have numbers and
a run can restart. Future steps are estimated: they double from the shortest to the longest allowed length and then stay
constant.
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
    """Shortest and longest step of a stage that chooses its own [s]."""

    least: float
    most: float


def most_cells(job: Sections) -> int:
    """Return the largest number of cells that a step may slide: the largest power of two up to a quarter of the
    shortest wave; one if a quarter wave is shorter than a cell, or if a file may have any wave."""
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
    """Return the longest step [s] that still follows the change of the load, or the phase of an oscillation."""
    if stage.frequency:
        return 1.0 / (CYCLE_STEPS * stage.frequency)
    return stage.seconds if stage.constant else stage.seconds / RAMP_STEPS


def bounds(stage: Stage, grid: Grid, cells: int = 1) -> Bounds:
    """Return the limits on steps of a stage: while it slides, at most `cells` cells; at rest, at most the whole
    stage."""
    most = longest_change(stage)
    if not stage.speed:
        return Bounds(min(LEAST_SHARE * stage.seconds, most), most)
    cell = one_cell(stage, grid)
    most = min(cells * cell, most)
    halvings = max(HALVINGS, math.ceil(math.log2(cell / (LEAST_SHARE * stage.seconds))))
    return Bounds(min(cell / 2.0**halvings, most), most)


@dataclass(frozen=True)
class StepLadder:
    """Steps that double from `first` to `most` [s] and then stay constant, for `seconds`."""

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
        """Return the end of step `index`, counted from 1 [s]; 0 is the start."""
        if index <= 0:
            return 0.0
        doubled = min(index - 1, self.doublings)
        return min(self.first * 2.0**doubled * (1 + max(0, index - 1 - self.doublings)), self.seconds)


@dataclass(frozen=True)
class ChosenEnds:
    """Ends of the steps of a stage: the steps `made` [s after its start], followed by the estimate `ladder`.

    The stage ends at the first of `stops` [s]; a second one is the end of a run that continues the stage. Steps also
    end with each `part` of a cycle [s], if it is not 0.
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
        """Return the length of step `index` [s], or of all steps after step `since`."""
        return self.elapsed(index) - self.elapsed(index - 1 if since is None else since)

    def __getitem__(self, index: int) -> float:
        """Return the end of step `index` as a fraction of the stage."""
        return self.elapsed(index) / self.stops[0]


class MadeStep(NamedTuple):
    """An accepted step of a stage that chooses its steps: number of the stage, end of the step [s after the start of
    the stage], and length of the next step [s]."""

    stage: int
    end: float
    next: float


@dataclass
class ChosenSteps:
    """The steps that stages have chosen so far: `ends` [s after the start of the stage] by the number of the stage, and
    the length of the `next` step [s], 0 if undecided. No step slides by more than `cells`."""

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
        """Return the steps of a stage that may continue to `until` [s after its start]."""
        made, limits = self.ends.get(index, []), bounds(stage, grid, self.cells)
        stops = (stage.seconds, *([until] if not reached(stage.seconds, until) else []))
        now = made[-1] if made else 0.0
        left = 0.0 if reached(now, stops[-1]) else stops[-1] - now
        first = min(self.next if made and self.next else limits.least, limits.most)
        longest = min(limits.most, one_cell(stage, grid)) if stage.speed else limits.most
        part = 1.0 / (PARTS_OF_CYCLE * stage.frequency) if stage.frequency else 0.0
        return ChosenEnds(made, stops, StepLadder(first, max(first, longest), left), limits, part)

    def numbers(self) -> dict[str, tuple[list[float] | float, str]]:
        """Return all data of the chosen steps with units, by their names in checkpoints."""
        stages = sorted(self.ends)
        return {
            "stages": ([float(stage) for stage in stages], "1"),
            "counts": ([float(len(self.ends[stage])) for stage in stages], "1"),
            "ends": ([end for stage in stages for end in self.ends[stage]], "s"),
            "next": (self.next, "s"),
        }


def describe_steps(job: Sections) -> str:
    """Return a text on the stages that choose their own time steps, with the reason; '' if there are none."""
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
    """Ends of `count` steps as fractions of a stage of `seconds`, each `growth` times as long as the one before.

    The last fraction is 1; further steps have the length of the last one.
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
        """Return the length of step `index` [s], or of all steps after step `since`; equal steps are exactly equal."""
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
    """Return the steps of a stage: no step exceeds the requested length, and an instantaneous stage has none. Automatic
    steps of a body without memory are one cell in sliding, the whole stage at rest, and several on a ramp. Cycles of an
    oscillation consist of equal steps, which also end at both turns."""
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
    """One solve: it ends at `time` [s], `dt` [s] after the last, with the surface at `position` [m].

    `dt` = 0 is a jump of the load. `control` names what `load` prescribes (Pa, N or m). `growth` is dt over the dt of
    the step before, 0 after a jump: the factor for extrapolation. `passed` is the number of further steps that this one
    replaces. `decide`, for a step that may be too long, takes the error of the step and the motion of the edge of a
    contact that attracts, in half process zones; it returns a shorter step to make instead, or the record of this step.
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
    """The steps of one stage: a jump if `jumps`, and `count` steps with a duration, after `before` steps of the
    history.

    The stage starts at `start` [s], with the surface at `origin` [m].
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
        """True if the surface slides."""
        return self.count > 0 and any(self.stage.velocity)

    @cached_property
    def rests(self) -> bool:
        """True if the surface rests under a constant load, and the length of steps is free."""
        free = self.stage.chooses or isinstance(self.stage.time_step, GeometricStep)
        return free and not any(self.stage.velocity) and self.stage.constant

    @property
    def extremes(self) -> tuple[float, float]:
        """First and last step with a duration [s]; for chosen steps, the shortest and the longest."""
        if isinstance(self.ends, ChosenEnds):
            return self.ends.limits.least, self.ends.limits.most
        return self.ends.interval(1), self.ends.interval(self.count)

    def time(self, index: int) -> float:
        """Return the end [s] of step `index`, counted among the steps with a duration."""
        return self.start + self.ends.elapsed(index)

    def position(self, index: int) -> tuple[float, float]:
        """Return the position of the surface [m] at the end of step `index`, counted as in `time`."""
        slid = self.stage.moving(self.ends.elapsed(index))
        (x, y), (along_x, along_y) = self.origin, self.stage.velocity
        return x + along_x * slid, y + along_y * slid

    def place(self, number: int) -> int:
        """Return the index of step `number` of the history among the stage's steps with a duration; 0 is the jump."""
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

    If the history ends before `until`, its last stage continues with its last time step, velocity and load, to the
    first step that reaches `until`; a stage of a single solve cannot continue. `pressure` [Pa] belongs to the initial
    state, None at rest.

    `chosen` has the steps of stages that choose their own, and grows during a run; further steps are estimated. If
    `chosen` is None, these stages have the steps of a body without memory.
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
        """Return all steps of a job; its last stage continues to `until` [s] if that is later than its end. `chosen`
        has the steps that stages have chosen so far; further steps are estimated."""
        record = (chosen or ChosenSteps.from_job(job)) if job.remembers else None
        return cls(job.history, job.grid, until, job.initial.pressure, record)

    @property
    def spans(self) -> list[Span]:
        """The steps of each stage, including the steps chosen so far."""
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
        """Return this timeline with the steps that an earlier run chose: the ends of its steps [s] by step number."""
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
        """Return the stage with its steps that holds the step `number`."""
        return self.spans[bisect_left(self.spans, number, key=lambda span: span.last)]

    @property
    def end(self) -> float:
        """End of the last step [s]."""
        return self[len(self)].time if len(self) else 0.0

    @property
    def lasts(self) -> bool:
        """True if there are steps with a duration."""
        return any(span.count for span in self.spans)

    @property
    def moves(self) -> bool:
        """True if the surface moves."""
        return any(span.moves for span in self.spans)

    def first_reaching(self, time: float) -> int:
        """Return the number of the first step that reaches a time [s], or the number of the last step."""
        return min(1 + bisect_left(range(1, len(self) + 1), True, key=lambda n: reached(self[n].time, time)), len(self))

    def shared(self, other: "Timeline") -> int:
        """Return the number of first steps that agree with another history, stage by stage."""
        same = takewhile(lambda pair: pair[0] == pair[1], zip(self.spans, other.spans, strict=False))
        return max((span.last for span, _ in same), default=0)

    def first_between_cells(self) -> Step | None:
        """Return the first step after which the surface is not displaced by whole cells along x, or None."""
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
