"""Admissible pressures and their conditions of contact.

`Constraint` is the interface that the solvers use; it alone decides where surfaces touch. `NonNegative` is contact
without adhesion; `bounded` adds a hardness.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.slab import Array, Slab
from . import kernels

CELL = 16  # tuning: side of a cell of `LocalLoad` [points]
Set = NDArray[np.bool_]
Mask = NDArray[Any]  # a map that is not 0 at the selected points


class Cells(NamedTuple):
    """Cells of `LocalLoad` on a rank: each has `rows` x `columns` points, and `above` rows of the first one belong to
    another rank."""

    rows: int
    above: int
    columns: int


class Constraint(Protocol):
    """Admissible pressures p and the conditions on the gap `g = u - h - d`. Maps have the shape (rows of this rank,
    nx).

    Methods return partial sums over the rows of this rank. Those with a parameter `slab` are collective.
    """

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest admissible pressure [unit of p]."""

    def touches(self, p: Array) -> Mask:
        """Return a map that is not 0 where the surfaces touch under an admissible pressure; it may be p itself."""

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        """Return the sums of p, p u, p g and p u^2, and those of p and p g over points whose pressure is between the
        bounds."""

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """Mark the working set: points between the bounds, and points at a bound that violate its condition.

        Return the sum of p times the violation of g; the number of points of the set and their sum of g; the number
        of points held at a pressure; and the largest penetration that is not admissible.
        """

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        """Put `p_old - step t`, limited to the bounds, into p, which may be `p_old`. Put into `sums`, cell by cell, the
        sums of free p, followed by those of the pressure that limiting has added (`LocalLoad`). Return the sum of p
        and of the added pressure."""

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        """Multiply p in each cell by the share `kept`, which changes its sum from `load`, and scale it to the sum
        `total`."""

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        """Scale an admissible p from the sum `load`, not 0, to the sum `total`; p may be at its lower bound
        everywhere."""

    def clip(self, p: Array) -> float:
        """Limit p to the bounds. Return its sum."""

    def next_set(self, x: Array, gap: Array, working: Set) -> Set:
        """Return points of the set whose x is admissible, and other points whose gap violates its condition."""


class NonNegative:
    """Hard contact without adhesion: `p >= 0`, `g >= 0`, `p g = 0`."""

    bounds = (0.0, np.inf)

    def touches(self, p: Array) -> Mask:
        """Return p: the surfaces touch where there is pressure."""
        return p

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        load, work, gaps, squares = kernels.pressure_sums(p, u, h, d)
        return load, work, gaps, squares, load, gaps

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """Mark points with pressure and points that penetrate."""
        wrong, count, gaps, deepest = mark_working_set(p, u, h, d, working)
        return wrong, count, gaps, 0.0, deepest

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        advance(p_old, t, step, p, cells, sums)
        columns = sums.shape[1] // 2
        return float(sums[:, :columns].sum()), float(sums[:, columns:].sum())

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        scale_cells(p, cells, total / load * kept)

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        p *= total / load

    def clip(self, p: Array) -> float:
        return float(clip(p))

    def next_set(self, x: Array, gap: Array, working: Set) -> Set:
        return np.where(working, x > 0.0, gap < 0.0)


@loop
def mark_working_set(p, u, h, d, working):
    """Mark points with pressure or penetration. Return, with `g = u - h - d`, the sum of p |g|, the number of marked
    points, their sum of g, and max(-g).

    The lowest gap is kept for each column: a single running minimum would not be vectorized.
    """
    wrong, count, gaps = 0.0, 0.0, 0.0
    lowest, deepest = np.empty(p.shape[1]), -np.inf
    for i in range(lowest.size):
        lowest[i] = np.inf
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
    for i in range(lowest.size):
        deepest = max(deepest, -lowest[i])
    return wrong, count, gaps, deepest


@loop
def advance(p_old, t, step, p, cells, sums):
    """Put `max(p_old - step t, 0)` into p; put the sums of p over cells into the first half of `sums`, and those of
    what was added into the second. Rows of a cell are added up first, so that the loop is vectorized."""
    columns = sums.shape[1] // 2
    load, cut = np.empty(p.shape[1]), np.empty(p.shape[1])
    for j in range(sums.shape[0]):
        for i in range(sums.shape[1]):
            sums[j, i] = 0.0
    for i in range(p.shape[1]):
        load[i] = cut[i] = 0.0
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
                load[i] = cut[i] = 0.0


@loop
def scale_cells(p, cells, factors):
    """Multiply each pressure by the factor of its cell."""
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
    """Put `max(p, 0)` into p. Return its sum."""
    load = 0.0
    for j in range(p.shape[0]):
        row = 0.0
        for i in range(p.shape[1]):
            kept = 0.0 if p[j, i] < 0.0 else p[j, i]
            p[j, i] = kept
            row += kept
        load += row
    return load
