"""Steps of a stage that follow from the job alone: of constant length, or growing by a constant factor."""

import math
from dataclasses import dataclass

from ..job.checks.limits import estimate_steps, first_step
from ..job.sections.calculation import Grid
from ..job.sections.oscillation import PARTS_OF_CYCLE
from ..job.sections.stages import AUTO, GeometricStep, Stage
from .chosen import RAMP_STEPS, SAME_TIME, longest_change, reached


@dataclass(frozen=True)
class GivenEnds:
    """Ends of `count` steps as fractions of a stage of `seconds`, each `growth` times as long as the one before.

    The last is 1; further steps have the length of the last one.
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
        """Return the end of the step [s after the start of the stage]."""
        return self[index] * self.seconds if index else 0.0

    def interval(self, index: int, since: int | None = None) -> float:
        """Return the length of the step [s], or of all steps since another one; equal steps are exactly equal."""
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
    """Return the steps of a stage: none exceeds the requested length, and an instantaneous stage has none. Automatic
    steps of a body without memory are one cell in sliding, the whole stage at rest, and several on a ramp. Cycles of
    an oscillation consist of equal steps, which also end at both turns."""
    if stage.seconds == 0.0:
        return GivenEnds(0, 1.0, 0.0)
    if stage.cycles is not None and not isinstance(stage.time_step, GeometricStep):
        return GivenEnds(stage.cycles * _steps_of_cycle(stage, grid), 1.0, stage.seconds)
    if stage.time_step == AUTO and not stage.constant and not stage.speed:
        return GivenEnds(RAMP_STEPS, 1.0, stage.seconds)
    steps = estimate_steps(stage, stage.seconds, first_step(stage, grid))
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    return GivenEnds(max(1, math.ceil(steps * (1.0 - SAME_TIME))), growth, stage.seconds)


def _steps_of_cycle(stage: Stage, grid: Grid) -> int:
    """Return the number of equal steps in a cycle."""
    longest = first_step(stage, grid)
    if stage.time_step == AUTO:
        longest = min(longest, longest_change(stage))
    part = 1.0 / (PARTS_OF_CYCLE * stage.frequency)
    return PARTS_OF_CYCLE * max(1, math.ceil(part / longest * (1.0 - SAME_TIME)))
