"""Steps of smallest residual, projected onto the admissible pressures in each step.

On the working set c (pressure, or penetration) of an admissible pressure x, a step goes along the preconditioned
residual t and the last two changes of x, as far along each as makes the sum of squares of `C R (A x - h)` smallest (R:
values on c, C: subtract the mean over c). Then what has become negative is put to 0, the load is restored, near by
first (`local_load`), and A is applied anew, so that the changes that are kept have exact images. A need not be
symmetric. Nothing is guaranteed: where a residual has nothing in common with the image of its own t, steps no longer
help, and the caller has to notice. Restoring the load from all points alike may then lead on, but is slower as a rule.
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
DIRECTIONS = 3  # the residual's, and the last two changes
SQUARES, WIDE, NARROW = 5, 0.5, (Grids(4), 1.0)  # tuning: grids of squares and floor of `ExtendedPreconditioner`; the
# last take a fifth more calls, but where a body is far stiffer at once, as on a line of points, larger cells or a
# smaller floor may make sets of points come and go
WITH_PAIRS = 0.3  # tuning: the floor with pairs: a higher one takes a tenth more calls


def extension_on(nx: int, ny: int, pairs: int) -> tuple[Grids, float]:
    """The grids and the floor of `ExtendedPreconditioner` on so many points, where so many `pairs` make square
    cells."""
    if 1 in (nx, ny):
        return NARROW
    return Grids(SQUARES + abs(pairs), pairs), WITH_PAIRS if pairs else WIDE


class Projected:
    """Holds DIRECTIONS maps t and as many of their images w, and those of `ExtendedPreconditioner`.

    With `pairs` that make square cells, cells of `LocalLoad` are smaller: so is the least cut they give back,
    `least_cut` of the load on squares.
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
        """The maps of directions and their images, of no use to it before the next `begin`."""
        return list(zip(self.t, self.w, strict=True))

    def begin(self, near_by: bool = True) -> None:
        """Forget earlier changes. From now on the load is restored `near_by` first, or from all points alike."""
        self.near_by = near_by
        for field in (*self.t, *self.w):
            field.fill(0.0)

    def step(self, x: Array, u: Array, h: Array, working: Set, load: float) -> None:
        """Move x, which is then admissible and has the sum `load`, and its image u with it; collective."""
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
        if not now > 0.0:  # changes made on earlier sets took all load off this one; the first direction leaves its sum
            np.multiply(self.t[0], sums[3] / (sums[6] - sums[0] ** 2 / members), out=x, where=working)
            np.subtract(self.t[2], x, out=x, where=working)
            now, cut = self.local_load.advance(self.constraint, x, x, 0.0, x)
        self.local_load.restore(self.constraint, x, now, load, self.near_by and cut > self._least_cut * now)
        self.operator.apply(x, u)
        self._keep_change(x, u)

    def _keep_change(self, x: Array, u: Array) -> None:
        """Keep the change of x and of its image, whose old values are in the last maps of t and w."""
        for kept, new in ((self.t, x), (self.w, u)):
            np.subtract(new, kept[2], out=kept[2])
            kept[1], kept[2] = kept[2], kept[1]


def _smallest(sums: Array, members: float) -> list[float]:
    """How far to go along each direction, from the sums of `_gram`; 0 along what is 0 or has been left out."""
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
    """Over the set: sums of a, b and c, of their products with `u - h - level`, and of aa, ab, ac, bb, bc and cc."""
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
    """Move x on the set, put 0 elsewhere; the old x is left in c."""
    for j in range(x.shape[0]):
        for i in range(x.shape[1]):
            old = x[j, i]
            value = old - along_a * a[j, i] - along_b * b[j, i] - along_c * c[j, i]
            x[j, i] = value if working[j, i] else 0.0
            c[j, i] = old
