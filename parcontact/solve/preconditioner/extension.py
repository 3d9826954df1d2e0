"""A residual carried on beyond the set of points it is known on, and what it causes there brought back.

A preconditioner K, the inverse of A without a contact set, makes of a residual r on a set c the correction `R K R r`
(R: values on c). That takes r as 0 outside c, where it really goes on: the correction that is wanted moves the surface
outside c, too. With an extension E of r to all points, `R E' K E R` is symmetric and positive, as K is; with the one
that makes the energy `<e, K e>` the smallest it is the inverse of `R A R`. That e varies, at any distance from c, over
lengths of about this distance. So does the mean over cells of all sizes that is taken here. With s the sum of r over a
cell, w the number of its points that are in c, and I the linear interpolation between cells of twice the length,

    e = (s + f I e_above)/(w + f),   f = FLOOR times the points of a cell,

from the largest cell, beyond which e is 0, down to single points, for which f = 0: a cell tells what it knows, and asks
the larger one about the rest. The number of iterations then hardly grows with the grid. The grid is taken to repeat for
ever, which does no harm where it does not. Maps of cells are in single precision: enough for a preconditioner.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel import pyramid
from ...parallel.slab import Array, Slab
from ..problem import Operator

FLOOR = 0.3  # tuning: of the points of a cell: so many count as having the value of the larger cell
LONG = 16.0  # tuning: times its width: with points further apart along one direction, square cells are worse than none
Maps = list[NDArray[Any]]  # of points, and of cells on each larger grid


def grids_for(dx: float, dy: float, reach: float = math.inf) -> int | None:
    """Return the most grids of larger cells to use with distances dx and dy of points; None for all that there are.

    Points further apart than the `reach` do not act on each other: no cell is longer than about that, if it is not the
    first.
    """
    if max(dx, dy) > LONG * min(dx, dy):
        return 0
    return None if reach == math.inf else max(round(math.log2(reach / max(dx, dy))), 1)


class ExtendedPreconditioner:
    """K on a set, extended as above; two maps in single precision on each grid of larger cells.

    `known` is `w/(w + f)` of each cell, for points the set itself.
    """

    def __init__(self, slab: Slab, floor: float = FLOOR, most: int | None = None) -> None:
        """With another floor, and `most` grids of larger cells."""
        self._steps = pyramid.steps_of(slab)[:most]
        grids = [step.coarse for step in self._steps]
        self._floors = [
            (np.float32(floor) * lengths(slab.ny, level)[grid.rows], lengths(slab.nx, level))
            for level, grid in enumerate(grids, 1)
        ]
        self._known, self._cells = ([grid.empty(np.float32) for grid in grids] for _ in range(2))

    @staticmethod
    def footprint(nx: int, ny: int, ranks: int, rank: int, most: int | None = None) -> int:
        """Bytes that it holds on a rank."""
        return 2 * 4 * pyramid.count_cells(nx, ny, ranks, rank, most)

    def apply(self, preconditioner: Operator, working: NDArray[Any], r: Array) -> None:
        """Put z in the place of the residual r, which is 0 outside the set; only on the set does z mean something.
        Collective."""
        known: Maps = [working, *self._known]
        maps: Maps = [r, *self._cells]
        self._add_up(known)
        for floors, weights in zip(self._floors, self._known, strict=True):
            _compare(*floors, weights)
        self._add_up(maps)
        self._weigh()
        self._interpolate(known, maps)
        preconditioner.apply(r, r)
        self._interpolate_back(known, maps)
        self._weigh()
        self._add_up_back(maps)

    def _weigh(self) -> None:
        """Divide by `w + f`."""
        for floors, known, cells in zip(self._floors, self._known, self._cells, strict=True):
            _weigh(known, *floors, cells)

    # -- between each grid and the next, and the transposes of that ----------------------------------------------------

    def _add_up(self, maps: Maps) -> None:
        for k, step in enumerate(self._steps):
            points, cells = maps[k : k + 2]
            add_up(points, step.points_beside(points, 0, -1), step.above, cells[step.own])
            step.complete(cells)

    def _add_up_back(self, maps: Maps) -> None:
        for k, step in reversed(list(enumerate(self._steps))):
            points, cells = maps[k : k + 2]
            add_up_back(cells[step.own], step.cells_beside(cells, 0, -1), step.above, points)

    def _interpolate(self, known: Maps, maps: Maps) -> None:
        for k, step in reversed(list(enumerate(self._steps))):
            points, cells = maps[k : k + 2]
            _interpolate(cells[step.own], step.cells_beside(cells, 0, -1), step.above, known[k], points)

    def _interpolate_back(self, known: Maps, maps: Maps) -> None:
        for k, step in enumerate(self._steps):
            weights, points, cells = known[k], maps[k], maps[k + 1]
            around = [step.points_beside(field, 0, 1, -2, -1) for field in (weights, points)]
            _interpolate_back(weights, around[0], points, around[1], step.above, cells[step.own])
            step.complete(cells)


def lengths(points: int, level: int) -> NDArray[np.float32]:
    """How many points there are of each cell along one direction: fewer in the last one."""
    length = 1 << level
    return np.diff(np.minimum(np.arange(0, points + length, length), points)).astype(np.float32)


@loop
def _compare(floors, lengths, weights):
    """`w/(w + f)`, with f the product of a floor of each row and a length of each column."""
    for j in range(weights.shape[0]):
        for i in range(weights.shape[1]):
            weights[j, i] /= weights[j, i] + floors[j] * lengths[i]


@loop
def _weigh(known, floors, lengths, cells):
    for j in range(cells.shape[0]):
        for i in range(cells.shape[1]):
            cells[j, i] *= (1.0 - known[j, i]) / (floors[j] * lengths[i])


@loop
def _row(own, beside, j):
    """Row j, counted from the first of `own`; of those beside, the ones above are the last."""
    if j < 0:
        return beside[beside.shape[0] + j]
    return own[j] if j < own.shape[0] else beside[j - own.shape[0]]


@loop
def add_up(points, beside, above, cells):
    """The sums over cells."""
    pairs = points.shape[1] // 2
    for j in range(cells.shape[0]):
        a, b = _row(points, beside, 2 * j - above), _row(points, beside, 2 * j - above + 1)
        out = cells[j]
        for i in range(pairs):
            out[i] = (a[2 * i] + b[2 * i]) + (a[2 * i + 1] + b[2 * i + 1])
        for i in range(pairs, out.size):
            out[i] = a[2 * i] + b[2 * i]


@loop
def add_up_back(cells, beside, above, points):
    """Add the value of each cell to its points."""
    pairs = points.shape[1] // 2
    for j in range(points.shape[0]):
        cell, out = _row(cells, beside, (j + above) // 2), points[j]
        for i in range(pairs):
            out[2 * i] += cell[i]
            out[2 * i + 1] += cell[i]
        for i in range(2 * pairs, out.size):
            out[i] += cell[i // 2]


@loop
def _interpolate(cells, beside, above, known, points):
    """Add `1 - known` times what is interpolated between cells."""
    pairs, columns = points.shape[1] // 2, cells.shape[1]
    line = np.empty(columns + 2, cells.dtype)
    for j in range(points.shape[0]):
        near = (j + above) // 2
        other = near + 1 if (j + above) % 2 else near - 1
        a, b = _row(cells, beside, near), _row(cells, beside, other)
        for i in range(columns):
            line[i + 1] = np.float32(0.75) * a[i] + np.float32(0.25) * b[i]
        line[0], line[columns + 1] = line[columns], line[1]
        out, weight = points[j], known[j]
        for i in range(pairs):
            middle = np.float32(0.75) * line[i + 1]
            out[2 * i] += (1.0 - weight[2 * i]) * (middle + np.float32(0.25) * line[i])
            out[2 * i + 1] += (1.0 - weight[2 * i + 1]) * (middle + np.float32(0.25) * line[i + 2])
        for i in range(2 * pairs, out.size):
            out[i] += (1.0 - weight[i]) * (np.float32(0.75) * line[i // 2 + 1] + np.float32(0.25) * line[i // 2])


@loop
def _interpolate_back(known, known_beside, points, beside, above, cells):
    """Add points to cells: `1 - known` times their values, by the weights of the interpolation."""
    count, columns = points.shape[1], cells.shape[1]
    line = np.zeros(2 * columns + 2, cells.dtype)
    for j in range(cells.shape[0]):
        first = 2 * j - above - 1
        a, b = _row(points, beside, first), _row(points, beside, first + 1)
        c, d = _row(points, beside, first + 2), _row(points, beside, first + 3)
        w_a, w_b = _row(known, known_beside, first), _row(known, known_beside, first + 1)
        w_c, w_d = _row(known, known_beside, first + 2), _row(known, known_beside, first + 3)
        for i in range(count):
            outer = (1.0 - w_a[i]) * a[i] + (1.0 - w_d[i]) * d[i]
            inner = (1.0 - w_b[i]) * b[i] + (1.0 - w_c[i]) * c[i]
            line[i + 1] = 0.25 * outer + 0.75 * inner
        line[0], line[2 * columns + 1] = line[2 * columns], line[1]
        out = cells[j]
        for i in range(columns):
            outer, inner = line[2 * i] + line[2 * i + 3], line[2 * i + 1] + line[2 * i + 2]
            out[i] = np.float32(0.25) * outer + np.float32(0.75) * inner
