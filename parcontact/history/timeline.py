"""The instants of a history: every step follows from the job alone, so that a restart needs only a step's number."""

import math
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple

from ..job import Job
from ..job.sections.settings import Grid
from ..job.sections.stages import GeometricStep, Ramp, Stage
from .chosen import ChosenEnds, ChosenSteps, reached
from .division import Fractions, divided

ROUNDINGS = 4.0  # of an instant, between two that are the same


class Step(NamedTuple):
    """One solve: it ends at `time` [s], `dt` [s] after the last, with the surface at `position` [m].

    `dt` = 0 is a jump, at an instant, of the load. `control` names what `load` prescribes (Pa, N or m). `growth` is
    dt over the dt of the step before, 0 where that was a jump: how far to extrapolate what changes smoothly. `passed`
    is the number of steps that this one stands for besides its own. `judge`, of a step that may be too long, is told
    the error of the step when it has been tried: it returns the shorter one to make instead, or None.
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
    judge: Callable[["Step", float], "Step | None"] | None = None

    @property
    def jump(self) -> bool:
        return self.dt == 0.0


@dataclass(frozen=True)
class Span:
    """The steps of one stage: after the first `before` of the history a jump or none, then `count` that last.

    They start at `start` [s], with the surface at `origin` [m].
    """

    index: int
    stage: Stage
    before: int
    jumps: bool
    count: int
    ends: Fractions | ChosenEnds
    start: float
    origin: tuple[float, float]

    @property
    def last(self) -> int:
        """The number of its last step."""
        return self.before + self.jumps + self.count

    @property
    def moves(self) -> bool:
        return self.count > 0 and any(self.stage.velocity)

    @cached_property
    def rests(self) -> bool:
        """Whether it stands under a constant load, and its steps may be as long as what happens allows."""
        stage = self.stage
        return (
            not any(stage.velocity)
            and stage.load.constant
            and (stage.chooses or isinstance(stage.time_step, GeometricStep))
        )

    def elapsed(self, index: int) -> float:
        """How long after the start of the stage the step `index` of those that last ends [s]."""
        if isinstance(self.ends, ChosenEnds):
            return self.ends.elapsed(index)
        return self.ends[index] * self.stage.seconds if index else 0.0

    def time(self, index: int) -> float:
        """When the step `index` of those that last ends [s]."""
        return self.start + self.elapsed(index)

    def interval(self, index: int, since: int | None = None) -> float:
        """How long the step `index` takes, or all steps `since` another one have taken with it [s].

        From the stage alone, as late instants may have no digits for it; steps that are alike are so to the last bit.
        """
        if isinstance(self.ends, ChosenEnds):
            return self.elapsed(index) - self.elapsed(index - 1 if since is None else since)
        if since is None and self.ends.growth == 1.0:
            return self.stage.seconds / self.ends.count
        return (self.ends[index] - self.ends[index - 1 if since is None else since]) * self.stage.seconds

    def position(self, index: int) -> tuple[float, float]:
        """Where the surface then is [m]."""
        slid = self.elapsed(index)
        (x, y), (along_x, along_y) = self.origin, self.stage.velocity
        return x + along_x * slid, y + along_y * slid

    @cached_property
    def load(self) -> Ramp:
        return self.stage.load

    @cached_property
    def facts(self) -> tuple[tuple[float, float], str]:
        """Of all steps: velocity and control."""
        return self.stage.velocity, self.stage.control

    def place(self, number: int) -> int:
        """Which of those that last the step of this number is; 0 is the jump."""
        return number - self.before - self.jumps

    def leap(self, number: int, target: int) -> Step:
        """The steps from one number to another in one."""
        dt = self.interval(self.place(target), since=self.place(number) - 1)
        return self.step(target)._replace(dt=dt, growth=0.0, passed=target - number)

    def step(self, number: int) -> Step:
        """The step of this number of the history."""
        index = self.place(number)
        if index == 0:
            return Step(number, self.index, self.start, 0.0, self.origin, *self.facts, self.load.start, 0.0)
        dt = self.interval(index)
        growth = dt / self.interval(index - 1) if index > 1 else 0.0
        load = self.load.at(min(self.ends[index], 1.0))
        return Step(number, self.index, self.time(index), dt, self.position(index), *self.facts, load, growth)


class Timeline:
    """All steps of a history, numbered from 1; step 0 is the initial state. Only stages are kept, not their steps.

    Where the history ends before `until`, its last stage goes on with its last time step, velocity and load, to the
    first step that reaches it; a last stage that is one solve cannot go on. `pressure` [Pa] is that of the initial
    state, None for a virgin body.

    `chosen` has the steps of stages that choose their own: as it grows, so does what is known here, and the others
    are guessed. None: these stages have the steps of a body without memory.
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
        self._spans: list[Span] = []  # of the first stages
        self._lasts: list[int] = []  # the numbers of their last steps
        self._open, self._seen = 0, self._chosen_so_far()
        total = self.spans[-1].last if history else 0
        self._from = [*(total - span.before for span in self._spans), 0]  # steps from a stage on that has not begun

    @classmethod
    def of(cls, job: Job, until: float = 0.0, chosen: ChosenSteps | None = None) -> "Timeline":
        """All steps of a job; its last stage goes on to `until` [s] if that is later than its end.

        `chosen` are the steps that stages have chosen so far; those to come are guessed.
        """
        record = (chosen or ChosenSteps.of(job)) if job.remembers else None
        return cls(job.history, job.grid, until, job.initial.pressure, record)

    @property
    def spans(self) -> list[Span]:
        """Those of all stages."""
        return self._first_spans(len(self.history))

    def _first_spans(self, count: int) -> list[Span]:
        """Those of so many stages, or more."""
        if (now := self._chosen_so_far()) != self._seen:
            self._seen = now
            del self._spans[self._open :], self._lasts[self._open :]
        while len(self._spans) < min(max(count, self._seen[0]), len(self.history)):
            self._add_span()
        return self._spans

    def _chosen_so_far(self) -> tuple[int, int]:
        """Up to which stage steps were chosen, and how many of its own."""
        if self.chosen is None or not self.chosen.ends:
            return 0, 0
        last = next(reversed(self.chosen.ends))
        return last + 1, len(self.chosen.ends[last])

    def _add_span(self) -> None:
        index, last = len(self._spans), self._spans[-1] if self._spans else None
        stage, number, time, position, before = self.history[index], 0, 0.0, (0.0, 0.0), self._before
        if last is not None:
            number, time, position = last.last, last.time(last.ends.count), last.position(last.ends.count)
            before = (last.stage.control, last.stage.load.end)
        ends = self._ends(index, stage, self.until - time)
        more = ends.beyond((self.until - time) / stage.seconds) if ends.count and self._is_last(index) else 0
        span = Span(index, stage, number, _jumps(stage, before), ends.count + more, ends, time, position)
        if self._open == index and not (isinstance(ends, ChosenEnds) and ends.ladder.count):
            self._open = index + 1
        self._spans.append(span)
        self._lasts.append(span.last)

    def _is_last(self, index: int) -> bool:
        return index == len(self.history) - 1

    def _ends(self, index: int, stage: Stage, until: float) -> Fractions | ChosenEnds:
        if self.chosen is None or not stage.chooses:
            return divided(stage, self.grid)
        return self.chosen.of_stage(index, stage, self.grid, until if self._is_last(index) else 0.0)

    def follow(self, times: Mapping[int, float]) -> "Timeline":
        """Take the times [s] of steps that were made, by their numbers, as those that the stages have chosen."""
        for index in range(len(self.history) if self.chooses else 0):
            assert self.chosen is not None
            span = self._first_spans(index + 1)[index]
            while isinstance(span.ends, ChosenEnds) and span.ends.ladder.count:
                number = span.before + span.jumps + len(span.ends.made) + 1
                if number not in times:
                    return self
                self.chosen.ends.setdefault(index, []).append(_elapsed(span, times[number]))
                span = self._first_spans(index + 1)[index]
        return self

    @property
    def count(self) -> int:
        """The number of steps, however many."""
        known = self._first_spans(1 if self.history else 0)
        return (known[-1].last if known else 0) + self._from[len(known)]

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, number: int) -> Step:
        """The step of this number, from 1."""
        if not 1 <= number <= len(self):
            raise IndexError(number)
        return self.span(number).step(number)

    def __iter__(self) -> Iterator[Step]:
        return self.after(0)

    def after(self, number: int) -> Iterator[Step]:
        """The steps that follow."""
        return (self[later] for later in range(number + 1, len(self) + 1))

    def span(self, number: int) -> Span:
        """That of a step."""
        while self._first_spans(1)[-1].last < number and len(self._spans) < len(self.history):
            self._add_span()
        return self._spans[bisect_left(self._lasts, number)]

    @property
    def end(self) -> float:
        """When the last step ends [s]."""
        return self[len(self)].time if len(self) else 0.0

    @property
    def lasts(self) -> bool:
        """Whether there is more than jumps."""
        return any(span.count for span in self.spans)

    @property
    def moves(self) -> bool:
        """Whether the surface leaves its place."""
        return any(span.moves for span in self.spans)

    def first_reaching(self, time: float) -> int:
        """The number of the first step that reaches a time [s], or that of the last step."""
        return min(1 + bisect_left(range(1, len(self) + 1), True, key=lambda n: reached(self[n].time, time)), len(self))

    def shared(self, other: "Timeline") -> int:
        """How many of the first steps are those of another history too, stage by stage."""
        same = takewhile(lambda pair: pair[0] == pair[1], zip(self.spans, other.spans, strict=False))
        return max((span.last for span, _ in same), default=0)


def _elapsed(span: Span, time: float) -> float:
    """How long after the start of a stage an instant is [s]: its end, if times have no digits to tell them apart."""
    assert isinstance(span.ends, ChosenEnds)
    for stop in span.ends.stops:
        if math.isclose(time, span.start + stop, rel_tol=ROUNDINGS * sys.float_info.epsilon):
            return stop
    return time - span.start


def _jumps(stage: Stage, before: tuple[str, float] | None) -> bool:
    """Whether the stage begins with a jump: an instantaneous stage, another load than before, or another control."""
    if stage.seconds == 0.0:
        return True
    if before is None:
        return stage.control == "approach" or stage.load.start != 0.0
    return before != (stage.control, stage.load.start)
