"""What a part of a run remembers from one step to the next: entries with units, which checkpoints are made of.

Whatever has a memory, the body, the energies or an effect that follows the steps, declares it here and nowhere else: a
checkpoint has its `entries`, and `restore` goes on from them, on any number of ranks.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .units import Units

Saved = Mapping[str, NDArray[Any]]


class MapCount(NamedTuple):
    """How many maps a part of a run holds, and how many of them its entries have: what a plan adds up."""

    held: int
    saved: int = 0


@dataclass(frozen=True)
class Entry:
    """Something remembered: this rank's rows of a map (two dimensions), or numbers; `unit` is the SI value of 1.

    A checkpoint may lack what is `optional`: `restore` knows what it is then. What is `given` follows from the job: it
    is not restored, and a checkpoint in which it differs is one of another body.
    """

    value: NDArray[Any] | float
    unit: float = 1.0
    symbol: str = "1"
    optional: bool = False
    given: bool = False

    @property
    def is_map(self) -> bool:
        return np.ndim(self.value) == 2

    @property
    def nbytes(self) -> int:
        return np.asarray(self.value).nbytes


class Remembers(Protocol):
    """A part of a run that has a memory."""

    def entries(self, units: Units) -> dict[str, Entry]:
        """What is remembered after the last step, by name; maps are the part's own, not copies. Local to this rank."""
        ...

    def restore(self, saved: Saved) -> None:
        """Go on from what a checkpoint has of the entries, in the run's units, numbers as arrays; local to this rank.

        Maps have been read into those of `entries`: those in `saved` are the part's own.
        """
        ...
