"""Who owns which rows of a map, and sums over all of them.

A map has `ny` rows of `nx` points. Rows are dealt out evenly and in order; x is contiguous and local. Rank counts that
do not divide `ny`, and ranks without rows, are normal.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import pyfftw
from mpi4py import MPI
from numpy.typing import DTypeLike, NDArray

from .tally import Tally

T = TypeVar("T")
Array = NDArray[np.floating]


def deal(count: int, ranks: int) -> list[slice]:
    """Split `count` items evenly and in order; the first ranks take one more where it does not divide."""
    bounds = [count * rank // ranks for rank in range(ranks + 1)]
    return [slice(start, stop) for start, stop in zip(bounds[:-1], bounds[1:], strict=True)]


class Slab:
    """This rank's rows of `ny x nx` maps, and the collective operations on them.

    Every method whose docstring says "collective" must be called by all ranks of `comm`.
    """

    def __init__(self, comm: MPI.Intracomm, nx: int, ny: int, tally: Tally | None = None) -> None:
        self.comm, self.nx, self.ny = comm, nx, ny
        self.dealt = deal(ny, comm.size)
        self.rows = self.dealt[comm.rank]
        self.shape = (self.rows.stop - self.rows.start, nx)
        self.tally = Tally() if tally is None else tally
        self._operations: dict[int, MPI.Op] = {}

    def resized(self, nx: int, ny: int) -> "Slab":
        """The slab of a map of another size on the same ranks."""
        return Slab(self.comm, nx, ny, self.tally)

    @property
    def root(self) -> bool:
        return self.comm.rank == 0

    @property
    def points(self) -> int:
        return self.nx * self.ny

    def empty(self, dtype: DTypeLike = np.float64) -> Array:
        """An uninitialised map: this rank's rows, aligned for the transforms, counted."""
        return allocate(self.shape, dtype, self.tally)

    def zeros(self, dtype: DTypeLike = np.float64) -> Array:
        field = self.empty(dtype)
        field.fill(0.0)
        return field

    def sum(self, *values: float) -> list[float]:
        """Collective. Sums over all ranks of several numbers, in one Allreduce."""
        return self.reduce(values, ())

    def reduce(self, sums: Sequence[float], maxima: Sequence[float]) -> list[float]:
        """Collective. Sums and maxima over all ranks, sums first, in one Allreduce."""
        self.tally["allreduce"] += 1
        values = np.array([*sums, *maxima], dtype=np.float64)
        if self.comm.size > 1:
            operation = MPI.SUM if not maxima else self._sums_then_maxima(len(sums))
            self.comm.Allreduce(MPI.IN_PLACE, values, operation)
        return [float(value) for value in values]

    def agree(self, value: T) -> T:
        """Collective. Root's value, on every rank."""
        return self.comm.bcast(value) if self.comm.size > 1 else value

    def from_all(self, value: T) -> list[T]:
        """Collective. The value of every rank, in order, on every rank."""
        return self.comm.allgather(value)

    def _sums_then_maxima(self, count: int) -> MPI.Op:
        if count not in self._operations:

            def combine(source: MPI.buffer, target: MPI.buffer, _: MPI.Datatype) -> None:
                a, b = np.frombuffer(source), np.frombuffer(target)
                b[:count] += a[:count]
                np.maximum(b[count:], a[count:], out=b[count:])

            self._operations[count] = MPI.Op.Create(combine, commute=True)
        return self._operations[count]


def allocate(shape: tuple[int, ...], dtype: DTypeLike, tally: Tally) -> Array:
    """An uninitialised array aligned for SIMD transforms, its bytes counted."""
    array = pyfftw.empty_aligned(shape, dtype=dtype, n=64)
    tally["map bytes"] += array.nbytes
    return array
