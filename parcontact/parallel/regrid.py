"""Exchange of rows of a map between ranks, and coarser grids.

Whole rows are exchanged point to point: each rank sends to the ranks that need its rows. A `RowExchange` is the plan of
an exchange, made once from the rows of all ranks; it can be used for any map of the slab. By such exchanges maps are
transferred between a grid and a coarser grid whose cells consist of whole fine cells.

A pyramid is a sequence of grids down to a single cell; each cell joins two by two cells of the grid before. The first
grids may join cells in pairs instead, along x or along y. Where the number of cells is odd, the last cell of the next
grid is smaller. A cell belongs to the rank that has its last row in the grid before. When a grid has few cells, every
rank gets the whole grid as a slab of its own, so that no further messages are needed.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from .slab import MPI, Array, Slab

Index = slice | NDArray[np.intp]


class Part(NamedTuple):
    """Rows of a map that are sent to one rank, or received from it."""

    rank: int
    rows: Index


class RowExchange:
    """Plan of an exchange in which this rank gets `count` rows of a map; rows that no rank has are zeros.

    `leaving` has the rows of the map that this rank sends to each rank, `coming` the places, among the `count` rows, of
    the rows that it gets from each rank. Both are in the order of ranks, and include this rank.
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
        """Return the exchange of a few rows: `wanted` has row numbers for each rank, shape (ranks, count); `rank` is
        this rank."""
        own, rows = wanted[rank], slab.rows
        asked = wanted if slab.comm.size > 1 else wanted[[rank]]
        here, there = (asked >= rows.start) & (asked < rows.stop), (own >= 0) & (own < slab.ny)
        owner = np.where(there, np.searchsorted(slab.bounds[:, 1], own, side="right"), -1)
        leaving = [Part(r, _index(asked[r, here[r]] - rows.start)) for r in np.flatnonzero(here.any(axis=1)).tolist()]
        coming = [Part(r, _index(np.flatnonzero(owner == r))) for r in sorted({*owner[there].tolist()})]
        return RowExchange(slab, own.size, leaving, coming, bool(there.all()))

    @staticmethod
    def of_parts(slab: Slab, wanted: NDArray[np.integer]) -> "RowExchange":
        """Return the exchange of consecutive rows: `wanted`, shape (ranks, 2), has each rank's first row and the row
        after its last row."""
        start, stop = wanted[slab.comm.rank].tolist()
        leaving = _overlaps(wanted, slab.rows.start, slab.rows.stop)
        return RowExchange(slab, stop - start, leaving, _overlaps(slab.bounds, start, stop), True)

    @property
    def partners(self) -> int:
        """Number of messages that this rank sends and receives."""
        return len(self._leaving) + len(self._coming)

    def fetch(self, values: NDArray[Any], out: NDArray[Any] | None = None) -> NDArray[Any]:
        """Return the rows that this rank wants, contiguous, in `out` if it is given; collective."""
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
    """Return rows of a map for this rank; `wanted` is as in `RowExchange.of_parts`. Collective. In a run on one rank
    the result is a view of the map."""
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
    """Return the row of a map before this rank's first row, shape (nx,); collective. Before the first row of the map
    comes the last row if the map is `cyclic`, otherwise the first row itself. Ranks without rows get zeros."""
    return _adjacent_rows(slab, field, (-1,), cyclic)[0]


def around(slab: Slab, field: Array, count: int, cyclic: bool) -> tuple[Array, Array]:
    """Return `count` rows of a map before this rank's first row, and `count` rows after its last row; collective.

    Both have the shape (count, nx), and begin with the row nearest to this rank's rows. A map that is not `cyclic`
    continues with its first and its last row. Ranks without rows get zeros.
    """
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
    """Return row numbers for each rank, shape (ranks, offsets). The offset -1 is the row
    before the rank's first row, and -2 the row before that; 0 is the row after its last row, and 1 the next one."""
    counted = np.array(offsets)
    return np.where(counted < 0, bounds[:, :1], bounds[:, 1:]) + counted


COARSEST = 32  # tuning: least points of a coarser grid along a direction


