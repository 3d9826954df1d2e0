"""Minimal residual steps, each projected onto the admissible pressures.

On the working set c (pressure or penetration) of an admissible pressure x, a step combines the preconditioned
residual t and the last two changes of x so that the sum of squares of `C R (A x - h)` is smallest (R: restrict to c,
C: subtract the mean over c). Then negative pressures are put to 0, the load is restored, near by first
(`local_load`), and A is applied to x, so that the stored changes have exact images. A need not be symmetric.
Convergence is not guaranteed; the caller must detect steps that no longer help. Restoring the load from all points
by one factor may then help, but is usually slower.
"""

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel.slab import Array, Slab
from .. import kernels
from ..constraint import Constraint
from ..local_load import LEAST_CUT, LocalLoad
from ..preconditioner.extension import ExtendedPreconditioner, Grids
from ..problem import Operator
from .gcr import centred_residual, gaps_on, sum_on

Set = NDArray[np.bool_]
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
    """Projected steps on one grid. It holds DIRECTIONS maps t, their images w, and the maps of
    `ExtendedPreconditioner`.

    `pairs` doublings make cells square. `least_cut` is LEAST_CUT of `LocalLoad` on squares, as a share of the load; the
    smaller cells of `pairs` reduce it.
    """

    def __init__(
        self,
        slab: Slab,
        operator: Operator,
        preconditioner: Operator,
        constraint: Constraint,
        pairs: int = 0,
        least_cut: float = LEAST_CUT,
    ) -> None:
        self.slab, self.operator, self.preconditioner, self.constraint = slab, operator, preconditioner, constraint
        self.t, self.w = ([slab.empty() for _ in range(DIRECTIONS)] for _ in range(2))
        grids, floor = extension_on(slab.nx, slab.ny, pairs)
        self.extended = ExtendedPreconditioner(slab, floor, grids)
        self.local_load, self._least_cut = LocalLoad(slab, pairs), least_cut / 2.0 ** abs(pairs)

    @property
    def pairs(self) -> list[tuple[Array, Array]]:
        """The maps of directions and of their images; others may use them until the next `begin`."""
        return list(zip(self.t, self.w, strict=True))

    def begin(self, near_by: bool = True) -> None:
        """Forget earlier changes. Restore the load in the next steps `near_by` first, or from all points by
        one factor."""
        self.near_by = near_by
        for field in (*self.t, *self.w):
            field.fill(0.0)

    def step(self, x: Array, u: Array, h: Array, working: Set, load: float) -> None:
        """Move x to an admissible pressure with the sum `load`, and update its image u; collective."""
        members, total = self.slab.sum(*gaps_on(working, u, h))
        level, t = total / members, self.t[0]
        centred_residual(working, u, h, level, t)
        self.extended.apply(self.preconditioner, working, t)
        (mean,) = self.slab.sum(sum_on(working, t))
        kernels.turn(working, t, 0.0, mean / members, t)
        self.operator.apply(t, self.w[0])
        sums = np.array(self.slab.sum(*_gram(working, u, h, level, *self.w)))
        a, b, c = self.slab.agree(_smallest(sums, members))
        _move(working, a, b, c, self.t[0], self.t[1], self.t[2], x)
        self.w[2][...] = u
        now, cut = self.local_load.advance(self.constraint, x, x, 0.0, x)
        if not now > 0.0:  # earlier changes took all load off this set; t alone leaves it
            np.multiply(self.t[0], sums[3] / (sums[6] - sums[0] ** 2 / members), out=x, where=working)
            np.subtract(self.t[2], x, out=x, where=working)
            now, cut = self.local_load.advance(self.constraint, x, x, 0.0, x)
        self.local_load.restore(self.constraint, x, now, load, self.near_by and cut > self._least_cut * now)
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
