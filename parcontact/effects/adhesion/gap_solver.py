"""Contact with adhesion by projected, preconditioned conjugate gradients over the gap.

Find the gap g >= 0 and the pressure p with the attraction sigma of a law, so that

    p = c - sigma(g),   c >= 0,   c g = 0,   A p = g + h + d,

for an operator A, effective heights h, and the approach d or the mean pressure P. K is the inverse of A on fields of
mean 0, a is the displacement per unit of uniform pressure, and `p = K (g + h) + m` with

    m = P                                  under a given load,
    m = (mean(g + h) + d)/a                under a given approach, a > 0,
    mean(g) = -mean(h) - d, which gives m  under a given approach, a = 0 (a periodic half space).

The solution is one of many stationary points of `E = <g + h, K (g + h)>/2 - sum gamma(g)` and the energy of m, with `d
gamma/dg = -sigma`. The solve starts at the gap of the last step, E falls in every iteration, and no barrier is crossed
deliberately, so that the history decides the branch. One iteration:

1. The working set consists of open points (g > 0) and of points in contact under tension (c < 0).
2. The residual is `c = K (g + h) + m + sigma(g)` there, preconditioned `z = A c`.
3. The direction is `t = z + beta t` (Polak and Ribiere), or `t = z` where that is no descent.
4. The change of the gap is `w = max(g - alpha t, 0) - g`, with the alpha that would have been best for the last step.
5. `g <- g + theta w` with Newton's step, `theta = -<c, w>/(<w, K w> - <w, (-sigma') w>)`. Where this curvature is not
   clearly positive, the majorized step `-<c, w>/<w, K w>` lowers E, as gamma is concave; under a load, K then gets a
   small stiffness of mean values. theta is limited by the gaps. A change that closes gaps is made in full, theta = 1,
   if Newton's step is at least WHOLE. If limiting the gaps makes w raise E, a smaller alpha is tried.
6. E must not rise. Otherwise the step is halved.

An iteration applies two operators: `A c`, which also gives the certificate, and `K w`, as the pressure changes by
`theta K w`.

Where the mean gap is given, c, z and t are centred, and w is scaled to keep this mean. V. Rey, G. Anciaux, J.-F.
Molinari, Comput. Mech. 60 (2017) 69 have these gradients without preconditioner; M. Bugnicourt, P. Sainsot, D.
Dureisseix, C. Gauthier, A. A. Lubrecht, Tribol. Lett. 66 (2018) 29 have the working set. All numbers are dimensionless.

`AdhesiveSolver` extends the solver, which needs the inverse of its operator, to a free body. The FFT does not invert
the operator A of a free body. The operator B of a periodic body, with the same Green's function up to half the box,
replaces it (`HalfSpace.gap_operators`), and the difference lags behind: each pass solves for the heights `h - (A - B)
p` with the p of the pass before. One or two passes are usual.

A contact that fills its box may be softer on B than on A, in its mean or in waves that continue across the edges. A
state that is stable on A is then unstable on B, and passes alternate between two states. So if later passes jump or
detach, or MAX_PASSES is reached, the solve restarts with A itself, whose inverse takes some iterations (`FreeInverse`).
Then E falls monotonically. Under a given mean pressure P, `p = K (g + h - P A 1) + P` with K the inverse of A on
pressures of mean 0.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...contact import kernels
from ...contact.certificate import LEAST_SHARE as SOLVER_LEAST_SHARE
from ...contact.problem import Approach, Contact, Control, MeanPressure, Operator, Workspace
from ...parallel.slab import Array, Slab
from ...physics.measures import Certificate
from . import law as gap_kernels
from .law import Law

# accuracy
SHARPER = 10.0  # factor on the complementarity; with it loads are as accurate as without adhesion
SPURIOUS, NET = 2.0, 5.0  # factors on pressures that violate the law: on their magnitude, and on their sum
LEAST_TRACTION = 1e-3  # load below which errors are not scaled by it, over the strength of the law at one point


class GapOperators(NamedTuple):
    """Operator of a body and its inverse K, which is 0 for mean values.

    `mean` is the displacement per unit of uniform pressure, 0 if the mean does not move; `least_mean` is a positive
    compliance for mean values. Both are infinite if K also inverts mean values.
    """

    operator: Operator
    inverse: Operator
    mean: float
    least_mean: float


@dataclass(frozen=True)
class GapSolution:
    """A solved gap (in the map of the start) and its pressure (in a map of the solver, valid until the next solve).

    `failure` is empty, or states why the solve failed. `detached`: no equilibrium exists under the load. `jumped`: the
    solve went through unstable states.
    """

    gap: Array
    p: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str
    detached: bool = False
    jumped: bool = False


@dataclass
class GapIterate:
    """Numbers of an iterate of the solver: mean and lowest gap, uniform part m of the pressure, and approach d.

    `given` is the prescribed mean gap or None. The last step made a `share` of its change of the gap, which changes the
    mean gap by `moved`, and m by `change`; `stable` is True for a Newton step. The next change is first tried with the
    length `step`.
    """

    law: Law
    heights: Array
    mean_height: float
    control: Control
    operators: GapOperators
    given: float | None
    mean_gap: float
    m: float = 0.0
    d: float = 0.0
    lowest: float = 0.0
    share: float = 0.0
    moved: float = 0.0
    change: float = 0.0
    stable: bool = True
    step: float = 1.0


def certify_gap(slab: Slab, it: GapIterate, working: Array, g: Array, q: Array, sigma: Array, z: Array) -> Certificate:
    """Return the certificate of a gap: the errors z, weighted by the pressure and divided by a length, and the error of
    the load; collective.

    The length is the variation of the deformation in the contact, at most the range of the law and at least a tenth of
    this range. The error of the load consists of pressures that violate the law: their magnitudes count SPURIOUS times,
    their sum NET times.
    """
    *sums, spurious, net = slab.sum(*gap_kernels.certificate_sums(working, g, it.heights, q, it.m, sigma, z))
    load, first, second, wrong = sums
    least = LEAST_TRACTION * it.law.strength
    spread, mean = 0.0, 0.0
    if load > 0.0:
        mean = first / load
        spread = math.sqrt(max(second / load - mean**2, 0.0))
    length = min(max(spread, SOLVER_LEAST_SHARE * abs(mean + it.d), SOLVER_LEAST_SHARE * it.law.range), it.law.range)
    load = max(load, least)
    load_error = max(SPURIOUS * spurious, NET * abs(net)) / load
    return Certificate(SHARPER * wrong / load / length, 0.0, load_error, length)


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
        """Solve from the map `gap`, which is overwritten by the solution; collective. `operators` replace the
        solver's."""
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


