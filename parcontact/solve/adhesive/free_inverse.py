"""The inverse of the operator of a free body: conjugate gradients, preconditioned with the inverse for another body.

That is the body which repeats itself, by the shortest way between two points (`HalfSpace.gap_operators`). On 32 x 32
points it is for all pressures between 0.48 and 2.9 times as stiff as the free one, so that a dozen steps give five
digits. These numbers leave 1 slowly on larger grids, as potentials of lines do.
"""

from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array, Slab
from ..problem import Operator
from .gap_iterate import GapOperators

MAX_STEPS = 100  # accuracy: a dozen do


@dataclass(frozen=True)
class FreeInverse:
    """The inverse of `free`, with the operators of the body that repeats itself; the energy of what is wrong with it is
    less than that of the whole by the square of the `tolerance`. It works in four `maps`.

    Without `means` it has no load, and is 0 for mean values: the inverse on pressures whose mean is 0.
    """

    slab: Slab
    free: Operator
    repeated: GapOperators
    tolerance: float
    maps: tuple[Array, Array, Array, Array]
    means: bool

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
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
