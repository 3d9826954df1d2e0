"""An iterate of the contact solver in numbers, and how wrong it is."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..parallel.slab import Array, Slab
from .certificate import Certificate
from .constraint import Constraint

LEAST_SHARE = 0.1  # accuracy: of the mean displacement under pressure: gaps are never compared with less
LEAST_HEIGHT = 1e-9  # accuracy: of the height of the surface, the same: for displacements that are only rounding


@dataclass(frozen=True)
class Iterate:
    """An iterate in numbers, for an approach d: the sums of p, of `p (A p)^2` and of p g, the sums of p and of p g
    over points that are free to move, and `energy = <p, A p>/2`.

    Where no point is free, `between` is the lowest and the highest approach for which no point has to move, or the
    other way round if there is none.
    """

    d: float
    load: float
    gaps: float
    energy: float
    squares: float
    free_load: float
    free_gaps: float
    between: tuple[float, float] | None = None

    @property
    def f(self) -> float:
        """`<p, A p>/2 - <p, h + d>`, with `h + d = A p - g`: no large numbers where h has a large offset."""
        return self.gaps - self.energy

    def settled(self) -> "Iterate":
        """The same iterate, for the d at which `<p, g> = 0` over free points, but for the rounding of d.

        If none is free it is the middle of `between`, or, with all pressures at one bound, the d for all points.
        Without any pressure it stays.
        """
        if self.between is not None:
            d = 0.5 * sum(self.between)
        elif self.free_load > 0.0:
            d = self.d + self.free_gaps / self.free_load
        else:
            d = self.d + (self.gaps / self.load if self.load > 0.0 else 0.0)
        rest = self.free_gaps - (d - self.d) * self.free_load
        return replace(self, d=d, gaps=self.gaps - (d - self.d) * self.load, free_gaps=rest)

    def length(self, height: float) -> float:
        """The length that gaps are compared with (`Certificate`), from LEAST_HEIGHT of the surface's height to all."""
        least = LEAST_HEIGHT * height
        if self.load <= 0.0:
            return least
        mean = 2.0 * self.energy / self.load
        spread = math.sqrt(max(self.squares / self.load - mean**2, 0.0))
        return max(min(max(spread, LEAST_SHARE * abs(mean)), height), least)


def certify(
    slab: Slab,
    constraint: Constraint,
    p: Array,
    u: Array,
    h: Array,
    iterate: Iterate,
    mean: float | None,
    height: float,
    working: NDArray[np.bool_],
) -> tuple[float, float, Certificate]:
    """Mark the working set of a pressure and its image u; its size, its sum of gaps, and the certificate; collective.

    `mean` is the mean pressure asked for, None with a given approach; `height` is that of the surface.
    """
    *sums, deepest = constraint.mark_working_set(p, u, h, iterate.d, working)
    wrong, members, excess, held, deepest = slab.reduce(sums, [deepest])
    length = iterate.length(height)
    complementarity = wrong / (iterate.load or 1.0) / length
    load = 0.0 if mean is None else abs(iterate.load / slab.points / mean - 1.0)
    share = (members + held) / slab.points
    return members, excess, Certificate(complementarity, max(deepest / length, 0.0), load, length, share)


def form_iterate(slab: Slab, constraint: Constraint, p: Array, u: Array, h: Array, d: float) -> Iterate:
    """A pressure and its image u in numbers, for an approach d; collective."""
    load, work, gaps, squares, free_load, free_gaps = slab.sum(*constraint.contact_sums(p, u, h, d))
    between = _approaches(slab, constraint, p, u, h) if free_load <= 0.0 < load else None
    return Iterate(d, load, gaps, 0.5 * work, squares, free_load, free_gaps, between)


def _approaches(slab: Slab, constraint: Constraint, p: Array, u: Array, h: Array) -> tuple[float, float] | None:
    """Return `Iterate.between`: all pressures are at a bound, and the gaps of those at the upper one are at most 0, of
    the others at least 0; None if no pressure is at one of the bounds; collective."""
    level, yields = u - h, p >= constraint.bounds[1]
    lowest = float(level.max(where=yields, initial=-np.inf))
    highest = float(level.min(where=~yields, initial=np.inf))
    lowest, highest = slab.reduce((), [lowest, -highest])
    return (lowest, -highest) if math.isfinite(lowest) and math.isfinite(highest) else None
