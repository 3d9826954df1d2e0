"""The steps of a stage that follow from the job alone: all alike, or each a factor longer than the one before."""

import math
from dataclasses import dataclass

from ..job.checks.limits import first_step
from ..job.sections.settings import Grid
from ..job.sections.stages import AUTO, GeometricStep, Stage
from .chosen import RAMP_STEPS, SAME_TIME, reached

MANY = 10**12  # steps of a stage, of which one is too little to be told from the end


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
    """The steps of a stage: none is longer than asked for, and an instantaneous stage has none.

    Of a body without memory that may choose its own: one cell in sliding, the whole stage at rest, some on a ramp.
    """
    if stage.seconds == 0.0:
        return Fractions(0)
    if stage.time_step == AUTO and not stage.load.constant and not stage.speed:
        return Fractions(RAMP_STEPS)
    steps = stage.seconds / first_step(stage, grid)
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    if growth == 1.0:
        return Fractions(max(1, math.ceil(steps * (1.0 - SAME_TIME))))
    count = math.ceil(math.log1p(steps * (growth - 1.0)) / math.log(growth) * (1.0 - SAME_TIME))
    return Fractions(max(1, count), growth)
