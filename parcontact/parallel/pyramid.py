"""Grids of larger and larger cells, each of two by two cells of the one before, down to a single cell.

The first `pairs` of them join two cells along x, or along y if `pairs` is negative. Cells at the end of the grid may
be cut. A cell belongs to the rank that has its last row in the grid before, until there are so few cells that every
rank has all of them, which needs no further messages.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI
from .rows import RowExchange, numbers_next_to
from .slab import Slab

Shape = tuple[int, int]  # points of a cell along x and y: 1 or 2
FEW = 8  # tuning: every rank has all cells of a grid with fewer cells than points of a rank over FEW


def pyramid_steps(slab: Slab, pairs: int = 0) -> list["PyramidStep"]:
    """Return all steps from a grid to a single cell, the finest first; the first `pairs` join pairs. A grid that every
    rank has is on a slab of one rank."""
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
    """Return a function of the rank that gives the rows of cells, `tall` rows each, that end in its rows of a finer
    grid."""
    if tall == 1:
        return fine.rows_of
    last = fine.comm.size - 1

    def rows_of(rank: int) -> slice:
        part = fine.rows_of(rank)
        return slice(part.start // 2, (part.stop + (rank == last)) // 2)

    return rows_of


@dataclass(frozen=True)
class PyramidStep:
    """The step from a grid of points to the next one, of cells of a `shape`. Methods are collective among the ranks of
    the points."""

    fine: Slab
    coarse: Slab
    shape: Shape
    _kept: dict[tuple[str, tuple[int, ...]], "RowExchange"] = field(default_factory=dict)

    @cached_property
    def above(self) -> int:
        """Number of rows of points of the first own cell on another rank: 0 or 1."""
        return self.fine.rows.start % self.shape[1]

    @cached_property
    def own(self) -> slice:
        """Slice of the cells that end in points of this rank, in its map of cells."""
        part = ending_in(self.fine, self.shape[1])(self.fine.comm.rank)
        return slice(part.start - self.coarse.rows.start, part.stop - self.coarse.rows.start)

    def complete(self, cells: NDArray[Any]) -> None:
        """Exchange cells if every rank has all of them."""
        comm = self.fine.comm
        if self.coarse.comm.size < comm.size:
            starts, stops = cells[:1].nbytes * self._ending.T
            comm.Allgatherv(MPI.IN_PLACE, [cells, (stops - starts, starts), MPI.BYTE])
            self.fine.tally["bytes sent"] += cells[self.own].nbytes * (comm.size - 1)

    def adjacent_points(self, points: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Return rows next to those of this rank: -1 is the last one above, 0 the first below, 1 the next; shape
        (offsets, nx).

        After the last row follows the first; if the number of rows is odd, with a row of zeros between. Ranks without
        points get zeros. The result is empty for cells of one row.
        """
        if self.shape[1] == 1:
            return points[:0]
        cycle = self.fine.ny + self.fine.ny % 2
        return self._row_exchange("points", self.fine, self.fine.bounds, cycle, offsets).fetch(points)

    def adjacent_cells(self, cells: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Return the same for rows next to the cells that end in points of this rank."""
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
