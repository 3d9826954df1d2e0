"""Frictionless contact of a body with a rigid surface by projected, preconditioned conjugate gradients.

Find the admissible pressure p, an `ny x nx` map, whose gap `g = A p - h - d` meets the conditions of the constraint. A
is symmetric and positive; either mean(p) = P0 is given and d unknown, or d is given. Without a hardness:

    p >= 0,   g >= 0,   p g = 0.

The solution minimizes `f(p) = <p, A p>/2 - <p, h + d>` over the admissible p. R restricts a map to the working set, and
C subtracts the mean over the working set. One iteration is:

1. The working set consists of the contact (p > 0) and of the points that penetrate (g < 0).
2. The residual is `r = C R g`, and the preconditioned residual is `z = C R E' K E r`. K is close to the inverse of A,
   and E extends r beyond the set (`preconditioner`).
3. The direction is `t = C R (z + beta t)`. Here beta makes t conjugate to the last direction, and corrects for a last
   step that was not exact. beta is 0, so that t = z, if f falls much less along `z + beta t` than along z, or if the
   bounds cut off much of the last step.
4. `p <- p - alpha t`, limited to the bounds of p and scaled to the mean P0. In cold solves in free boxes, much load
   that the lower bound has added is first removed by subtracting one pressure from all points: scaling would unload
   spots to which nothing was added. If the hardness is far below the stiffness, alpha is limited, so that few pressures
   change from one bound to the other.
5. f must not rise. Otherwise the step is halved, and the direction is forgotten.

The exact step `<r, t>/<t, A t>` needs one more application of the operator. As K E is nearly the inverse of A, a fixed
step near 1 replaces it. `A p` of the next iterate gives `<t, A t>` and thus the exact step. If the ratio of the exact
step to the step made, or its inverse, exceeds MAX_STEP_RATIO, or if the certificate no longer falls, the rest of the
solve makes exact steps. On lines of points and on cells much longer than wide, all steps are exact.

With d given, nothing is centred or scaled. With P0 given, d is the mean of `A p - h` over free points, weighted by p,
so that `<p, g> = 0` and scaling p does not change f to first order. Thus f falls for every sufficiently small step (D.
P. Bertsekas, SIAM J. Control Optim. 20 (1982) 221, for d given). Without K this is the method of I. A. Polonsky and L.
M. Keer, Wear 231 (1999) 206; with K the number of iterations hardly depends on the grid. All numbers are dimensionless.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..parallel.slab import Array, Slab, reused
from ..physics import loops
from ..physics.records import Certificate
from . import kernels
from .certificate import Iterate, certify, form_iterate
from .preconditioner import ALL, ExtendedPreconditioner, Grids
from .problem import Contact, Problem, Workspace, scale_to_load, subtract_load

# tuning
MAX_STALLED_ITERATIONS = 60  # limit on iterations without a smaller certificate
MAX_STALLED_IN_SINGLE = 12  # the same with displacements in single precision; double precision is tried next
MAX_HALVINGS = 12  # limit on halvings of a step that raises f; the last one is accepted
STEP = 0.95  # fixed step at small contact areas; it tends to 1 in full contact
MAX_STEP_RATIO = 1.25  # limit on exact step/step made and its inverse; beyond it all further steps are exact
MAX_STEP_RATIO_FREE = 2.0  # the same in a free box, or with a `further` preconditioner: K is less close to the inverse
ITERATIONS_UNTIL_EXACT_STEPS = 5  # iterations without a smaller certificate after which steps are exact
LEAST_DESCENT = 0.5  # least slope along t over that along z; below it the last direction is forgotten
REACH = 4.0  # largest change of a pressure in one step, over the highest admissible pressure
LARGE_CUT = 0.003  # share of the load that counts as much; if more is cut off, the direction is forgotten
# accuracy
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # share of <p, A p>/2 below which a rise of f is rounding
LEAST_LOAD = float(np.finfo(np.float64).tiny)  # least mean pressure that maps can represent; less counts as none
NOT_FINITE = "met numbers that are not finite"


class ContactSolver:
    """Conjugate-gradient solver of frictionless contacts on one grid.

    Parameters:

    * workspace: maps for all intermediate results;
    * height: height of the surface, from its lowest to its highest point [unit of h];
    * tolerance: largest error with which a solve ends (`records.Certificate`);
    * max_iterations: limit on the iterations of a solve;
    * grids: coarser grids for the extension of residuals (`preconditioner.grids_for`);
    * free: True for a box that does not repeat;
    * further: function from a slab and the preconditioner of a half space to the preconditioner of the body
      (`physics.halfspace.Response.preconditioner`).
    """

    def __init__(
        self,
        workspace: Workspace,
        height: float,
        tolerance: float,
        max_iterations: int,
        grids: Grids = ALL,
        free: bool = False,
        further: Callable[[Slab, ExtendedPreconditioner], Any] | None = None,
    ) -> None:
        self.workspace, self.slab = workspace, workspace.slab
        self.height, self.tolerance, self.max_iterations = height, tolerance, max_iterations
        extended = ExtendedPreconditioner(self.slab, larger=grids)
        self._rough_inverse = grids.most == 0 or min(self.slab.nx, self.slab.ny) == 1  # K E is far from the inverse
        self._extended = extended if further is None or self._rough_inverse else further(self.slab, extended)
        self._free = free
        self._most_ratio = MAX_STEP_RATIO_FREE if free or further is not None else MAX_STEP_RATIO

    def solve(self, problem: Problem, start: Array, tolerance: float | None = None, cold: bool = False) -> Contact:
        """Solve a contact problem from the admissible pressure `start`, which is overwritten by the solution;
        collective.

        Under load control the start is scaled to the load, or replaced by a uniform pressure if it is 0 everywhere.
        `tolerance` replaces the tolerance of the solver. `cold` is True for a start of 0 or from a coarser grid. If the
        tolerance is not reached, `failure` of the contact states why, and the maps hold the last iterate.
        """
        mean = problem.control.mean
        if mean is not None and 0.0 <= mean < LEAST_LOAD:
            return self._separate(problem, start)
        tolerance = self.tolerance if tolerance is None else tolerance
        p, other = start, self.workspace.pressure
        iterate = self._begin(problem, p)
        best, slope, iteration = (np.inf, 0), 0.0, 0
        exact, shifts = self._rough_inverse, cold and self._free and problem.constraint.highest == math.inf
        while True:
            members, excess, certificate = self._certify(problem, p, iterate)
            best = min(best, (certificate.worst, iteration))
            failure = self._verdict(certificate.worst, tolerance, iteration, *best)
            if failure is not None:
                if p is not start:
                    start[...] = p
                return Contact(start, self.workspace.displacement, iterate.d, certificate, iteration, failure)
            level = iterate.d + (excess / members if mean is not None else 0.0)
            slope, ratio = self._turn(problem, level, slope, members, other)
            unlike = not 1.0 / self._most_ratio < ratio < self._most_ratio
            exact |= unlike or iteration - best[1] > ITERATIONS_UNTIL_EXACT_STEPS
            usual = None if exact else STEP + (1.0 - STEP) * (members / self.slab.points) ** 3
            iterate, cut = self._descend(problem, p, iterate, usual, slope, members if shifts else 0.0, other)
            p, other = other, p
            iteration += 1
            exact |= cut == math.inf
            if cut > LARGE_CUT:
                slope = 0.0

    def check(self, problem: Problem, p: Array, otherwise: str) -> Contact:
        """Scale the admissible pressure p to the load, and return the contact with its errors (`Certificate`);
        collective. If they exceed the tolerance of the solver, `failure` of the contact is the text `otherwise`."""
        iterate = self._begin(problem, p)
        *_, certificate = self._certify(problem, p, iterate)
        failure = "" if certificate.worst <= self.tolerance else otherwise
        return Contact(p, self.workspace.displacement, iterate.d, certificate, 0, failure)

    # -- the steps of a solve ------------------------------------------------------------------------------------------

    def _begin(self, problem: Problem, p: Array) -> Iterate:
        """Scale the start to the load and forget the direction of the last solve."""
        self.workspace.direction.fill(0.0)
        mean = problem.control.mean
        if mean is not None:
            (load,) = self.slab.sum(kernels.sum_of(p))
            scale_to_load(self.slab, problem.constraint, p, load, mean * self.slab.points)
        problem.operator.apply(p, self.workspace.displacement)
        return self._form_iterate(problem, p, 0.0 if mean is not None else problem.control.value)

    def _form_iterate(self, problem: Problem, p: Array, d: float) -> Iterate:
        """Return the sums over p and its image at the approach d; under a load, at the approach that they determine."""
        iterate = form_iterate(self.slab, problem.constraint, p, self.workspace.displacement, problem.heights, d)
        return iterate if problem.control.mean is None else iterate.settled()

    def _certify(self, problem: Problem, p: Array, iterate: Iterate) -> tuple[float, float, Certificate]:
        """Mark the working set. Return its size, its sum of gaps, and the certificate."""
        u, working = self.workspace.displacement, self.workspace.working
        box, h, mean = problem.constraint, problem.heights, problem.control.mean
        return certify(self.slab, box, p, u, h, iterate, mean, self.height, working)

    def _verdict(self, worst: float, tolerance: float, iteration: int, best: float, best_at: int) -> str | None:
        """Return None to continue, an empty string if solved, else why the solve has failed."""
        if worst <= tolerance:
            return ""
        if not np.isfinite(worst):
            return NOT_FINITE
        asked = f"{worst:.3g} where {tolerance:.3g} was asked for"
        single = self.workspace.displacement.dtype == np.float32
        most = MAX_STALLED_IN_SINGLE if single else MAX_STALLED_ITERATIONS
        if iteration - best_at >= most:
            return f"stalled: no residual below {best:.3g} in {most} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the residual is {asked}"
        return None

    def _turn(self, problem: Problem, level: float, slope: float, members: float, free: Array) -> tuple[float, float]:
        """Make the new search direction. Return its slope `<r, t>`, and the exact step over the last step made.

        The residual is `u - h - level` on the working set. `slope` belongs to the last direction; 0 forgets it. The
        map `free` is overwritten.
        """
        work, h = self.workspace, problem.heights
        u, t, working = work.displacement, work.direction, work.working
        z = reused(free, free.shape, t.dtype)
        kernels.gap_residual(working, u, h, level, z)
        self._extended.apply(problem.preconditioner, working, z)
        sums = kernels.step_products(working, u, h, level, work.other_displacement, z, t)
        sum_z, sum_t, sum_change, r_z, change_z, r_t = self.slab.sum(*sums)
        centred = problem.control.mean is not None
        mean_z, mean_t = (sum_z / members, sum_t / members) if centred else (0.0, 0.0)
        beta, ratio, fallen = 0.0, 1.0, slope - r_t  # decrease of the slope along the last direction
        if slope > 0.0:
            ratio = slope / fallen if fallen > 0.0 else math.inf
            beta = (max(0.0, change_z - mean_z * sum_change) + r_t) / fallen if fallen > 0.0 else 0.0
        if r_z + beta * r_t <= LEAST_DESCENT * r_z:
            beta = 0.0
        kernels.turn(working, z, beta, mean_z + beta * mean_t, t)
        return r_z + beta * r_t, ratio

    def _descend(
        self, problem: Problem, old_p: Array, old: Iterate, usual: float | None, slope: float, sharing: float, p: Array
    ) -> tuple[Iterate, float]:
        """Make a step of length `usual`, or the exact step if it is None, from `old_p` to p. The old displacement is
        kept in the other displacement of the workspace. `sharing` is the number of points from which much load that the
        lower bound adds is subtracted in equal parts, or 0 to scale pressures only.

        Return the new iterate and the share of its load that was cut off at the bounds, infinite if the step was
        halved.
        """
        work, box, mean = self.workspace, problem.constraint, problem.control.mean
        step = usual if usual is not None else self._exact(problem, slope)
        if box.highest < math.inf:
            most, largest = REACH * box.highest, self._largest(work.direction)
            step = most / largest if step * largest > most else step
        for halvings in range(MAX_HALVINGS + 1):
            sums = kernels.advance(old_p, work.direction, step, box.lowest, box.highest, p)
            load, cut = self.slab.sum(*sums)
            if mean is not None:
                total = mean * self.slab.points
                if sharing and cut > LARGE_CUT * load:
                    load = subtract_load(self.slab, box, p, load - total, sharing)
                scale_to_load(self.slab, box, p, load, total)
            problem.operator.apply(p, work.other_displacement)
            work.swap_displacements()
            new = form_iterate(self.slab, box, p, work.displacement, problem.heights, old.d)
            if new.f - old.f <= ENERGY_ROUNDING * new.energy or halvings == MAX_HALVINGS:
                break
            work.swap_displacements()
            step *= 0.5
        return new if mean is None else new.settled(), cut / load if halvings == 0 and load > 0.0 else math.inf

    def _largest(self, t: Array) -> float:
        """Return the largest magnitude of a map; collective."""
        return max(self.slab.reduce((), [float(t.max(initial=0.0)), -float(t.min(initial=0.0))]))

    def _exact(self, problem: Problem, slope: float) -> float:
        """Return the step that minimizes f along the direction, by one application of the operator."""
        t, image = self.workspace.direction, self.workspace.other_displacement
        curvature = self.slab.sum(loops.dot(t, problem.operator.apply(t, image)))[0]
        return slope / curvature if curvature > 0.0 else 0.0

    def _separate(self, problem: Problem, p: Array) -> Contact:
        """Return the contact without load: no pressure, and a surface that just touches the body."""
        p.fill(0.0)
        self.workspace.displacement.fill(0.0)
        highest = self.slab.reduce((), [float(problem.heights.max(initial=-np.inf))])[0]
        failure = "" if np.isfinite(highest) else NOT_FINITE
        return Contact(p, self.workspace.displacement, -highest, Certificate(0.0, 0.0, 0.0), 0, failure)
