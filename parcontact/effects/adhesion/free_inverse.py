"""Inverse of the operator of a free body, by conjugate gradients preconditioned with the inverse for a periodic body.

The periodic body has the same Green's function up to half the box (`HalfSpace.gap_operators`), so that a dozen steps
give five digits.
"""

from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array, Slab
from ...solve.problem import Operator
from .gap_iterate import GapOperators

MAX_STEPS = 100  # accuracy: limit on the steps; a dozen are usual


@dataclass(frozen=True)
class FreeInverse:
    """Inverse of `free`, with the operators of the periodic body. The energy of the error is below `tolerance^2` times
    that of the solution. It works in four `maps`.

    If `means` is False, it is the inverse on pressures of mean 0 and ignores mean displacements.
    """

    slab: Slab
    free: Operator
    repeated: GapOperators
    tolerance: float
    maps: tuple[Array, Array, Array, Array]
    means: bool

    def apply(self, field: Array, out: Array) -> Array:
        """Put the pressure that causes the displacement `field` into `out`; collective."""
        r, z, t, image = self.maps
        r[...] = field
        t[...] = self._precondition(r, z)
        size = self._product(r, z)
        goal = self.tolerance**2 * size
        out.fill(0.0)
        for _ in range(MAX_STEPS):
            if not size > goal:
                break
            self.free.apply(t, image)
            step, before = size / self._product(t, image), size
            out += np.multiply(t, step, out=z)
            r -= np.multiply(image, step, out=z)
            size = self._product(r, self._precondition(r, z))
            t *= size / before
            t += z
        return out

    def _precondition(self, r: Array, z: Array) -> Array:
        self.repeated.inverse.apply(r, z)
        if self.means:
            z += self.slab.sum(float(r.sum()))[0] / self.slab.points / self.repeated.least_mean
        return z

    def _product(self, a: Array, b: Array) -> float:
        return self.slab.sum(float(np.vdot(a, b)))[0]
