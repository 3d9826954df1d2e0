"""Preconditioners of linear solves on sets: a plain one, and one for bodies that are soft along stripes.

Under a surface that slides fast, waves that do not vary along the sliding load no point cyclically: for them the
body has its relaxed modulus, for all others nearly its glassy one, up to a thousand times larger. So a residual on a
set is extended beyond it (`preconditioner.extension`) as its mean along each stripe, and its difference from this
mean by means over squares:

    E r = S r + E0 (r - R S r),    S r = (sum of r over the stripe)/(FLOOR length + number of its points on the set),

and the transpose of E brings the preconditioned residual back to the set.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array, Slab
from ..preconditioner.extension import ExtendedPreconditioner
from ..problem import Operator

FLOOR = 1e-3  # tuning: weight of a residual of 0, as a share of the points of a stripe


class OnSet(Protocol):
    """Approximate inverse of A on a set of points."""

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """Put the preconditioned residual into z; r is 0 outside the set, and z is valid on the set only.
        Collective."""


@dataclass(frozen=True)
class Plain:
    """Approximate inverse of A without a set, as `operator`."""

    operator: Operator

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """See `OnSet.apply`."""
        self.operator.apply(r, z)


@dataclass(frozen=True)
class Stripes:
    """Approximate inverse of A with means along stripes.

    `along` is the axis of sliding of an array of rows; `extended` makes the means over squares. It holds no maps.
    """

    slab: Slab
    operator: Operator
    extended: ExtendedPreconditioner
    along: int

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """See `OnSet.apply`."""
        length = self.slab.nx if self.along == 1 else self.slab.ny
        weight = 1.0 / (self.sums(working) + FLOOR * length)
        onto = _OntoStripes(self, weight * self.sums(r))
        z[...] = r
        np.subtract(z, onto.means, out=z, where=working, casting="same_kind")
        self.extended.apply(onto, working, z)
        np.copyto(z, 0.0, where=~working)
        np.add(z, weight * (onto.sums - self.sums(z)), out=z, where=working, casting="same_kind")

    def sums(self, field: NDArray[np.generic]) -> Array:
        """Return sums along each stripe, which broadcast to a map; collective."""
        own = field.sum(axis=self.along, dtype=np.float64, keepdims=True)
        return own if self.along == 1 else np.array([self.slab.sum(*own[0].tolist())])


class _OntoStripes:
    """The operator applied to a map plus the `means` of stripes. `sums` holds the sums of its result along stripes."""

    def __init__(self, stripes: Stripes, means: Array) -> None:
        self._stripes, self.means = stripes, means
        self.sums = means

    def apply(self, field: Array, out: Array) -> Array:
        """Apply the operator to `field` plus the means; collective."""
        np.add(field, self.means, out=field, casting="same_kind")
        self._stripes.operator.apply(field, out)
        self.sums = self._stripes.sums(out)
        return out
