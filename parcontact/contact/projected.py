"""Projected steps for operators that are not symmetric, in light contact and free boxes.

Minimal residual steps, each projected onto the admissible pressures. On the working set c (pressure or penetration) of
an admissible pressure x, a step combines the preconditioned residual t and the last two changes of x so that the sum of
squares of `C R (A x - h)` is smallest (R: restrict to c, C: subtract the mean over c). Then negative pressures are put
to 0, the load is restored, near by first (`LocalLoad`), and A is applied to x, so that the stored changes have exact
images. A need not be symmetric. Convergence is not guaranteed: a solve is given up when its certificate no longer
halves.

In a free box (`FreeSteadySolver`) proximal points follow where these steps do not help. The symbol of a padded box has
waves with a negative real part, so that its resolvents may not exist (`splitting`). There the contact is the limit of
contacts with less loss: with S symmetric and positive, the contact p' of the operator `A + S` for heights `h + S p`
satisfies

    A p' - h - d = S (p - p') where there is pressure,

which is the contact for A and h when p' = p. As A is positive, each step reduces the error of p, measured by S, also
if p' is only accurate to a share of the change (proximal points: R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)
877). S is the smallest that limits the loss tangent of `A + S` to 1: `|Im A| - Re A` for waves whose tangent is
larger, 0 for the others.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.regrid import RowExchange
from ..parallel.slab import Array, Slab
from ..physics.convolution import Convolution
from ..physics.measures import Certificate
from . import kernels
from .certificate import Judge, describe_failure
from .constraint import Box, scale_to_load
from .preconditioner import ExtendedPreconditioner, Grids
from .problem import Contact, MeanPressure, Operator

CELL = 16  # tuning: side of a cell of `LocalLoad` [points]
LEAST_SIDE = 4  # tuning: least side of a cell [points]; contacts may cycle with fewer
MOST_GIVEN_BACK = 0.5  # tuning: largest share of its load that a cell loses


class Cells(NamedTuple):
    """Cells of `LocalLoad` on a rank: each has `rows` x `columns` points, and `above` rows of the first one belong to
    another rank."""

    rows: int
    above: int
    columns: int


class LocalLoad:
    """Removal of the load that cutting off negative pressures adds, near the points where it was added.

    Scaling all pressures by one factor would remove it, but waves as long as the box would move every spot by more than
    the gaps at its edge, and points would penetrate again. So each cell of CELL x CELL points loses what was added in
    it, which changes the displacement only near by. Where points are closer along one direction, cells have fewer
    points along the other, so that they are about square: in long cells, one spot would lose what another has gained,
    and projected steps may cycle. Cells are the same on any number of ranks. The object holds no maps.
    """

    def __init__(self, slab: Slab, pairs: int = 0) -> None:
        """Make cells on a grid where `pairs` doublings make cells square (`preconditioner.pairs_for`)."""
        self._slab = slab
        if slab.only_counts:
            return
        rows, columns = (max(CELL >> max(count, 0), LEAST_SIDE) for count in (pairs, -pairs))
        touched = [_rows_of_cells(part, rows) for part in slab.dealt]
        rank, self._width = slab.comm.rank, -(-slab.nx // columns)
        ends = np.cumsum([0] + [part.stop - part.start for part in touched]).tolist()
        stacked = [slice(start, stop) for start, stop in pairwise(ends)]
        self._stack = Slab(slab.comm, 2 * self._width, ends[-1], slab.tally, stacked.__getitem__)
        numbers = np.concatenate([np.arange(part.start, part.stop) for part in touched])
        wanted = np.searchsorted(numbers, [(part.start, part.stop) for part in touched])
        self._exchange = RowExchange.of_parts(self._stack, wanted)
        own = np.arange(touched[rank].start, touched[rank].stop)
        self._starts = np.searchsorted(numbers[slice(*wanted[rank].tolist())], own)
        self._cells = Cells(rows, slab.rows.start % rows, columns)
        self._sums = np.zeros(self._stack.shape)

    def cut_off(self, p: Array) -> tuple[float, float]:
        """Put negative pressures to 0. Return the sum of p and of what this has added; collective."""
        cut_off_cells(p, self._cells, self._sums)
        loads, added = self._sums[:, : self._width], self._sums[:, self._width :]
        load, cut = self._slab.sum(float(loads.sum()), float(added.sum()))
        return load, cut

    def restore(self, p: Array, load: float, total: float, near_by: bool) -> None:
        """Scale p from the sum `load`, as `cut_off` returned it, to the sum `total`; collective. If `near_by`, each
        cell first loses what was added in it, at most MOST_GIVEN_BACK of its load."""
        if not near_by:
            p *= total / load
            return
        loads, shares = self._sums[:, : self._width], self._shares()
        load -= self._slab.sum(float(np.sum(shares * loads)))[0]
        scale_cells(p, self._cells, total / load * (1.0 - shares))

    def _shares(self) -> Array:
        """Return the share of its load that each cell with points on this rank loses; collective."""
        parts = self._exchange.fetch(self._sums)
        whole = np.add.reduceat(parts, self._starts, axis=0) if len(parts) else parts
        loads, added = whole[:, : self._width], whole[:, self._width :]
        shares = np.divide(added, loads, out=np.zeros_like(loads), where=loads > 0.0)
        return np.minimum(shares, MOST_GIVEN_BACK)


def _rows_of_cells(part: slice, rows: int) -> slice:
    """Return the rows of cells that contain given rows of points, for cells of `rows` rows."""
    start = part.start // rows
    return slice(start, max(-(-part.stop // rows), start) if part.stop > part.start else start)


@loop
def cut_off_cells(p, cells, sums):
    """Put `max(p, 0)` into p; put the sums of p over cells into the first half of `sums`, and those of what was added
    into the second. Rows of a cell are added up first, so that the loop is vectorized."""
    columns = sums.shape[1] // 2
    load, cut = np.empty(p.shape[1]), np.empty(p.shape[1])
    for j in range(sums.shape[0]):
        for i in range(sums.shape[1]):
            sums[j, i] = 0.0
    for i in range(p.shape[1]):
        load[i] = cut[i] = 0.0
    for j in range(p.shape[0]):
        for i in range(p.shape[1]):
            value = p[j, i]
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


Set = NDArray[np.bool_]
LEAST_CUT = 3e-4  # tuning: share of the load; less added load is removed by one factor for all points
DIRECTIONS = 3  # the residual and the last two changes
SQUARES, WIDE = 5, 0.5  # tuning: grids of squares and floor of `ExtendedPreconditioner`
NARROW = Grids(4), 1.0  # tuning: the same on lines; larger cells or a smaller floor may make sets cycle there
WITH_PAIRS = 0.3  # tuning: floor of `ExtendedPreconditioner` with pairs


def extension_on(nx: int, ny: int, pairs: int) -> tuple[Grids, float]:
    """Return grids and floor of `ExtendedPreconditioner` on nx x ny points, where `pairs` doublings make
    cells square."""
    if 1 in (nx, ny):
        return NARROW
    return Grids(SQUARES + abs(pairs), pairs), WITH_PAIRS if pairs else WIDE


class Projected:
    """Projected steps on one grid. It holds DIRECTIONS maps t, their images w, the displacement, a byte per point, and
    the maps of `ExtendedPreconditioner`.

    `pairs` doublings make cells square. `least_cut` is the least added load that is removed near by, over the
    load and on squares; the smaller cells of `pairs` reduce it.
    """

    def __init__(
        self, judge: Judge, operator: Operator, preconditioner: Operator, pairs: int = 0, least_cut: float = LEAST_CUT
    ) -> None:
        self.judge, self.operator, self.preconditioner = judge, operator, preconditioner
        self.slab = slab = judge.slab
        self.t, self.w = ([slab.empty() for _ in range(DIRECTIONS)] for _ in range(2))
        self._u = slab.zeros()
        self._working: NDArray[Any] = slab.zeros(np.bool_)
        grids, floor = extension_on(slab.nx, slab.ny, pairs)
        self.extended = ExtendedPreconditioner(slab, floor, grids)
        self.local_load, self._least_cut = LocalLoad(slab, pairs), least_cut / 2.0 ** abs(pairs)

    def solve(self, h: Array, mean: float, p: Array, tolerance: float, patience: int, near_by: bool = True) -> Contact:
        """Solve for heights h under the mean pressure `mean`; the solution overwrites the start p. A start that is 0
        everywhere is replaced by a uniform pressure. Restore the load `near_by` first, or from all points by one
        factor. Give up if the certificate does not halve in `patience` steps. Collective."""
        steps, best, since = 0, math.inf, 0
        try:
            d, certificate = self._begin(h, mean, p)
            while certificate.worst > tolerance and since < patience:
                self.step(p, self._u, h, self._working, mean * self.slab.points, near_by)
                d, certificate = self._certify(h, mean, p)
                halved, steps = certificate.worst <= 0.5 * best, steps + 1
                best, since = (certificate.worst, 0) if halved else (best, since + 1)
        except ZeroDivisionError:  # no load or no points in a set; all ranks have the same sums
            p.fill(0.0)
            d, certificate = math.nan, Certificate(math.nan, math.nan, math.nan)
            return Contact(p, self._u, d, certificate, steps, "no point is left that carries load")
        failure = describe_failure(f"no progress in {since} projected steps", certificate, tolerance)
        return Contact(p, self._u, d, certificate, steps, failure)

    def _begin(self, h: Array, mean: float, p: Array) -> tuple[float, Certificate]:
        """Scale the start to the load, and forget earlier changes. Return its approach and certificate."""
        (load,) = self.slab.sum(kernels.sum_of(p))
        scale_to_load(self.slab, Box(), p, load, mean * self.slab.points)
        self.forget()
        self.operator.apply(p, self._u)
        return self._certify(h, mean, p)

    def forget(self) -> None:
        """Forget earlier changes."""
        for field in (*self.t, *self.w):
            field.fill(0.0)

    def _certify(self, h: Array, mean: float, p: Array) -> tuple[float, Certificate]:
        return self.judge.certify(p, self._u, h, MeanPressure(mean), self._working)

    def step(self, x: Array, u: Array, h: Array, working: Set, load: float, near_by: bool = True) -> None:
        """Move x to an admissible pressure with the sum `load`, and update its image u; collective."""
        members, total = self.slab.sum(*gaps_on(working, u, h))
        level, t = total / members, self.t[0]
        kernels.gap_residual(working, u, h, level, t)
        self.extended.apply(self.preconditioner, working, t)
        (mean,) = self.slab.sum(sum_on(working, t))
        kernels.turn(working, t, 0.0, mean / members, t)
        self.operator.apply(t, self.w[0])
        sums = np.array(self.slab.sum(*_gram(working, u, h, level, *self.w)))
        a, b, c = self.slab.agree(_smallest(sums, members))
        _move(working, a, b, c, self.t[0], self.t[1], self.t[2], x)
        self.w[2][...] = u
        now, cut = self.local_load.cut_off(x)
        if not now > 0.0:  # earlier changes took all load off this set; t alone leaves it
            np.multiply(self.t[0], sums[3] / (sums[6] - sums[0] ** 2 / members), out=x, where=working)
            np.subtract(self.t[2], x, out=x, where=working)
            now, cut = self.local_load.cut_off(x)
        self.local_load.restore(x, now, load, near_by and cut > self._least_cut * now)
        self.operator.apply(x, u)
        self._keep_change(x, u)

    def _keep_change(self, x: Array, u: Array) -> None:
        """Store the change of x and of its image; the last maps of t and w hold the old values."""
        for kept, new in ((self.t, x), (self.w, u)):
            np.subtract(new, kept[2], out=kept[2])
            kept[1], kept[2] = kept[2], kept[1]


def _smallest(sums: Array, members: float) -> list[float]:
    """Return the length along each direction from the sums of `_gram`; 0 along directions that are 0 or left out."""
    totals, against, pairs = sums[:3], sums[3:6], sums[6:]
    gram = np.empty((3, 3))
    gram[np.triu_indices(3)] = pairs
    gram = np.triu(gram) + np.triu(gram, 1).T - np.outer(totals, totals) / members
    size = np.sqrt(np.maximum(gram.diagonal(), 0.0))
    if not np.all(np.isfinite(sums)) or not size[0] > 0.0:
        return [0.0] * 3
    size[size == 0.0] = np.inf
    far = np.linalg.lstsq(gram / np.outer(size, size), against / size, rcond=1e-10)[0] / size
    return [float(value) for value in far]


@loop
def _gram(working, u, h, level, a, b, c):
    """Return sums over the set of a, b and c, of their products with `u - h - level`, and of aa, ab, ac,
    bb, bc and cc."""
    total = np.zeros(12)
    for j in range(u.shape[0]):
        s_a, s_b, s_c, r_a, r_b, r_c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        a_a, a_b, a_c, b_b, b_c, c_c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(u.shape[1]):
            weight, here = 1.0 if working[j, i] else 0.0, u[j, i] - h[j, i] - level
            x, y, z = weight * a[j, i], weight * b[j, i], weight * c[j, i]
            s_a += x
            s_b += y
            s_c += z
            r_a += here * x
            r_b += here * y
            r_c += here * z
            a_a += x * x
            a_b += x * y
            a_c += x * z
            b_b += y * y
            b_c += y * z
            c_c += z * z
        total += np.array([s_a, s_b, s_c, r_a, r_b, r_c, a_a, a_b, a_c, b_b, b_c, c_c])
    return total


@loop
def _move(working, along_a, along_b, along_c, a, b, c, x):
    """Move x on the set, put 0 elsewhere, and leave the old x in c."""
    for j in range(x.shape[0]):
        for i in range(x.shape[1]):
            old = x[j, i]
            value = old - along_a * a[j, i] - along_b * b[j, i] - along_c * c[j, i]
            x[j, i] = value if working[j, i] else 0.0
            c[j, i] = old


@loop
def gaps_on(working, u, h):
    """Return the number of points of the set, and the sum of `u - h` over it."""
    count, total = 0.0, 0.0
    for j in range(u.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(u.shape[1]):
            weight = 1.0 if working[j, i] else 0.0
            row_count += weight
            row_total += weight * (u[j, i] - h[j, i])
        count += row_count
        total += row_total
    return count, total


@loop
def sum_on(working, z):
    total = 0.0
    for j in range(z.shape[0]):
        row = 0.0
        for i in range(z.shape[1]):
            row += z[j, i] if working[j, i] else 0.0
        total += row
    return total


PATIENCE = 20  # tuning: limit on projected steps in which the certificate must halve
LEAST_CUT_INSIDE = 1.5e-5  # tuning: LEAST_CUT of contacts with less loss
INNER_PATIENCE = 12  # tuning: limit on projected steps of a contact with less loss in which its certificate must halve
SHARE, MOST = 0.3, 0.5  # tuning: tolerance of the next contact over the last certificate; up to MOST after a failure
LEAST = 0.3  # tuning: least tolerance of a contact, over the tolerance of the solve
MAX_CONTACTS_TO_HALVE = 20  # tuning: limit on contacts in which the certificate must halve
Symbol = NDArray[np.inexact]


class FreeSteadySolver:
    """Solver on one grid with the interface of `SteadySolver`. It holds the maps of `Projected`; where that fails, also
    those of `_Points`."""

    def __init__(
        self, judge: Judge, operator: Convolution, preconditioner: Convolution, tolerance: float, pairs: int
    ) -> None:
        self._judge, self._operator, self._preconditioner = judge, operator, preconditioner
        self._tolerance, self._pairs = tolerance, pairs
        self._projected = Projected(judge, operator, preconditioner, pairs)

    def hold_all(self) -> "_Points":
        """Allocate all maps that a solve may need."""
        return _Points(self._judge, self._operator, self._preconditioner, self._pairs)

    def solve(self, h: Array, mean: float, start: Array) -> Contact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure `start`.
        A start that is 0 everywhere is replaced by a uniform pressure."""
        for near_by in (True, False):
            contact = self._projected.solve(h, mean, start, self._tolerance, PATIENCE, near_by)
            if contact.converged:
                return contact
        return self.hold_all().solve(h, mean, start, self._tolerance)


