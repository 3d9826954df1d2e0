"""Grids of ever larger cells, each made of two by two cells of the one before, down to a single cell; the first of
them, if so many `pairs` are wanted, of two cells along x, or for numbers below 0 along y.

A cell that is cut by the end of the grid has what there is of it. Each cell is with the rank that has its last row in
the grid before, until there are so few cells that every rank has all of them, which needs no more messages.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, pairwise
from typing import Any

from numpy.typing import NDArray

from .mpi import MPI
from .regrid import fetch
from .rows import RowsBeside
from .slab import Slab

Shape = tuple[int, int]  # points of a cell along x and y: 1 or 2
FEW = 8  # tuning: times fewer cells than a rank has points: then every rank has all cells


def pyramid_steps(slab: Slab, pairs: int = 0) -> list["PyramidStep"]:
    """All steps from a grid to a single cell, the finest first; so many to `pairs` come first. A grid that every rank
    has is that of a rank alone."""
    grids, shapes = [slab], []
    for nx, ny, shape, alone in _larger(slab.nx, slab.ny, slab.comm.size, pairs):
        shapes.append(shape)
        comm, rows_of = (MPI.COMM_SELF, None) if alone else (slab.comm, ending_in(grids[-1], shape[1]))
        grids.append(Slab(comm, nx, ny, slab.tally, rows_of))
    return [PyramidStep(fine, coarse, shape) for (fine, coarse), shape in zip(pairwise(grids), shapes, strict=True)]


def _larger(nx: int, ny: int, ranks: int, pairs: int) -> Iterator[tuple[int, int, Shape, bool]]:
    """Cells along x and y of each larger grid, of which shape, and whether every rank has all of them."""
    enough, alone = nx * ny // (FEW * ranks), ranks == 1
    for pair in count():
        if nx * ny == 1:
            return
        wide, tall = (1 if pair < -pairs else 2), (1 if pair < pairs else 2)
        nx, ny = -(-nx // wide), -(-ny // tall)
        alone = alone or (tall == 2 and nx * ny <= enough)
        yield nx, ny, (wide, tall), alone


def ending_in(fine: Slab, tall: int) -> Callable[[int], slice]:
    """The rows of cells of so many rows that end in the rows of a rank of a finer grid, over ranks."""
    if tall == 1:
        return fine.rows_of
    last = fine.comm.size - 1

    def rows_of(rank: int) -> slice:
        part = fine.rows_of(rank)
        return slice(part.start // 2, (part.stop + (rank == last)) // 2)

    return rows_of


@dataclass(frozen=True)
class PyramidStep:
    """From a grid of points to the next one of cells of a `shape`. Methods are collective among the ranks of the
    points."""

    fine: Slab
    coarse: Slab
    shape: Shape
    _kept: dict[tuple[str, tuple[int, ...]], "RowsBeside"] = field(default_factory=dict)

    @property
    def above(self) -> int:
        """Rows of points of the first own cell that are with another rank: 0 or 1."""
        return self.fine.rows.start % self.shape[1]

    @cached_property
    def own(self) -> slice:
        """Where the cells that end in points of this rank are in its map of cells."""
        part = ending_in(self.fine, self.shape[1])(self.fine.comm.rank)
        return slice(part.start - self.coarse.rows.start, part.stop - self.coarse.rows.start)

    def complete(self, cells: NDArray[Any]) -> None:
        """Where every rank has all cells, tell each those of the others."""
        if self.coarse.comm.size < self.fine.comm.size:
            ends = ending_in(self.fine, self.shape[1])
            made = Slab(self.fine.comm, self.coarse.nx, self.coarse.ny, self.fine.tally, ends)
            cells[...] = fetch(made, cells[self.own], [slice(0, made.ny)] * made.comm.size)

    def points_beside(self, points: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Rows beside those of this rank: -1 is the last one above, 0 the first below, 1 the next; shape (offsets, nx).

        After the last row comes the first again; of an odd number of rows, one of zeros before it. Of a rank without
        points, nothing; nor of cells of one row.
        """
        if self.shape[1] == 1:
            return points[:0]
        cycle = self.fine.ny + self.fine.ny % 2
        return self._beside("points", self.fine, self.fine.dealt, cycle, offsets).fetch(points)

    def cells_beside(self, cells: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """The same of rows beside the cells that end in points of this rank, of which none are missing."""
        if self.shape[1] == 1:
            return cells[:0]
        return self._beside("cells", self.coarse, self._ending, self.coarse.ny, offsets).fetch(cells)

    @cached_property
    def _ending(self) -> list[slice]:
        """The rows of cells that end in points of each rank."""
        return list(map(ending_in(self.fine, self.shape[1]), range(self.fine.comm.size)))

    def _beside(self, what: str, slab: Slab, parts: list[slice], cycle: int, offsets: tuple[int, ...]) -> "RowsBeside":
        """Beside the part of each rank that has points; kept for the next time."""
        key = what, offsets
        if key not in self._kept:
            wanted = [
                [((part.start if offset < 0 else part.stop) + offset) % cycle for offset in offsets]
                if points.start < points.stop
                else []
                for part, points in zip(parts, self.fine.dealt, strict=True)
            ]
            self._kept[key] = RowsBeside(slab, wanted, self.fine.comm.rank)
        return self._kept[key]
