"""Contact with adhesion by projected, preconditioned conjugate gradients over the gap.

Find the gap g >= 0 and the pressure p with the attraction sigma of a law, so that

    p = c - sigma(g),   c >= 0,   c g = 0,   A p = g + h + d,

for an operator A, effective heights h, and the approach d or the mean pressure P. K is the inverse of A on fields of
mean 0, a is the displacement over a uniform pressure, and `p = K (g + h) + m` with

    m = P                                  under a given load,
    m = (mean(g + h) + d)/a                under a given approach, a > 0,
    mean(g) = -mean(h) - d, which gives m  under a given approach, a = 0 (a periodic half space).

The solution is a stationary point of `E = <g + h, K (g + h)>/2 - sum gamma(g)` and the energy of m, with `d gamma/dg
= -sigma`. There are many. The solve starts at the gap of the last step, E falls in every iteration, and no barrier
is crossed deliberately, so that the history decides the branch. One iteration:

1. The working set consists of open points (g > 0) and of points in contact under tension (c < 0).
2. The residual is `c = K (g + h) + m + sigma(g)` there, preconditioned `z = A c`.
3. The direction is `t = z + beta t` (Polak and Ribiere), or `t = z` where that is no descent.
4. The way is `w = max(g - alpha t, 0) - g`, with the alpha that the last step should have had.
5. `g <- g + theta w` with Newton's step, `theta = -<c, w>/(<w, K w> - <w, (-sigma') w>)`. Where this curvature is
   not clearly positive, the majorized step `-<c, w>/<w, K w>` lowers E, as gamma is concave; under a load, K then
   gets a small stiffness of mean values. theta is limited by the gaps. A way that closes gaps is made in full, theta
   = 1, if Newton's step is at least WHOLE. If limiting has made a way that raises E, a shorter one is tried.
6. E must not rise. Otherwise the step is halved.

An iteration applies two operators: `A c`, which also gives the certificate, and `K w`, as the pressure changes by
`theta K w`.

Where the mean gap is given, c, z and t are centred, and w is scaled to it. V. Rey, G. Anciaux, J.-F. Molinari,
Comput. Mech. 60 (2017) 69 have these gradients without preconditioner; M. Bugnicourt, P. Sainsot, D. Dureisseix, C.
Gauthier, A. A. Lubrecht, Tribol. Lett. 66 (2018) 29 have the working set. All numbers are dimensionless.
"""

import math

import numpy as np

from ...parallel.slab import Array, Slab
from ...solve import kernels
from ...solve.certificate import Certificate
from ...solve.problem import Approach, Control, MeanPressure
from . import gap_kernels
from .gap_iterate import GapIterate, GapOperators, GapSolution, certify_gap
from .law import Law

# tuning
LEAST_CURVATURE = 0.02  # least curvature of E over the elastic one for Newton's step
LOOSE = 0.01  # stiffness of mean values in majorized steps under a load, over that under an approach
WHOLE = 0.75  # least Newton step for which a way that closes gaps is made in full, theta = 1
SHORTER = 0.1  # factor on the length of a way that raises E
MAX_TRIES = 12  # limit on shorter ways, and on halvings of a step that raises E
MAX_STALLED_ITERATIONS = 120  # limit on iterations without a smaller certificate
LEAST_DESCENT = 0.1  # least slope along t over that along z; below it the last direction is forgotten
# accuracy
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # share of the terms of a change of E that is rounding
HELD = 0.5  # least attraction of open surfaces that still hold, over the tensile load
FAR = 4.0  # gap over the range beyond which surfaces that attract less than the load have detached


