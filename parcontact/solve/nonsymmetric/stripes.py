"""Preconditioners of linear solves on sets of points: one as it is, and one for bodies that are soft along stripes.

Under a surface that slides fast, the waves that do not vary along the sliding load no point in turn: to them the body
is as soft as in the end, to all others nearly as stiff as at once, up to a thousand times. So a residual on a set is
carried on beyond it (`preconditioner.extension`) as its mean along each stripe, which costs next to nothing, and what
differs from this mean by means over squares:

    E r = S r + E0 (r - R S r),    S r: in each stripe the sum of r over FLOOR of its length and its points on the set,

and what the preconditioner makes of it is brought back by the transpose of E. Without S linear solves on a set take up
to ten times the steps.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array, Slab
from ..preconditioner.extension import ExtendedPreconditioner
from ..problem import Operator

FLOOR = 1e-3  # tuning: of the points of a stripe: so many count as having no residual


class OnSet(Protocol):
    """Something near the inverse of A on a set of points."""

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """Make z of the residual r, which is 0 outside the set; only on the set does z mean something. Collective."""


@dataclass(frozen=True)
class Plain:
    """An `operator` near the inverse of A without a set, as it is."""

    operator: Operator

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """As `OnSet.apply`."""
        self.operator.apply(r, z)


@dataclass(frozen=True)
class Stripes:
    """The same with means along the stripes of a surface that slides along the axis `along` of an array of rows, and
    the means over squares of `extended`; it holds nothing."""

    slab: Slab
    operator: Operator
    extended: ExtendedPreconditioner
    along: int

    def apply(self, working: NDArray[np.bool_], r: Array, z: Array) -> None:
        """As `OnSet.apply`."""
        length = self.slab.nx if self.along == 1 else self.slab.ny
        weight = 1.0 / (self.sums(working) + FLOOR * length)
        onto = _OntoStripes(self, weight * self.sums(r))
        z[...] = r
        np.subtract(z, onto.means, out=z, where=working, casting="same_kind")
        self.extended.apply(onto, working, z)
        np.copyto(z, 0.0, where=~working)
        np.add(z, weight * (onto.sums - self.sums(z)), out=z, where=working, casting="same_kind")

    def sums(self, field: NDArray[np.generic]) -> Array:
        """Sums along each stripe, which broadcast to a map; collective."""
        own = field.sum(axis=self.along, dtype=np.float64, keepdims=True)
        return own if self.along == 1 else np.array([self.slab.sum(*own[0].tolist())])


class _OntoStripes:
    """The operator on a map to which the `means` of stripes are added; the sums along stripes of what it makes are kept
    in `sums`."""

    def __init__(self, stripes: Stripes, means: Array) -> None:
        self._stripes, self.means = stripes, means
        self.sums = means

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        np.add(field, self.means, out=field, casting="same_kind")
        self._stripes.operator.apply(field, out)
        self.sums = self._stripes.sums(out)
        return out
