"""Between points and the larger cells of `extension`: squares of two by two, or pairs where cells are long.

Pairs are made first, until points are about as far apart along x as along y: what is smooth over square cells is not
over long ones. A number of pairs is that of pairs along x, and below 0 of pairs along y.
"""

from dataclasses import dataclass
from types import ModuleType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel import pyramid
from ...parallel.slab import Slab, dealt_to
from . import pairs_along_y, squares

Map = NDArray[Any]


class Level(Protocol):
    """Sums over cells, interpolation between them, and the transposes of both, each added to its second map but for
    sums. `known` are the points of which interpolation knows the values; maps of the rows of this rank. Collective."""

    @property
    def coarse(self) -> Slab: ...
    def add_up(self, points: Map, cells: Map) -> None: ...
    def add_up_back(self, cells: Map, points: Map) -> None: ...
    def interpolate(self, cells: Map, known: Map, points: Map) -> None: ...
    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None: ...


@dataclass(frozen=True)
class Stepped:
    """Cells of a step of `pyramid`, and their `loops`: `squares` or `pairs_along_y`."""

    step: pyramid.Step
    loops: ModuleType

    @property
    def coarse(self) -> Slab:
        return self.step.coarse

    def add_up(self, points: Map, cells: Map) -> None:
        self.loops.add_up(points, self.step.points_beside(points, 0, -1), self.step.above, cells[self.step.own])
        self.step.complete(cells)

    def add_up_back(self, cells: Map, points: Map) -> None:
        step = self.step
        self.loops.add_up_back(cells[step.own], step.cells_beside(cells, 0, -1), step.above, points)

    def interpolate(self, cells: Map, known: Map, points: Map) -> None:
        step = self.step
        self.loops.interpolate(cells[step.own], step.cells_beside(cells, 0, -1), step.above, known, points)

    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None:
        step = self.step
        around = [step.points_beside(field, 0, 1, -2, -1) for field in (known, points)]
        self.loops.interpolate_back(known, around[0], points, around[1], step.above, cells[step.own])
        step.complete(cells)


@dataclass(frozen=True)
class PairsAlongX:
    """Cells of two points along x; no messages."""

    coarse: Slab

    def add_up(self, points: Map, cells: Map) -> None:
        _add_pairs(points, cells)

    def add_up_back(self, cells: Map, points: Map) -> None:
        _add_pairs_back(cells, points)

    def interpolate(self, cells: Map, known: Map, points: Map) -> None:
        _interpolate_pairs(cells, known, points)

    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None:
        _interpolate_pairs_back(known, points, cells)


def levels_of(slab: Slab, pairs: int) -> list[Level]:
    """All levels of a grid up to a single cell, the finest first, of which so many are of pairs."""
    made: list[Level] = []
    for _ in range(pairs):
        slab = Slab(slab.comm, (slab.nx + 1) // 2, slab.ny, slab.tally, slab.dealt)
        made.append(PairsAlongX(slab))
    steps = pyramid.steps_of(slab, -pairs)
    return made + [Stepped(step, pairs_along_y if k < -pairs else squares) for k, step in enumerate(steps)]


def interpolate(levels: list[Level], known: list[Map], maps: list[Map]) -> None:
    """Interpolate from the largest cells down to points, each grid added to the next finer one; collective."""
    for k, level in reversed(list(enumerate(levels))):
        level.interpolate(maps[k + 1], known[k], maps[k])


def interpolate_back(levels: list[Level], known: list[Map], maps: list[Map]) -> None:
    """The transpose of `interpolate`, from points to the largest cells; collective."""
    for k, level in enumerate(levels):
        level.interpolate_back(known[k], maps[k], maps[k + 1])


def count_cells(nx: int, ny: int, ranks: int, rank: int, most: int | None, pairs: int) -> int:
    """Cells of all levels, or of `most` of them, that a rank has."""
    total, rows = 0, dealt_to(ny, ranks, rank)
    for _ in range(pairs if most is None else min(pairs, most)):
        nx = (nx + 1) // 2
        total += nx * (rows.stop - rows.start)
    left = None if most is None else max(most - max(pairs, 0), 0)
    return total + pyramid.count_cells(nx, ny, ranks, rank, left, -pairs)


@loop
def _add_pairs(points, cells):
    """The sums over pairs; a last point without another is alone."""
    pairs = points.shape[1] // 2
    for j in range(points.shape[0]):
        row, out = points[j], cells[j]
        for i in range(pairs):
            out[i] = row[2 * i] + row[2 * i + 1]
        for i in range(pairs, out.size):
            out[i] = row[2 * i]


@loop
def _add_pairs_back(cells, points):
    """Add the value of each pair to its points."""
    for j in range(points.shape[0]):
        row, out = cells[j], points[j]
        for i in range(out.size):
            out[i] += row[i // 2]


@loop
def _interpolate_pairs(cells, known, points):
    """Add `1 - known` times what is interpolated between pairs, 3/4 of the own and 1/4 of the nearest other one."""
    columns = cells.shape[1]
    for j in range(points.shape[0]):
        row, out, weight = cells[j], points[j], known[j]
        for i in range(out.size):
            near = i // 2
            other = (near + 1) % columns if i % 2 else (near - 1) % columns
            told = np.float32(0.75) * row[near] + np.float32(0.25) * row[other]
            out[i] += (1.0 - weight[i]) * told


@loop
def _interpolate_pairs_back(known, points, cells):
    """Put points into pairs: `1 - known` times their values, by the weights of the interpolation."""
    columns = cells.shape[1]
    for j in range(points.shape[0]):
        row, out, weight = points[j], cells[j], known[j]
        for i in range(columns):
            out[i] = np.float32(0.0)
        for i in range(row.size):
            near = i // 2
            other = (near + 1) % columns if i % 2 else (near - 1) % columns
            value = (1.0 - weight[i]) * row[i]
            out[near] += np.float32(0.75) * value
            out[other] += np.float32(0.25) * value
