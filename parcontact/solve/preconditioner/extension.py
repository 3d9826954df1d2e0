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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel.slab import Array, Slab
from ..problem import Operator
from .levels import cell_levels, interpolate, interpolate_back

FLOOR = 0.3  # tuning: of the points of a cell: so many count as having the value of the larger cell
LONG = 16.0  # tuning: times its width: with points further apart along one direction, square cells are worse than none
FADING = 2.7  # tuning: power of the reach of a layer with which the floor of cells longer than that grows
Maps = list[NDArray[Any]]  # of points, and of cells on each larger grid


class Grids(NamedTuple):
    """Grids of larger cells: how many at most, None for all that there are, of which the first are of so many `pairs`
    (`levels`); the floor of the `last` one over that of the others."""

    most: int | None = None
    pairs: int = 0
    last: float = 1.0


ALL = Grids()


def pairs_for(dx: float, dy: float) -> int:
    """Return how often points at distances dx and dy have to be joined to pairs along x until cells are about square,
    below 0 along y; 0 where they are too far from square."""
    if max(dx, dy) > LONG * min(dx, dy):
        return 0
    return round(math.log2(dy / dx))


def grids_for(dx: float, dy: float, reach: float = math.inf) -> Grids:
    """Return the grids of larger cells to use with distances dx and dy of points.

    Where points are nearer along one direction, pairs along it are made first, until cells are about square: a step of
    a slide takes as many iterations as on squares then, and up to a half more without. Points further apart than the
    `reach` do not act on each other: no square cell is longer than about that. There are two sizes of these at least;
    if the larger one is longer than the reach, it counts for less, as its floor is higher.
    """
    if max(dx, dy) > LONG * min(dx, dy):
        return Grids(0)
    pairs = pairs_for(dx, dy)
    if reach == math.inf:
        return Grids(None, pairs)
    sizes = max(math.log2(reach / max(dx, dy)), -10.0)
    return Grids(abs(pairs) + max(round(sizes), 2), pairs, max(2.0 ** (FADING * (1.5 - sizes)), 1.0))


class ExtendedPreconditioner:
    """K on a set, extended as above; two maps in single precision on each grid of larger cells.

    `known` is `w/(w + f)` of each cell, for points the set itself.
    """

    def __init__(self, slab: Slab, floor: float = FLOOR, larger: Grids = ALL) -> None:
        """With another floor, or other grids of `larger` cells than all."""
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
        """Put z in the place of the residual r, which is 0 outside the set; only on the set does z mean something.
        Collective."""
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
    """How many points there are of each cell along one direction: fewer in the last one."""
    length = 1 << max(level, 0)
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
