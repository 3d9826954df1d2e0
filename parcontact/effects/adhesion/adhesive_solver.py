"""Contact with adhesion for the body of a run, periodic or free.

The solver of gaps needs the inverse of its operator. For the operator A of a free body, the FFT does not
give it. The
operator B of a periodic body, with the same Green's function up to half the box, replaces it
(`HalfSpace.gap_operators`), and the difference is lagged: the next pass has the heights `h - (A - B) p` of the last
p. One or two passes are usual.

A contact that fills its box may be softer on B than on A, in its mean or in waves that continue across the edges. A
state that is stable on A is then unstable on B, and passes alternate between two states. So if later passes jump or
detach, or MAX_PASSES is reached, the solve restarts with A itself, whose inverse takes some iterations
(`free_inverse`). Then E falls monotonically. Under a given mean pressure P, `p = K (g + h - P A 1) + P` with K the
inverse of A on pressures of mean 0.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...parallel.slab import Array
from ...solve.contact import Contact
from ...solve.problem import Approach, Control, MeanPressure, Operator
from ...solve.workspace import Workspace
from . import gap_kernels
from .free_inverse import FreeInverse
from .gap_iterate import SHARPER, GapSolution
from .gap_solver import GapSolver
from .law import Law

MAX_PASSES = 12  # tuning: limit on passes of a free body before A itself is used; one to three are usual
LEFT = 0.8  # accuracy: tolerance of a solve with A over the tolerance of the run; the rest is for the inverse
DIGITS = 0.01  # accuracy: relative error of the inverse of A, over the tolerance
UNSETTLED = "did not settle in a free box"
LEAST_SHARE, MOST_SHARE = 0.1, 4.0  # tuning: limits on the share of a change of the lagged part that is made


@dataclass
class AdhesiveSolver:
    """Solver of contacts with adhesion; `free` is the operator A of a free body, None for a periodic one."""

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
        """Solve from `gap`, which is overwritten by the solution, and put the pressure into `out`; collective.

        `free_correction` is `(A - B) p` of a free body and is updated. The tolerance is `loose` times the tolerance
        of the run. Return the contact, and whether the surfaces have detached.
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
