"""Groups of ranks that work at the same time on different tasks."""

from typing import TypeVar

from .mpi import MPI

T = TypeVar("T")


class Groups:
    """The ranks of `everyone` in `count` groups, at most as many as ranks: `number` is the group of this rank, `comm`
    its ranks. The sizes of groups differ by at most one; the constructor is collective."""

    def __init__(self, everyone: MPI.Intracomm, count: int = 1) -> None:
        self.everyone, self.count = everyone, max(1, min(count, everyone.size))
        self.number = everyone.rank * self.count // everyone.size
        split = everyone.Split(self.number, everyone.rank) if self.count > 1 else everyone
        self.comm: MPI.Intracomm = split  # type: ignore[assignment]  # of an Intracomm it is one

    @property
    def root(self) -> bool:
        """True on the rank that decides for all groups."""
        return self.everyone.rank == 0

    def agree(self, value: T) -> T:
        """Return the value of the root, on every rank of everyone; collective."""
        return self.everyone.bcast(value)

    def from_all(self, value: T) -> list[T]:
        """Return the value of the first rank of each group, on every rank of everyone; collective."""
        found = self.everyone.allgather((self.number, value))
        return list(dict(reversed(found)).values())[::-1]
