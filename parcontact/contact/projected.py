"""Projected steps for operators that need not be symmetric, in light contact and free boxes.

A step minimizes the residual and is then projected onto the admissible pressures. The working set c of an admissible
pressure x consists of the points with pressure or penetration. On c a step combines the preconditioned residual t and
the last two changes of x so that the sum of squares of `C R (A x - h)` is smallest. Here R restricts a map to c, and C
subtracts the mean over c. Then negative pressures are put to 0, x is scaled to the load, and A is applied to x, so that
the image of each stored change is exact. Convergence is not guaranteed: a solve is given up when its certificate no
longer halves.

In a free box (`FreeSteadySolver`) the method of proximal points follows if projected steps do not converge. The symbol
of the padded box has a negative real part at some waves, so that the resolvents of `splitting` may not exist. Then the
contact is found as the limit of a sequence of contacts of bodies with less loss. With S symmetric and positive, the
contact p' of the operator `A + S` for heights `h + S p` satisfies

    A p' - h - d = S (p - p') where there is pressure,

which is the contact for A and h when p' = p. As A is positive, each step reduces the error of p in the norm of S, also
if p' is inexact (R. T. Rockafellar, SIAM J. Control Optim. 14 (1976) 877). S is the smallest operator that limits the
loss tangent of `A + S` to 1: its symbol is `|Im A| - Re A` for waves whose tangent is larger, and 0 for other waves.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.slab import Array
from ..physics.convolution import Convolution
from ..physics.records import Certificate
from . import kernels
from .certificate import Judge, describe_failure
from .preconditioner import ALL, ExtendedPreconditioner, Grids
from .problem import Box, Contact, MeanPressure, Operator, scale_to_load

Set = NDArray[np.bool_]
DIRECTIONS = 3  # the residual and the last two changes


class Projected:
    """Solver by projected steps on one grid. It holds DIRECTIONS maps of directions (the preconditioned residual and
    earlier changes of x), the images of these maps under A, the displacement, the working set with a byte per point,
    and the maps of `ExtendedPreconditioner`.

    `grids` are the coarser grids of the extension (`preconditioner.grids_for`).
    """

    def __init__(self, judge: Judge, operator: Operator, preconditioner: Operator, grids: Grids = ALL) -> None:
        self.judge, self.operator, self.preconditioner = judge, operator, preconditioner
        self.slab = slab = judge.slab
        self.t, self.w = ([slab.empty() for _ in range(DIRECTIONS)] for _ in range(2))
        self._u = slab.zeros()
        self._working: NDArray[Any] = slab.zeros(np.bool_)
        self.extended = ExtendedPreconditioner(slab, grids)

    def solve(self, h: Array, mean: float, p: Array, tolerance: float, patience: int) -> Contact:
        """Solve for heights h under the mean pressure `mean`; the solution overwrites the start p. A start that is 0
        everywhere is replaced by a uniform pressure. Give up if the error (`Certificate`) does not halve in `patience`
        steps. Collective."""
        steps, best, since = 0, math.inf, 0
        try:
            d, certificate = self._begin(h, mean, p)
            while certificate.worst > tolerance and since < patience:
                self.step(p, self._u, h, self._working, mean * self.slab.points)
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
        """Put the stored changes of x in earlier steps to 0."""
        for field in (*self.t, *self.w):
            field.fill(0.0)

    def _certify(self, h: Array, mean: float, p: Array) -> tuple[float, Certificate]:
        return self.judge.certify(p, self._u, h, MeanPressure(mean), self._working)

    def step(self, x: Array, u: Array, h: Array, working: Set, load: float) -> None:
        """Move the pressure x to an admissible pressure with the sum `load`, and update its displacement `u = A x`;
        collective. `working` is the working set of the old x."""
        members, total = self.slab.sum(*gaps_on(working, u, h))
        level, t = total / members, self.t[0]
        kernels.gap_residual(working, u, h, level, t)
        self.extended.apply(self.preconditioner, working, t)
        (mean,) = self.slab.sum(sum_on(working, t))
        kernels.turn(working, t, 0.0, mean / members, t)
        self.operator.apply(t, self.w[0])
        sums = np.array(self.slab.sum(*_gram(working, u, h, level, *self.w)))
        a, b, c = self.slab.agree(_smallest(sums, members))
        (now,) = self.slab.sum(_move(working, a, b, c, self.t[0], self.t[1], self.t[2], x))
        self.w[2][...] = u
        if not now > 0.0:  # earlier changes took all load off this set; t alone leaves it
            np.multiply(self.t[0], sums[3] / (sums[6] - sums[0] ** 2 / members), out=x, where=working)
            np.subtract(self.t[2], x, out=x, where=working)
            np.maximum(x, 0.0, out=x)
            (now,) = self.slab.sum(kernels.sum_of(x))
        x *= load / now
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
    """Move x on the set, put 0 elsewhere and where it would be negative, and leave the old x in c. Return the sum of
    the new x."""
    total = 0.0
    for j in range(x.shape[0]):
        row = 0.0
        for i in range(x.shape[1]):
            old = x[j, i]
            value = old - along_a * a[j, i] - along_b * b[j, i] - along_c * c[j, i]
            value = 0.0 if value < 0.0 else value
            x[j, i] = value if working[j, i] else 0.0
            row += x[j, i]
            c[j, i] = old
        total += row
    return total


@loop
def gaps_on(working, u, h):
    """Return the number of points in the set `working`, and the sum of `u - h` over them."""
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
INNER_PATIENCE = 12  # tuning: limit on projected steps of a contact with less loss in which its certificate must halve
SHARE, MOST = 0.3, 0.5  # tuning: tolerance of the next contact over the last certificate; up to MOST after a failure
LEAST = 0.3  # tuning: least tolerance of a contact, over the tolerance of the solve
MAX_CONTACTS_TO_HALVE = 20  # tuning: limit on contacts in which the certificate must halve
Symbol = NDArray[np.inexact]


class FreeSteadySolver:
    """Solver of steady sliding in a free box. It has the same methods as `SteadySolver`. It holds the maps of
    `Projected` and, if projected steps fail, the maps of the method of proximal points."""

    def __init__(
        self, judge: Judge, operator: Convolution, preconditioner: Convolution, tolerance: float, grids: Grids
    ) -> None:
        self._judge, self._operator, self._preconditioner = judge, operator, preconditioner
        self._tolerance, self._grids = tolerance, grids
        self._projected = Projected(judge, operator, preconditioner, grids)

    def hold_all(self) -> "_Points":
        """Allocate all maps that a solve may need, and return the solver by proximal points, which holds the maps that
        projected steps do not need."""
        return _Points(self._judge, self._operator, self._preconditioner, self._grids)

    def solve(self, h: Array, mean: float, start: Array) -> Contact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure `start`.
        A start that is 0 everywhere is replaced by a uniform pressure."""
        contact = self._projected.solve(h, mean, start, self._tolerance, PATIENCE)
        if contact.converged:
            return contact
        return self.hold_all().solve(h, mean, start, self._tolerance)


class _Points:
    """Proximal points. They hold the symbols of `A + S`, of its inverse and of S, and three maps."""

    def __init__(self, judge: Judge, operator: Convolution, preconditioner: Convolution, grids: Grids) -> None:
        kind = operator.dtype
        nearer, nearer_inverse = operator.mapped(_nearer, kind), preconditioner.mapped(_nearer_inverse, kind)
        self._judge, self._operator, self._pull = judge, operator, operator.mapped(_pull, np.float64)
        self._inner = Projected(judge, nearer, nearer_inverse, grids)
        self._h, self._kept, self._u = (judge.slab.empty() for _ in range(3))
        self._working: NDArray[Any] = judge.slab.zeros(np.bool_)

    def solve(self, h: Array, mean: float, start: Array, tolerance: float) -> Contact:
        """Solve as `FreeSteadySolver.solve`, to `tolerance`. The result counts the steps of all contacts.
        Collective."""
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
