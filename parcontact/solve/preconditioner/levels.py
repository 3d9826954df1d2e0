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

    def add_up(self, points: Map, cells: Map) -> None:
        step = self.step
        loops.add_up(points, step.adjacent_points(points, 0, -1), step.above, *self._sides, cells[step.own])
        step.complete(cells)

    def add_up_back(self, cells: Map, points: Map) -> None:
        step = self.step
        loops.add_up_back(cells[step.own], step.adjacent_cells(cells, 0, -1), step.above, *self._sides, points)

    def interpolate(self, cells: Map, known: Map, points: Map) -> None:
        step = self.step
        loops.interpolate_cells(
            cells[step.own], step.adjacent_cells(cells, 0, -1), step.above, *self._sides, known, points
        )

    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None:
        step = self.step
        around = [step.adjacent_points(field, 0, 1, -2, -1) for field in (known, points)]
        own = cells[step.own]
        loops.gather_cells(known, around[0], points, around[1], step.above, *self._sides, own)
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
