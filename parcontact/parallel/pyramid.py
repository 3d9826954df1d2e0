"""Grids of ever larger cells, each made of two by two cells of the one before, down to a single cell.

A cell that is cut by the end of the grid has what there is of it. Each cell is with the rank that has its last row in
the grid before, until there are so few cells that every rank has all of them, which needs no more messages.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI
from .regrid import fetch
from .slab import Slab, deal

FEW = 8  # times fewer cells than a rank has points: then every rank has all cells


def steps_of(slab: Slab) -> list["Step"]:
    """All steps from a grid to a single cell, the finest first. A grid that every rank has is that of a rank alone."""
    grids = [slab]
    for nx, ny, dealt in _larger(slab.nx, slab.ny, slab.dealt):
        alone = len(dealt) == 1
        grids.append(Slab(MPI.COMM_SELF if alone else slab.comm, nx, ny, slab.tally, dealt))
    return [Step(fine, coarse) for fine, coarse in pairwise(grids)]


def count_cells(nx: int, ny: int, ranks: int, rank: int, most: int | None = None) -> int:
    """Cells of the next grids, `most` of them or all, that a rank has."""
    total = 0
    for width, _, dealt in islice(_larger(nx, ny, deal(ny, ranks)), most):
        part = dealt[rank if len(dealt) > 1 else 0]
        total += width * (part.stop - part.start)
    return total


def _larger(nx: int, ny: int, dealt: list[slice]) -> Iterator[tuple[int, int, list[slice]]]:
    """Cells along x and y of each larger grid, and which rows each rank has; one part where every rank has all."""
    enough = nx * ny // (FEW * len(dealt))
    while nx * ny > 1:
        nx, ny = (nx + 1) // 2, (ny + 1) // 2
        dealt = halves(dealt) if len(dealt) > 1 and nx * ny > enough else [slice(0, ny)]
        yield nx, ny, dealt


def halves(dealt: list[slice]) -> list[slice]:
    """The rows of cells that end in each part of the rows of a finer grid."""
    ends = [part.stop // 2 for part in dealt[:-1]]
    return [slice(start, stop) for start, stop in pairwise([0, *ends, (dealt[-1].stop + 1) // 2])]


@dataclass(frozen=True)
class Step:
    """From a grid to the next, called points and cells here. Methods are collective among the ranks of the points."""

    fine: Slab
    coarse: Slab

    @property
    def above(self) -> int:
        """Rows of points of the first own cell that are with another rank: 0 or 1."""
        return self.fine.rows.start % 2

    @property
    def own(self) -> slice:
        """Where the cells that end in points of this rank are in its map of cells."""
        part = halves(self.fine.dealt)[self.fine.comm.rank]
        return slice(part.start - self.coarse.rows.start, part.stop - self.coarse.rows.start)

    def complete(self, cells: NDArray[Any]) -> None:
        """Where every rank has all cells, tell each those of the others."""
        if self.coarse.comm.size < self.fine.comm.size:
            made = Slab(self.fine.comm, self.coarse.nx, self.coarse.ny, self.fine.tally, halves(self.fine.dealt))
            cells[...] = fetch(made, cells[self.own], [slice(0, made.ny)] * made.comm.size)

    def points_beside(self, points: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Rows beside those of this rank: -1 is the last one above, 0 the first below, 1 the next; shape (offsets, nx).

        After the last row comes the first again; of an odd number of rows, one of zeros before it. Of a rank without
        points, nothing.
        """
        cycle = self.fine.ny + self.fine.ny % 2
        return np.concatenate([self._row(self.fine, points, self.fine.dealt, offset, cycle) for offset in offsets])

    def cells_beside(self, cells: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """The same of rows beside the cells that end in points of this rank, of which none are missing."""
        parts, cycle = halves(self.fine.dealt), self.coarse.ny
        return np.concatenate([self._row(self.coarse, cells, parts, offset, cycle) for offset in offsets])

    def _row(self, slab: Slab, field: NDArray[Any], parts: list[slice], offset: int, cycle: int) -> NDArray[Any]:
        rank, wanted = self.fine.comm.rank, list[slice]()
        for part, points in zip(parts, self.fine.dealt, strict=True):
            number = ((part.start if offset < 0 else part.stop) + offset) % cycle
            there = points.start < points.stop and number < slab.ny
            wanted.append(slice(number, number + 1) if there else slice(0, 0))
        row = field[wanted[rank]] if slab.comm.size == 1 else fetch(slab, field, wanted)
        return np.zeros((1, slab.nx), field.dtype) if row.size == 0 and self.fine.shape[0] else row
