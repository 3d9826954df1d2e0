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
so that history decides the branch. One iteration:

1. the working set is what is free to move: open points (g > 0), and points in contact that are pulled (c < 0);
2. residual `c = K (g + h) + m + sigma(g)` there, preconditioned `z = A c`;
3. direction `t = z + beta t` (Polak and Ribiere), and `t = z` where that is no descent;
4. the way `w = max(g - alpha t, 0) - g` of a step as long as the last one should have been;
5. `g <- g + theta w` with the step of Newton, `theta = -<c, w>/(<w, K w> - <w, (-sigma') w>)`, and where that curvature
   is not clearly positive the majorized one, `-<c, w>/<w, K w>`: as gamma is concave it lowers E. Under a load only
   attraction holds mean values, to which K then adds what bounds the step. It is no longer than gaps allow, and a way
   that closes gaps is gone to its end, theta = 1, if it nearly is by Newton. Where cutting off has made a way that
   raises E, a shorter one takes its place;
6. E must not rise: else the step is halved.

An iteration takes two operator calls, `A c` and `K w`: the pressure follows from `theta K w`, and the certificate
from `A c`.

Where the mean gap is given, c, z and t are centred and w leads to it. V. Rey, G. Anciaux, J.-F. Molinari, Comput.
Mech. 60 (2017) 69 have these gradients without preconditioner; M. Bugnicourt, P. Sainsot, D. Dureisseix, C. Gauthier,
A. A. Lubrecht, Tribol. Lett. 66 (2018) 29 the working set. Everything is dimensionless.
"""

import math

import numpy as np

from ...parallel.slab import Array, Slab
from .. import kernels
from ..certificate import Certificate
from ..problem import Approach, Control, MeanPressure
from . import gap_kernels
from .gap_iterate import GapIterate, GapOperators, GapSolution, certify_gap
from .law import Law

# tuning
LEAST_CURVATURE = 0.02  # of the elastic one: with less the majorized step is made
LOOSE = 0.01  # stiffness of mean values under a load, which has none, in majorized steps; over that under an approach
WHOLE = 0.75  # share of a way that closes gaps, if Newton's step: from it on it is gone to its end
SHORTER = 0.1  # length of a way over that of one that raises E
MAX_TRIES = 12  # of ways, and of halvings of a step that raises E
MAX_STALLED_ITERATIONS = 120  # iterations without a better certificate after which a solve gives up
LEAST_DESCENT = 0.1  # over that without the last direction: with less it is forgotten
# accuracy
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # of the terms of a change of E
HELD = 0.5  # of a load that pulls: all points being open, with less attraction than that nothing holds
FAR = 4.0  # times the range, by which all points are open where nothing holds any more


class GapSolver:
    """Loop for contacts with adhesion on one grid."""

    def __init__(self, slab: Slab, operators: GapOperators, max_iterations: int) -> None:
        self.slab, self.operators, self.max_iterations = slab, operators, max_iterations
        self._q, self._way, self._image, self._gap, self._t = (slab.zeros() for _ in range(5))
        self._sigma, self._other_sigma = slab.zeros(), slab.zeros()
        self._working = slab.zeros(np.bool_)

    def solve(
        self,
        law: Law,
        heights: Array,
        control: Control,
        gap: Array,
        tolerance: float,
        operators: GapOperators | None = None,
    ) -> GapSolution:
        """Solve from the `gap`, in whose place the solution will be; for a body of other `operators` than its own, if
        they are given; collective."""
        it = self._begin(law, heights, control, gap, operators or self.operators)
        g, other = gap, self._gap
        best, scale, iteration, stuck, jumped = (math.inf, 0), 0.0, 0, False, False
        while True:
            members, lost = self._find_residual(it, g)
            certificate = self._precondition(it, g, other)
            best = min(best, (certificate.worst, iteration))
            failure = "" if lost else self._verdict(certificate.worst, tolerance, iteration, *best, stuck)
            if failure is not None:
                if g is not gap:
                    gap[...] = g
                self._find_pressure(it)
                return GapSolution(gap, self._q, it.d, certificate, iteration, failure, lost, jumped)
            scale = self._turn(it, members, scale, other)
            if not self._descend(it, g, other):
                members, _ = self._find_residual(it, g)  # where z points across a bound: c does not
                self._turn(it, members, 0.0, self._way)
                scale, stuck = 0.0, not self._descend(it, g, other)
            if not it.stable:  # on its way from one equilibrium to another, where certificates rise first
                best, jumped = (math.inf, iteration), True
            if not stuck:
                g, other = other, g
            iteration += 1

    # -- the steps of a solve ------------------------------------------------------------------------------------------

    def _begin(self, law: Law, heights: Array, control: Control, gap: Array, operators: GapOperators) -> GapIterate:
        """Give the start its mean where that is given, find its pressure, and forget the last direction."""
        self._t.fill(0.0)
        sums = self.slab.sum(kernels.sum_of(heights), kernels.sum_of(gap))
        mean_h, mean_g = (each / self.slab.points for each in sums)
        given = None
        if isinstance(control, Approach) and operators.mean == 0.0:
            given = max(-mean_h - control.value, 0.0)
            if mean_g > 0.0:
                gap *= given / mean_g
            else:
                gap.fill(given)
            mean_g = given
        np.add(gap, heights, out=self._q)
        operators.inverse.apply(self._q, self._q)
        gap_kernels.attract(law, gap, self._sigma)
        d = control.value if isinstance(control, Approach) else 0.0
        return GapIterate(law, heights, mean_h, control, operators, given, mean_g, d=d)

    def _uniform(self, it: GapIterate, mean_gap: float) -> float:
        """The uniform part m of the pressure, where it is not a multiplier."""
        if isinstance(it.control, MeanPressure):
            return it.control.value
        return (mean_gap + it.mean_height + it.control.value) / it.operators.mean

    def _find_residual(self, it: GapIterate, g: Array) -> tuple[float, bool]:
        """Let the pressure follow the last step, and find the working set and c on it, in the map of the way; the size
        of the set, and whether the surface has come off; collective."""
        q, sigma, before = self._q, self._sigma, it.m
        count, total = self.slab.sum(*gap_kernels.press(g, q, sigma, it.share, self._image))
        if it.given is None:
            it.m = self._uniform(it, it.mean_gap)
        else:
            it.m = -total / count if count else self._least_uniform(it)
        sums = gap_kernels.pressure_residual(g, q, sigma, it.m, self._working, self._way)
        members, total, attracted, least = self.slab.reduce(sums[:3], sums[3:])
        if it.given is not None and members:
            it.m -= total / members
            kernels.turn(self._working, self._way, 0.0, total / members, self._way)
        it.change = it.m - before
        it.lowest = -least
        if isinstance(it.control, Approach):
            return members, False
        it.d = it.operators.mean * it.m - it.mean_gap - it.mean_height
        if it.lowest <= 0.0:
            return members, False
        held = attracted / self.slab.points  # with all points open it only falls from here on
        return members, held < HELD * -it.m or (held < -it.m and it.lowest > FAR * it.law.range)

    def _find_pressure(self, it: GapIterate) -> None:
        """Put the pressure into its map. Where nothing touches under an approach it is minus the attraction: far apart
        that is less than what is wrong with K (g + h)."""
        if isinstance(it.control, Approach) and it.lowest > 0.0:
            np.negative(self._sigma, out=self._q)
        else:
            self._q += it.m

    def _least_uniform(self, it: GapIterate) -> float:
        """The least uniform pressure that holds full contact; collective."""
        lowest = float((-self._q).max(initial=-np.inf))
        return self.slab.reduce((), [lowest])[0] - it.law.strength

    def _verdict(
        self, worst: float, tolerance: float, iteration: int, best: float, best_at: int, stuck: bool
    ) -> str | None:
        """None: go on; empty: solved; else what happened instead."""
        if worst <= tolerance:
            return ""
        if not np.isfinite(worst):
            return "met numbers that are not finite"
        if stuck:
            return f"stalled: no step lowers the energy, at a residual of {worst:.3g}"
        asked = f"{worst:.3g} where {tolerance:.3g} was asked for"
        if iteration - best_at >= MAX_STALLED_ITERATIONS:
            return f"stalled: no residual below {best:.3g} in {MAX_STALLED_ITERATIONS} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the residual is {asked}"
        return None

    def _precondition(self, it: GapIterate, g: Array, z: Array) -> Certificate:
        """Put `z = A c` into a map, with c in that of the way; returns the certificate that z makes; collective."""
        it.operators.operator.apply(self._way, z)
        return certify_gap(self.slab, it, self._working, g, self._q, self._sigma, z)

    def _turn(self, it: GapIterate, members: float, scale: float, z: Array) -> float:
        """Make the new direction from z; returns `<c, z>`; collective.

        `scale` is that of the last one, 0 for one to be forgotten.
        """
        working = self._working
        step = it.share, self._image, self._other_sigma, it.change
        sums = gap_kernels.gap_products(working, self._q, it.m, self._sigma, *step, z, self._t)
        sum_z, sum_t, c_z, e_z, c_t = self.slab.sum(*sums)
        beta = max(0.0, e_z / scale) if scale > 0.0 else 0.0
        if c_z + beta * c_t <= LEAST_DESCENT * c_z:
            beta = 0.0
        mean = (sum_z + beta * sum_t) / members if it.given is not None else 0.0
        kernels.turn(working, z, beta, mean, self._t)
        return c_z

    def _descend(self, it: GapIterate, g: Array, out: Array) -> bool:
        """Make a step along the direction to the gap `out` and its attraction; returns whether any lowers E;
        collective."""
        share = self._share(it, g)
        for _ in range(MAX_TRIES if share > 0.0 else 0):
            to = share, self._way, self._image, out, self._other_sigma
            rise, size = self.slab.sum(*gap_kernels.move(it.law, g, self._q, it.m, self._sigma, *to))
            mean = it.mean_gap
            if it.given is None:
                mean += share * it.moved
                rise += 0.5 * share * it.moved * self.slab.points * (self._uniform(it, mean) - it.m)
            if rise <= ENERGY_ROUNDING * size:
                self._sigma, self._other_sigma = self._other_sigma, self._sigma
                it.share, it.mean_gap = share, mean
                return True
            share *= 0.5
        it.share = 0.0
        return False

    def _share(self, it: GapIterate, g: Array) -> float:
        """Find a way along the direction; returns which share of it to go; collective."""
        for _ in range(MAX_TRIES):
            total, cut = self.slab.sum(*gap_kernels.lead(g, self._t, it.step, self._way))
            if it.given is not None and cut > 0.0:
                gap_kernels.rescale(g, it.given * self.slab.points / total, self._way)
            wanted, most = self._newton(it, g)
            if cut == 0.0 or wanted > 0.0:
                break
            it.step *= SHORTER
        it.step *= wanted if wanted > 0.0 else 1.0
        return 1.0 if cut > 0.0 and wanted >= WHOLE else min(wanted, most)

    def _newton(self, it: GapIterate, g: Array) -> tuple[float, float]:
        """The share of the way that is the step of Newton, or the majorized one, and the most that gaps allow;
        collective."""
        it.operators.inverse.apply(self._way, self._image)
        *sums, fastest = gap_kernels.curvature(it.law, g, self._q, it.m, self._sigma, self._way, self._image)
        slope, stiff, soft, total, fastest = self.slab.reduce(sums, [fastest])
        it.moved = total / self.slab.points
        own, loaded = self.slab.points * it.moved**2 / it.operators.least_mean, isinstance(it.control, MeanPressure)
        true, major = stiff - soft + (0.0 if loaded else own), stiff + (LOOSE if loaded else 1.0) * own
        it.stable = true > LEAST_CURVATURE * major
        wanted = slope / (true if it.stable else major) if major > 0.0 else 0.0
        return wanted, 1.0 / fastest if fastest > 0.0 else math.inf
