"""Admissible pressures, and the conditions of contact that go with them.

`Constraint` is all that the solvers ask, and all that the program knows of where surfaces touch. `NonNegative` is
contact without adhesion. Another law is another class with these methods (`bounded`).
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.slab import Array, Slab
from . import kernels

CELL = 16  # tuning: points along a side of a cell of `LocalLoad`; 8 and 32 need a few iterations more
Set = NDArray[np.bool_]
Mask = NDArray[Any]  # a map that is not 0 at the points that are meant


class Cells(NamedTuple):
    """Cells of `LocalLoad` on a rank: the `rows` and `columns` of points of each, and how many rows of the first one
    another rank `above` has."""

    rows: int
    above: int
    columns: int


class Constraint(Protocol):
    """Admissible pressures p, and the conditions on the gap `g = u - h - d` beneath them.

    Methods work on this rank's rows and return its partial sums, but for those with a `slab`, which are collective.
    """

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest admissible pressure."""

    def touches(self, p: Array) -> Mask:
        """Return where the surfaces touch under an admissible pressure: a map that is not 0 there, which may be p."""

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        """Sums of p, p u, p g and p u^2; and of p and p g over the points that are free to move."""

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """Mark the working set: points that are free to move, or are not where they should be. Returns the sum of p
        times what is wrong with g, the number of these points and their sum of g, the number of points that are held
        under pressure, and the deepest penetration that is not allowed."""

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        """`p = p_old - step t`, cut off at the bounds, which may be in the place of the old one; sums over cells of
        free p, and beside them of what cutting off added (`LocalLoad`). Returns the sum of p, and how much was cut."""

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        """Scale p in each cell by its share that is `kept`, which makes its sum `load`, and then to the sum `total`."""

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        """Make `total` the sum of an admissible p, which is `load`, not 0; p may be at its lower bound everywhere."""

    def clip(self, p: Array) -> float:
        """Cut p off at the bounds; returns its sum."""

    def next_set(self, x: Array, gap: Array, working: Set) -> Set:
        """Points of a set where x is admissible, and others whose gap is not."""


class NonNegative:
    """`p >= 0`, `g >= 0`, `p g = 0`: surfaces that do not stick, and neither of which yields."""

    bounds = (0.0, np.inf)

    def touches(self, p: Array) -> Mask:
        """The surfaces touch where there is a pressure."""
        return p

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        load, work, gaps, squares = kernels.pressure_sums(p, u, h, d)
        return load, work, gaps, squares, load, gaps

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """The working set is the contact, and the points that penetrate."""
        wrong, count, gaps, deepest = mark_working_set(p, u, h, d, working)
        return wrong, count, gaps, 0.0, deepest

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        advance(p_old, t, step, p, cells, sums)
        loads, cuts = np.split(sums, 2, axis=1)
        return float(loads.sum()), float(cuts.sum())

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        scale_cells(p, cells, total / load * kept)

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        p *= total / load

    def clip(self, p: Array) -> float:
        return float(clip(p))

    def next_set(self, x: Array, gap: Array, working: Set) -> Set:
        return np.where(working, x > 0.0, gap < 0.0)

    def choose_active(self, x: Array, u: Array, h: Array, d: float, kappa: float, working: Set) -> tuple[float, ...]:
        """Mark the next set of a method whose x is admissible only in the end: points with `x > kappa g`. Returns the
        sums of x > 0, of -x < 0, of |x g|, the number of these points, how many others there are than before, and
        max(-g)."""
        found: tuple[float, ...] = choose(x, u, h, d, kappa, working)
        return found


@loop
def mark_working_set(p, u, h, d, working):
    """Mark the working set: pressure, or penetration. With the gap `g = u - h - d`: sum of p |g|, over the working set
    the count and the sum of g, and max(-g).

    The lowest gap is kept for each column: that is as fast as a sum, which a single running minimum is not.
    """
    wrong, count, gaps = 0.0, 0.0, 0.0
    lowest = np.full(p.shape[1], np.inf)
    for j in range(p.shape[0]):
        row_wrong, row_count, row_gaps = 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            gap = u[j, i] - h[j, i] - d
            inside = (p[j, i] > 0.0) | (gap < 0.0)
            working[j, i] = inside
            weight = 1.0 if inside else 0.0
            row_wrong += p[j, i] * abs(gap)
            row_count += weight
            row_gaps += weight * gap
            lowest[i] = min(lowest[i], gap)
        wrong += row_wrong
        count += row_count
        gaps += row_gaps
    return wrong, count, gaps, -lowest.min()


@loop
def advance(p_old, t, step, p, cells, sums):
    """`p = max(p_old - step t, 0)`; the sums over cells of p, and beside them of what was added.

    Rows of a cell are added up first, which is as fast as no sums at all.
    """
    columns = sums.shape[1] // 2
    load, cut = np.zeros(p.shape[1]), np.zeros(p.shape[1])
    sums[:] = 0.0
    for j in range(p.shape[0]):
        for i in range(p.shape[1]):
            value = p_old[j, i] - step * t[j, i]
            kept = 0.0 if value < 0.0 else value
            p[j, i] = kept
            load[i] += kept
            cut[i] += kept - value
        if (j + cells.above + 1) % cells.rows == 0 or j + 1 == p.shape[0]:
            row = sums[(j + cells.above) // cells.rows]
            for i in range(p.shape[1]):
                row[i // cells.columns] += load[i]
                row[columns + i // cells.columns] += cut[i]
            load[:] = 0.0
            cut[:] = 0.0


@loop
def scale_cells(p, cells, factors):
    """Scale each pressure by the factor of its cell."""
    line = np.empty(p.shape[1])
    for j in range(p.shape[0]):
        if j == 0 or (j + cells.above) % cells.rows == 0:
            row = factors[(j + cells.above) // cells.rows]
            for i in range(line.size):
                line[i] = row[i // cells.columns]
        for i in range(p.shape[1]):
            p[j, i] *= line[i]


@loop
def clip(p):
    """`p <- max(p, 0)`; returns the sum of p."""
    load = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            kept = 0.0 if p[j, i] < 0.0 else p[j, i]
            p[j, i] = kept
            row += kept
        load += row
    return load


@loop
def choose(x, u, h, d, kappa, working):
    """Mark points with `x > kappa g`; sums of x > 0, of -x < 0, of |x g|, of marked points and of those that
    are others than before; and max(-g)."""
    positive, negative, wrong, count, changed, deepest = 0.0, 0.0, 0.0, 0.0, 0.0, -np.inf
    for j in range(x.shape[0]):
        row_positive, row_negative, row_wrong = 0.0, 0.0, 0.0
        row_count, row_changed, row_deepest = 0.0, 0.0, -np.inf
        for i in range(x.shape[1]):
            gap = u[j, i] - h[j, i] - d
            inside = x[j, i] > kappa * gap
            row_changed += 1.0 if inside != working[j, i] else 0.0
            working[j, i] = inside
            row_positive += max(x[j, i], 0.0)
            row_negative += max(-x[j, i], 0.0)
            row_wrong += abs(x[j, i] * gap)
            row_count += 1.0 if inside else 0.0
            row_deepest = max(row_deepest, -gap)
        positive += row_positive
        negative += row_negative
        wrong += row_wrong
        count += row_count
        changed += row_changed
        deepest = max(deepest, row_deepest)
    return positive, negative, wrong, count, changed, deepest
