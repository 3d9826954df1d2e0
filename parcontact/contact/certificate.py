"""Error measures of a contact pressure: sums over p and gaps, their reference length, and the certificate."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..parallel.slab import Array, Slab
from ..physics.records import Certificate
from . import kernels
from .problem import Approach, Box, Control

LEAST_SHARE = 0.1  # accuracy: least length that gaps are compared with, over the mean displacement under pressure
LEAST_HEIGHT = 1e-9  # accuracy: the same, over the height of the surface, where displacements are only rounding


@dataclass(frozen=True)
class Lines:
    """Grid lines along the sliding direction, for a body that is stiffer for waves along these lines.

    `axis` is the axis of maps, 0 or 1, along which the lines run. `contrast` c is the modulus of waves along the lines,
    divided by the modulus of other waves. An error of the gap that varies along the lines causes c times the pressure
    that other errors cause. The length of the certificate is therefore multiplied by the factor s,

        s^2 = v + (1 - v)/c^2.

    Here v is the variance of u, weighted by the pressure, after the mean of each line is subtracted, divided by the
    variance before.
    """

    axis: int
    contrast: float

    def share_of_length(self, slab: Slab, p: Array, u: Array, iterate: "Iterate") -> float:
        """Return the factor s (see the class) for the pressure p and its displacement u; collective. `iterate` has the
        sums over p and u."""
        loads, moments = p.sum(axis=self.axis), np.einsum("ij,ij->i" if self.axis else "ij,ij->j", p, u)
        if not self.axis:  # lines cross the rows of all ranks
            loads, moments = np.split(np.array(slab.sum(*loads, *moments)), 2)
        between = np.divide(moments**2, loads, out=np.zeros_like(loads), where=loads > 0.0).sum()
        between = slab.sum(between)[0] if self.axis else between
        variance = iterate.squares - (2.0 * iterate.energy) ** 2 / iterate.load
        along = min(max((iterate.squares - between) / variance, 0.0), 1.0) if variance > 0.0 else 1.0
        return math.sqrt(along + (1.0 - along) / self.contrast**2)


@dataclass(frozen=True)
class Iterate:
    """Sums over a pressure p and its gap g at the approach d.

    Over all points `load` is the sum of p, `gaps` of p g, `squares` of p u^2, and `energy` is half of the sum of p u,
    with u = A p. Over free points `free_load` is the sum of p less its lower bound, and `free_gaps` that of its
    products with g.

    If no point is free, `between` holds the lowest and the highest approach at which no pressure changes. If there is
    no such approach, the first number exceeds the second.
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
        """Return `<p, A p>/2 - <p, h + d>`, computed from gaps: a large offset of h then does not cost digits."""
        return self.gaps - self.energy

    def settled(self) -> "Iterate":
        """Return the iterate at the approach d for which `<p, g> = 0` over free points, to rounding.

        If no point is free, d is the mean of `between`; if all pressures are at one bound, `<p, g> = 0` over all
        points. Without pressure d does not change.
        """
        if self.between is not None:
            d = 0.5 * sum(self.between)
        elif self.free_load > 0.0:
            d = self.d + self.free_gaps / self.free_load
        else:
            d = self.d + (self.gaps / self.load if self.load > 0.0 else 0.0)
        gaps, rest = self.gaps - (d - self.d) * self.load, self.free_gaps - (d - self.d) * self.free_load
        return replace(self, d=d, gaps=gaps, free_gaps=rest)

    def length(self, height: float) -> float:
        """Return the length that gaps are divided by in `Certificate`, from LEAST_HEIGHT times `height` to `height`."""
        least = LEAST_HEIGHT * height
        if self.load <= 0.0:
            return least
        mean = 2.0 * self.energy / self.load
        spread = math.sqrt(max(self.squares / self.load - mean**2, 0.0))
        return max(min(max(spread, LEAST_SHARE * abs(mean)), height), least)


def certify(
    slab: Slab,
    box: Box,
    p: Array,
    u: Array,
    h: Array,
    iterate: Iterate,
    mean: float | None,
    height: float,
    working: NDArray[np.bool_],
) -> tuple[float, float, Certificate]:
    """Mark the points that the solver changes, and return their number, their sum of gaps, and the certificate of p;
    collective.

    u is the displacement under p, and `working` the map to mark. `mean` is the prescribed mean pressure, None if the
    approach is given; `height` is the height of the surface.
    """
    *sums, deepest = kernels.mark_working_set(p, u, h, iterate.d, box.lowest, box.highest, working)
    wrong, members, excess, held, deepest = slab.reduce(sums, [deepest])
    length = iterate.length(height)
    complementarity = wrong / (iterate.load or 1.0) / length
    load = 0.0 if mean is None else abs(iterate.load / slab.points / mean - 1.0)
    share = (members + held) / slab.points
    return members, excess, Certificate(complementarity, max(deepest / length, 0.0), load, length, share)


def form_iterate(slab: Slab, box: Box, p: Array, u: Array, h: Array, d: float) -> Iterate:
    """Return the sums of `Iterate` for a pressure p and its displacement u at the approach d; collective."""
    sums = kernels.contact_sums(p, u, h, d, box.lowest, box.highest)
    load, work, gaps, squares, free_load, free_gaps = slab.sum(*sums)
    between = _approaches(slab, box, p, u, h) if free_load <= 0.0 < load else None
    return Iterate(d, load, gaps, 0.5 * work, squares, free_load, free_gaps, between)


def _approaches(slab: Slab, box: Box, p: Array, u: Array, h: Array) -> tuple[float, float] | None:
    """Return `Iterate.between` for pressures that are all at a bound; None if one of the bounds has no points;
    collective. Gaps of points at the upper bound must be <= 0, all others >= 0."""
    level, yields = u - h, p >= box.highest
    lowest = float(level.max(where=yields, initial=-np.inf))
    highest = float(level.min(where=~yields, initial=np.inf))
    lowest, highest = slab.reduce((), [lowest, -highest])
    return (lowest, -highest) if math.isfinite(lowest) and math.isfinite(highest) else None


@dataclass(frozen=True)
class Judge:
    """Certifies pressures on one grid. `height` is the height of the surface; `lines` are given for a body that is
    stiffer along them, None otherwise."""

    slab: Slab
    height: float
    lines: Lines | None = None

    def certify(
        self, p: Array, u: Array, h: Array, control: Control, working: NDArray[np.bool_]
    ) -> tuple[float, Certificate]:
        """Mark the points that a solver changes under an admissible pressure p with displacement u. Return the approach
        and the certificate of p; collective."""
        slab, given = self.slab, isinstance(control, Approach)
        iterate = form_iterate(slab, Box(), p, u, h, control.value if given else 0.0)
        iterate, mean = (iterate, None) if given else (iterate.settled(), control.value)
        *_, certificate = certify(slab, Box(), p, u, h, iterate, mean, self.height, working)
        if self.lines is not None and iterate.load > 0.0:
            certificate = certificate.shortened(self.lines.share_of_length(slab, p, u, iterate))
        return iterate.d, certificate


def describe_failure(reason: str, certificate: Certificate, tolerance: float) -> str:
    """Return a sentence with the reason and the residual of a failed solve; '' if the tolerance is met."""
    worst = certificate.worst
    return "" if worst <= tolerance else f"{reason}: the residual is {worst:.3g} where {tolerance:.3g} was asked for"
