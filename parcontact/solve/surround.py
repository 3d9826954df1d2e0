"""A residual carried on beyond the set of points it is known on, and what it causes there brought back.

A preconditioner K, the inverse of A without a contact set, makes of a residual r on a set c the correction `R K R r`
(R: values on c). That takes r as 0 outside c, where it really goes on: the correction that is wanted moves the surface
outside c, too. With S the sum over a square of cells around a point, points outside c take

    e = S r/(S 1_c + FLOOR)

from those in c near by, which is 0 far away; and the transpose brings pressure that K puts outside c back into c. With
E for the extension, `R E' K E R` is symmetric and positive, as K is. Of the iterations of a contact solve a third is
saved.

Sums over squares are made of sums over pieces of columns, which are carried from row to row. One map has the values on
c and those outside: one kind is read while the other is written.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.regrid import fetch
from ..parallel.slab import Array, Slab
from .operator import Operator

REACH = 4  # cells to each side
SIDE = 2 * REACH + 1
FLOOR = 0.1 * SIDE * SIDE  # so many cells of a square count as residual 0
BLOCK = 256  # points of a row that are left out together where there is nothing to do


class Surround:
    """K on a set, extended as above; a buffer of a byte per point."""

    def __init__(self, slab: Slab, preconditioner: Operator) -> None:
        self.slab, self.preconditioner = slab, preconditioner
        self._counts = slab.empty(np.uint8)
        self._above = [slice(max(part.start - REACH, 0), part.start) for part in slab.dealt]
        self._below = [slice(part.stop, min(part.stop + REACH, slab.ny)) for part in slab.dealt]

    @staticmethod
    def footprint(cells: int) -> int:
        """Bytes that it holds for so many points of this rank."""
        return cells

    def apply(self, working: NDArray[Any], r: Array) -> None:
        """Put z in the place of the residual r, which is 0 outside the set; only on the set does z mean something.
        Collective."""
        sets = self._beside(working)
        _extend(*sets, *self._beside(r), self._counts)
        self.preconditioner.apply(r, r)
        _bring_back(*sets, *self._beside(r), *self._beside(self._counts))

    def _beside(self, field: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """The rows above those of this rank, these, and the rows below."""
        return fetch(self.slab, field, self._above), field, fetch(self.slab, field, self._below)


@loop
def _extend(set_above, working, set_below, r_above, r, r_below, counts):
    """Put e outside the set, and how many points of the set each square has into `counts`."""
    nx = r.shape[1]
    sums, points = np.zeros(nx + 2 * REACH), np.zeros(nx + 2 * REACH, np.uint8)
    for j in range(-2 * REACH, r.shape[0]):
        for sign, k in ((1, j + REACH), (-1, j - REACH - 1)):
            inside, there = _row(set_above, working, set_below, k)
            values, _ = _row(r_above, r, r_below, k)
            for i in range(0, nx if there else 0, BLOCK):
                here, around = slice(i, min(i + BLOCK, nx)), slice(i + REACH, min(i + BLOCK, nx) + REACH)
                if _any(inside[here]):
                    _count(inside[here], sign, points[around])
                    _sum_inside(inside[here], values[here], sign, sums[around])
        for i in range(0, nx if j >= 0 else 0, BLOCK):
            here, around = slice(i, min(i + BLOCK, nx)), slice(i, min(i + BLOCK, nx) + 2 * REACH)
            _count_across(points[around], counts[j, here])
            if _any(counts[j, here]):
                _put_outside(working[j, here], sums[around], counts[j, here], r[j, here])


@loop
def _bring_back(set_above, working, set_below, z_above, z, z_below, counts_above, counts, counts_below):
    """Add to z on the set what the transpose of the extension makes of z outside it."""
    nx = z.shape[1]
    sums = np.zeros(nx + 2 * REACH)
    for j in range(-2 * REACH, z.shape[0]):
        for sign, k in ((1, j + REACH), (-1, j - REACH - 1)):
            inside, there = _row(set_above, working, set_below, k)
            values, _ = _row(z_above, z, z_below, k)
            points, _ = _row(counts_above, counts, counts_below, k)
            for i in range(0, nx if there else 0, BLOCK):
                here, around = slice(i, min(i + BLOCK, nx)), slice(i + REACH, min(i + BLOCK, nx) + REACH)
                if _any(points[here]):
                    _sum_outside(inside[here], values[here], points[here], sign, sums[around])
        for i in range(0, nx if j >= 0 else 0, BLOCK):
            here, around = slice(i, min(i + BLOCK, nx)), slice(i, min(i + BLOCK, nx) + 2 * REACH)
            if _any(working[j, here]):
                _add_inside(working[j, here], sums[around], z[j, here])


@loop
def _row(above, own, below, j):
    """Row j of maps one below the other, counted from the first of `own`; and whether there is one."""
    if j < -above.shape[0] or j >= own.shape[0] + below.shape[0]:
        return own[:1].ravel(), False
    if j < 0:
        return above[j + above.shape[0]], True
    return (own[j], True) if j < own.shape[0] else (below[j - own.shape[0]], True)


# -- parts of a row; sums over columns have REACH entries more at each end ---------------------------------------------


@loop
def _any(flags):
    """Whether one is not 0."""
    found = np.uint8(0)
    for i in range(flags.size):
        found |= np.uint8(flags[i])
    return found != 0


@loop
def _count(inside, sign, points):
    for i in range(inside.size):
        points[i] += np.uint8(sign) * np.uint8(inside[i])


@loop
def _sum_inside(inside, values, sign, sums):
    for i in range(inside.size):
        sums[i] += sign * values[i] if inside[i] else 0.0


@loop
def _sum_outside(inside, values, counts, sign, sums):
    for i in range(inside.size):
        sums[i] += 0.0 if inside[i] else sign * values[i] / (counts[i] + FLOOR)


@loop
def _count_across(points, counts):
    for i in range(counts.size):
        count = np.uint8(0)
        for k in range(SIDE):
            count += points[i + k]
        counts[i] = count


@loop
def _put_outside(inside, sums, counts, r):
    for i in range(r.size):
        total = 0.0
        for k in range(SIDE):
            total += sums[i + k]
        r[i] = r[i] if inside[i] else total / (counts[i] + FLOOR)


@loop
def _add_inside(inside, sums, z):
    for i in range(z.size):
        total = 0.0
        for k in range(SIDE):
            total += sums[i + k]
        z[i] += total if inside[i] else 0.0
