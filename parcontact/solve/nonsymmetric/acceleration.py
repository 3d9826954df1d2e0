"""Anderson acceleration of an iteration `s <- s + f(s)` for a map s.

With the last changes ds_j of s and df_j of the residual f,

    theta = argmin |f - sum_j theta_j df_j|,    s <- s + R f - sum_j theta_j (ds_j + R df_j),

R the relaxation (D. G. Anderson, J. ACM 12 (1965) 547; H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715).
Without earlier changes this is the plain iteration, relaxed. Changes are stored in single precision: s is advanced by
the change that is stored.
"""

import math

import numpy as np

from ...compiled import loop
from ...parallel.slab import Array, Slab, allocate

DEPTH = 5  # tuning: number of earlier changes
RELAXATION = 1.5  # tuning: relaxation of the residual; below 2, so that the plain iteration converges, too
TRACE_SHARE = 1e-8  # accuracy: share of the mean square of changes that is added to each, above their rounding


class Acceleration:
    """Acceleration on one grid. It holds the residual and, in single precision, DEPTH changes of s and of f."""

    def __init__(self, slab: Slab) -> None:
        self.slab, self.f = slab, slab.empty()
        shape = DEPTH, *slab.shape
        self._ds, self._df = (allocate(shape, np.float32, slab.tally) for _ in range(2))
        self.forget()

    def forget(self) -> None:
        """Forget all changes of s and f."""
        self._gram = np.zeros((DEPTH, DEPTH))
        self._count, self._last = 0, -1  # number of complete changes, and place of the last change of s
        self._against = np.zeros(DEPTH)

    def residual(self, y: Array, p: Array, shift: float) -> float:
        """Put `y + shift - p` into the residual, and its change into the history. Return its rms; collective."""
        if self._last < 0:
            square = self.slab.sum(_first(y, p, shift, self.f))[0]
            return math.sqrt(square / self.slab.points)
        self._count = max(self._count, self._last + 1)
        square, *sums = self.slab.sum(*_change(y, p, shift, self.f, self._df, self._last, self._count))
        self._against[: self._count], row = sums[: self._count], sums[self._count :]
        self._gram[self._last, : self._count] = self._gram[: self._count, self._last] = row
        return math.sqrt(square / self.slab.points)

    def advance(self, s: Array, plain: bool) -> None:
        """Advance s, without earlier changes if `plain`."""
        theta = np.zeros(DEPTH)
        if self._count and not plain:
            theta[: self._count] = self._smallest()
        self._last = (self._last + 1) % DEPTH
        _advance(s, self.f, self._ds, self._df, theta[: self._count], self._last)

    def _smallest(self) -> Array:
        """Return the theta that make the residual smallest."""
        gram = self._gram[: self._count, : self._count]
        most = TRACE_SHARE * np.trace(gram) / self._count
        if not most > 0.0:
            return np.zeros(self._count)
        return np.linalg.solve(gram + most * np.eye(self._count), self._against[: self._count])


@loop
def _first(y, p, shift, f):
    """Put `y + shift - p` into f. Return its sum of squares."""
    total = 0.0
    for j in range(f.shape[0]):
        row = 0.0
        for i in range(f.shape[1]):
            f[j, i] = y[j, i] + shift - p[j, i]
            row += f[j, i] * f[j, i]
        total += row
    return total


@loop
def _change(y, p, shift, f, df, last, count):
    """Put `y + shift - p` into f and its change into df[last]. Return the sum of f^2, the products of f with `count`
    changes, and those of the last change with them."""
    total, sums = 0.0, np.zeros(1 + 2 * count)
    for j in range(f.shape[0]):
        row = 0.0
        for i in range(f.shape[1]):
            new = y[j, i] + shift - p[j, i]
            df[last, j, i] = new - f[j, i]
            f[j, i] = new
            row += new * new
        total += row
        for k in range(count):
            with_f, with_last = 0.0, 0.0
            for i in range(f.shape[1]):
                here = np.float64(df[k, j, i])
                with_f += here * f[j, i]
                with_last += here * df[last, j, i]
            sums[1 + k] += with_f
            sums[1 + count + k] += with_last
    sums[0] = total
    return sums


@loop
def _advance(s, f, ds, df, theta, last):
    """Add `R f - sum theta (ds + R df)` to s, and put it into ds[last]."""
    line = np.empty(s.shape[1])
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            line[i] = RELAXATION * f[j, i]
        for k in range(theta.size):
            for i in range(s.shape[1]):
                line[i] -= theta[k] * (ds[k, j, i] + RELAXATION * df[k, j, i])
        for i in range(s.shape[1]):
            ds[last, j, i] = line[i]
            s[j, i] += ds[last, j, i]
