"""Counts of operations, and groups of ranks.

* Counts of operations and allocations of a run; they do not depend on the load of the machine.
* Groups of ranks that work at the same time on different tasks.
"""

import weakref
from collections import Counter
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI

PURPOSE = "map bytes: "  # prefix of a ledger's counts by purpose


class Tally(Counter[str]):
    """Named counts of one rank, e.g. `tally["operator"]`; a name that was never counted reads 0.

    Names in use: `fft` (2-D transforms, forward or backward), `fft 2048x2048 float64` (the same by size and
    precision), `operator` (applications of a pressure -> displacement operator or its inverse), `allreduce`, `messages`
    (with rows, to single ranks), `bytes sent` (to other ranks in transforms and moves of rows), `map bytes` (held in
    maps and transform buffers), `map bytes at most` (their maximum), `shift` (sub-cell shifts of a surface).

    If it `only_counts`, arrays take no memory (`Ledger`). Only a ledger uses the `purpose` of arrays.
    """

    only_counts = False
    purpose = ""

    def hold(self, array: NDArray[Any]) -> None:
        """Count the bytes of an array as long as it exists."""
        self["map bytes"] += array.nbytes
        self["map bytes at most"] = max(self["map bytes at most"], self["map bytes"])
        owner = array
        while isinstance(owner.base, np.ndarray):  # views keep it alive
            owner = owner.base
        weakref.finalize(owner, self.subtract, {"map bytes": array.nbytes}).atexit = False

    @property
    def by_purpose(self) -> dict[str, int]:
        """Return the bytes of all arrays of a ledger by purpose."""
        return {name.removeprefix(PURPOSE): held for name, held in self.items() if name.startswith(PURPOSE) and held}

    def since(self, earlier: Counter[str]) -> dict[str, int]:
        """Return the counts since `earlier = tally.copy()`."""
        return {name: count - earlier[name] for name, count in self.items() if count != earlier[name]}


class Ledger(Tally):
    """Counts for a plan: the calculation is not made.

    Its arrays have shapes and types but neither memory nor values. Bytes are also counted by purpose.
    """

    only_counts = True

    def hold(self, array: NDArray[Any]) -> None:
        """Count the bytes of an array as long as it exists, in total and by purpose."""
        super().hold(array)
        name = f"{PURPOSE}{self.purpose}"
        self[name] += array.nbytes
        weakref.finalize(array.base, self.subtract, {name: array.nbytes}).atexit = False


T = TypeVar("T")


class Groups:
    """The ranks of `everyone` in `count` groups, at most one per rank: `number` is the group of this rank, `comm` the
    communicator of this group. The sizes of groups differ by at most one; the constructor is collective."""

    def __init__(self, everyone: MPI.Intracomm, count: int = 1) -> None:
        self.everyone, self.count = everyone, max(1, min(count, everyone.size))
        self.number = everyone.rank * self.count // everyone.size
        split = everyone.Split(self.number, everyone.rank) if self.count > 1 else everyone
        self.comm: MPI.Intracomm = split  # type: ignore[assignment]  # of an Intracomm it is one

    @property
    def root(self) -> bool:
        """True on the single rank that decides for all groups."""
        return self.everyone.rank == 0

    def agree(self, value: T) -> T:
        """Return the value of root on all ranks of all groups; collective."""
        return self.everyone.bcast(value)

    def from_all(self, value: T) -> list[T]:
        """Return the value of the first rank of each group, on all ranks of all groups; collective."""
        found = self.everyone.allgather((self.number, value))
        return list(dict(reversed(found)).values())[::-1]
