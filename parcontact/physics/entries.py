"""Entries of checkpoints: what a part of a run remembers from one step to the next, and the units of a run.

Each part defines its first memory, the entries of a memory, and the memory that entries give, for any number of ranks
(`RunPart`); `march.state.parts_of` lists all parts.

In the units of a run all numbers are dimensionless. The units are powers of two: conversion is exact, and a checkpoint
in SI units restarts bit for bit.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray


def _power_of_two(value: float) -> float:
    return 2.0 ** round(math.log2(value)) if value > 0.0 else 1.0


@dataclass(frozen=True)
class Units:
    """Units of a run: of heights and displacements [m], of lengths in the plane [m], and of moduli [Pa]."""

    height: float
    length: float
    modulus: float

    @classmethod
    def near(cls, height: float, length: float, modulus: float) -> "Units":
        """Return the powers of two nearest to typical values; for a flat surface (height 0) the unit of heights is
        `length`."""
        return cls(_power_of_two(height or length), _power_of_two(length), _power_of_two(modulus))

    @property
    def pressure(self) -> float:
        """Unit of pressures [Pa], `modulus height/length`."""
        return self.modulus * self.height / self.length


Saved = Mapping[str, NDArray[Any]]
Memory = TypeVar("Memory")


@dataclass(frozen=True)
class Entry:
    """A remembered quantity: a map (two-dimensional, the rows of this rank), or numbers; times `unit` in SI units.

    A checkpoint may lack an `optional` entry, which `restored` then replaces. A `given` entry follows from the job: it
    is not restored, and a checkpoint with another value is refused.
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
        """Bytes of this rank's part of the entry."""
        return np.asarray(self.value).nbytes


class RunPart(Protocol[Memory]):
    """A part of a run that has a memory from one step to the next.

    The memory is a value: a step returns a new one. Two memories may share maps (`march.state`).
    """

    def at_rest(self) -> Memory:
        """Return the memory before the first step, in new maps."""

    def entries(self, memory: Memory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries of a memory by the part's own names; maps are not copied."""

    def restored(self, memory: Memory, saved: Saved) -> Memory:
        """Return the memory that a checkpoint holds, whose maps have been read into `memory`; numbers are arrays in the
        run's units."""


def with_part(part: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the entries of a part under their full names `part/name` in a checkpoint."""
    return {f"{part}/{name}": entry for name, entry in entries.items()}


def part_of(part: str, saved: Saved) -> Saved:
    """Return the entries of one part of a checkpoint, by the part's own names."""
    head = f"{part}/"
    return {name.removeprefix(head): value for name, value in saved.items() if name.startswith(head)}
