"""A residual carried on beyond the set of points it is known on, and what it causes there brought back.

A preconditioner K, the inverse of A without a contact set, makes of a residual r on a set c the correction `R K r` (R:
values on c). That takes r as 0 outside c, where it really goes on: the correction that is wanted moves the surface
outside c, too. With S the mean over a square of cells around a point, points outside c take

    e = S r/(S 1_c + FLOOR)

from those in c near by, which is 0 far away; and the transpose brings pressure that K puts outside c back into c. On
the contact of rough surfaces the residual then falls by 0.65 per step instead of 0.78.
"""

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.regrid import fetch
from ..parallel.slab import Array, Slab
from .contact import Operator

REACH = 4  # cells to each side
FLOOR = 0.3  # as much of a square counts as residual 0


class Surround:
    """K on a set, extended as above; buffers of three maps."""

    def __init__(self, slab: Slab, preconditioner: Operator, dtype: type) -> None:
        self.slab, self.preconditioner = slab, preconditioner
        self.share, self.carried, self.means = (slab.empty(dtype) for _ in range(3))
        self._wanted = [_around(part, slab.ny) for part in slab.dealt]
        self._above = slab.rows.start - self._wanted[slab.comm.rank].start

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """z of the residual r, which is 0 outside the set; only on the set does it mean something. Collective."""
        self.carried[...] = working
        self._average(self.carried, self.share)
        self._average(r, self.means)
        _extend(working, r, self.means, self.share, self.carried)
        self.preconditioner.apply(self.carried, z)
        _outside(working, z, self.share, self.carried)
        self._average(self.carried, self.means)
        z += self.means

    def _average(self, field: Array, out: Array) -> None:
        side = 2 * REACH + 1
        scale = 1.0 / (min(side, self.slab.nx) * min(side, self.slab.ny))
        _means(fetch(self.slab, field, self._wanted), self._above, scale, out)


def _around(part: slice, ny: int) -> slice:
    """The rows that those of a part see; none for a rank without rows."""
    return slice(max(part.start - REACH, 0), min(part.stop + REACH, ny)) if part.start < part.stop else part


@loop
def _means(rows, above, scale, out):
    """Sums over squares, times `scale`; row `above` of `rows` is the first of `out`; beyond the box is nothing."""
    nx = rows.shape[1]
    for j in range(out.shape[0]):
        column = np.zeros(nx)
        for k in range(max(j + above - REACH, 0), min(j + above + REACH + 1, rows.shape[0])):
            for i in range(nx):
                column[i] += rows[k, i]
        total = column[: min(REACH, nx)].sum()
        for i in range(nx):
            if i + REACH < nx:
                total += column[i + REACH]
            if i > REACH:
                total -= column[i - REACH - 1]
            out[j, i] = total * scale


@loop
def _extend(working, r, means, share, carried):
    for j in range(r.shape[0]):
        for i in range(r.shape[1]):
            carried[j, i] = r[j, i] if working[j, i] else means[j, i] / (share[j, i] + FLOOR)


@loop
def _outside(working, z, share, carried):
    for j in range(z.shape[0]):
        for i in range(z.shape[1]):
            carried[j, i] = 0.0 if working[j, i] else z[j, i] / (share[j, i] + FLOOR)
