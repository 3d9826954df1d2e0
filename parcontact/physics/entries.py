"""Entries: what a part of a run remembers from one step to the next, with units, as checkpoints have it.

Each part has its first memory, the entries of a memory, and the way back from them, for any number of ranks, in one
place (`RunPart`); `march.state.parts_of` lists all parts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from .units import Units

Saved = Mapping[str, NDArray[Any]]
Memory = TypeVar("Memory")


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


class RunPart(Protocol[Memory]):
    """A part of a run that remembers something from one step to the next.

    Its memory is a value: a step returns another one. Maps of two memories may be the same, as `march.state` says.
    """

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return what a checkpoint has of a memory, by the part's own names; maps are no copies."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory of a checkpoint, whose maps have been read into those of another memory; numbers are
        arrays in the run's units."""


def with_part(part: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the entries of a part by the names that they have in a checkpoint."""
    return {f"{part}/{name}": entry for name, entry in entries.items()}


def part_of(part: str, saved: Saved) -> Saved:
    """Return what a checkpoint has of a part, by the part's own names."""
    head = f"{part}/"
    return {name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)}
