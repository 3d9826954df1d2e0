"""Grids of ever larger cells, each made of two by two cells of the one before, down to a single cell.

A cell that is cut by the end of the grid has what there is of it. Each cell is with the rank that has its last row in
the grid before, until there are so few cells that every rank has all of them, which needs no more messages.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI
from .regrid import fetch
from .slab import Slab, deal

OFFSETS = (-2, -1, 0, 1)  # of rows beside those of a rank, as `Step` tells them
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

    @cached_property
    def own(self) -> slice:
        """Where the cells that end in points of this rank are in its map of cells."""
        part = self._ending[self.fine.comm.rank]
        return slice(part.start - self.coarse.rows.start, part.stop - self.coarse.rows.start)

    def complete(self, cells: NDArray[Any]) -> None:
        """Where every rank has all cells, tell each those of the others."""
        if self.coarse.comm.size < self.fine.comm.size:
            made = Slab(self.fine.comm, self.coarse.nx, self.coarse.ny, self.fine.tally, self._ending)
            cells[...] = fetch(made, cells[self.own], [slice(0, made.ny)] * made.comm.size)

    def points_beside(self, points: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """Rows beside those of this rank: -1 is the last one above, 0 the first below, 1 the next; shape (offsets, nx).

        After the last row comes the first again; of an odd number of rows, one of zeros before it. Of a rank without
        points, nothing.
        """
        return np.concatenate([self._row(self.fine, points, self._points_wanted[offset]) for offset in offsets])

    def cells_beside(self, cells: NDArray[Any], *offsets: int) -> NDArray[Any]:
        """The same of rows beside the cells that end in points of this rank, of which none are missing."""
        return np.concatenate([self._row(self.coarse, cells, self._cells_wanted[offset]) for offset in offsets])

    @cached_property
    def _ending(self) -> list[slice]:
        """The rows of cells that end in points of each rank."""
        return halves(self.fine.dealt)

    @cached_property
    def _points_wanted(self) -> dict[int, list[slice]]:
        return self._wanted(self.fine, self.fine.dealt, self.fine.ny + self.fine.ny % 2)

    @cached_property
    def _cells_wanted(self) -> dict[int, list[slice]]:
        return self._wanted(self.coarse, self._ending, self.coarse.ny)

    def _wanted(self, slab: Slab, parts: list[slice], cycle: int) -> dict[int, list[slice]]:
        """The row of a map that each rank wants beside its part, by offset; none where there are no points."""
        found: dict[int, list[slice]] = {}
        for offset in OFFSETS:
            numbers = [((part.start if offset < 0 else part.stop) + offset) % cycle for part in parts]
            there = [
                points.start < points.stop and number < slab.ny
                for points, number in zip(self.fine.dealt, numbers, strict=True)
            ]
            found[offset] = [
                slice(n, n + 1) if is_there else slice(0, 0) for n, is_there in zip(numbers, there, strict=True)
            ]
        return found

    def _row(self, slab: Slab, field: NDArray[Any], wanted: list[slice]) -> NDArray[Any]:
        row = field[wanted[self.fine.comm.rank]] if slab.comm.size == 1 else fetch(slab, field, wanted)
        return np.zeros((1, slab.nx), field.dtype) if row.size == 0 and self.fine.shape[0] else row
