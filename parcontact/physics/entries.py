"""Entries: what a part of a run remembers from one step to the next, with units, as checkpoints have it.

Each part names its entries and how it goes on from them where its memory is defined, for any number of ranks;
`march.state` has the one list of all parts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Saved = Mapping[str, NDArray[Any]]


class MapCount(NamedTuple):
    """Numbers of maps that a part of a run holds, and that its entries have: what a plan adds up."""

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
        """The bytes of this rank's part."""
        return np.asarray(self.value).nbytes


def prefixed(part: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the entries of a part by the names that they have in a checkpoint."""
    return {f"{part}/{name}": entry for name, entry in entries.items()}


def part_of(part: str, saved: Saved) -> Saved:
    """Return what a checkpoint has of a part, by the part's own names."""
    head = f"{part}/"
    return {name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)}
