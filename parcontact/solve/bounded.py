"""Contact with a counterbody that yields where the pressure reaches its hardness.

With H the highest pressure that it bears, in the unit of p,

    0 <= p <= H,   g >= 0 where p < H,   g <= 0 where p > 0:

where p = H the rigid surface gives way, and the gap tells how far. Each solve starts from its full heights: it does not
remember where it gave way before (A. Almqvist, F. Sahlin, R. Larsson, S. Glavatskih, Tribol. Int. 40 (2007) 574). The
mean pressure must be below H. Points with `0 < p < H` are free: the approach follows from them, and they are scaled to
the load.
"""

from dataclasses import dataclass

import numpy as np

from ..compiled import loop
from ..parallel.slab import Array, Slab
from . import kernels
from .constraint import Cells, Mask, Set

MAX_PASSES = 20  # accuracy: of scaling to the load, of which each takes in those that reach H; 2 or 3 do as a rule
LOAD_ROUNDING = 1e-14  # accuracy: of the load, a smaller part of which cannot be told from none
SNAP = 1e-12  # accuracy: of H: pressures as near to H, or to 0, are H and 0, as they were for another modulus


@dataclass(frozen=True)
class Bounded:
    """Pressures from 0 to `highest`."""

    highest: float

    @property
    def bounds(self) -> tuple[float, float]:
        return 0.0, self.highest

    def touches(self, p: Array) -> Mask:
        """The surfaces touch where there is a pressure, also where one of them has yielded."""
        return p

    def contact_sums(self, p: Array, u: Array, h: Array, d: float) -> tuple[float, ...]:
        load, work, gaps, squares = kernels.pressure_sums(p, u, h, d)
        return load, work, gaps, squares, *_sum_free(p, u, h, d, self.highest)

    def mark_working_set(self, p: Array, u: Array, h: Array, d: float, working: Set) -> tuple[float, ...]:
        """Points work that are free, penetrate without having yielded, or have yielded under an open gap."""
        found: tuple[float, ...] = _mark_working_set(p, u, h, d, self.highest, working)
        return found

    def advance(self, p_old: Array, t: Array, step: float, p: Array, cells: Cells, sums: Array) -> tuple[float, float]:
        load, cut = _advance(p_old, t, step, p, self.highest, cells, sums)
        return float(load), float(cut)

    def restore(self, slab: Slab, p: Array, load: float, total: float, kept: Array, cells: Cells) -> None:
        """Free pressures give back load; those that reach H by it stay there."""
        _scale_cells(p, self.highest, cells, kept)
        self.rescale_to_load(slab, p, load, total)

    def rescale_to_load(self, slab: Slab, p: Array, load: float, total: float) -> None:
        """Scale free pressures. If they cannot make up for the load, mix all pressures with none, or with H."""
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
        """Points of the set that are free, others that penetrate without having yielded or have under an open gap."""
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
    """Mark the working set; sums of p times what is wrong with the gap, of the set and its gaps, of points that have
    yielded and stay so; and the deepest penetration of those that have not."""
    wrong, count, gaps, held = 0.0, 0.0, 0.0, 0.0
    lowest = np.full(p.shape[1], np.inf)
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
    return wrong, count, gaps, held, -lowest.min()


@loop
def _advance(p_old, t, step, p, highest, cells, sums):
    """`p = p_old - step t` between 0 and H; the sums over cells of free p, and beside them of what was added less what
    was taken off. Returns the sum of p, and of what was added or taken off."""
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
    """Scale each free pressure, up to H; the sums of those that are free, and of the others."""
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