class _Points:
    """Proximal points. They hold the symbols of `A + S`, of its inverse and of S, and three maps."""

    def __init__(self, judge: Judge, operator: Convolution, preconditioner: Convolution, pairs: int) -> None:
        kind = operator.dtype
        nearer, nearer_inverse = operator.mapped(_nearer, kind), preconditioner.mapped(_nearer_inverse, kind)
        self._judge, self._operator, self._pull = judge, operator, operator.mapped(_pull, np.float64)
        self._inner = Projected(judge, nearer, nearer_inverse, pairs, LEAST_CUT_INSIDE)
        self._h, self._kept, self._u = (judge.slab.empty() for _ in range(3))
        self._working: NDArray[Any] = judge.slab.zeros(np.bool_)

    def solve(self, h: Array, mean: float, start: Array, tolerance: float) -> Contact:
        """Solve as `FreeSteadySolver.solve`; `steps` is the sum over all contacts. Collective."""
        worst, best, since, share, steps = 1.0, math.inf, 0, SHARE, 0
        while True:
            self._kept[...] = start
            self._pull.apply(start, self._h)
            self._h += h
            contact = self._inner.solve(self._h, mean, start, max(share * worst, LEAST * tolerance), INNER_PATIENCE)
            if not math.isfinite(contact.certificate.worst):
                return contact
            steps, since = steps + contact.iterations, since + 1
            self._operator.apply(start, self._u)
            d, certificate = self._judge.certify(start, self._u, h, MeanPressure(mean), self._working)
            if contact.failure and best < certificate.worst and share < MOST and since < MAX_CONTACTS_TO_HALVE:
                share *= 2.0
                start[...] = self._kept
                continue
            worst, share = certificate.worst, max(SHARE, 0.5 * share)
            best, since = (worst, 0) if worst <= 0.5 * best else (best, since)
            if worst <= tolerance or since >= MAX_CONTACTS_TO_HALVE:
                failure = describe_failure(f"no progress in {since} contacts", certificate, tolerance)
                return Contact(start, self._u, d, certificate, steps, failure)


def _pull(symbol: Symbol) -> Symbol:
    """Return the symbol of S from that of A."""
    return np.maximum(np.abs(symbol.imag) - symbol.real, 0.0)


def _nearer(symbol: Symbol) -> Symbol:
    """Return the symbol of `A + S` from that of A."""
    return symbol + _pull(symbol)


def _nearer_inverse(symbol: Symbol) -> Symbol:
    """Return the symbol of the inverse of `A + S` from that of the inverse of A; 0 where that is 0."""
    square = np.abs(symbol) ** 2
    own = np.divide(_pull(symbol), square, out=np.zeros_like(square), where=square > 0.0)
    return symbol / (1.0 + own * symbol)