def coarser(slab: Slab) -> Slab | None:
    """Return the grid with cells of twice the side, along each direction with an even and sufficient number of points;
    None if there is no such direction."""
    points = next(coarser_points(slab.nx, slab.ny), None)
    return slab.resized(*points) if points else None


def coarser_points(nx: int, ny: int) -> Iterator[tuple[int, int]]:
    """Yield the points along x and y of all coarser grids."""
    while True:
        before = nx, ny
        nx, ny = (n // 2 if n % 2 == 0 and n >= 2 * COARSEST else n for n in before)
        if (nx, ny) == before:
            return
        yield nx, ny


def factors(fine: Slab, coarse: Slab) -> tuple[int, int]:
    """Return the number of fine cells per coarse cell, along y and x."""
    return fine.ny // coarse.ny, fine.nx // coarse.nx


def restrict(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the means over the cells of the coarse grid."""
    if fine.only_counts:
        return coarse.empty(field.dtype)
    fy, fx = factors(fine, coarse)
    rows, out = _rows_of_cells(fine, coarse, field), coarse.empty(field.dtype)
    if fy == fx == 2:
        _average(rows, out)
    else:
        out[...] = rows.reshape(-1, fy, fine.nx).mean(axis=1).reshape(*coarse.shape, fx).mean(axis=2)
    return out


def highest(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the largest values within the cells of the coarse grid."""
    fy, fx = factors(fine, coarse)
    rows = _rows_of_cells(fine, coarse, field)
    return np.asarray(rows.reshape(-1, fy, fine.nx).max(axis=1).reshape(*coarse.shape, fx).max(axis=2))


def _rows_of_cells(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the rows of a map within the rows of cells of this rank."""
    fy, _ = factors(fine, coarse)
    return fetch(fine, field, fy * coarse.bounds)


@loop
def _average(rows: Array, out: Array) -> None:
    """Put means over two by two points into `out`."""
    quarter = out.dtype.type(0.25)
    for j in range(out.shape[0]):
        a, b = rows[2 * j], rows[2 * j + 1]
        for i in range(out.shape[1]):
            out[j, i] = ((a[2 * i] + a[2 * i + 1]) + (b[2 * i] + b[2 * i + 1])) * quarter


@loop
def _spread(cells: Array, above: int, fy: int, fx: int, out: Array) -> None:
    """Put the value of each cell at all its points; `above` rows of the first cell are missing."""
    for j in range(out.shape[0]):
        row, points = cells[(j + above) // fy], out[j]
        for i in range(row.size):
            for k in range(fx):
                points[fx * i + k] = row[i]


def prolong(coarse: Slab, fine: Slab, field: Array, out: Array) -> Array:
    """Put the value of each coarse cell into all its fine cells, so that points far from contact get no pressure."""
    fy, fx = factors(fine, coarse)
    _spread(fetch(coarse, field, (fine.bounds + np.array([0, fy - 1])) // fy), fine.rows.start % fy, fy, fx, out)
    return out


Shape = tuple[int, int]  # points of a cell along x and y: 1 or 2
FEW = 8  # tuning: every rank has all cells of a grid with fewer cells than points of a rank over FEW


def pyramid_steps(slab: Slab, pairs: int = 0) -> list["PyramidStep"]:
    """Return all steps from a grid to a single cell, the finest first.

    The first `pairs` steps join only two cells, along x, or along y if `pairs` is negative. The slab of a grid that
    every rank has as a whole has one rank.
    """
    grids, shapes = [slab], []
    for nx, ny, shape, alone in _larger(slab.nx, slab.ny, slab.comm.size, pairs):
        shapes.append(shape)
        comm, rows_of = (MPI.COMM_SELF, None) if alone else (slab.comm, ending_in(grids[-1], shape[1]))
        grids.append(Slab(comm, nx, ny, slab.tally, rows_of))
    return [PyramidStep(fine, coarse, shape) for (fine, coarse), shape in zip(pairwise(grids), shapes, strict=True)]


def _larger(nx: int, ny: int, ranks: int, pairs: int) -> Iterator[tuple[int, int, Shape, bool]]:
    """Yield for each larger grid its cells along x and y, the shape of a cell, and whether every rank has all cells."""
    enough, alone = nx * ny // (FEW * ranks), ranks == 1
    for pair in count():
        if nx * ny == 1:
            return
        wide, tall = (1 if pair < -pairs else 2), (1 if pair < pairs else 2)
        nx, ny = -(-nx // wide), -(-ny // tall)
        alone = alone or (tall == 2 and nx * ny <= enough)
        yield nx, ny, (wide, tall), alone


def ending_in(fine: Slab, tall: int) -> Callable[[int], slice]:
    """Return a function that returns, for the number of a rank, the slice of the rows of cells that end on this rank.

    Cells are `tall` rows of the fine grid high, 1 or 2.
    """
    if tall == 1:
        return fine.rows_of
    last = fine.comm.size - 1

    def rows_of(rank: int) -> slice:
        part = fine.rows_of(rank)
        return slice(part.start // 2, (part.stop + (rank == last)) // 2)

    return rows_of


@dataclass(frozen=True)
class PyramidStep:
    """The step of a pyramid from a grid of points to a grid of cells, each of which joins as many points along x and y
    as `shape` says. Methods are collective."""

    fine: Slab
    coarse: Slab
    shape: Shape
    _kept: dict[tuple[str, tuple[int, ...]], "RowExchange"] = field(default_factory=dict)

    @cached_property
    def above(self) -> int:
        """1 if a row of points of this rank's first cell is on the rank before, else 0."""
        return self.fine.rows.start % self.shape[1]

    @cached_property
    def own(self) -> slice:
        """Slice of this rank's rows of cells: cells whose last row of points is on this rank."""
        part = ending_in(self.fine, self.shape[1])(self.fine.comm.rank)
        return slice(part.start - self.coarse.rows.start, part.stop - self.coarse.rows.start)

    def complete(self, cells: NDArray[Any]) -> None:
        """Give all cells to all ranks if each rank is to have the whole grid of cells, but has made only its `own`."""
        comm = self.fine.comm
        if self.coarse.comm.size < comm.size:
            starts, stops = cells[:1].nbytes * self._ending.T
            comm.Allgatherv(MPI.IN_PLACE, [cells, (stops - starts, starts), MPI.BYTE])
            self.fine.tally["bytes sent"] += cells[self.own].nbytes * (comm.size - 1)

    def adjacent_points(self, points: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Return the rows of points at these `offsets` from this rank's rows (`numbers_next_to`), shape (offsets, nx).

        The map is cyclic. If it has an odd number of rows, a row of zeros comes between its last and its first row.
        Ranks without points get zeros. The result is empty for cells of one row.
        """
        if self.shape[1] == 1:
            return points[:0]
        cycle = self.fine.ny + self.fine.ny % 2
        return self._row_exchange("points", self.fine, self.fine.bounds, cycle, offsets).fetch(points)

    def adjacent_cells(self, cells: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Return the rows of cells at these `offsets` from the cells that end in points of this rank; collective."""
        if self.shape[1] == 1:
            return cells[:0]
        return self._row_exchange("cells", self.coarse, self._ending, self.coarse.ny, offsets).fetch(cells)

    @cached_property
    def _ending(self) -> NDArray[np.int64]:
        """The rows of cells that end in points of each rank, as in `Slab.bounds`."""
        parts = map(ending_in(self.fine, self.shape[1]), range(self.fine.comm.size))
        return np.array([(part.start, part.stop) for part in parts], np.int64)

    def _row_exchange(
        self, what: str, slab: Slab, bounds: NDArray[np.int64], cycle: int, offsets: tuple[int, ...]
    ) -> "RowExchange":
        """Return the exchange of rows next to the part of each rank with points; it is stored for further calls."""
        key = what, offsets
        if key not in self._kept:
            wanted = numbers_next_to(bounds, offsets) % cycle
            wanted[self.fine.bounds[:, 0] == self.fine.bounds[:, 1]] = -1
            self._kept[key] = RowExchange.of_numbers(slab, wanted, self.fine.comm.rank)
        return self._kept[key]
