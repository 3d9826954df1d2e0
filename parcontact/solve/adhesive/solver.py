"""Contact with adhesion: projected, preconditioned conjugate gradients over the gap.

Find the gap g >= 0 and the pressure p with the attraction sigma of a law, so that

    p = c - sigma(g),   c >= 0,   c g = 0,   A p = g + h + d,

for an operator A, effective heights h, and either the approach d or the mean pressure P. With K, the inverse of A but
for mean values, `p = K (g + h) + m`, and with a the displacement over a uniform pressure

    m = P                                  under a given load,
    m = (mean(g + h) + d)/a                under a given approach, a > 0,
    mean(g) = -mean(h) - d, which gives m  under a given approach, a = 0 (a periodic half space).

It is a stationary point of `E = <g + h, K (g + h)>/2 - sum gamma(g)` and the energy of m, `d gamma/dg = -sigma`. There
are many: the gap of the step before is the start, E falls in every iteration, and no barrier is jumped over on purpose,
so that history decides the branch. One iteration, with M = keep the values on the working set:

1. the working set is what is free to move: open points (g > 0), and points in contact that are pulled (c < 0);
2. residual `c = K (g + h) + m + sigma(g)` there, preconditioned `z = M A c`;
3. direction `t = z + beta t` (Polak and Ribiere), and `t = z` where that is no descent;
4. `g <- max(g - alpha t, 0)` with the step of Newton, `alpha = <c, t>/(<t, K t> - <t, (-sigma') t>)`, and where that
   curvature is not clearly positive the majorized one, `<c, t>/<t, K t>`: as gamma is concave it lowers E;
5. E must not rise: else the step is halved.

Where the mean gap is given, c, z and t are centred and g is scaled to it. V. Rey, G. Anciaux, J.-F. Molinari, Comput.
Mech. 60 (2017) 69 have these gradients without preconditioner; M. Bugnicourt, P. Sainsot, D. Dureisseix, C. Gauthier,
A. A. Lubrecht, Tribol. Lett. 66 (2018) 29 the working set. Everything is dimensionless.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...parallel.slab import Array, Slab
from .. import kernels as maps
from ..certificate import Certificate
from ..iterate import LEAST_SHARE
from ..problem import Approach, MeanPressure, Operator
from . import kernels

LEAST_CURVATURE = 0.02  # tuning: of the elastic one: with less the majorized step is made
LONGEST_STRIDE = 64.0  # tuning: of majorized steps that follow each other, as where a contact snaps
MAX_HALVINGS = 12  # of a step that raises E
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # of the terms of a change of E
MAX_STALLED_ITERATIONS = 120  # iterations without a better certificate after which a solve gives up
SHARPER = 10.0  # accuracy: times the certificate of contacts that do not stick: with it the load is as right as theirs
LEAST_TRACTION = 1e-3  # accuracy: of the strength of a point: pressures that add up to less are none
LEAST_DESCENT = 0.1  # tuning: over that without the last direction: with less it is forgotten
HELD = 0.5  # accuracy: of a load that pulls: all points being open, with less attraction than that nothing holds
FAR = 4.0  # accuracy: times the range, by which all points are open where nothing holds any more


class Law(NamedTuple):
    """A law in the units of a solve: `kind`, strength and range (`kernels`)."""

    kind: int
    strength: float
    range: float


class GapOperators(NamedTuple):
    """The operator of a body and its inverse K, which is 0 for mean values; `mean` is the displacement over a uniform
    pressure, 0 where there is none, and `least_mean` that by which the operator moves mean values, always positive."""

    operator: Operator
    inverse: Operator
    mean: float
    least_mean: float


@dataclass(frozen=True)
class GapSolution:
    """Solved gap (the map that was given as the start) and pressure (the solver's map, valid until the next solve).

    `failure` is empty, or says what happened instead; `detached` says that no equilibrium was left under the load.
    """

    gap: Array
    p: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str
    detached: bool = False


@dataclass
class _Iterate:
    """A gap in numbers: its mean, the uniform part m of the pressure, the approach; under which load or mean gap; and
    by how much majorized steps are lengthened, where one follows the other."""

    law: Law
    heights: Array
    mean_height: float
    control: Approach | MeanPressure
    given: float | None
    mean_gap: float = 0.0
    m: float = 0.0
    d: float = 0.0
    stride: float = 1.0


class GapSolver:
    """Loop for contacts with adhesion on one grid."""

    def __init__(self, slab: Slab, operators: GapOperators, max_iterations: int) -> None:
        self.slab, self.operators, self.max_iterations = slab, operators, max_iterations
        self._q, self._q_new, self._image, self._gap = (slab.zeros() for _ in range(4))
        self._c, self._c_old, self._t = (slab.zeros() for _ in range(3))
        self._working = slab.zeros(np.bool_)

    @staticmethod
    def footprint(cells: int) -> int:
        """Bytes that it holds on a rank that has so many points."""
        return (7 * 8 + 1) * cells

    def solve(
        self, law: Law, heights: Array, control: Approach | MeanPressure, gap: Array, tolerance: float
    ) -> GapSolution:
        """Solve from the `gap`, in whose place the solution will be; collective."""
        it = self._begin(law, heights, control, gap)
        g, other = gap, self._gap
        best, scale, stuck, iteration = (math.inf, 0), 0.0, 0, 0
        while True:
            members, lost = self._find_residual(it, g)
            z = self.operators.operator.apply(self._c, self._q_new)
            certificate = self._certify(it, g, z)
            best = min(best, (certificate.worst, iteration))
            failure = "" if lost else self._verdict(certificate.worst, tolerance, iteration, *best)
            if stuck > 2 and failure is None:
                failure = f"stalled: no step lowers the energy, at a residual of {certificate.worst:.3g}"
            if failure is not None:
                if g is not gap:
                    gap[...] = g
                self._q += it.m
                return GapSolution(gap, self._q, it.d, certificate, iteration, failure, lost)
            if stuck > 1:  # even where z points across a bound, c does not
                z[...] = self._c
            slope, scale = self._turn(it, members, scale)
            step, stable = self._step(it, g, slope)
            if not stable:  # on its way from one equilibrium to another, where certificates rise first
                best = (math.inf, iteration)
            if self._descend(it, g, step, other):
                g, other, stuck = other, g, 0
            else:
                stuck, scale = stuck + 1, 0.0
            iteration += 1

    # -- the steps of a solve ------------------------------------------------------------------------------------------

    def _begin(self, law: Law, heights: Array, control: Approach | MeanPressure, gap: Array) -> _Iterate:
        """Give the start its mean where that is given, find its pressure, and forget the last direction."""
        self._t.fill(0.0)
        self._c.fill(0.0)
        sums = self.slab.sum(maps.total(heights), maps.total(gap))
        mean_h, mean_g = (each / self.slab.points for each in sums)
        given = None
        if isinstance(control, Approach) and self.operators.mean == 0.0:
            given = max(-mean_h - control.value, 0.0)
            if mean_g > 0.0:
                maps.scale(gap, given / mean_g)
            else:
                gap.fill(given)
            mean_g = given
        it = _Iterate(law, heights, mean_h, control, given, mean_g)
        np.add(gap, heights, out=self._q)
        self.operators.inverse.apply(self._q, self._q)
        return it

    def _uniform(self, it: _Iterate, mean_gap: float) -> float:
        """The uniform part m of the pressure, where it is not a multiplier."""
        if isinstance(it.control, MeanPressure):
            return it.control.value
        return (mean_gap + it.mean_height + it.control.value) / self.operators.mean

    def _find_residual(self, it: _Iterate, g: Array) -> tuple[float, bool]:
        """Mark the working set and find c on it; its size, and whether the surface has come off; collective."""
        law, working = it.law, self._working
        if it.given is None:
            it.m = self._uniform(it, it.mean_gap)
        else:
            count, total = self.slab.sum(*kernels.open_residual(*law, g, self._q))
            it.m = -total / count if count else self._lowest(it, g)
        sums = kernels.residual(*law, g, self._q, it.m, working, self._c, self._c_old)
        *sums, least = self.slab.reduce(sums[:3], sums[3:])
        members, total, attraction = sums
        if it.given is not None and members:
            it.m -= total / members
            kernels.centre(working, total / members, self._c)
        it.d = self.operators.mean * it.m - it.mean_gap - it.mean_height
        if not isinstance(it.control, MeanPressure) or -least <= 0.0:
            return members, False
        held = attraction / self.slab.points  # with all points open it only falls from here on
        return members, held < HELD * -it.m or (held < -it.m and -least > FAR * law.range)

    def _lowest(self, it: _Iterate, g: Array) -> float:
        """The least uniform pressure that holds full contact; collective."""
        lowest = float((-self._q).max(initial=-np.inf))
        return self.slab.reduce((), [lowest])[0] - kernels.traction(*it.law, 0.0)

    def _certify(self, it: _Iterate, g: Array, z: Array) -> Certificate:
        """How wrong the gap is: by `z`, weighted by the pressure, over a length; collective.

        The length is by how much the body is deformed in the contact, at most the range, and at least a tenth of it.
        """
        sums = kernels.judge(self._working, self._q, it.m, self._c, g, it.heights, z)
        load, first, second, wrong = self.slab.sum(*sums)
        least = LEAST_TRACTION * it.law.strength
        spread, mean = 0.0, 0.0
        if load > 0.0:
            mean = first / load
            spread = math.sqrt(max(second / load - mean**2, 0.0))
        length = min(max(spread, LEAST_SHARE * abs(mean + it.d), LEAST_SHARE * it.law.range), it.law.range)
        return Certificate(SHARPER * wrong / max(load, least) / length, 0.0, 0.0, length)

    def _verdict(self, worst: float, tolerance: float, iteration: int, best: float, best_at: int) -> str | None:
        """None: go on; empty: solved; else what happened instead."""
        if worst <= tolerance:
            return ""
        if not np.isfinite(worst):
            return "met numbers that are not finite"
        asked = f"{worst:.3g} where {tolerance:.3g} was asked for"
        if iteration - best_at >= MAX_STALLED_ITERATIONS:
            return f"stalled: no residual below {best:.3g} in {MAX_STALLED_ITERATIONS} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the residual is {asked}"
        return None

    def _turn(self, it: _Iterate, members: float, scale: float) -> tuple[float, float]:
        """Make the new direction from z; returns its slope `<c, t>`, and `<c, z>`; collective.

        `scale` is that of the last one, 0 for one to be forgotten.
        """
        z, working = self._q_new, self._working
        sums = kernels.products(working, self._c, self._c_old, z, self._t)
        sum_z, sum_t, c_z, old_z, c_t = self.slab.sum(*sums)
        beta = max(0.0, (c_z - old_z) / scale) if scale > 0.0 else 0.0
        if c_z + beta * c_t <= LEAST_DESCENT * c_z:
            beta = 0.0
        mean = (sum_z + beta * sum_t) / members if it.given is not None else 0.0
        kernels.turn(self._working, z, beta, mean, self._t)
        return c_z + beta * c_t, c_z

    def _step(self, it: _Iterate, g: Array, slope: float) -> tuple[float, bool]:
        """The step of Newton, or the majorized one, and whether it is the former; `K t` is in its map; collective."""
        self.operators.inverse.apply(self._t, self._image)
        stiff, soft, total = self.slab.sum(*kernels.curvature(*it.law, g, self._t, self._image))
        mean, points = total / self.slab.points, self.slab.points
        stiff += points * mean**2 / self.operators.least_mean
        own = 0.0 if it.given is not None else points * mean**2 / self.operators.least_mean
        if isinstance(it.control, MeanPressure):
            own = 0.0
        true = stiff - points * mean**2 / self.operators.least_mean + own - soft
        if true > LEAST_CURVATURE * stiff:
            it.stride = 1.0
            return slope / true, True
        step = it.stride * slope / stiff if stiff > 0.0 else 0.0
        it.stride = min(2.0 * it.stride, LONGEST_STRIDE)
        return step, False

    def _descend(self, it: _Iterate, g: Array, step: float, out: Array) -> bool:
        """Make the step, or a shorter one, to the gap `out` and its pressure; returns whether any lowers E;
        collective."""
        for _ in range(MAX_HALVINGS):
            total, cut = self.slab.sum(*kernels.advance(g, self._t, step, out))
            if it.given is not None and total > 0.0:
                if cut > 0.0:
                    maps.scale(out, it.given * self.slab.points / total)
                total = it.given * self.slab.points
            if cut > 0.0:
                np.add(out, it.heights, out=self._q_new)
                self.operators.inverse.apply(self._q_new, self._q_new)
            else:
                kernels.subtract(self._q, step, self._image, self._q_new)
            rise, size, moved = self.slab.sum(*kernels.change(*it.law, g, self._q, out, self._q_new))
            mean = total / self.slab.points
            if it.given is None:
                rise += moved * 0.5 * (it.m + self._uniform(it, mean))
            if rise <= ENERGY_ROUNDING * size:
                self._q, self._q_new = self._q_new, self._q
                it.mean_gap = mean
                return True
            step *= 0.5
            it.stride = 1.0
        return False