MAX_STEPS = 100  # accuracy: limit on the steps; a dozen are usual


@dataclass(frozen=True)
class FreeInverse:
    """Inverse of the operator `free` of a free body, by conjugate gradients with the inverse for a `repeated` body,
    which has the same Green's function up to half the box: a dozen steps give five digits. The energy of the error is
    below `tolerance^2` times the energy of the solution. Four `maps` hold intermediate results.

    If `means` is False, pressures have the mean 0, and mean displacements are ignored.
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


MAX_PASSES = 12  # tuning: limit on passes of a free body before A itself is used; one to three are usual
LEFT = 0.8  # accuracy: tolerance of a solve with A over the tolerance of the run; the rest is for the inverse
DIGITS = 0.01  # accuracy: relative error of the inverse of A, over the tolerance
UNSETTLED = "did not settle in a free box"
LEAST_SHARE, MOST_SHARE = 0.1, 4.0  # tuning: limits on the share of a change of the lagged part that is made


@dataclass
class AdhesiveSolver:
    """Solver of contacts with adhesion; `free` is the operator A of a free body, None for a periodic body."""

    gaps: GapSolver
    workspace: Workspace
    tolerance: float
    free: Operator | None = None

    def solve(
        self,
        law: Law,
        heights: Array,
        control: Control,
        gap: Array,
        free_correction: Array | None,
        out: Array,
        loose: float = 1.0,
    ) -> tuple[Contact, bool]:
        """Solve from the map `gap`, which is overwritten by the solution, and put the pressure into `out`; collective.

        `free_correction` is `(A - B) p` of a free body and is updated. `loose` multiplies the tolerance. Return the
        contact, and True if the surfaces have detached.
        """
        tolerance = loose * self.tolerance
        if self.free is None or free_correction is None:
            found = self.gaps.solve(law, heights, control, gap, tolerance)
            out[...] = found.p
            u = self.workspace.displacement
            np.add(gap, heights, out=u)
            u += found.d
            return self._contact(found, out, found.iterations), found.detached
        start = self.workspace.pressure
        start[...] = gap
        found, iterations = self._solve_fixed_point(law, heights, control, gap, free_correction, out, tolerance)
        if found.failure:
            gap[...] = start
            found = self._solve_free(law, heights, control, gap, free_correction, out, tolerance)
            iterations += found.iterations
        return self._contact(found, out, iterations), found.detached

    def _solve_fixed_point(
        self,
        law: Law,
        heights: Array,
        control: Control,
        gap: Array,
        free_correction: Array,
        out: Array,
        tolerance: float,
    ) -> tuple[GapSolution, int]:
        """Repeat the solve of a free body until `free_correction` is constant. Return the solution, with a failure if
        it does not settle, and the iterations of all passes; collective."""
        iterations, share, last = 0, 1.0, free_correction
        for passes in range(1, MAX_PASSES + 1):
            found = self.gaps.solve(law, heights - free_correction, control, gap, tolerance)
            iterations += found.iterations
            found, change, worst = self._compare(heights, control, gap, found, out)
            share = self._share(share, out, change, last) if passes > 1 else 1.0
            last = change
            free_correction += share * change
            if found.failure or worst <= tolerance or (found.detached and passes == 1):
                return found, iterations
            if passes > 1 and (found.jumped or found.detached):
                break
        return replace(found, failure=UNSETTLED), iterations

    def _solve_free(
        self,
        law: Law,
        heights: Array,
        control: Control,
        gap: Array,
        free_correction: Array,
        out: Array,
        tolerance: float,
    ) -> GapSolution:
        """Solve with the operator of the free body and update `free_correction`; collective."""
        assert self.free is not None
        work, repeated = self.workspace, self.gaps.operators
        maps = (work.pressure, work.displacement, work.other_displacement, free_correction)  # all in double precision
        inverse = FreeInverse(work.slab, self.free, repeated, DIGITS * tolerance, maps, isinstance(control, Approach))
        operators = repeated._replace(operator=self.free, inverse=inverse)
        if isinstance(control, Approach):
            operators = operators._replace(mean=math.inf, least_mean=math.inf)
            found = self.gaps.solve(law, heights + control.value, Approach(0.0), gap, LEFT * tolerance, operators)
            found = replace(found, d=control.value)
        else:
            work.displacement.fill(1.0)
            lifted = heights - control.value * self.free.apply(work.displacement, work.displacement)
            found = self.gaps.solve(law, lifted, control, gap, LEFT * tolerance, operators)
        found, _, worst = self._compare(heights, control, gap, found, out)
        repeated.operator.apply(out, free_correction)
        np.subtract(work.displacement, free_correction, out=free_correction)
        if not found.failure and worst > tolerance:
            asked = f"changes are {worst:.3g} where {tolerance:.3g} was asked for"
            return replace(found, failure=f"{UNSETTLED}: {asked}")
        return found

    def _compare(
        self, heights: Array, control: Control, gap: Array, found: GapSolution, out: Array
    ) -> tuple[GapSolution, Array, float]:
        """Put the pressure into `out`; collective. Return the solution with its error on the free body in the
        certificate, the displacement of the free body minus that of the solution, and the size of this difference."""
        assert self.free is not None
        out[...] = found.p
        change = self.free.apply(out, self.workspace.displacement) - (heights + gap)
        change -= found.d
        found, worst = self._judge(control, found, out, change)
        return found, change, worst

    def _judge(self, control: Control, found: GapSolution, p: Array, change: Array) -> tuple[GapSolution, float]:
        """Add the change of displacements in a pass to the certificate, except a change of the approach. Return the
        solution and this error; collective."""
        certificate, slab = found.certificate, self.workspace.slab
        load, sum_change = slab.sum(*gap_kernels.weighted_sums(p, change))
        shift = sum_change / load if isinstance(control, MeanPressure) and load > 0.0 else 0.0
        (wrong,) = slab.sum(gap_kernels.weigh_off(p, change, shift))
        worst = SHARPER * wrong / load / certificate.length if load > 0.0 else 0.0
        certificate = replace(certificate, complementarity=max(certificate.complementarity, worst))
        return replace(found, certificate=certificate, d=found.d + shift), worst

    def _share(self, share: float, p: Array, change: Array, last: Array) -> float:
        """Return the share of a change to make: Aitken's extrapolation of the last two, weighted by the pressure;
        collective."""
        weight, difference = np.abs(p), change - last
        along = float((weight * last * difference).sum())
        along, size = self.workspace.slab.sum(along, float((weight * difference**2).sum()))
        wanted = -share * along / size if size > 0.0 else 1.0
        return min(max(wanted, LEAST_SHARE), MOST_SHARE)

    def _contact(self, found: GapSolution, p: Array, iterations: int) -> Contact:
        """Return the solution as a contact, whose displacement is in the workspace."""
        return Contact(p, self.workspace.displacement, found.d, found.certificate, iterations, found.failure)
