"""Extension of a residual beyond its set of points, and the transpose of the extension.

A preconditioner K, the inverse of A without a contact set, turns a residual r on a set c into the correction `R K R
r` (R: restrict to c). This takes r as 0 outside c, whereas the wanted correction moves the surface outside c, too.
With an extension E of r to all points, `R E' K E R` is symmetric and positive, as K is. It is the inverse of `R A R`
if e = E r minimizes `<e, K e>`. At any distance from c this e varies over lengths of about the distance. So does the
mean over cells of all sizes used here. With s the sum of r over a cell, w the number of its points in c, and I the
linear interpolation between cells of twice the length,

    e = (s + f I e_above)/(w + f),   f = FLOOR times the points of a cell,

from the largest cell, above which e is 0, down to single points, with f = 0. The number of iterations then hardly
grows with the grid. The grid is taken as periodic, also for free boxes. Maps of cells are in single precision.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel.slab import Array, Slab
from ..problem import Operator
from .levels import cell_levels, interpolate, interpolate_back

FLOOR = 0.3  # tuning: weight of the larger cell, as a share of the points of a cell
LONG = 16.0  # tuning: largest ratio of distances of points for which larger cells are used
FADING = 2.7  # tuning: power with which the floor of cells longer than the reach of a layer grows
Maps = list[NDArray[Any]]  # a map of points, followed by maps of cells on each larger grid


class Grids(NamedTuple):
    """Grids of larger cells: at most `most`, None for all; the first of them double cells along one side, `pairs` times
    (`levels`); the floor of the last one is `last` times that of the others."""

    most: int | None = None
    pairs: int = 0
    last: float = 1.0


ALL = Grids()


def pairs_for(dx: float, dy: float) -> int:
    """Return how many doublings along x make points at distances dx and dy about square; negative for doublings along
    y; 0 if the ratio exceeds LONG."""
    if max(dx, dy) > LONG * min(dx, dy):
        return 0
    return round(math.log2(dy / dx))


def grids_for(dx: float, dy: float, reach: float = math.inf) -> Grids:
    """Return the grids of larger cells for points at distances dx and dy.

    Where points are closer along one direction, cells are doubled along it first, until they are about square.
    Points further away than `reach` do not act on each other: square cells have at most about this length. There are
    at least two sizes of these; if the larger one exceeds the reach, its floor is raised.
    """
    if max(dx, dy) > LONG * min(dx, dy):
        return Grids(0)
    pairs = pairs_for(dx, dy)
    if reach == math.inf:
        return Grids(None, pairs)
    sizes = max(math.log2(reach / max(dx, dy)), -10.0)
    return Grids(abs(pairs) + max(round(sizes), 2), pairs, max(2.0 ** (FADING * (1.5 - sizes)), 1.0))


class ExtendedPreconditioner:
    """K on a set with the extension E. It holds two maps in single precision on each grid of larger cells.

    `known` is `w/(w + f)` of each cell; for points it is the set.
    """

    def __init__(self, slab: Slab, floor: float = FLOOR, larger: Grids = ALL) -> None:
        """Use the grids `larger` with this floor."""
        most, pairs, last = larger
        down, across = max(pairs, 0), max(-pairs, 0)
        self._levels = cell_levels(slab, pairs)[:most]
        grids = [level.coarse for level in self._levels]
        self._floors = [
            (np.float32(floor) * lengths(slab.ny, level - down)[grid.rows], lengths(slab.nx, level - across))
            for level, grid in enumerate(grids, 1)
        ]
        if self._floors and last > 1.0:
            rows, columns = self._floors[-1]
            self._floors[-1] = np.float32(last) * rows, columns
        self._known, self._cells = ([grid.empty(np.float32) for grid in grids] for _ in range(2))

    def apply(self, preconditioner: Operator, working: NDArray[Any], r: Array) -> None:
        """Replace the residual r, which is 0 outside the set, by z; z is valid on the set only. Collective."""
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
    """Return the number of points of each cell along one direction; the last cell may have fewer."""
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
