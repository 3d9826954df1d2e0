"""Effects that follow the steps of a march: what they are told of each step, and what they have to have.

Such an effect is one file here, with what decides on it, and one line of `FURTHER` in `scene.py`. It may hold maps,
which its entries save and restore on any number of ranks.
"""

from dataclasses import dataclass
from typing import Protocol

from ..job.timeline import Step
from ..parallel.slab import Array
from ..physics.entries import Remembers
from ..physics.ledger import Measures


@dataclass(frozen=True)
class Instant:
    """A step just made, in the run's units unless others are given; maps are valid until the next step begins.

    The pressure on this rank's rows is `modulus pressure` (0 outside contact), `displacement` that of the body. `slid`
    [m] is by how much the surface moved in the step.
    """

    step: Step
    pressure: Array
    modulus: float
    displacement: Array
    slid: float
    measures: Measures


class Follower(Remembers, Protocol):
    """An effect that is told of every step made."""

    def follow(self, instant: Instant) -> None:
        """After a step; collective."""
        ...