class GapSolver:
    """Solver for contacts with adhesion on one grid."""

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
        """Solve from `gap`, which is overwritten by the solution. `operators` replace the operators of the solver;
        collective."""
        it = self._begin(law, heights, control, gap, operators or self.operators)
        g, other = gap, self._gap
        best, scale, iteration, no_descent, jumped = (math.inf, 0), 0.0, 0, False, False
        while True:
            members, lost = self._find_residual(it, g)
            certificate = self._precondition(it, g, other)
            best = min(best, (certificate.worst, iteration))
            failure = "" if lost else self._verdict(certificate.worst, tolerance, iteration, *best, no_descent)
            if failure is not None:
                if g is not gap:
                    gap[...] = g
                self._find_pressure(it)
                return GapSolution(gap, self._q, it.d, certificate, iteration, failure, lost, jumped)
            scale = self._turn(it, members, scale, other)
            if not self._descend(it, g, other):
                members, _ = self._find_residual(it, g)  # z may point across a bound; c does not
                self._turn(it, members, 0.0, self._way)
                scale, no_descent = 0.0, not self._descend(it, g, other)
            if not it.stable:  # between two equilibria certificates rise at first
                best, jumped = (math.inf, iteration), True
            if not no_descent:
                g, other = other, g
            iteration += 1

    # -- the steps of a solve ------------------------------------------------------------------------------------------

    def _begin(self, law: Law, heights: Array, control: Control, gap: Array, operators: GapOperators) -> GapIterate:
        """Scale the start to a given mean gap, compute its pressure, and forget the last direction."""
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
        """Return the uniform part m of the pressure, unless the mean gap is given."""
        if isinstance(it.control, MeanPressure):
            return it.control.value
        return (mean_gap + it.mean_height + it.control.value) / it.operators.mean

    def _find_residual(self, it: GapIterate, g: Array) -> tuple[float, bool]:
        """Update the pressure by the last step, mark the working set, and put c into the map of the way. Return the
        size of the set, and whether the surfaces have detached; collective."""
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
        held = attracted / self.slab.points  # as all points are open, it can only fall
        return members, held < HELD * -it.m or (held < -it.m and it.lowest > FAR * it.law.range)

    def _find_pressure(self, it: GapIterate) -> None:
        """Put the pressure into its map. If nothing touches under a given approach, the pressure is -sigma: at large
        gaps sigma is below the error of K (g + h)."""
        if isinstance(it.control, Approach) and it.lowest > 0.0:
            np.negative(self._sigma, out=self._q)
        else:
            self._q += it.m

    def _least_uniform(self, it: GapIterate) -> float:
        """Return the least uniform pressure that keeps full contact; collective."""
        lowest = float((-self._q).max(initial=-np.inf))
        return self.slab.reduce((), [lowest])[0] - it.law.strength

    def _verdict(
        self, worst: float, tolerance: float, iteration: int, best: float, best_at: int, no_descent: bool
    ) -> str | None:
        """Return None to continue, an empty string if solved, else why the solve has failed."""
        if worst <= tolerance:
            return ""
        if not np.isfinite(worst):
            return "met numbers that are not finite"
        if no_descent:
            return f"stalled: no step lowers the energy, at a residual of {worst:.3g}"
        asked = f"{worst:.3g} where {tolerance:.3g} was asked for"
        if iteration - best_at >= MAX_STALLED_ITERATIONS:
            return f"stalled: no residual below {best:.3g} in {MAX_STALLED_ITERATIONS} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the residual is {asked}"
        return None

    def _precondition(self, it: GapIterate, g: Array, z: Array) -> Certificate:
        """Put `A c` into z, with c in the map of the way. Return the certificate that z gives; collective."""
        it.operators.operator.apply(self._way, z)
        return certify_gap(self.slab, it, self._working, g, self._q, self._sigma, z)

    def _turn(self, it: GapIterate, members: float, scale: float, z: Array) -> float:
        """Make the new direction from z. Return `<c, z>`; `scale` belongs to the last direction, 0 forgets it.
        Collective."""
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
        """Make a step along the direction to the gap `out` and its attraction. Return whether E has fallen;
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
        """Find a way along the direction. Return the share of it to go; collective."""
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
        """Return Newton's or the majorized step as a share of the way, and the largest share that gaps allow;
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
