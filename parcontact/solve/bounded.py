"""Contact with a counterbody that yields where the pressure reaches its hardness H [unit of p].

    0 <= p <= H,   g >= 0 where p < H,   g <= 0 where p > 0.

Where p = H the rigid surface yields by -g. Each solve starts from the full heights: earlier yielding is not
remembered (A. Almqvist, F. Sahlin, R. Larsson, S. Glavatskih, Tribol. Int. 40 (2007) 574). The mean pressure must be
below H. Points with `0 < p < H` are free: they determine the approach, and they are scaled to the load.
"""

from dataclasses import dataclass

import numpy as np

from ..compiled import loop
from ..parallel.slab import Array, Slab
from . import kernels
from .constraint import Cells, Mask, Set

MAX_PASSES = 20  # accuracy: largest number of passes that scale pressures to the load; 2 or 3 are usual
LOAD_ROUNDING = 1e-14  # accuracy: tolerance on the load, as a share of it, set by rounding
SNAP = 1e-12  # accuracy: pressures within this share of H of a bound are put on the bound


@dataclass(frozen=True)
class Bounded:
    """Constraint `0 <= p <= highest` [unit of p]."""

    highest: float

    @property
    def bounds(self) -> tuple[float, float]:
        return 0.0, self.highest

    def touches(self, p: Array) -> Mask:
        """Return p: the surfaces touch where there is pressure, also at points that have yielded."""
        return p

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        load, work, gaps, squares = kernels.pressure_sums(p, u, h, d)
        return load, work, gaps, squares, *_sum_free(p, u, h, d, self.highest)

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """Mark points that are free, that penetrate below H, or that have yielded although the gap is open."""
        found: tuple[float, ...] = _mark_working_set(p, u, h, d, self.highest, working)
        return found

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        load, cut = _advance(p_old, t, step, p, self.highest, cells, sums)
        return float(load), float(cut)

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        """Scale free pressures of each cell, at most to H, and then all to the load."""
        _scale_cells(p, self.highest, cells, kept)
        self.rescale_to_load(slab, p, load, total)

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        """Scale free pressures. If these cannot carry the load, mix all pressures with 0 or with H."""
        factor = 1.0
        for _ in range(MAX_PASSES):
            free, held = slab.sum(*_scale_free(p, factor, self.highest))
            if abs(free + held - total) <= max(LOAD_ROUNDING * total, SNAP * self.highest):
                return
            if free <= 0.0 or held >= total:
                break
            factor = (total - held) / free
        if free + held > total:
            p *= total / (free + held)
        else:
            share = (total - free - held) / (self.highest * slab.points - free - held)
            p += share * (self.highest - p)

    def clip(self, p: Array) -> float:
        np.clip(p, 0.0, self.highest, out=p)
        return float(kernels.sum_of(p))

    def next_set(self, x: Array, gap: Array, working: Set) -> Set:
        """Return free points of the set, and other points that penetrate below H or have yielded under an open gap."""
        return np.where(working, (x > 0.0) & (x < self.highest), np.where(x < self.highest, gap < 0.0, gap > 0.0))


@loop
def _sum_free(p, u, h, d, highest):
    """Sums of p and p g over free points."""
    load, gaps = 0.0, 0.0
    for j in range(p.shape[0]):
        row_load, row_gaps = 0.0, 0.0
        for i in range(p.shape[1]):
            free = p[j, i] if p[j, i] < highest else 0.0
            row_load += free
            row_gaps += free * (u[j, i] - h[j, i] - d)
        load += row_load
        gaps += row_gaps
    return load, gaps


@loop
def _mark_working_set(p, u, h, d, highest, working):
    """Mark the working set. Return the sum of p |g| except where points yield with g <= 0; the number of points of the
    set and their sum of g; the number of points that yield with g <= 0; and the largest -g of points below H."""
    wrong, count, gaps, held = 0.0, 0.0, 0.0, 0.0
    lowest, deepest = np.empty(p.shape[1]), -np.inf
    for i in range(lowest.size):
        lowest[i] = np.inf
    for j in range(p.shape[0]):
        row_wrong, row_count, row_gaps, row_held = 0.0, 0.0, 0.0, 0.0
        for i in range(p.shape[1]):
            gap = u[j, i] - h[j, i] - d
            yields = p[j, i] >= highest
            stays = yields & (gap <= 0.0)
            inside = ((p[j, i] > 0.0) | (gap < 0.0)) & ~stays
            working[j, i] = inside
            weight = 1.0 if inside else 0.0
            row_wrong += 0.0 if stays else p[j, i] * abs(gap)
            row_count += weight
            row_gaps += weight * gap
            row_held += 1.0 if stays else 0.0
            lowest[i] = min(lowest[i], np.inf if yields else gap)
        wrong += row_wrong
        count += row_count
        gaps += row_gaps
        held += row_held
    for i in range(lowest.size):
        deepest = max(deepest, -lowest[i])
    return wrong, count, gaps, held, deepest


@loop
def _advance(p_old, t, step, p, highest, cells, sums):
    """Put `p_old - step t`, limited to 0..H, into p; put the sums of free p over cells into the first half of `sums`,
    and those of the limited minus the unlimited values into the second. Return the sum of p and of the magnitude of
    this difference."""
    columns = sums.shape[1] // 2
    load, cut = 0.0, 0.0
    sums[:] = 0.0
    for j in range(p.shape[0]):
        row = sums[(j + cells.above) // cells.rows]
        row_load, row_cut = 0.0, 0.0
        for i in range(p.shape[1]):
            value = p_old[j, i] - step * t[j, i]
            kept = min(max(value, 0.0), highest) if value == value else value
            p[j, i] = kept
            row[i // cells.columns] += kept if kept < highest else 0.0
            row[columns + i // cells.columns] += kept - value
            row_load += kept
            row_cut += abs(kept - value)
        load += row_load
        cut += row_cut
    return load, cut


@loop
def _scale_cells(p, highest, cells, factors):
    """Scale each free pressure by the factor of its cell, up to H."""
    for j in range(p.shape[0]):
        row = factors[(j + cells.above) // cells.rows]
        for i in range(p.shape[1]):
            p[j, i] = min(p[j, i] * row[i // cells.columns], highest) if p[j, i] < highest else p[j, i]


@loop
def _scale_free(p, factor, highest):
    """Scale each free pressure, at most to H. Return the sums of free pressures and of those at H."""
    free, held = 0.0, 0.0
    for j in range(p.shape[0]):
        row_free, row_held = 0.0, 0.0
        for i in range(p.shape[1]):
            value = p[j, i] * factor if p[j, i] < highest else p[j, i]
            value = highest if value > (1.0 - SNAP) * highest else value
            value = 0.0 if value < SNAP * highest else value
            p[j, i] = value
            yields = value >= highest
            row_free += 0.0 if yields else value
            row_held += value if yields else 0.0
        free += row_free
        held += row_held
    return free, held
