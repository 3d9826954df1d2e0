"""The load that cutting off pressures at their bounds adds, taken back near by.

A step makes pressures at the edges of contact negative, and 0 in their place adds load there. If all pressures were
scaled by one factor to take it back, every spot would be lifted or lowered by its share of waves as long as the box: by
much more, on a large grid, than the gaps are beside an edge, so that points penetrate along all edges, enter, and are
cut off again. So each cell of CELL x CELL points gives back what was added in it, which changes the displacement near
by only. From a cold start on 4096 x 4096 points that makes 22 of 57 applications of the operator. Where points are
nearer along one direction, cells have fewer points along the other and are about square: in longer ones spots give back
what others added, and projected steps towards a steady state may cycle.
"""

from itertools import pairwise

import numpy as np

from ..parallel.regrid import fetch
from ..parallel.slab import Array, Slab
from .constraint import CELL, Cells, Constraint

LEAST_CUT = 3e-4  # tuning, of the load: less disturbs no long wave, and is better taken from all points alike
LEAST = 4  # tuning: points along a side of a cell; with fewer, as on cells of 16 : 1, contacts may cycle
MOST_GIVEN_BACK = 0.5  # tuning, of the load of a cell: more is not taken from it


class LocalLoad:
    """Cells of one grid, the same on any number of ranks; it holds no maps."""

    def __init__(self, slab: Slab, pairs: int = 0) -> None:
        """On a grid where so many `pairs` make square cells (`preconditioner.levels`)."""
        self._slab = slab
        if slab.only_counts:
            return
        rows, columns = (max(CELL >> max(count, 0), LEAST) for count in (pairs, -pairs))
        touched = [_rows_of_cells(part, rows) for part in slab.dealt]
        rank, width = slab.comm.rank, -(-slab.nx // columns)
        ends = np.cumsum([0] + [part.stop - part.start for part in touched]).tolist()
        stacked = [slice(start, stop) for start, stop in pairwise(ends)]
        self._stack = Slab(slab.comm, 2 * width, ends[-1], slab.tally, stacked.__getitem__)
        numbers = np.concatenate([np.arange(part.start, part.stop) for part in touched])
        self._wanted = [slice(*np.searchsorted(numbers, [part.start, part.stop]).tolist()) for part in touched]
        own = np.arange(touched[rank].start, touched[rank].stop)
        self._starts = np.searchsorted(numbers[self._wanted[rank]], own)
        self._cells = Cells(rows, slab.rows.start % rows, columns)
        self._sums = np.zeros(self._stack.shape)

    def advance(self, constraint: Constraint, p_old: Array, t: Array, step: float, p: Array) -> tuple[float, float]:
        """`p = p_old - step t`, cut off at the bounds, which may be in the place of the old one; returns the sum of p
        and how much was cut off; collective."""
        load, cut = self._slab.sum(*constraint.advance(p_old, t, step, p, self._cells, self._sums))
        return load, cut

    def restore(self, constraint: Constraint, p: Array, load: float, total: float, near_by: bool) -> None:
        """Make `total` the sum of p, which is `load` since it was advanced: what was added is first taken back
        `near_by`, from the pressure of the same cell, but at most MOST_GIVEN_BACK of it; collective."""
        loads = np.split(self._sums, 2, axis=1)[0]
        shares = np.zeros_like(loads)
        if near_by:
            shares = _shares(self._complete(self._sums))
            load -= self._slab.sum(float(np.sum(shares * loads)))[0]
        constraint.restore(self._slab, p, load, total, 1.0 - shares, self._cells)

    def _complete(self, own: Array) -> Array:
        """The sums over whole cells, of those that this rank has points of."""
        parts = fetch(self._stack, own, self._wanted)
        return np.add.reduceat(parts, self._starts, axis=0) if len(parts) else parts


def _rows_of_cells(part: slice, rows: int) -> slice:
    """The rows of cells, of so many rows of points, that some rows of points belong to."""
    start = part.start // rows
    return slice(start, max(-(-part.stop // rows), start) if part.stop > part.start else start)


def _shares(sums: Array) -> Array:
    """The share of its load that each cell gives back, from the loads and the cuts."""
    loads, cuts = np.split(sums, 2, axis=1)
    return np.clip(
        np.divide(cuts, loads, out=np.zeros_like(loads), where=loads > 0.0), -MOST_GIVEN_BACK, MOST_GIVEN_BACK
    )
