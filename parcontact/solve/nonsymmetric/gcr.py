"""Generalized conjugate residuals on a set of points with a fixed sum.

Improve x on a set c, keeping its sum over c, so that `A x - h` tends to a constant on c. With R = restrict to c and
C = subtract the mean over c, each step makes the direction `t = C R K r` orthogonal, in `C R A t`, to the earlier
ones, and minimizes the sum of squares of `r = C R (A x - h)` along it. A need not be symmetric. (S. C. Eisenstat, H.
C. Elman, M. H. Schultz, SIAM J. Numer. Anal. 20 (1983) 345.)
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel.slab import Array, Slab
from .. import kernels
from ..problem import Operator
from .stripes import OnSet


class GcrBasis:
    """Up to `count` directions t and their images A t, first in the maps `pairs`, then in new maps of the type `kept`.

    New maps and the residual are allocated at their first use.
    """

    def __init__(
        self,
        slab: Slab,
        operator: Operator,
        preconditioner: OnSet,
        count: int,
        kept: type,
        pairs: Sequence[tuple[Array, Array]] = (),
    ) -> None:
        self.slab, self.operator, self.preconditioner, self.count = slab, operator, preconditioner, count
        self.kept, self._pairs = kept, list(pairs)
        self._r: Array | None = None

    def hold_all(self) -> None:
        """Allocate all maps that a solve may need."""
        self._residual()
        for number in range(self.count):
            self._pair(number)

    def _residual(self) -> Array:
        if self._r is None:
            self._r = self.slab.empty()
        return self._r

    def _pair(self, number: int) -> tuple[Array, Array]:
        if number == len(self._pairs):
            self._pairs.append((self.slab.empty(self.kept), self.slab.empty(self.kept)))
        return self._pairs[number]

    def improve(self, x: Array, u: Array, h: Array, working: NDArray[np.bool_], limit: int, reduction: float) -> int:
        """Make up to `limit` steps on `working` until the residual has fallen by the factor `reduction`; update u = A
        x. Return the number of steps; collective."""
        members, total = self.slab.sum(*gaps_on(working, u, h))
        if members == 0.0:
            return 0
        r = self._residual()
        size = self.slab.sum(centred_residual(working, u, h, total / members, r))[0]
        goal = reduction**2 * size
        norms: list[float] = []
        means: list[float] = []
        for step in range(limit):
            if size <= goal or size == 0.0:
                return step
            t, w = self._pair(step)
            self.preconditioner.apply(working, r, t)
            (mean,) = self.slab.sum(sum_on(working, t))
            kernels.turn(working, t, 0.0, mean / members, t)
            self.operator.apply(t, w)
            self._orthogonalize(working, members, norms, means)
            total, square, product = self.slab.sum(*_products(working, w, r))
            means.append(total / members)
            norms.append(square - total * means[-1])
            if not norms[-1] > 0.0 or not math.isfinite(product):
                return step
            alpha = product / norms[-1]
            size = self.slab.sum(_step(working, alpha, t, w, means[-1], x, u, r))[0]
        return limit

    def _orthogonalize(
        self, working: NDArray[np.bool_], members: float, norms: list[float], means: list[float]
    ) -> None:
        """Make the image of the newest direction orthogonal to the earlier images on the set."""
        last = len(norms)
        if last == 0:
            return
        t, w = self._pairs[last]
        earlier = self._pairs[:last]
        sums = [_common(working, w, other) for _, other in earlier]
        total, *common = self.slab.sum(sum_on(working, w), *sums)
        for k, (other_t, other_w) in enumerate(earlier):
            beta = (common[k] - total * means[k]) / norms[k]
            _subtract(beta, other_t, t)
            _subtract(beta, other_w, w)


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
def centred_residual(working, u, h, mean, r):
    """Put `u - h - mean` on the set, 0 elsewhere, into r. Return its sum of squares."""
    size = 0.0
    for j in range(u.shape[0]):
        row = 0.0
        for i in range(u.shape[1]):
            value = u[j, i] - h[j, i] - mean if working[j, i] else 0.0
            r[j, i] = value
            row += value * value
        size += row
    return size


@loop
def sum_on(working, z):
    total = 0.0
    for j in range(z.shape[0]):
        row = 0.0
        for i in range(z.shape[1]):
            row += z[j, i] if working[j, i] else 0.0
        total += row
    return total


@loop
def _common(working, a, b):
    total = 0.0
    for j in range(a.shape[0]):
        row = 0.0
        for i in range(a.shape[1]):
            row += a[j, i] * b[j, i] if working[j, i] else 0.0
        total += row
    return total


@loop
def _products(working, w, r):
    """Return sums over the set of w, of w^2 and of w r."""
    total, square, product = 0.0, 0.0, 0.0
    for j in range(w.shape[0]):
        row_total, row_square, row_product = 0.0, 0.0, 0.0
        for i in range(w.shape[1]):
            value = w[j, i] if working[j, i] else 0.0
            row_total += value
            row_square += value * value
            row_product += value * r[j, i]
        total += row_total
        square += row_square
        product += row_product
    return total, square, product


@loop
def _subtract(beta, a, b):
    """Subtract `beta a` from b."""
    for j in range(b.shape[0]):
        for i in range(b.shape[1]):
            b[j, i] -= beta * a[j, i]


@loop
def _step(working, alpha, t, w, mean, x, u, r):
    """Move x, u and r along t. Return the sum of squares of r."""
    size = 0.0
    for j in range(x.shape[0]):
        row = 0.0
        for i in range(x.shape[1]):
            x[j, i] -= alpha * t[j, i]
            u[j, i] -= alpha * w[j, i]
            value = r[j, i] - alpha * (w[j, i] - mean) if working[j, i] else 0.0
            r[j, i] = value
            row += value * value
        size += row
    return size
