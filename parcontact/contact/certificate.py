"""The error of a contact pressure, stated from the pressure alone: its certificate.

A `records.Certificate` follows from sums over pressures and gaps. Gaps are divided by a reference length, so that the
errors have no unit.
"""

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
    """Grid lines along the sliding direction, for a body that is stiffer for waves that vary along these lines.

    `axis` is the axis of maps, 0 or 1, along which the lines run. `contrast` c is the modulus of waves that vary along
    the lines, divided by the modulus of waves that do not. An error of the gap that varies along the lines causes a
    pressure c times as large as other errors of the gap cause. The length by which gaps are divided (`Certificate`) is
    therefore multiplied by the factor s,

        s^2 = v + (1 - v)/c^2.

    Here v is the share of the variance of the displacement u that remains after the mean of each line is subtracted
    from u. The variance and the means are weighted by the pressure.
    """

    axis: int
    contrast: float

    def share_of_length(self, slab: Slab, p: Array, u: Array, iterate: "Iterate") -> float:
        """Return the factor s of `Lines` for a pressure p with the displacement u; collective. `iterate` holds the sums
        over p and u."""
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
    """Sums over a pressure p and its gap `g = u - h - d` at the approach d, with the displacement `u = A p`. `lowest`
    is the lower bound of p.

    * load: sum of p over all points;
    * gaps: sum of p g over all points;
    * energy: half of the sum of p u over all points;
    * squares: sum of p u^2 over all points;
    * free_load: sum of `p - lowest` over points with p below the upper bound;
    * free_gaps: sum of `(p - lowest) g` over the same points;
    * between: None unless p is at a bound at every point and each bound is reached at some point. Otherwise the lowest
      and the highest d for which p meets all conditions of its bounds. If there is no such d, the first number exceeds
      the second.
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
        """Return the functional `<p, A p>/2 - <p, h + d>` that the solution minimizes. The value is computed from gaps,
        so that a large offset of h does not cost digits."""
        return self.gaps - self.energy

    def settled(self) -> "Iterate":
        """Return the iterate at the approach d for which `<p - lowest, g> = 0` over points below the upper bound, to
        rounding. Here `lowest` is the lower bound.

        If all pressures are at bounds, d is the midpoint of `between`. If all pressures are at the same bound, d is
        such that `<p, g> = 0` over all points. If p is 0 everywhere, d does not change.
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
        """Return the reference length by which `Certificate` divides gaps. It is at least LEAST_HEIGHT times the
        `height` of the surface, and at most this height."""
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
    """Set `working` to True at the points that the solver changes next, and to False elsewhere. Return the number of
    these points, the sum of their gaps, and the errors of p (`Certificate`); collective.

    u is the displacement under p at the approach of `iterate`. `mean` is the prescribed mean pressure, or None if the
    approach is given. `height` is the height of the surface.
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
    """States the errors of pressures p >= 0 on one grid. `height` is the height of the surface. `lines` is None unless
    the modulus of the body depends on the direction of waves (`Lines`)."""

    slab: Slab
    height: float
    lines: Lines | None = None

    def certify(
        self, p: Array, u: Array, h: Array, control: Control, working: NDArray[np.bool_]
    ) -> tuple[float, Certificate]:
        """Return the approach of an admissible pressure p with displacement u, and its errors (`Certificate`). Set
        `working` to True at the points that a solver changes next, and to False elsewhere. Collective."""
        slab, given = self.slab, isinstance(control, Approach)
        iterate = form_iterate(slab, Box(), p, u, h, control.value if given else 0.0)
        iterate, mean = (iterate, None) if given else (iterate.settled(), control.value)
        *_, certificate = certify(slab, Box(), p, u, h, iterate, mean, self.height, working)
        if self.lines is not None and iterate.load > 0.0:
            certificate = certificate.shortened(self.lines.share_of_length(slab, p, u, iterate))
        return iterate.d, certificate


def describe_failure(reason: str, certificate: Certificate, tolerance: float) -> str:
    """Return a sentence why a solve failed, with the largest error that it reached; '' if the tolerance is met."""
    worst = certificate.worst
    return "" if worst <= tolerance else f"{reason}: the residual is {worst:.3g} where {tolerance:.3g} was asked for"
