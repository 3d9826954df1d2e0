"""The instants of a history: every step follows from the job alone, so that a restart needs only a step's number."""

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from typing import NamedTuple

from .history import GeometricStep, Ramp, Stage
from .limits import first_step
from .sections import Grid

SAME_TIME = 1e-9  # relative: a duration this close to a whole number of steps is one
MANY = 10**12  # steps of a stage, of which one is too little to be told from the end
WHOLE = 1e-6  # a displacement this close to whole cells, in cells, is one of whole cells


class Step(NamedTuple):
    """One solve: it ends at `time` [s], `dt` [s] after the last, with the surface at `position` [m].

    `dt` = 0 is a jump, at an instant, of the load. `control` names what `load` prescribes (Pa, N or m). `growth` is
    dt over the dt of the step before, 0 where that was a jump: how far to extrapolate what changes smoothly. `passed`
    is the number of steps that this one stands for besides its own.
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

    @property
    def jump(self) -> bool:
        return self.dt == 0.0


def reached(time: float, until: float) -> bool:
    """Whether a time is the one asked for, or later."""
    return time >= until * (1.0 - SAME_TIME)


@dataclass(frozen=True)
class Fractions:
    """Ends of `count` steps as fractions of their stage, each `growth` times as long as the one before.

    The last is 1; what goes on beyond it goes on with the last step.
    """

    count: int
    growth: float = 1.0

    def __getitem__(self, index: int) -> float:
        """The end of step `index`, from 1; 0 is the start of the stage."""
        if index > self.count:
            return 1.0 + (index - self.count) * self.last
        if self.growth == 1.0 or index == self.count:
            return index / self.count
        return math.expm1(index * math.log(self.growth)) / math.expm1(self.count * math.log(self.growth))

    @property
    def last(self) -> float:
        """How much the last step is of the stage; more than nothing, however many there are."""
        return max(1.0 - self[self.count - 1], 1.0 / self.count) if self.count > MANY else 1.0 - self[self.count - 1]

    def beyond(self, until: float) -> int:
        """How many more steps it takes to reach the fraction `until`."""
        step = self.last
        more = max(0, math.ceil((until * (1.0 - SAME_TIME) - 1.0) / step) - 1)
        while not reached(self[self.count + more], until):
            more += 1
        return more


def divided(stage: Stage, grid: Grid) -> Fractions:
    """The steps of a stage: none is longer than asked for, and an instantaneous stage has none."""
    if stage.seconds == 0.0:
        return Fractions(0)
    steps = stage.seconds / first_step(stage, grid)
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    if growth == 1.0:
        return Fractions(max(1, math.ceil(steps * (1.0 - SAME_TIME))))
    count = math.ceil(math.log1p(steps * (growth - 1.0)) / math.log(growth) * (1.0 - SAME_TIME))
    return Fractions(max(1, count), growth)


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
    ends: Fractions
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
        return not any(stage.velocity) and stage.load.constant and isinstance(stage.time_step, GeometricStep)

    def time(self, index: int) -> float:
        """When the step `index` of those that last ends [s]."""
        return self.start + self.ends[index] * self.stage.seconds if index else self.start

    def interval(self, index: int, since: int | None = None) -> float:
        """How long the step `index` takes, or all steps `since` another one have taken with it [s].

        From the stage alone, as late instants may have no digits for it; steps that are alike are so to the last bit.
        """
        if since is None and self.ends.growth == 1.0:
            return self.stage.seconds / self.ends.count
        return (self.ends[index] - self.ends[index - 1 if since is None else since]) * self.stage.seconds

    def position(self, index: int) -> tuple[float, float]:
        """Where the surface then is [m]."""
        slid = self.ends[index] * self.stage.seconds if index else 0.0
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
    """

    def __init__(
        self, history: tuple[Stage, ...], grid: Grid, until: float = 0.0, pressure: float | None = None
    ) -> None:
        self.spans: list[Span] = []
        number, time, position = 0, 0.0, (0.0, 0.0)
        before = None if pressure is None else ("pressure", pressure)
        for index, stage in enumerate(history):
            ends = divided(stage, grid)
            more = ends.beyond((until - time) / stage.seconds) if ends.count and index == len(history) - 1 else 0
            span = Span(index, stage, number, _jumps(stage, before), ends.count + more, ends, time, position)
            self.spans.append(span)
            number, time, position = span.last, span.time(ends.count), span.position(ends.count)
            before = (stage.control, stage.load.end)
        self._lasts = [span.last for span in self.spans]

    @property
    def count(self) -> int:
        """The number of steps, however many."""
        return self._lasts[-1] if self._lasts else 0

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
        return self.spans[bisect_left(self._lasts, number)]

    @property
    def end(self) -> float:
        """When the last step ends [s]."""
        return self[len(self)].time if self._lasts and len(self) else 0.0

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

    def first_between_cells(self, grid: Grid) -> Step | None:
        """The first step after which the surface is not moved by whole cells along x."""
        for span in filter(lambda span: span.moves, self.spans):
            (x, _), (slid, _) = span.origin, span.position(span.ends.count)
            start, each = x / grid.dx, (slid - x) / grid.dx / span.ends.count
            worst = abs(start - round(start)) + abs(each - round(each)) * span.count
            if span.ends.growth == 1.0 and not span.stage.velocity[1] and worst < WHOLE / 2:
                continue
            first = span.before + span.jumps + 1
            if span.ends.growth == 1.0 and not span.stage.velocity[1] and (off := abs(each - round(each))):
                first += max(0, int((WHOLE - abs(start - round(start))) / off) - 2)  # none before can be that far off
            for step in (span.step(number) for number in range(first, span.last + 1)):
                cells = step.position[0] / grid.dx
                if step.position[1] != 0.0 or abs(cells - round(cells)) >= WHOLE:
                    return step
        return None

    def shared(self, other: "Timeline") -> int:
        """How many of the first steps are those of another history too, stage by stage."""
        same = takewhile(lambda pair: pair[0] == pair[1], zip(self.spans, other.spans, strict=False))
        return max((span.last for span, _ in same), default=0)


def _jumps(stage: Stage, before: tuple[str, float] | None) -> bool:
    """Whether the stage begins with a jump: an instantaneous stage, another load than before, or another control."""
    if stage.seconds == 0.0:
        return True
    if before is None:
        return stage.control == "approach" or stage.load.start != 0.0
    return before != (stage.control, stage.load.start)
