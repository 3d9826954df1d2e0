"""Ranks in groups that work side by side, each on something of its own."""

from typing import TypeVar

from .mpi import MPI

T = TypeVar("T")


class Groups:
    """The ranks of `everyone` in as many groups as asked for, or as there are ranks: `number` is the group of this
    rank, `comm` its ranks. Groups have the same number of ranks, give or take one; making them is collective."""

    def __init__(self, everyone: MPI.Intracomm, count: int = 1) -> None:
        self.everyone, self.count = everyone, max(1, min(count, everyone.size))
        self.number = everyone.rank * self.count // everyone.size
        split = everyone.Split(self.number, everyone.rank) if self.count > 1 else everyone
        self.comm: MPI.Intracomm = split  # type: ignore[assignment]  # of an Intracomm it is one

    @property
    def root(self) -> bool:
        """True on the rank that speaks for all of them."""
        return self.everyone.rank == 0

    def agree(self, value: T) -> T:
        """The value of that rank, on every rank of everyone; collective."""
        return self.everyone.bcast(value)

    def from_all(self, value: T) -> list[T]:
        """The value that the first rank of each group has, on every rank of everyone; collective."""
        found = self.everyone.allgather((self.number, value))
        return list(dict(reversed(found)).values())[::-1]
