"""Grids of cells for `extension`: each cell joins two by two cells of the next finer grid, or a pair of them.

Pairs come first, until points are about as far from each other along x as along y, as fields that are smooth over
square cells are not smooth over long ones. A positive number of pairs joins along x, a negative one along y.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from ...parallel import pyramid
from ...parallel.slab import Slab
from . import cell_loops as loops

Map = NDArray[Any]


@dataclass(frozen=True)
class CellLevel:
    """Sums over cells, interpolation between them, and the transposes of both, for one step of `pyramid`.

    Maps hold the rows of this rank. `known` marks points that interpolation leaves unchanged. All but `add_up` add
    to their last map. Collective.
    """

    step: pyramid.PyramidStep

    @cached_property
    def _sides(self) -> tuple[int | None, int | None]:
        """The shape of a cell as `cell_loops` takes it."""
        wide, tall = self.step.shape
        return wide if wide > 1 else None, tall if tall > 1 else None

    @property
    def coarse(self) -> Slab:
        return self.step.coarse

    @cached_property
    def _alone(self) -> bool:
        """True if this rank has all rows, and no row of zeros is between the last and the first: `loops.row_of` then
        finds the rows next to a map in the map itself."""
        return self.step.fine.comm.size == 1 and self.step.fine.ny % 2 == 0

    def add_up(self, points: Map, cells: Map) -> None:
        step = self.step
        around = points if self._alone else step.adjacent_points(points, 0, -1)
        loops.add_up(points, around, step.above, *self._sides, cells[step.own])
        step.complete(cells)

    def add_up_back(self, cells: Map, points: Map) -> None:
        step = self.step
        around = cells if self._alone else step.adjacent_cells(cells, 0, -1)
        loops.add_up_back(cells[step.own], around, step.above, *self._sides, points)

    def interpolate(self, cells: Map, known: Map, points: Map) -> None:
        step = self.step
        around = cells if self._alone else step.adjacent_cells(cells, 0, -1)
        loops.interpolate_cells(cells[step.own], around, step.above, *self._sides, known, points)

    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None:
        step, next_known, next_points = self.step, known, points
        if not self._alone:
            next_known, next_points = (step.adjacent_points(field, 0, 1, -2, -1) for field in (known, points))
        own = cells[step.own]
        loops.gather_cells(known, next_known, points, next_points, step.above, *self._sides, own)
        step.complete(cells)


def cell_levels(slab: Slab, pairs: int = 0) -> list[CellLevel]:
    """Return all levels of a grid up to a single cell, the finest first; the first `pairs` levels join pairs."""
    return [CellLevel(step) for step in pyramid.pyramid_steps(slab, pairs)]


def interpolate(levels: list[CellLevel], known: list[Map], maps: list[Map]) -> None:
    """Interpolate from the largest cells down to points, adding each grid to the next finer one; collective."""
    for k, level in reversed(list(enumerate(levels))):
        level.interpolate(maps[k + 1], known[k], maps[k])


def interpolate_back(levels: list[CellLevel], known: list[Map], maps: list[Map]) -> None:
    """Apply the transpose of `interpolate`, from points to the largest cells; collective."""
    for k, level in enumerate(levels):
        level.interpolate_back(known[k], maps[k], maps[k + 1])
