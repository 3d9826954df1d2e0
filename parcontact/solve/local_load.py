"""Negative pressures cut off at 0, and the load that this adds taken back near by.

A step makes pressures at the edges of contact negative, and 0 in their place adds load there. If all pressures were
scaled by one factor to take it back, every spot would be lifted or lowered by its share of waves as long as the box: by
much more, on a large grid, than the gaps are beside an edge, so that points penetrate along all edges, enter, and are
cut off again. So each cell of CELL x CELL points gives back what was added in it, which changes the displacement near
by only. From a cold start on 4096 x 4096 points that makes 22 of 57 applications of the operator.
"""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.regrid import fetch
from ..parallel.slab import Array, Slab

CELL = 16  # points along each side of a cell; 8 and 32 need a few iterations more
LEAST = 3e-4  # of the load: if less is cut off, that disturbs no long wave, and is better taken from all points alike
MOST = 0.5  # of the load of a cell: more is not taken from it


class LocalLoad:
    """Cells of one grid, the same on any number of ranks; it holds no maps."""

    def __init__(self, slab: Slab) -> None:
        self._slab = slab
        touched = [_rows_of_cells(part) for part in slab.dealt]
        rank, width = slab.comm.rank, -(-slab.nx // CELL)
        ends = np.cumsum([0] + [part.stop - part.start for part in touched]).tolist()
        stacked = [slice(start, stop) for start, stop in pairwise(ends)]
        self._stack = Slab(slab.comm, 2 * width, ends[-1], slab.tally, stacked)
        numbers = np.concatenate([np.arange(part.start, part.stop) for part in touched])
        self._wanted = [slice(*np.searchsorted(numbers, [part.start, part.stop]).tolist()) for part in touched]
        own = np.arange(touched[rank].start, touched[rank].stop)
        self._starts = np.searchsorted(numbers[self._wanted[rank]], own)

    def cut_off(self, p: Array, load: float | None = None) -> float:
        """Put 0 in the place of negative pressures, and take what that adds from the pressure of the same cell, but
        at most MOST of it, unless it is less than LEAST of all; returns the sum of p. Collective.

        `load` is the sum of what is positive, if that is known, and that more than LEAST will be added.
        """
        above = self._slab.rows.start % CELL
        own = np.zeros(self._stack.shape)
        _cut_off(p, above, own)
        loads, cuts = np.split(own, 2, axis=1)
        if load is None:
            load, cut = self._slab.sum(float(loads.sum()), float(cuts.sum()))
            if not cut > LEAST * load:
                return load
        shares = _shares(self._complete(own))
        _take(p, above, shares)
        return load - self._slab.sum(float(np.sum(shares * loads)))[0]

    def _complete(self, own: Array) -> Array:
        """The sums over whole cells, of those that this rank has points of."""
        parts = fetch(self._stack, own, self._wanted)
        return np.add.reduceat(parts, self._starts, axis=0) if len(parts) else parts


def _rows_of_cells(part: slice) -> slice:
    """The rows of cells that some rows of points belong to."""
    start = part.start // CELL
    return slice(start, max(-(-part.stop // CELL), start) if part.stop > part.start else start)


def _shares(sums: Array) -> Array:
    """What share of its load each cell gives back, from the loads and the cuts."""
    loads, cuts = np.split(sums, 2, axis=1)
    return np.minimum(np.divide(cuts, loads, out=np.zeros_like(loads), where=loads > 0.0), MOST)


@loop
def _cut_off(p: NDArray[Any], above: int, sums: Array) -> None:
    """`p <- max(p, 0)`; the sums over cells of p, and beside them of what was added."""
    columns = sums.shape[1] // 2
    for j in range(p.shape[0]):
        row = sums[(j + above) // CELL]
        for k in range(columns):
            load, cut = 0.0, 0.0
            for i in range(k * CELL, min((k + 1) * CELL, p.shape[1])):
                value = p[j, i]
                kept = 0.0 if value < 0.0 else value
                p[j, i] = kept
                load += kept
                cut += kept - value
            row[k] += load
            row[columns + k] += cut


@loop
def _take(p: NDArray[Any], above: int, shares: Array) -> None:
    """Take the share of its cell from each pressure."""
    for j in range(p.shape[0]):
        row = shares[(j + above) // CELL]
        for k in range(row.size):
            if row[k] > 0.0:
                factor = 1.0 - row[k]
                for i in range(k * CELL, min((k + 1) * CELL, p.shape[1])):
                    p[j, i] *= factor
