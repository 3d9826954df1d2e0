"""The preconditioner of the contact solver: K with residuals extended beyond the contact.

A preconditioner K is close to the inverse of A on the whole grid. A residual r on a set c of points could be turned
into the correction `R K R r`, where R restricts maps to c. But this correction takes r as 0 outside c, whereas the
wanted correction moves the surface outside c, too. With an extension E of r to all points, `R E' K E R` is symmetric
and positive, as K is, and is the inverse of `R A R` if e = E r minimizes `<e, K e>`. At a distance from c this e varies
over lengths of about that distance. The extension used here also varies over such lengths: it consists of means of r
over cells of all sizes. With s the sum of r over a cell, w the number of points of c in the cell, and I the linear
interpolation from the cells of the next coarser grid,

    e = (s + f I e_above)/(w + f),   f = FLOOR times the points of a cell,

from the largest cell, above which e is 0, down to single points, with f = 0. The number of iterations then hardly grows
with the grid. The grid is taken as periodic, also for free boxes. Maps of cells are in single precision.

Each cell joins two by two cells, or only two cells, of the next finer grid. Pairs of cells are joined first, until
points are about as far from each other along x as along y, as fields that are smooth over square cells are not smooth
over long ones. Interpolation takes 3/4 of the value of a point's own cell and 1/4 of the value of the nearest other
cell, along each side.

The functions and loops have these arguments:

* pairs: the first |pairs| levels join two cells only, along x if `pairs` > 0 and along y if `pairs` < 0;
* wide, tall: points of a cell along x and y, each 2 or None. None stands for 1: loops are then compiled without
  branches that they do not need;
* above: 1 if this rank's first cell has a row of points on the rank before, else 0;
* neighbours: rows next to the rows of this rank (`row_of`);
* known: weight of each cell, `w/(w + f)`, or of each point, 1 in c and 0 outside c. Interpolation adds `1 - known`
  times the interpolated value.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel import regrid
from ..parallel.slab import Array, Slab
from .problem import Operator


@loop
def row_of(own, neighbours, j):
    """Return row j of a map whose rows `own` are on this rank. `neighbours` holds first the rows after the last row,
    and then the rows before row 0, for which j < 0."""
    if j < 0:
        return neighbours[neighbours.shape[0] + j]
    return own[j] if j < own.shape[0] else neighbours[j - own.shape[0]]


@loop
def add_up(points, neighbours, above, wide, tall, cells):
    """Set each cell of the map `cells` to the sum of the map `points` over the points of the cell."""
    height = 1 if tall is None else 2
    second = np.float32(height - 1)
    pairs = points.shape[1] // 2
    for j in range(cells.shape[0]):
        a, b = (
            row_of(points, neighbours, height * j - above),
            row_of(points, neighbours, height * j - above + height - 1),
        )
        out = cells[j]
        if wide is None:
            for i in range(out.size):
                out[i] = a[i] + second * b[i]
            continue
        for i in range(pairs):
            out[i] = (a[2 * i] + second * b[2 * i]) + (a[2 * i + 1] + second * b[2 * i + 1])
        for i in range(pairs, out.size):
            out[i] = a[2 * i] + second * b[2 * i]


@loop
def add_up_back(cells, neighbours, above, wide, tall, points):
    """Add the value of each cell in `cells` to `points` at the points of the cell; the transpose of `add_up`."""
    pairs, height = points.shape[1] // 2, 1 if tall is None else 2
    for j in range(points.shape[0]):
        cell, out = row_of(cells, neighbours, (j + above) // height), points[j]
        if wide is None:
            for i in range(out.size):
                out[i] += cell[i]
            continue
        for i in range(pairs):
            out[2 * i] += cell[i]
            out[2 * i + 1] += cell[i]
        for i in range(2 * pairs, out.size):
            out[i] += cell[i // 2]


@loop
def interpolate_cells(cells, neighbours, above, wide, tall, known, points):
    """Add `1 - known` times the linear interpolation between `cells` to the map `points`."""
    pairs, columns = points.shape[1] // 2, cells.shape[1]
    line = np.empty(columns + 2, np.float32)
    for j in range(points.shape[0]):
        if tall is None:
            a = cells[j + above]
            for i in range(columns):
                line[i + 1] = a[i]
        else:
            near = (j + above) // 2
            a = row_of(cells, neighbours, near)
            b = row_of(cells, neighbours, near + 1 if (j + above) % 2 else near - 1)
            for i in range(columns):
                line[i + 1] = np.float32(0.75) * a[i] + np.float32(0.25) * b[i]
        out, weight = points[j], known[j]
        if wide is None:
            for i in range(columns):
                out[i] += (1.0 - weight[i]) * line[i + 1]
            continue
        line[0], line[columns + 1] = line[columns], line[1]
        for i in range(pairs):
            middle = np.float32(0.75) * line[i + 1]
            out[2 * i] += (1.0 - weight[2 * i]) * (middle + np.float32(0.25) * line[i])
            out[2 * i + 1] += (1.0 - weight[2 * i + 1]) * (middle + np.float32(0.25) * line[i + 2])
        for i in range(2 * pairs, out.size):
            out[i] += (1.0 - weight[i]) * (np.float32(0.75) * line[i // 2 + 1] + np.float32(0.25) * line[i // 2])


@loop
def gather_cells(known, known_neighbours, points, neighbours, above, wide, tall, cells):
    """Set `cells` to the transpose of `interpolate_cells`: sums of `1 - known` times the map `points`, with the weights
    of the interpolation."""
    count, columns = points.shape[1], cells.shape[1]
    width, height = columns if wide is None else 2 * columns, 1 if tall is None else 2
    line = np.empty(width + 2, np.float32)
    line[width] = 0.0  # beyond an odd number of points
    for j in range(cells.shape[0]):
        first = height * j - above
        a, w_a = row_of(points, neighbours, first), row_of(known, known_neighbours, first)
        if tall is None:
            for i in range(count):
                line[i + 1] = (1.0 - w_a[i]) * a[i]
        else:
            b, w_b = row_of(points, neighbours, first + 1), row_of(known, known_neighbours, first + 1)
            over, w_over = row_of(points, neighbours, first - 1), row_of(known, known_neighbours, first - 1)
            under, w_under = row_of(points, neighbours, first + 2), row_of(known, known_neighbours, first + 2)
            for i in range(count):
                outer = (1.0 - w_over[i]) * over[i] + (1.0 - w_under[i]) * under[i]
                inner = (1.0 - w_a[i]) * a[i] + (1.0 - w_b[i]) * b[i]
                line[i + 1] = 0.25 * outer + 0.75 * inner
        out = cells[j]
        if wide is None:
            for i in range(columns):
                out[i] = line[i + 1]
            continue
        line[0], line[2 * columns + 1] = line[2 * columns], line[1]
        for i in range(columns):
            outer, inner = line[2 * i] + line[2 * i + 3], line[2 * i + 1] + line[2 * i + 2]
            out[i] = np.float32(0.25) * outer + np.float32(0.75) * inner


Map = NDArray[Any]


@dataclass(frozen=True)
class CellLevel:
    """Transfers between one grid and the next coarser grid of cells (`cell_levels`): sums over cells, interpolation
    between cells, and the transposes of both.

    Maps hold the rows of this rank. `known` holds the weights of the module: interpolation does not change a point with
    the weight 1. `add_up` and `interpolate_back` replace the map in their last argument. The other methods add to the
    map in their last argument. All methods are collective.
    """

    step: regrid.PyramidStep

    @cached_property
    def _sides(self) -> tuple[int | None, int | None]:
        """The shape of a cell as the loops take it."""
        wide, tall = self.step.shape
        return wide if wide > 1 else None, tall if tall > 1 else None

    @property
    def coarse(self) -> Slab:
        return self.step.coarse

    @cached_property
    def _alone(self) -> bool:
        """True if this rank has all rows, and no row of zeros is between the last and the first: `row_of` then
        finds the rows next to a map in the map itself."""
        return self.step.fine.comm.size == 1 and self.step.fine.ny % 2 == 0

    def add_up(self, points: Map, cells: Map) -> None:
        step = self.step
        around = points if self._alone else step.adjacent_points(points, 0, -1)
        add_up(points, around, step.above, *self._sides, cells[step.own])
        step.complete(cells)

    def add_up_back(self, cells: Map, points: Map) -> None:
        step = self.step
        around = cells if self._alone else step.adjacent_cells(cells, 0, -1)
        add_up_back(cells[step.own], around, step.above, *self._sides, points)

    def interpolate(self, cells: Map, known: Map, points: Map) -> None:
        step = self.step
        around = cells if self._alone else step.adjacent_cells(cells, 0, -1)
        interpolate_cells(cells[step.own], around, step.above, *self._sides, known, points)

    def interpolate_back(self, known: Map, points: Map, cells: Map) -> None:
        step, next_known, next_points = self.step, known, points
        if not self._alone:
            next_known, next_points = (step.adjacent_points(field, 0, 1, -2, -1) for field in (known, points))
        own = cells[step.own]
        gather_cells(known, next_known, points, next_points, step.above, *self._sides, own)
        step.complete(cells)


def cell_levels(slab: Slab, pairs: int = 0) -> list[CellLevel]:
    """Return the levels from a grid to a single cell, the finest first. The first |`pairs`| levels join two cells,
    along x if `pairs` > 0 and along y if `pairs` < 0. All further levels join two by two cells."""
    return [CellLevel(step) for step in regrid.pyramid_steps(slab, pairs)]


def interpolate(levels: list[CellLevel], known: list[Map], maps: list[Map]) -> None:
    """Interpolate `maps`, the finest first, from each grid to the next finer one, and add the result to the map there;
    collective."""
    for k, level in reversed(list(enumerate(levels))):
        level.interpolate(maps[k + 1], known[k], maps[k])


def interpolate_back(levels: list[CellLevel], known: list[Map], maps: list[Map]) -> None:
    """Apply the transpose of `interpolate` to the first of `maps`, the map of points, and overwrite the maps of cells
    with the results; collective."""
    for k, level in enumerate(levels):
        level.interpolate_back(known[k], maps[k], maps[k + 1])


FLOOR = 0.3  # tuning: weight of the larger cell, as a share of the points of a cell
LONG = 16.0  # tuning: largest ratio of distances of points for which larger cells are used
Maps = list[NDArray[Any]]  # a map of points, followed by maps of cells on each larger grid


class Grids(NamedTuple):
    """Number of coarser grids of a preconditioner: at most `most`, or all if `most` is None. The first |`pairs`| of
    these grids double cells along x only (`pairs` > 0) or along y only (`pairs` < 0)."""

    most: int | None = None
    pairs: int = 0


ALL = Grids()


def grids_for(dx: float, dy: float, reach: float = math.inf) -> Grids:
    """Return the coarser grids to use for a grid with the point spacings dx and dy.

    If dx and dy differ, cells are first doubled along the shorter side until they are about square. Points further
    apart than `reach` do not interact. Cells are therefore not enlarged beyond `reach` or twice the larger spacing,
    whichever is larger.
    """
    if max(dx, dy) > LONG * min(dx, dy):
        return Grids(0)
    pairs = round(math.log2(dy / dx))
    if reach == math.inf:
        return Grids(None, pairs)
    return Grids(abs(pairs) + max(round(math.log2(reach / max(dx, dy))), 1), pairs)


class ExtendedPreconditioner:
    """Preconditioner `R E' K E R` on a set of points, with residuals extended by E. It holds two maps in single
    precision on each coarser grid."""

    def __init__(self, slab: Slab, larger: Grids = ALL) -> None:
        most, pairs = larger
        down, across = max(pairs, 0), max(-pairs, 0)
        self._levels = cell_levels(slab, pairs)[:most]
        grids = [level.coarse for level in self._levels]
        self._floors = [
            (np.float32(FLOOR) * lengths(slab.ny, level - down)[grid.rows], lengths(slab.nx, level - across))
            for level, grid in enumerate(grids, 1)
        ]
        self._known, self._cells = ([grid.empty(np.float32) for grid in grids] for _ in range(2))

    def apply(self, preconditioner: Operator, working: NDArray[Any], r: Array) -> None:
        """Replace the residual r, which must be 0 outside the set `working`, by the preconditioned residual `E' K E r`,
        with the operator `preconditioner` as K. The result is valid on the set only. Collective."""
        known: Maps = [working, *self._known]
        maps: Maps = [r, *self._cells]
        self._add_up(known)
        for floors, weights in zip(self._floors, self._known, strict=True):
            _compare(*floors, weights)
        self._add_up(maps)
        self._weigh()
        interpolate(self._levels, known, maps)
        preconditioner.apply(r, r)
        interpolate_back(self._levels, known, maps)
        self._weigh()
        self._add_up_back(maps)

    def _weigh(self) -> None:
        """Divide by `w + f`."""
        for floors, known, cells in zip(self._floors, self._known, self._cells, strict=True):
            _weigh(known, *floors, cells)

    # -- between each grid and the next, and the transposes of that ----------------------------------------------------

    def _add_up(self, maps: Maps) -> None:
        for k, level in enumerate(self._levels):
            level.add_up(maps[k], maps[k + 1])

    def _add_up_back(self, maps: Maps) -> None:
        for k, level in reversed(list(enumerate(self._levels))):
            level.add_up_back(maps[k + 1], maps[k])


def lengths(points: int, level: int) -> NDArray[np.float32]:
    """Return the number of points in each cell of a level along a side with `points` points. The last cell may have
    fewer points than the others."""
    length = 1 << max(level, 0)
    return np.diff(np.minimum(np.arange(0, points + length, length), points)).astype(np.float32)


@loop
def _compare(floors, lengths, weights):
    """Divide weights w by `w + f`; f is a floor for each row times a length for each column."""
    for j in range(weights.shape[0]):
        for i in range(weights.shape[1]):
            weights[j, i] /= weights[j, i] + floors[j] * lengths[i]


@loop
def _weigh(known, floors, lengths, cells):
    for j in range(cells.shape[0]):
        for i in range(cells.shape[1]):
            cells[j, i] *= (1.0 - known[j, i]) / (floors[j] * lengths[i])
