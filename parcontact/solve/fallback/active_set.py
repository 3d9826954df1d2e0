"""Contact by a primal-dual active set: solve for the pressure on a guessed contact, correct the guess, repeat.

On a set of points contact is a linear problem, `A x = h + d` with x = 0 elsewhere, solved by preconditioned
conjugate gradients. Then points with x < 0 leave the set and points that penetrate enter it (M. Hintermueller, K.
Ito and K. Kunisch, SIAM J. Optim. 13 (2003) 865). A few sets are usual, but sets may cycle.

The projected method (`contact`) is cheaper where it works. It changes its set in every step and never accumulates
conjugate directions; it is slow where the preconditioner is far from an inverse, as on cells much longer than wide.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array
from ...physics import loops
from .. import kernels
from ..contact import Contact, ContactSolver
from ..problem import Problem

MAX_SETS = 40  # tuning: limit on the number of sets
ITERATIONS_RATIO = 4  # tuning: limit on iterations of all sets, over max_iterations
GAP_SHARE = 0.1  # tuning: largest gap on a set to which its linear problem is solved, over the tolerance


def solve(solver: ContactSolver, problem: Problem, start: Array) -> Contact:
    """Solve as `ContactSolver.solve`, for a load that is not 0; collective. `iterations` of the contact counts
    iterations of the linear problems."""
    search = _Search(solver, problem, start)
    contact, iterations = solver.check(problem, start, ""), 0
    search.begin(contact)
    for count in range(1, MAX_SETS + 1):
        iterations += search.solve_on_set(contact.u, GAP_SHARE * solver.tolerance * contact.certificate.length)
        chosen = search.next_set(contact.u)
        problem.constraint.clip(start)
        limit = ITERATIONS_RATIO * solver.max_iterations
        spent = f" in {ITERATIONS_RATIO} times max_iterations = {limit}" if iterations >= limit else ""
        contact = solver.check(problem, start, f"found no contact among {count} sets of points{spent}")
        if contact.converged or spent or not np.isfinite(contact.certificate.worst):
            break
        search.working = chosen
    return replace(contact, iterations=iterations)


class _Search:
    """Pressure x on the set `working`. The direction, the residual and images are in maps of the workspace."""

    def __init__(self, solver: ContactSolver, problem: Problem, x: Array) -> None:
        self.solver, self.problem, self.h, self.slab, self.x = solver, problem, problem.heights, solver.slab, x
        self.load = None if problem.mean is None else problem.mean * self.slab.points
        self.d = 0.0 if self.load is not None else problem.control.value
        self.working = np.zeros(x.shape, np.bool_)
        self.members = 0.0

    def begin(self, contact: Contact) -> None:
        """Mark the first set: contact and points that penetrate. If these are all points under a given approach, which
        may have no solution, mark those that would penetrate the undeformed body."""
        self.problem.constraint.mark_working_set(self.x, contact.u, self.h, contact.d, self.working)
        if self.load is None and self.slab.sum(float(np.count_nonzero(self.working)))[0] == self.slab.points:
            self.working[...] = self.h + self.d > 0.0

    def solve_on_set(self, u: Array, goal: float) -> int:
        """Make conjugate gradient steps on the set until no gap exceeds `goal`; update `u = A x`. Return the number of
        steps."""
        problem, maps, slab, x, working = self.problem, self.solver.workspace, self.slab, self.x, self.working
        w, r, t = maps.pressure, maps.other_displacement, maps.direction
        product = 0.0
        self._restrict(u)
        t.fill(0.0)
        iterations = 0
        while self._residual(u, r) > goal and iterations < self.solver.max_iterations:
            z = problem.preconditioner.apply(r, w)
            sum_z, sum_t, _, r_z, _, _ = slab.sum(*kernels.step_products(working, u, self.h, self.d, u, z, t))
            beta, product = r_z / product if product > 0.0 else 0.0, r_z
            mean = (sum_z + beta * sum_t) / self.members if self.load is not None else 0.0
            kernels.turn(working, z, beta, mean, t)
            change = problem.operator.apply(t, w)
            slope, curvature = slab.sum(loops.dot(r, t), loops.dot(t, change))
            if not (slope > 0.0 and curvature > 0.0):
                break
            step = np.float64(slope / curvature)  # a double, so that products with t are not rounded
            x -= step * t
            u -= step * change
            iterations += 1
        return iterations

    def next_set(self, u: Array) -> NDArray[np.bool_]:
        """Return points of the set with pressure, and other points that penetrate."""
        return self.problem.constraint.next_set(self.x, u - self.h - self.d, self.working)

    # -- parts ---------------------------------------------------------------------------------------------------------

    def _restrict(self, u: Array) -> None:
        """Put x to a bound outside the set, and make up for a given load on the set; update `u = A x`."""
        x, working = self.x, self.working
        lower, upper = self.problem.constraint.bounds
        x[...] = np.where(working, x, np.where(x < upper, lower, upper))
        self.members, total = self.slab.sum(float(np.count_nonzero(working)), kernels.sum_of(x))
        if self.load is not None and self.members:
            x += (self.load - total) / self.members * working
        self.problem.operator.apply(x, u)

    def _residual(self, u: Array, r: Array) -> float:
        """Put the gap on the set into r, with the d at which its mean is 0 unless d is given. Return its largest
        magnitude."""
        if self.load is not None and self.members:
            self.d = self.slab.sum(float(np.sum((u - self.h) * self.working)))[0] / self.members
        kernels.gap_residual(self.working, u, self.h, self.d, r)
        return self.slab.reduce((), [float(np.abs(r).max(initial=0.0))])[0]
