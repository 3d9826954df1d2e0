"""Tractions of a contact that sticks and slips, by projected, preconditioned conjugate gradients on discs.

With A the operator of the body, from tractions to displacements, and bounds f of the tractions, find t with

    |t| <= f,     w = e - A t,     w = 0 where |t| < f,     w along t where |t| = f.

w is the slip in a step in which a point that sticks ends at the displacement e. The solution minimizes the convex
function `J(t) = <t, A t>/2 - <t, e>` over the product of discs |t| <= f. One iteration:

1. Points slip where t was shortened to its disc and w is not against it; the others stick. A traction that slips can
   only turn. Turning it by an angle is resisted by the body, and by its slip: to A, `|w|/f` is added.
2. The residual r is w where points stick, and the part of w across t where they slip. The direction z is `S E' K E S r
   + (1 - S^2)/(1/kappa + |w|/f) r + k <w>`. K is close to the inverse of A, E extends each component beyond the points
   that move along it (`preconditioner.extension`), and S, 1 where points stick, is small where slip resists more than
   the shortest waves. K is left out for a component along which there is little to correct. <w> is the mean slip of
   the points that stick. In a periodic box, whose mean traction does not move the surface, these resist it with about
   `k = kappa/(1 - m)`, where m is their share of the box: much more than K assumes.
3. With d the last change of t, t moves by `STEP (z + beta d) + gamma d`. beta makes z conjugate to d, and gamma
   minimizes J along d: both follow from A d, which is known. Then tractions that slip get the length f, and others are
   shortened to it.
4. Discs are convex, so that all tractions between the old and the new ones are admissible. t becomes the one with the
   least J of them, and A t follows without another application of A. So J never rises. If all points stick and J is
   least far beyond the new ones, K is much smaller than the inverse of A, as in a free row of long cells: STEP grows.
5. If this is a small part of the way, the next iteration takes `t + kappa w`, shortened to its disc, for the new
   tractions. It always descends.

kappa is a stiffness of the contact as a whole. The certificate is the larger of two measures of what t lacks, over the
sum of |t|: of the traction that the slip w gives, `sum |P(t + kappa w) - t|` with P(t) = t shortened to its disc, and
of the change in step 3, where K measures residuals of all wavelengths. It is 0 for the solution alone, and the
relative error of tractions where K is close. Over many small steps errors of each would add up, as points slip by
them. So it must also be below a share of the change of t since the last step, but for a tenth of the tolerance. For
the related constraint p >= 0 the method is that of `solve.contact`.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...parallel.slab import Array, Slab
from ...solve.preconditioner.extension import ExtendedPreconditioner, Grids
from ...solve.problem import Operator
from . import discs
from .shear_operator import ShearOperator, components, stacked

# tuning
STEP = 0.6  # least step along z; waves along q have half the stiffness that K assumes
FAR = 2.0  # ratio of the way to the least J and the way gone, or its inverse, from which the step changes
MOST_STIFFENING = 4.0  # limit on k over kappa
LEAST_PART = 0.2  # least share of a component in the residual for which K is applied to it
LEAST_DESCENT = 0.5  # least slope along a direction over that along z; below it the last change is forgotten
MOST_GROWTH = 20.0  # limit on gamma; reached where nothing resists, as all points of a periodic box stick
SMALL_SHARE = 0.2  # share of the way to the new tractions; below it, tractions follow the slip next
MAX_STALLED = 60  # limit on iterations without a smaller certificate
# accuracy
SHARE_OF_CHANGE = 0.2  # largest certificate over the change of tractions since the last step
LEAST_TOLERANCE = 0.1  # share of the tolerance that is small enough however little tractions change
LEAST_LEFT = 0.01  # share of the last tractions; errors of tractions that fall below it count relative to it
ROUNDING = 4 * float(np.finfo(np.float64).eps)  # share of sums of t w below which a change of J is rounding
Components = tuple[Array, Array, Array, Array, Array, Array]  # those of t, A t and e


class TractionProblem(NamedTuple):
    """Bounds f; stacked displacements e of points that stick; a stiffness kappa of the contact, in the unit of t over
    the unit of e; and the tolerance of the certificate."""

    bound: Array
    aim: Array
    kappa: float
    tolerance: float


@dataclass(frozen=True)
class Tractions:
    """Solved tractions, in the caller's map. `displacement = A t` belongs to the solver and is valid until its next
    solve.

    `failure` is empty, or states why the tolerance was not reached.
    """

    displacement: Array
    certificate: float
    iterations: int
    failure: str = ""


class TangentialSolver:
    """Solver on one grid, with the `operator` of the body for stacked tractions and a `preconditioner` for one
    component."""

    def __init__(self, slab: Slab, operator: ShearOperator, preconditioner: Operator, grids: Grids, limit: int) -> None:
        self.slab, self._limit = slab, limit
        self._operator, self._preconditioner = operator, preconditioner
        self._extended = ExtendedPreconditioner(slab, larger=grids)
        both = stacked(slab)
        self._other, self._u, self._other_u, self._z = (both.zeros() for _ in range(4))
        self._turn = slab.zeros()
        self._free, self._hit, self._moves = (slab.zeros(np.bool_) for _ in range(3))

    def solve(self, problem: TractionProblem, t: Array, last: Array, factor: float = 1.0) -> Tractions:
        """Solve from the tractions t, which are overwritten by the solution; collective. `factor` times `last` are the
        tractions of the step before."""
        bound, aim, kappa, asked = problem
        discs.shorten_to_bounds(bound, *components(t), self._hit)
        if self._is_at_rest(bound, aim, t):
            self._u.fill(0.0)
            return Tractions(self._u, 0.0, 0)
        start, best, iteration, follows, step = t, (math.inf, 0), 0, False, STEP
        self._operator.apply(t, self._u)
        while True:
            now = *components(t), *components(self._u), *components(aim)
            found = self.slab.sum(*discs.examine(bound, self._hit, *now, kappa, self._free, self._turn))
            change = self._move(bound, now, kappa, found, step, begins=iteration == 0)
            since = discs.change_since(bound, *now[:2], *components(last), factor)
            change, changed, before = self.slab.sum(change, *since)
            size = max(*found[:2], LEAST_LEFT * before)
            certificate = max(found[2], change) / size
            tolerance = min(asked, max(SHARE_OF_CHANGE * changed / size, LEAST_TOLERANCE * asked))
            best = min(best, (certificate, iteration))
            failure = self._verdict(certificate, tolerance, iteration, best)
            if failure is not None:
                if t is not start:
                    start[...], self._other = t, t
                return Tractions(self._u, certificate, iteration, failure)
            if follows:
                self._other[...] = t + kappa * (aim - self._u)
                discs.shorten_to_bounds(bound, *components(self._other), self._hit)
            t, share = self._descend(aim, t)
            if iteration > 0 and not follows and not 1.0 / FAR < share < FAR:
                step = min(max(share * step, STEP), MOST_GROWTH)
            follows, iteration = share < SMALL_SHARE, iteration + 1

    def _move(
        self, bound: Array, now: Components, kappa: float, found: list[float], step: float, begins: bool
    ) -> float:
        """Put the next tractions in the place of the last ones, and return this rank's sum of changes; collective.

        `now` are the components of t, A t and e, `found` the sums of `discs.examine`."""
        parts, mean = found[3:5], self._mean_step(kappa, *found[5:])
        z, points = components(self._z), (bound, self._free, self._turn)
        for along_x, r, part in zip((True, False), z, parts, strict=True):
            if part <= LEAST_PART * sum(parts):
                r.fill(0.0)
                continue
            discs.residual(*points, *now, self._operator.short, along_x, self._moves, r)
            self._extended.apply(self._preconditioner, self._moves, r)
        last, last_u = components(self._other), components(self._other_u)
        products = discs.complete(*points, *now, *last, *last_u, self._operator.short, 1.0 / kappa, *mean, *z)
        again = 0.0 if begins else _step_along_last(step, *self.slab.sum(*products))
        return discs.move_tractions(bound, self._free, *now[:2], *z, step, again, *last, self._hit)

    def _mean_step(self, kappa: float, w_x: float, w_y: float, sticking: float) -> tuple[float, float]:
        """Return `k <w>`, from sums of the slip over points that stick; 0 if these fill the box, as nothing resists."""
        others = self.slab.points - sticking
        if self._operator.free or sticking == 0.0 or others == 0.0:
            return 0.0, 0.0
        k = kappa * min(self.slab.points / others, MOST_STIFFENING)
        return k * w_x / sticking, k * w_y / sticking

    def _descend(self, aim: Array, t: Array) -> tuple[Array, float]:
        """Go from the tractions t towards the next ones, to the least J on the way. Return the new tractions, and the
        way to the least J over the way to the next ones: at most 1 where tractions reach their bounds; collective."""
        new, u, new_u = self._other, self._u, self._other_u
        self._operator.apply(new, new_u)
        sums = discs.slope_and_curvature(t, new, u, new_u, aim)
        slope, curvature, size, hits = self.slab.sum(*sums, float(self._hit.any()))
        rounded = max(abs(slope), curvature) <= ROUNDING * size
        share = 1.0 if rounded or curvature <= 0.0 or (hits and slope >= curvature) else max(slope / curvature, 0.0)
        if share < 1.0:
            discs.shorten_change(t, share, new)
            discs.shorten_change(u, share, new_u)
        self._other, self._u, self._other_u = t, new_u, u
        return new, share

    def _verdict(self, certificate: float, tolerance: float, iteration: int, best: tuple[float, int]) -> str | None:
        """Return None to continue, an empty string if solved, else why the solve has failed."""
        if certificate <= tolerance:
            return ""
        asked = f"{certificate:.3g} where {tolerance:.3g} was asked for"
        if iteration >= self._limit or not math.isfinite(certificate):
            failed = f"the tractions did not converge in {iteration} iterations: the residual is {asked}"
            return f"{failed}; try numerics.max_iterations above {self._limit}, or smaller steps"
        if iteration - best[1] >= MAX_STALLED:
            failed = f"the tractions stalled: no residual below {best[0]:.3g} in {MAX_STALLED} iterations, now {asked}"
            return f"{failed}; try a larger numerics.tolerance, or smaller steps"
        return None

    def _is_at_rest(self, bound: Array, aim: Array, t: Array) -> bool:
        """Return whether tractions and displacements are 0 at all points in contact; collective."""
        touching = bound > 0.0
        parts = *components(aim), *components(t)
        largest = max(float(np.abs(part).max(where=touching, initial=0.0)) for part in parts)
        return self.slab.reduce((), [largest])[0] == 0.0


def _step_along_last(step: float, r_z: float, r_d: float, z_c: float, d_c: float) -> float:
    """Return the step along the last change d for a step along z, from the products of `discs.complete`."""
    again = MOST_GROWTH
    if r_d <= MOST_GROWTH * d_c:
        again = (r_d - step * z_c) / d_c if d_c > 0.0 else 0.0
    return again if step * r_z + again * r_d > LEAST_DESCENT * step * r_z else 0.0
