"""The instants of a history. Every step follows from the job and its number, so that a restart needs only
this number."""

import math
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple

from ..job.sections.calculation import Grid
from ..job.sections.stages import GeometricStep, Stage
from .chosen import ChosenEnds, ChosenSteps, MadeStep, Planned, reached
from .given import GivenEnds, divide

ROUNDINGS = 4.0  # accuracy: rounding units between two equal instants
SAME_PLACE = 1e-6  # accuracy: deviation from a displacement of whole cells that is ignored [cells]


class Step(NamedTuple):
    """One solve: it ends at `time` [s], `dt` [s] after the last, with the surface at `position` [m].

    `dt` = 0 is a jump of the load. `control` names what `load` prescribes (Pa, N or m). `growth` is dt over the dt of
    the step before, 0 after a jump: the factor for extrapolation. `passed` is the number of further steps that this one
    replaces. `decide`, for a step that may be too long, gets the error of the step and the motion of the edge of an
    contact that attracts, in half process zones; it returns the shorter step to make instead, or the record of
    this one.
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
    """The steps of one stage: after the first `before` of the history one jump or none, and `count` steps with a
    duration.

    They start at `start` [s], with the surface at `origin` [m].
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
        """Return the end [s] of step `index` of those with a duration."""
        return self.start + self.ends.elapsed(index)

    def position(self, index: int) -> tuple[float, float]:
        """Return the position of the surface at this end [m]."""
        slid = self.stage.moving(self.ends.elapsed(index))
        (x, y), (along_x, along_y) = self.origin, self.stage.velocity
        return x + along_x * slid, y + along_y * slid

    def place(self, number: int) -> int:
        """Return the index of the step `number` among those with a duration; 0 is the jump."""
        return number - self.before - self.jumps

    def leap(self, number: int, target: int) -> Step:
        """Return the steps from one number to another as one."""
        dt = self.ends.interval(self.place(target), since=self.place(number) - 1)
        return self.step(target)._replace(dt=dt, growth=0.0, passed=target - number)

    def step(self, number: int) -> Step:
        """Return the step of this number of the history."""
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
    first step that reaches it; a stage of a single solve cannot continue. `pressure` [Pa] belongs to the initial
    state, None at rest.

    `chosen` has the steps of stages that choose their own, and grows during a run; further steps are estimated. If
    it is None, these stages have the steps of a body without memory.
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
    def from_job(cls, job: Planned, until: float = 0.0, chosen: ChosenSteps | None = None) -> "Timeline":
        """Return all steps of a job; its last stage continues to `until` [s] if that is later than its end. `chosen`
        are the steps that stages have chosen so far; further ones are estimated."""
        record = (chosen or ChosenSteps.from_job(job)) if job.remembers else None
        return cls(job.history, job.grid, until, job.initial.pressure, record)

    @property
    def spans(self) -> list[Span]:
        """The steps of each stage, with those chosen so far."""
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
        """Use the times [s] of steps that were made, by their numbers, as chosen steps."""
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
        return self.after(0)

    def after(self, number: int) -> Iterator[Step]:
        return (self[later] for later in range(number + 1, len(self) + 1))

    def span(self, number: int) -> Span:
        """Return the span that holds a step."""
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
        """Return how many of the first steps agree with those of another history, stage by stage."""
        same = takewhile(lambda pair: pair[0] == pair[1], zip(self.spans, other.spans, strict=False))
        return max((span.last for span, _ in same), default=0)

    def first_between_cells(self) -> Step | None:
        """Return the first step after which the displacement of the surface is not of whole cells along x."""
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
