"""Frictionless contact of a body with a rigid surface: projected, preconditioned conjugate gradients.

Find the pressure p of an `ny x nx` map that the constraint admits, such that the gap `g = A p - h - d` meets its
conditions, with A a symmetric positive operator and either mean(p) = P0 (d unknown) or d given. For p that may not be
negative (`constraint.NonNegative`) these are

    p >= 0,   g >= 0,   p g = 0.

It is the minimum of `f(p) = <p, A p>/2 - <p, h + d>` over the admissible p. One iteration, with `R` = keep the values
on the working set and put 0 elsewhere, `C` = subtract the mean over it:

1. the working set is what is free to move: the contact (p > 0) and the points that penetrate (g < 0), which enter by
   the search direction itself;
2. residual `r = C R g`, preconditioned `z = C R E' K E r` with K close to the inverse of A, and E carrying r on beyond
   the set (`preconditioner`);
3. direction `t = C R (z + beta t)` with a beta that makes it conjugate to the last one and makes up for what the last
   step fell short of or went too far; or `t = z` where that is much less of a descent, or where much of the last step
   was cut off;
4. `p <- p - alpha t`, cut off at the bounds of p, with a step alpha that is nearly exact, the load that cutting off
   adds taken back near by if it is much (`local_load`), then scaled to the mean P0; if p is bounded by a hardness that
   is far less than the stiffness, shorter, so that few points go from one bound to the other at once;
5. f must not rise: else the step is halved along this path, without the former, and the direction is forgotten.

The exact step would be `<r, t>/<t, A t>`, for one more application of the operator in each iteration. It is 0.95 within
0.03 at 0.4 to 60 % of contact, where K E is nearly the inverse, and 1 in full contact. Afterwards `A p` is known anyway
and `<t, A t>` with it: if the step differs from the exact one by more than a quarter (in a box with nothing around, by
a factor of two), or steps do not help, the rest of the solve makes exact ones. On lines of points, and with cells much
longer than wide, all are exact.

With d given there is neither centring nor scaling. With P0 given, d is the mean of `A p - h` over free points, weighted
by p, so that `<p, g> = 0`: scaling p then does not change f to first order, and cutting t off at a bound, which a small
step does only where g points beyond it, only helps. Thus f falls for every step that is small enough (D. P. Bertsekas,
SIAM J. Control Optim. 20 (1982) 221, for d given). The unpreconditioned ancestor is I. A. Polonsky and L. M. Keer, Wear
231 (1999) 206; K makes the number of iterations nearly independent of the grid. Everything here is dimensionless.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array, reused
from ..physics import loops
from ..physics.layer import LongWaves
from . import kernels
from .certificate import Certificate
from .iterate import Iterate, certify, form_iterate
from .local_load import LEAST_CUT, LocalLoad
from .preconditioner.extension import ALL, ExtendedPreconditioner, Grids
from .preconditioner.long_waves import LongWavePreconditioner
from .problem import Problem
from .workspace import Workspace

# tuning
MAX_STALLED_ITERATIONS = 60  # iterations without a better certificate after which a solve gives up
MAX_STALLED_IN_SINGLE = 12  # the same with displacements in single precision, of which double may lead on
MAX_HALVINGS = 12  # of a step that raises f; then it is taken as it is
STEP = 0.95  # beside edges of contact, and 1 far from them
MAX_STEP_RATIO = 1.25  # of the exact step over the one made, or its inverse: beyond it, steps are exact from then on
MAX_STEP_RATIO_FREE = (
    2.0  # the same in a box with nothing around, at whose edges K is less near to the inverse; on thin layers
)
ITERATIONS_UNTIL_EXACT_STEPS = 5  # without a better certificate
LEAST_DESCENT = 0.5  # over that without the last direction: with less it is one of a set of points that is no more
REACH = 4.0  # times the highest pressure: no step that is not cut off moves a pressure further
LARGE_CUT = 0.003  # of the load: if more is cut off a step at the bounds, the next one takes no notice of its direction
# accuracy
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # of <p, A p>/2: a smaller rise of f cannot be told from none
LEAST_LOAD = float(np.finfo(np.float64).tiny)  # a smaller one than maps can hold is none
NOT_FINITE = "met numbers that are not finite"


@dataclass(frozen=True)
class Contact:
    """A solved (or given up) contact, maps of shape (rows of this rank, nx).

    `p` is the map that was given as the start, the caller's own; `u = A p` is the solver's, valid until its next solve.
    `failure` is empty, or says what the solve did instead of reaching the tolerance.
    """

    p: Array
    u: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


class ContactSolver:
    """Loop for contacts on one grid.

    Parameters: the `workspace` that it works in; `height` of the surface from its lowest to its highest point, in the
    unit of h; `tolerance` on the certificate; `max_iterations`; `grids` of larger cells by which a residual is extended
    (`extension.grids_for`); whether the box is `free`, with nothing around; the `long_waves` of a layer, for which K
    is not stiff enough.
    """

    def __init__(
        self,
        workspace: Workspace,
        height: float,
        tolerance: float,
        max_iterations: int,
        grids: Grids = ALL,
        free: bool = False,
        long_waves: LongWaves | None = None,
    ) -> None:
        self.workspace, self.slab = workspace, workspace.slab
        self.height, self.tolerance, self.max_iterations = height, tolerance, max_iterations
        extended = ExtendedPreconditioner(self.slab, larger=grids)
        self._extended: ExtendedPreconditioner | LongWavePreconditioner = extended
        self._rough_inverse = grids.most == 0 or min(self.slab.nx, self.slab.ny) == 1  # K E is only roughly the inverse
        if long_waves is not None and not self._rough_inverse:
            self._extended = LongWavePreconditioner(self.slab, long_waves, extended)
        self._most_ratio = MAX_STEP_RATIO_FREE if free or long_waves is not None else MAX_STEP_RATIO
        self._local_load = LocalLoad(self.slab)

    def solve(self, problem: Problem, start: Array, tolerance: float | None = None) -> Contact:
        """Solve from the pressure `start`, which is admissible and in whose place the solution will be; collective.

        Under load control the start is scaled to the load, or uniform where it is zero everywhere. The `tolerance`
        is the solver's own unless it is given. A solve that does not reach it says why in `failure`; its maps are then
        the last iterate, not a solution.
        """
        mean = problem.mean
        if mean is not None and 0.0 <= mean < LEAST_LOAD:
            return self._separate(problem, start)
        tolerance = self.tolerance if tolerance is None else tolerance
        p, other = start, self.workspace.pressure
        iterate = self._begin(problem, p)
        best, slope, iteration = (np.inf, 0), 0.0, 0
        exact = self._rough_inverse
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
            iterate, cut = self._descend(problem, p, iterate, usual, slope, other)
            p, other = other, p
            iteration += 1
            exact |= cut == math.inf
            if cut > LARGE_CUT:
                slope = 0.0

    def check(self, problem: Problem, p: Array, otherwise: str) -> Contact:
        """The admissible pressure p, scaled to the load, as it is; `otherwise` is its failure unless it solves the
        problem; collective."""
        iterate = self._begin(problem, p)
        *_, certificate = self._certify(problem, p, iterate)
        failure = "" if certificate.worst <= self.tolerance else otherwise
        return Contact(p, self.workspace.displacement, iterate.d, certificate, 0, failure)

    # -- the steps of a solve ------------------------------------------------------------------------------------------

    def _begin(self, problem: Problem, p: Array) -> Iterate:
        """Give the start its load and forget the last solve's direction."""
        self.workspace.direction.fill(0.0)
        if problem.mean is not None:
            load = self.slab.sum(kernels.sum_of(p))[0]
            if load > 0.0:
                problem.constraint.rescale_to_load(self.slab, p, load, problem.mean * self.slab.points)
            else:
                p.fill(problem.mean)
        problem.operator.apply(p, self.workspace.displacement)
        return self._form_iterate(problem, p, 0.0 if problem.mean is not None else problem.control.value)

    def _form_iterate(self, problem: Problem, p: Array, d: float) -> Iterate:
        """A pressure in numbers, for the approach d or the one that suits it."""
        iterate = form_iterate(self.slab, problem.constraint, p, self.workspace.displacement, problem.heights, d)
        return iterate if problem.mean is None else iterate.settled()

    def _certify(self, problem: Problem, p: Array, iterate: Iterate) -> tuple[float, float, Certificate]:
        """Mark the working set; its size, its sum of gaps, and the certificate."""
        u, working = self.workspace.displacement, self.workspace.working
        constraint, h, mean = problem.constraint, problem.heights, problem.mean
        return certify(self.slab, constraint, p, u, h, iterate, mean, self.height, working)

    def _verdict(self, worst: float, tolerance: float, iteration: int, best: float, best_at: int) -> str | None:
        """None: go on; empty: solved; else what happened instead."""
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
        """Make the new search direction; returns its slope `<r, t>`, and the exact step over the last one.

        The residual is `u - h - level` on the working set. `slope` is that of the last direction, 0 for one to be
        forgotten. There is a map that is `free`.
        """
        work, h = self.workspace, problem.heights
        u, t, working = work.displacement, work.direction, work.working
        z = reused(free, free.shape, t.dtype)
        kernels.gap_residual(working, u, h, level, z)
        self._extended.apply(problem.preconditioner, working, z)
        sums = kernels.step_products(working, u, h, level, work.other_displacement, z, t)
        sum_z, sum_t, sum_change, r_z, change_z, r_t = self.slab.sum(*sums)
        centred = problem.mean is not None
        mean_z, mean_t = (sum_z / members, sum_t / members) if centred else (0.0, 0.0)
        beta, ratio, fallen = 0.0, 1.0, slope - r_t  # by how much the slope along the last direction fell in its step
        if slope > 0.0:
            ratio = slope / fallen if fallen > 0.0 else math.inf
            beta = (max(0.0, change_z - mean_z * sum_change) + r_t) / fallen if fallen > 0.0 else 0.0
        if r_z + beta * r_t <= LEAST_DESCENT * r_z:
            beta = 0.0
        kernels.turn(working, z, beta, mean_z + beta * mean_t, t)
        return r_z + beta * r_t, ratio

    def _descend(
        self, problem: Problem, old_p: Array, old: Iterate, usual: float | None, slope: float, p: Array
    ) -> tuple[Iterate, float]:
        """Make the usual step from `old_p` against the direction to p, or the exact one, and keep the old displacement
        as the other one; returns the new iterate and how much of its load was cut off at the bounds, infinity where the
        step was halved."""
        work, constraint, mean = self.workspace, problem.constraint, problem.mean
        step = usual if usual is not None else self._exact(problem, slope)
        if constraint.bounds[1] < math.inf:
            most, largest = REACH * constraint.bounds[1], self._largest(work.direction)
            step = most / largest if step * largest > most else step
        for halvings in range(MAX_HALVINGS + 1):
            load, cut = self._local_load.advance(constraint, old_p, work.direction, step, p)
            if mean is not None:
                near_by = cut > LEAST_CUT * load and halvings == 0
                self._local_load.restore(constraint, p, load, mean * self.slab.points, near_by)
            problem.operator.apply(p, work.other_displacement)
            work.swap_displacements()
            new = form_iterate(self.slab, constraint, p, work.displacement, problem.heights, old.d)
            if new.f - old.f <= ENERGY_ROUNDING * new.energy or halvings == MAX_HALVINGS:
                break
            work.swap_displacements()
            step *= 0.5
        return new if mean is None else new.settled(), cut / load if halvings == 0 and load > 0.0 else math.inf

    def _largest(self, t: Array) -> float:
        """The largest size of a map; collective."""
        return max(self.slab.reduce((), [float(t.max(initial=0.0)), -float(t.min(initial=0.0))]))

    def _exact(self, problem: Problem, slope: float) -> float:
        """The step that makes f the smallest, for a slope along the direction; by one more application of the
        operator."""
        t, image = self.workspace.direction, self.workspace.other_displacement
        curvature = self.slab.sum(loops.dot(t, problem.operator.apply(t, image)))[0]
        return slope / curvature if curvature > 0.0 else 0.0

    def _separate(self, problem: Problem, p: Array) -> Contact:
        """No load: no pressure, the surface just touches the body."""
        p.fill(0.0)
        self.workspace.displacement.fill(0.0)
        highest = self.slab.reduce((), [float(problem.heights.max(initial=-np.inf))])[0]
        failure = "" if np.isfinite(highest) else NOT_FINITE
        return Contact(p, self.workspace.displacement, -highest, Certificate(0.0, 0.0, 0.0), 0, failure)
