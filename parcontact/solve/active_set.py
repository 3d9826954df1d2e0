"""Contact by guessing where it is: solve for the pressure there, correct the guess, again.

On a guessed set of points contact is a linear problem, `A x = h + d` with x = 0 elsewhere, solved by preconditioned
conjugate gradients that live on the set. Then points with x < 0 leave the set and points that penetrate enter it:
Newton's method for the contact conditions (M. Hintermueller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2003) 865). A
handful of sets is usual, but nothing excludes that one comes back.

The projected method (`contact`) needs less where it works. It changes its set in every step and so never builds up
conjugate directions; where the preconditioner is far from an inverse on parts of the box, as with cells much longer
than wide, it crawls. There this one is the way out.
"""

from dataclasses import replace

import numpy as np

from ..parallel.slab import Array
from . import kernels
from .contact import Approach, Contact, ContactSolver, MeanPressure

SETS = 40  # guesses after which to give up
BUDGET = 4  # times max_iterations, for all sets together: nothing is left to be tried after this
SHARE = 0.1  # of the tolerance: the largest gap on a set to which its linear problem is solved


def solve(solver: ContactSolver, h: Array, control: MeanPressure | Approach) -> Contact:
    """As `ContactSolver.solve`, whose buffers and start it uses, for a load that is not 0; collective.

    Iterations are those of the linear problems.
    """
    search = _Search(solver, h, control)
    contact, iterations = solver.judge(h, control, ""), 0
    search.begin()
    for count in range(1, SETS + 1):
        iterations += search.solve_on_set()
        chosen = search.next_set()
        np.maximum(solver.p, 0.0, out=solver.p)
        limit = BUDGET * solver.max_iterations
        spent = f" in {BUDGET} times max_iterations = {limit}" if iterations >= limit else ""
        contact = solver.judge(h, control, f"found no contact among {count} sets of points{spent}")
        if contact.converged or spent or not np.isfinite(contact.certificate.worst):
            break
        solver.working[...] = chosen
    return replace(contact, iterations=iterations)


class _Search:
    """The set is the solver's `working`, x its `p`, `A x` its `u`."""

    def __init__(self, solver: ContactSolver, h: Array, control: MeanPressure | Approach) -> None:
        self.solver, self.h, self.slab = solver, h, solver.slab
        self.load = control.value * self.slab.points if isinstance(control, MeanPressure) else None
        self.d = 0.0 if self.load is not None else control.value
        self.members = 0.0

    def begin(self) -> None:
        """After a judgement: the contact and what penetrates. All points with a given approach, a problem that may have
        no solution, become those that would penetrate the undeformed body."""
        working = self.solver.working
        if self.load is None and self._count() == self.slab.points:
            working[...] = self.h + self.d > 0.0

    def solve_on_set(self) -> int:
        """Conjugate gradients on the set, from the last x; returns their number."""
        solver, slab = self.solver, self.slab
        goal, product = SHARE * solver.tolerance * solver.height, 0.0
        self._restrict()
        solver.t.fill(0.0)
        solver.spare.fill(0.0)
        iterations = 0
        while self._residual() > goal and iterations < solver.max_iterations:
            z = solver.preconditioner.apply(solver.r, solver.w)
            sums = slab.sum(*kernels.products(solver.working, solver.r, solver.spare, z, solver.t))
            sum_z, sum_t, _, r_z, _, _ = sums
            beta, product = r_z / product if product > 0.0 else 0.0, r_z
            mean = (sum_z + beta * sum_t) / self.members if self.load is not None else 0.0
            kernels.turn(solver.working, z, beta, mean, solver.t)
            change = solver.operator.apply(solver.t, solver.w)
            slope, curvature = slab.sum(kernels.dot(solver.r, solver.t), kernels.dot(solver.t, change))
            if not (slope > 0.0 and curvature > 0.0):
                break
            solver.p -= slope / curvature * solver.t
            solver.u -= slope / curvature * change
            iterations += 1
        return iterations

    def next_set(self) -> Array:
        """Points of the set that are pressed, others that are penetrated."""
        solver = self.solver
        gap = solver.u - self.h - self.d
        return np.where(solver.working, solver.p > 0.0, gap < 0.0)

    # -- parts ---------------------------------------------------------------------------------------------------------

    def _count(self) -> float:
        return self.slab.sum(float(np.count_nonzero(self.solver.working)))[0]

    def _restrict(self) -> None:
        """x = 0 outside the set, and the load, if it is given, made up for on it."""
        solver = self.solver
        solver.p *= solver.working
        self.members, total = self.slab.sum(float(np.count_nonzero(solver.working)), kernels.total(solver.p))
        if self.load is not None:
            solver.p += (self.load - total) / self.members * solver.working
        solver.operator.apply(solver.p, solver.u)

    def _residual(self) -> float:
        """Put the gap on the set into `r`, for the d at which its mean is 0 unless that is given; its largest size."""
        solver = self.solver
        if self.load is not None:
            self.d = self.slab.sum(float(np.sum((solver.u - self.h) * solver.working)))[0] / self.members
        kernels.residual(solver.working, solver.u, self.h, self.d, solver.r)
        return self.slab.reduce((), [float(np.abs(solver.r).max(initial=0.0))])[0]
