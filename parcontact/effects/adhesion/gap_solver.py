"""Contact with adhesion by projected, preconditioned conjugate gradients over the gap.

Find the gap g >= 0 and the pressure p with the attraction sigma of a law, so that

    p = c - sigma(g),   c >= 0,   c g = 0,   A p = g + h + d,

for an operator A, effective heights h, and the approach d or the mean pressure P. K is the inverse of A on fields of
mean 0, a is the displacement per unit of uniform pressure, and `p = K (g + h) + m` with

    m = P                                  under a given load,
    m = (mean(g + h) + d)/a                under a given approach, a > 0,
    mean(g) = -mean(h) - d, which gives m  under a given approach, a = 0 (a periodic half space).

The solution is one of many stationary points of the energy E, which is `<g + h, K (g + h)>/2 - sum gamma(g)` plus the
energy of the uniform pressure m, with `d gamma/dg = -sigma`. The solve starts at the gap of the last step, E falls in
every iteration, and no barrier is crossed deliberately, so that the history decides the branch. One iteration:

1. The working set consists of open points (g > 0) and of points in contact under tension (c < 0).
2. The residual on the working set is `c = K (g + h) + m + sigma(g)`. The preconditioned residual is `z = A c`.
3. The direction is `t = z + beta t` (Polak and Ribiere), or `t = z` if E does not fall along `z + beta t`.
4. The change of the gap is `w = max(g - alpha t, 0) - g`, with the alpha that would have been best for the last step.
5. The new gap is `g + theta w`. theta is Newton's step `-<c, w>/(<w, K w> - <w, (-sigma') w>)` if its denominator, the
   curvature of E along w, is clearly positive. Otherwise it is the majorized step `-<c, w>/<w, K w>`, which lowers E as
   gamma is concave; under a load, K then gets a small stiffness of mean values. theta is limited so that no gap becomes
   negative. If w closes gaps and Newton's step is at least WHOLE, theta is 1. If w would raise E because gaps are at
   least 0, a smaller alpha is tried.
6. E must not rise. Otherwise the step is halved.

An iteration applies two operators: A to c, which also gives the certificate, and K to w, which gives the change of the
pressure, `theta K w`.

If the mean gap is given, c, z and t get the mean 0, and w is scaled so that the mean gap does not change. V. Rey, G.
Anciaux, J.-F. Molinari, Comput. Mech. 60 (2017) 69 use these gradients without a preconditioner; M. Bugnicourt, P.
Sainsot, D. Dureisseix, C. Gauthier, A. A. Lubrecht, Tribol. Lett. 66 (2018) 29 use the working set. All numbers are
dimensionless.

The attraction sigma, its energy gamma and its slope follow from a `Law`. It has a `kind` (EXPONENTIAL or DUGDALE), a
strength s, a range rho and a ramp r,

    exponential  sigma(g) = s exp(-g/rho),            gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s ((rho - g)/r + 1/2), limited to 0..s, and -d gamma/dg = sigma.

Over the ramp, of at most 2 rho, the attraction falls linearly from s to 0. This is the mean of the law without a ramp
over a cell in which the gap rises by r. The energy gamma(0) = s rho is the same as without a ramp. The exponential is
the most expensive part of a loop, so energy and slope are computed from sigma.

In the loops, which run over the rows of this rank and return partial sums for one Allreduce, q is the pressure
K (g + h), to which a mean is added.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import loop
from ...contact import kernels
from ...contact.certificate import LEAST_SHARE as SOLVER_LEAST_SHARE
from ...contact.problem import Approach, Control, MeanPressure, Operator
from ...parallel.slab import Array, Slab
from ...physics.records import Certificate

EXPONENTIAL, DUGDALE = 0, 1
LOG_TWO = math.log(2.0)
TAYLOR = tuple(1.0 / math.factorial(power) for power in range(14))  # series of exp, exact to rounding up to LOG_TWO/2
FARTHEST = 700.0  # accuracy: largest exponent; exp(-x) of a larger x, below 1e-304, is taken as 0
POWERS = 2.0 ** -np.arange(FARTHEST / LOG_TWO + 2.0)


class Law(NamedTuple):
    """Law of attraction in the units of a solve: its kind (EXPONENTIAL or DUGDALE), strength, range and ramp. Only the
    kind DUGDALE has a ramp."""

    kind: int
    strength: float
    range: float
    ramp: float = 0.0


@loop
def decay(x):
    """Return `exp(-x)` for x >= 0, to a few units of rounding, in a form that compilers vectorize."""
    near = x if x < FARTHEST else FARTHEST
    whole = math.floor(near / LOG_TWO + 0.5)
    rest = whole * LOG_TWO - near
    result = TAYLOR[13]
    for power in range(12, -1, -1):
        result = result * rest + TAYLOR[power]
    return result * POWERS[int(whole)] if x < FARTHEST else 0.0


@loop
def attraction(law, g):
    """Return the attraction sigma of a law at the gap g."""
    if law.kind == EXPONENTIAL:
        return law.strength * decay(g / law.range)
    return law.strength * min(max((law.range - g) / law.ramp + 0.5, 0.0), 1.0)


@loop
def energy(law, g, sigma):
    """Return gamma(g): the energy per area that opens the gap from g to infinity. `sigma` is the attraction at g."""
    if law.kind == EXPONENTIAL:
        return law.range * sigma
    end = law.range + 0.5 * law.ramp
    return sigma * (law.range - g if sigma == law.strength else 0.5 * (end - g))


@loop
def softening(law, sigma):
    """Return `-d sigma/dg` at the gap where the attraction is sigma."""
    if law.kind == EXPONENTIAL:
        return sigma / law.range
    return law.strength / law.ramp if 0.0 < sigma < law.strength else 0.0


SHORT = 1e-3  # accuracy: longest way over the range for which the trapezoidal energy is used; its error is 1e-7


@loop
def attract(law, g, sigma):
    """Put the attraction sigma(g) of a law into the map `sigma`."""
    for j in range(g.shape[0]):
        for i in range(g.shape[1]):
            sigma[j, i] = attraction(law, g[j, i])


@loop
def press(g, q, sigma, step, image):
    """Add `step image` to q, the pressure without its mean. Return the number of open points, and the sum of `q +
    sigma` over these points."""
    count, total = 0.0, 0.0
    for j in range(g.shape[0]):
        row_count, row_total = 0.0, 0.0
        for i in range(g.shape[1]):
            q[j, i] += step * image[j, i]
            weight = 1.0 if g[j, i] > 0.0 else 0.0
            row_count += weight
            row_total += weight * (q[j, i] + sigma[j, i])
        count += row_count
        total += row_total
    return count, total


@loop
def pressure_residual(g, q, sigma, mean, working, c):
    """Put `q + mean + sigma` into c on the working set (open points, and closed points under tension), 0 elsewhere.
    Return the size of the set, the sum of c, and the sum of sigma over all points."""
    count, total, attracted = 0.0, 0.0, 0.0
    for j in range(g.shape[0]):
        row_count, row_total, row_attracted = 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            pushed = q[j, i] + mean + sigma[j, i]
            row_attracted += sigma[j, i]
            inside = (g[j, i] > 0.0) | (pushed < 0.0)
            working[j, i] = inside
            c[j, i] = pushed if inside else 0.0
            row_count += 1.0 if inside else 0.0
            row_total += pushed if inside else 0.0
        count += row_count
        total += row_total
        attracted += row_attracted
    return count, total, attracted


@loop
def certificate_sums(working, g, h, q, mean, sigma, z):
    """Return six sums from which the error of a gap follows: of w, w u and w u^2 over all points, and of w |z|, |c| and
    c over the working set.

    u is the displacement `g + h`. c is the residual `p + sigma` on the working set and 0 elsewhere, with the pressure
    `p = q + mean`, and z the preconditioned residual. The weight w of a point is |p| + |c|.
    """
    load, first, second, wrong, spurious, net = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(g.shape[0]):
        row_load, row_first, row_second, row_wrong, row_spurious, row_net = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            p, u, weight = q[j, i] + mean, g[j, i] + h[j, i], 1.0 if working[j, i] else 0.0
            c = weight * (p + sigma[j, i])
            size = abs(p) + abs(c)
            row_load += size
            row_first += size * u
            row_second += size * u * u
            row_wrong += weight * size * abs(z[j, i])
            row_spurious += abs(c)
            row_net += c
        load += row_load
        first += row_first
        second += row_second
        wrong += row_wrong
        spurious += row_spurious
        net += row_net
    return load, first, second, wrong, spurious, net


@loop
def gap_products(working, q, mean, sigma, step, image, sigma_old, shift, z, t):
    """Return the sums of z, t, c z, e z and c t over the working set. c is the residual `q + mean + sigma`, and e its
    change in the last step, `step image + sigma - sigma_old + shift`; `shift` is the change of the mean."""
    sum_z, sum_t, c_z, e_z, c_t = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(z.shape[0]):
        row_z, row_t, row_c_z, row_e_z, row_c_t = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(z.shape[1]):
            weight = 1.0 if working[j, i] else 0.0
            z_here, t_here = weight * z[j, i], weight * t[j, i]
            c = q[j, i] + mean + sigma[j, i]
            row_z += z_here
            row_t += t_here
            row_c_z += c * z_here
            row_e_z += (step * image[j, i] + sigma[j, i] - sigma_old[j, i] + shift) * z_here
            row_c_t += c * t_here
        sum_z += row_z
        sum_t += row_t
        c_z += row_c_z
        e_z += row_e_z
        c_t += row_c_t
    return sum_z, sum_t, c_z, e_z, c_t


@loop
def lead(g, t, step, way):
    """Put the change of the gap, `max(g - step t, 0) - g`, into the map `way`. Return the sum of all gaps after this
    change, and the amount by which the limit 0 has raised this sum."""
    total, cut = 0.0, 0.0
    for j in range(t.shape[0]):
        row_total, row_cut = 0.0, 0.0
        for i in range(t.shape[1]):
            wanted = g[j, i] - step * t[j, i]
            kept = wanted if wanted > 0.0 else 0.0
            way[j, i] = kept - g[j, i]
            row_total += kept
            row_cut += kept - wanted
        total += row_total
        cut += row_cut
    return total, cut


@loop
def curvature(law, g, q, mean, sigma, way, image):
    """Return the sums of `-c w`, `w K w`, `w^2 (-d sigma/dg)` and w, and the largest -w/g. w is the change of the gap
    in the map `way`, K w is in the map `image`, and c is the residual `q + mean + sigma`."""
    slope, stiff, soft, total = 0.0, 0.0, 0.0, 0.0
    fastest, most = np.empty(g.shape[1]), 0.0
    for i in range(fastest.size):
        fastest[i] = 0.0
    for j in range(g.shape[0]):
        row_slope, row_stiff, row_soft, row_total = 0.0, 0.0, 0.0, 0.0
        for i in range(g.shape[1]):
            w = way[j, i]
            row_slope -= (q[j, i] + mean + sigma[j, i]) * w
            row_stiff += w * image[j, i]
            row_soft += w * w * softening(law, sigma[j, i])
            row_total += w
            fastest[i] = max(fastest[i], -w / g[j, i] if w < 0.0 else 0.0)
        slope += row_slope
        stiff += row_stiff
        soft += row_soft
        total += row_total
    for i in range(fastest.size):
        most = max(most, fastest[i])
    return slope, stiff, soft, total, most


@loop
def move(law, g, q, mean, sigma, step, way, image, g_new, sigma_new):
    """Put `g + step way`, at least 0, into the map `g_new`, and the attraction at this gap into `sigma_new`.

    Return by how much the energy changes, which is the sum of `d (q + mean + step image/2) + gamma(g) - gamma(g_new)`
    with `d = g_new - g`. Also return the sum of the magnitudes of both parts. For small d the change of gamma is
    computed as d times the mean attraction, which has a smaller rounding error.
    """
    total, size = 0.0, 0.0
    for j in range(g.shape[0]):
        row_total, row_size = 0.0, 0.0
        for i in range(g.shape[1]):
            now, d, pull = g[j, i], step * way[j, i], sigma[j, i]
            new = now + d if now + d > 0.0 else 0.0
            pull_new = attraction(law, new)
            surface = energy(law, now, pull) - energy(law, new, pull_new)
            if law.kind == EXPONENTIAL and abs(d) < SHORT * law.range:
                surface = 0.5 * d * (pull + pull_new)
            push = q[j, i] + mean + 0.5 * step * image[j, i]
            g_new[j, i] = new
            sigma_new[j, i] = pull_new
            row_total += d * push + surface
            row_size += abs(d * push) + abs(surface)
        total += row_total
        size += row_size
    return total, size


@loop
def surface_energy(law, g):
    """Return the sum of `-gamma(g)`, the energy of the surfaces."""
    total = 0.0
    for j in range(g.shape[0]):
        row = 0.0
        for i in range(g.shape[1]):
            row -= energy(law, g[j, i], attraction(law, g[j, i]))
        total += row
    return total


# accuracy
SHARPER = 10.0  # factor on the complementarity; with it loads are as accurate as without adhesion
SPURIOUS, NET = 2.0, 5.0  # factors on pressures that violate the law: on their magnitude, and on their sum
LEAST_TRACTION = 1e-3  # load below which errors are not scaled by it, over the strength of the law at one point


class GapOperators(NamedTuple):
    """The operator A of a body, and its `inverse` K on fields of mean 0. K of a uniform field is 0.

    `mean` is the displacement under a uniform pressure of 1, of which K takes no account; 0 if a uniform pressure does
    not move the surface. Divisions are by `least_mean`, which is a positive number if `mean` is 0, and otherwise equal
    to it. If K is the inverse of A on all fields, both are infinite, so that `1/mean` adds nothing.
    """

    operator: Operator
    inverse: Operator
    mean: float
    least_mean: float


class GapProblem(NamedTuple):
    """Input of a solve: the law of attraction, the effective heights and the prescribed load."""

    law: Law
    heights: Array
    control: Control


@dataclass(frozen=True)
class GapSolution:
    """Solution of a problem: the gap, the pressure p, and the approach d.

    `gap` is the map from which the solve started. `p` is a map of the solver, which is valid until the next solve.
    `failure` is empty, or states why the solve failed. `detached` is True if no equilibrium exists under the load, and
    `jumped` if the solve went through unstable states.
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
    """The input of a solve, and numbers of its present iterate: the mean and the lowest gap, the uniform part m of the
    pressure, and the approach d.

    `given` is the prescribed mean gap, or None. The last iteration made a `share` of its full step. The full step would
    have changed the mean gap by `moved`. The iteration changed m by `change`. `stable` is True after a Newton step.
    `step` is the first alpha (see the module) of the next iteration.
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
        self, problem: GapProblem, gap: Array, tolerance: float, operators: GapOperators | None = None
    ) -> GapSolution:
        """Solve from the gap in the map `gap`, which the solution overwrites; collective. `operators` are used in place
        of the operators of the solver."""
        it = self._begin(problem, gap, operators or self.operators)
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

    def _begin(self, problem: GapProblem, gap: Array, operators: GapOperators) -> GapIterate:
        """Scale the start to a given mean gap, compute its pressure, and forget the last direction."""
        law, heights, control = problem
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
        attract(law, gap, self._sigma)
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
        count, total = self.slab.sum(*press(g, q, sigma, it.share, self._image))
        if it.given is None:
            it.m = self._uniform(it, it.mean_gap)
        else:
            lowest = 0.0 if count else self.slab.reduce((), [float((-q).max(initial=-np.inf))])[0]
            it.m = -total / count if count else lowest - it.law.strength  # in full contact the least that keeps it
        sums = pressure_residual(g, q, sigma, it.m, self._working, self._way)
        members, total, attracted, least = self.slab.reduce(sums, [-float(g.min(initial=np.inf))])
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
        """Put `A c` into z, with c in the map of the way; collective. Return the certificate of the gap: the errors z,
        weighted by the pressure and divided by a length, and the error of the load.

        The length is the variation of the deformation in the contact, at most the range of the law and at least a tenth
        of this range. The error of the load consists of pressures that violate the law: their magnitudes count SPURIOUS
        times, their sum NET times.
        """
        it.operators.operator.apply(self._way, z)
        maps = self._working, g, it.heights, self._q, it.m, self._sigma, z
        load, first, second, wrong, spurious, net = self.slab.sum(*certificate_sums(*maps))
        mean = first / load if load > 0.0 else 0.0
        spread = math.sqrt(max(second / load - mean**2, 0.0)) if load > 0.0 else 0.0
        reach, load = it.law.range, max(load, LEAST_TRACTION * it.law.strength)
        length = min(max(spread, SOLVER_LEAST_SHARE * abs(mean + it.d), SOLVER_LEAST_SHARE * reach), reach)
        return Certificate(
            SHARPER * wrong / load / length, 0.0, max(SPURIOUS * spurious, NET * abs(net)) / load, length
        )

    def _turn(self, it: GapIterate, members: float, scale: float, z: Array) -> float:
        """Make the new direction from z. Return `<c, z>`; `scale` belongs to the last direction, 0 forgets it.
        Collective."""
        working = self._working
        step = it.share, self._image, self._other_sigma, it.change
        sums = gap_products(working, self._q, it.m, self._sigma, *step, z, self._t)
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
            rise, size = self.slab.sum(*move(it.law, g, self._q, it.m, self._sigma, *to))
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
            total, cut = self.slab.sum(*lead(g, self._t, it.step, self._way))
            if it.given is not None and cut > 0.0:
                self._way += g  # the gap after the step, scaled to its mean
                self._way *= it.given * self.slab.points / total
                self._way -= g
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
        *sums, fastest = curvature(it.law, g, self._q, it.m, self._sigma, self._way, self._image)
        slope, stiff, soft, total, fastest = self.slab.reduce(sums, [fastest])
        it.moved = total / self.slab.points
        own, loaded = self.slab.points * it.moved**2 / it.operators.least_mean, isinstance(it.control, MeanPressure)
        true, major = stiff - soft + (0.0 if loaded else own), stiff + (LOOSE if loaded else 1.0) * own
        it.stable = true > LEAST_CURVATURE * major
        wanted = slope / (true if it.stable else major) if major > 0.0 else 0.0
        return wanted, 1.0 / fastest if fastest > 0.0 else math.inf
