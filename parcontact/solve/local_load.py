"""Removal of the load that limiting pressures to their bounds adds, near the points where it was added.

A step makes pressures at edges of contact negative; putting them to 0 adds load. Scaling all pressures by one factor
would remove it, but waves as long as the box would move every spot by more than the gaps at its edge, and points
would penetrate again. So each cell of CELL x CELL points loses what was added in it, which changes the displacement
only near by. Where points are closer along one direction, cells have fewer points along the other, so that they are
about square: in long cells, one spot would lose what another has gained, and projected steps may cycle.
"""

from itertools import pairwise

import numpy as np

from ..parallel.rows import RowExchange
from ..parallel.slab import Array, Slab
from .constraint import CELL, Cells, Constraint

LEAST_CUT = 3e-4  # tuning: share of the load; less added load is removed by one factor for all points
LEAST = 4  # tuning: least side of a cell [points]; contacts may cycle with fewer
MOST_GIVEN_BACK = 0.5  # tuning: largest share of its load that a cell loses


class LocalLoad:
    """Cells of one grid, the same on any number of ranks. It holds no maps."""

    def __init__(self, slab: Slab, pairs: int = 0) -> None:
        """Make cells on a grid where `pairs` doublings make cells square (`preconditioner.levels`)."""
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
        wanted = np.searchsorted(numbers, [(part.start, part.stop) for part in touched])
        self._exchange = RowExchange.of_parts(self._stack, wanted)
        own = np.arange(touched[rank].start, touched[rank].stop)
        self._starts = np.searchsorted(numbers[slice(*wanted[rank].tolist())], own)
        self._cells = Cells(rows, slab.rows.start % rows, columns)
        self._sums = np.zeros(self._stack.shape)

    def advance(self, constraint: Constraint, p_old: Array, t: Array, step: float, p: Array) -> tuple[float, float]:
        """Put `p_old - step t`, limited to the bounds, into p, which may be `p_old`. Return the sum of p and of the
        added pressure; collective."""
        load, cut = self._slab.sum(*constraint.advance(p_old, t, step, p, self._cells, self._sums))
        return load, cut

    def restore(self, constraint: Constraint, p: Array, load: float, total: float, near_by: bool) -> None:
        """Scale p from the sum `load`, as `advance` returned it, to the sum `total`; collective. If `near_by`, each
        cell first loses what was added in it, at most MOST_GIVEN_BACK of its load."""
        loads, _ = _halves(self._sums)
        shares = np.zeros_like(loads)
        if near_by:
            shares = _shares(self._complete(self._sums))
            load -= self._slab.sum(float(np.sum(shares * loads)))[0]
        constraint.restore(self._slab, p, load, total, 1.0 - shares, self._cells)

    def _complete(self, own: Array) -> Array:
        """Return sums over whole cells, for cells with points on this rank."""
        parts = self._exchange.fetch(own)
        return np.add.reduceat(parts, self._starts, axis=0) if len(parts) else parts


def _rows_of_cells(part: slice, rows: int) -> slice:
    """Return the rows of cells that contain given rows of points, for cells of `rows` rows."""
    start = part.start // rows
    return slice(start, max(-(-part.stop // rows), start) if part.stop > part.start else start)


def _halves(sums: Array) -> tuple[Array, Array]:
    """Return the sums over cells of the load and of the added pressure."""
    columns = sums.shape[1] // 2
    return sums[:, :columns], sums[:, columns:]


def _shares(sums: Array) -> Array:
    """Return the share of its load that each cell loses, from its load and the added pressure."""
    loads, cuts = _halves(sums)
    return np.clip(
        np.divide(cuts, loads, out=np.zeros_like(loads), where=loads > 0.0), -MOST_GIVEN_BACK, MOST_GIVEN_BACK
    )
