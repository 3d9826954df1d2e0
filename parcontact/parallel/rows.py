"""Exchange of whole rows of a map between ranks, point to point: each rank sends to those that want its rows.

A `RowExchange` is a plan, found once from the rows of all ranks; it can be kept and used for any map of the slab.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI
from .slab import Array, Slab

Index = slice | NDArray[np.intp]


class Part(NamedTuple):
    """Rows of a map that go to one rank, or come from it."""

    rank: int
    rows: Index


class RowExchange:
    """Plan of an exchange in which this rank gets `count` rows of a map; rows that no rank has are zeros.

    `leaving` are rows of this rank for each rank that wants some, `coming` the places of those that it gets; both are
    in the order of ranks, and include this rank. A map that every rank has is on a slab of one rank.
    """

    def __init__(self, slab: Slab, count: int, leaving: list[Part], coming: list[Part], whole: bool) -> None:
        self._slab, self._count, self._make = slab, count, np.empty if whole else np.zeros
        own = slab.comm.rank
        self._kept = [
            (came.rows, left.rows) for left in leaving if left.rank == own for came in coming if came.rank == own
        ]
        self._leaving = [part for part in leaving if part.rank != own]
        self._coming = [part for part in coming if part.rank != own]

    @staticmethod
    def of_numbers(slab: Slab, wanted: NDArray[np.integer], rank: int) -> "RowExchange":
        """Return the exchange of a few rows: `wanted` has the row numbers for each rank, shape (ranks, count); this one
        is `rank`."""
        own, rows = wanted[rank], slab.rows
        asked = wanted if slab.comm.size > 1 else wanted[[rank]]
        here, there = (asked >= rows.start) & (asked < rows.stop), (own >= 0) & (own < slab.ny)
        owner = np.where(there, np.searchsorted(slab.bounds[:, 1], own, side="right"), -1)
        leaving = [Part(r, _index(asked[r, here[r]] - rows.start)) for r in np.flatnonzero(here.any(axis=1)).tolist()]
        coming = [Part(r, _index(np.flatnonzero(owner == r))) for r in sorted({*owner[there].tolist()})]
        return RowExchange(slab, own.size, leaving, coming, bool(there.all()))

    @staticmethod
    def of_parts(slab: Slab, wanted: NDArray[np.integer]) -> "RowExchange":
        """Return the exchange of consecutive rows: `wanted` has the first row for each rank and the one after its
        last, shape (ranks, 2)."""
        start, stop = wanted[slab.comm.rank].tolist()
        leaving = _overlaps(wanted, slab.rows.start, slab.rows.stop)
        return RowExchange(slab, stop - start, leaving, _overlaps(slab.bounds, start, stop), True)

    @property
    def partners(self) -> int:
        """Number of messages that this rank sends and receives."""
        return len(self._leaving) + len(self._coming)

    def fetch(self, values: NDArray[Any], out: NDArray[Any] | None = None) -> NDArray[Any]:
        """Return the wanted rows of this rank, in `out` if it is given, contiguous; collective."""
        if out is None:
            out = self._make((self._count, values.shape[1]), values.dtype)
        for places, rows in self._kept:
            out[places] = values[rows]
        if self.partners:
            self._exchange(np.ascontiguousarray(values), out)
        return out

    def _exchange(self, values: NDArray[Any], out: NDArray[Any]) -> None:
        comm, tally = self._slab.comm, self._slab.tally
        coming = [out[rows] for _, rows in self._coming]  # copies of scattered rows, else places in `out`
        leaving = [values[rows] for _, rows in self._leaving]
        requests = [comm.Irecv([rows, MPI.BYTE], part.rank) for part, rows in zip(self._coming, coming, strict=True)]
        requests += [comm.Isend([rows, MPI.BYTE], part.rank) for part, rows in zip(self._leaving, leaving, strict=True)]
        MPI.Request.Waitall(requests)
        for part, rows in zip(self._coming, coming, strict=True):
            if not isinstance(part.rows, slice):
                out[part.rows] = rows
        tally["messages"] += len(leaving)
        tally["bytes sent"] += sum(rows.nbytes for rows in leaving)


def _index(numbers: NDArray[np.intp]) -> Index:
    """Return the index of rows; a slice, which needs no copy, if they are consecutive."""
    first, count = int(numbers[0]), numbers.size
    return slice(first, first + count) if (np.diff(numbers) == 1).all() else numbers


def _overlaps(parts: NDArray[np.integer], start: int, stop: int) -> list[Part]:
    """Return the rows in common with the part of each rank, counted from `start`."""
    low, high = np.maximum(parts[:, 0], start), np.minimum(parts[:, 1], stop)
    ranks = np.flatnonzero(low < high).tolist()
    return [Part(rank, slice(int(low[rank]) - start, int(high[rank]) - start)) for rank in ranks]


def fetch(slab: Slab, field: Array, wanted: NDArray[np.integer]) -> Array:
    """Return rows of a map for this rank; `wanted` as for `RowExchange.of_parts`; collective. On one rank it is a view
    of the map."""
    if slab.comm.size == 1:
        return field[slice(*wanted[0].tolist())]
    return RowExchange.of_parts(slab, wanted).fetch(field)


def roll_rows(slab: Slab, field: Array, count: int, out: Array) -> Array:
    """Put `field(j - count)`, cyclic along y, into `out` for this rank's rows; not in place; collective."""
    count %= slab.ny
    for low, high, shift in ((0, count, slab.ny - count), (count, slab.ny, -count)):
        wanted = np.clip(slab.bounds, low, high)
        start, stop = (wanted[slab.comm.rank] - slab.rows.start).tolist()
        RowExchange.of_parts(slab, wanted + shift).fetch(field, out[start:stop])
    return out


def before_first(slab: Slab, field: Array, cyclic: bool) -> Array:
    """Return the row of a map before this rank's first one, shape (nx,); collective. The row before the first of the
    map is the last if the map is `cyclic`, otherwise the first itself. Ranks without rows get zeros."""
    return _adjacent_rows(slab, field, (-1,), cyclic)[0]


def around(slab: Slab, field: Array, count: int, cyclic: bool) -> tuple[Array, Array]:
    """Return the rows of a map before this rank's first one and after its last, shape (count, nx), the nearest first;
    collective. A map that is not `cyclic` continues with its first and last row. Ranks without rows get zeros."""
    found = _adjacent_rows(slab, field, (*range(-1, -1 - count, -1), *range(count)), cyclic)
    return found[:count], found[count:]


def _adjacent_rows(slab: Slab, field: Array, offsets: tuple[int, ...], cyclic: bool) -> Array:
    """Return rows next to those of this rank, by an exchange that the slab keeps."""
    key = offsets, cyclic
    if key not in slab.exchanges:
        numbers = numbers_next_to(slab.bounds, offsets)
        wanted = numbers % slab.ny if cyclic else numbers.clip(0, slab.ny - 1)
        wanted[slab.bounds[:, 0] == slab.bounds[:, 1]] = -1
        slab.exchanges[key] = RowExchange.of_numbers(slab, wanted, slab.comm.rank)
    return slab.exchanges[key].fetch(field)


def numbers_next_to(bounds: NDArray[np.integer], offsets: tuple[int, ...]) -> NDArray[np.integer]:
    """Return row numbers for each rank, shape (ranks, offsets), counted from its first row if an offset is negative
    (-1 is the row before it), and from the one after its last row otherwise."""
    counted = np.array(offsets)
    return np.where(counted < 0, bounds[:, :1], bounds[:, 1:]) + counted
