"""Constraints on pressures, and the laws that limit them.

Admissible pressures and their conditions of contact.

`Constraint` is the interface that the solvers use; it alone decides where surfaces touch. `NonNegative` is contact
without adhesion; `bounded` adds a hardness.

Contact with a counterbody that yields where the pressure reaches its hardness H [unit of p].

    0 <= p <= H,   g >= 0 where p < H,   g <= 0 where p > 0.

Where p = H the rigid surface yields by -g. Each solve starts from the full heights: earlier yielding is not
remembered (A. Almqvist, F. Sahlin, R. Larsson, S. Glavatskih, Tribol. Int. 40 (2007) 574). The mean pressure must be
below H. Points with `0 < p < H` are free: they determine the approach, and they are scaled to the load.

Removal of the load that limiting pressures to their bounds adds, near the points where it was added.

A step makes pressures at edges of contact negative; putting them to 0 adds load. Scaling all pressures by one factor
would remove it, but waves as long as the box would move every spot by more than the gaps at its edge, and points
would penetrate again. So each cell of CELL x CELL points loses what was added in it, which changes the displacement
only near by. Where points are closer along one direction, cells have fewer points along the other, so that they are
about square: in long cells, one spot would lose what another has gained, and projected steps may cycle.

Law of the interface: how far unresolved roughness lets the mean planes of two surfaces approach under a pressure.

Roughness finer than the grid is squeezed by the closing c(p), which rises with p. The conditions of contact are

    p >= 0,    w = A p + c(p) - h - d >= 0,    p w = 0,

so that a point with pressure penetrates by `h + d - c(p)`. As c rises, the problem is monotone and has one solution.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..errors import InputError
from ..parallel.regrid import RowExchange
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


STEPS = 6  # accuracy: linear pieces in each interval of a table, equal in the logarithm of the pressure


@dataclass(frozen=True)
class InterfaceLaw:
    """Piecewise linear closing c(p) with `c(0) = 0`: `pressures` rise from 0, and `closings` do not fall. Both have any
    unit.

    Beyond the last point c is constant.
    """

    pressures: Array
    closings: Array

    @classmethod
    def of_table(cls, pressures: Array, closings: Array) -> "InterfaceLaw":
        """Return the law through the points of a table, shape (n,), n >= 2, of rising positive pressures.

        Between the points c is a monotone cubic in log p (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5
        (1984) 300); below the first it is linear in p with the same slope, and c(0) = 0. Raises InputError for a
        table that does not rise.
        """
        if len(pressures) < 2 or pressures[0] <= 0.0 or np.any(np.diff(pressures) <= 0.0):
            raise InputError("an interface law needs two positive pressures or more, which rise")
        if np.any(np.diff(closings) < 0.0):
            raise InputError("an interface law needs closings that do not fall while the pressure rises")
        from scipy.interpolate import PchipInterpolator  # slow to import, and of use to few

        logs = np.log(pressures)
        count = STEPS * (len(logs) - 1) + 1
        fine = np.interp(np.linspace(0, len(logs) - 1, count), np.arange(len(logs)), logs)
        known = PchipInterpolator(logs, closings)
        values = np.maximum.accumulate(known(fine))  # removes rounding errors
        slope = float(known(logs[0], 1))  # dc/d(log p) = p dc/dp, which is c(p) - c(0) below the first point
        return cls(np.concatenate([[0.0], np.exp(fine)]), np.concatenate([[0.0], values - closings[0] + slope]))

    def in_units(self, pressure: float, length: float) -> "InterfaceLaw":
        """Return the law in the given units of pressure and length."""
        return InterfaceLaw(self.pressures / pressure, self.closings / length)

    def closing(self, p: Array) -> Array:
        """Return c(p), of the shape of p."""
        found, pressed = np.zeros(p.shape), p > 0.0
        found[pressed] = np.interp(p[pressed], self.pressures, self.closings)
        return found


HARD = InterfaceLaw(np.array([0.0, 1.0]), np.zeros(2))  # no closing


@loop
def resolve(s, h, gamma, pressures, sums, p, reflected):
    """Solve `p + gamma c(p) = s + gamma h` for `p >= 0` where the right side is positive, else p = 0. Put `2 p - s`
    into `reflected` and return its sum. `sums` is `pressures + gamma c` at the points of the law."""
    total, last = 0.0, sums.size - 1
    for j in range(s.shape[0]):
        row = 0.0
        for i in range(s.shape[1]):
            value = s[j, i] + gamma * h[j, i]
            if value <= 0.0:
                found = 0.0
            elif value >= sums[last]:
                found = pressures[last] + value - sums[last]
            else:
                low, high = 0, last
                while high - low > 1:
                    middle = (low + high) // 2
                    if sums[middle] <= value:
                        low = middle
                    else:
                        high = middle
                share = (value - sums[low]) / (sums[high] - sums[low])
                found = pressures[low] + share * (pressures[high] - pressures[low])
            p[j, i] = found
            reflected[j, i] = 2.0 * found - s[j, i]
            row += reflected[j, i]
        total += row
    return total


@loop
def begin_split(p, whole, u, h, d, gamma, s):
    """Put `p + gamma (c - h)` where there is pressure, c = whole - u, and `-gamma (u - d)` elsewhere, into s."""
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            pressed = p[j, i] + gamma * (whole[j, i] - u[j, i] - h[j, i])
            s[j, i] = pressed if p[j, i] > 0.0 else gamma * (d - u[j, i])
