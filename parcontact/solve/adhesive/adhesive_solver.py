"""Contacts that stick, for the body of a run: on a body that repeats itself, or on one with nothing around its box.

The solver of gaps needs the inverse of its operator. That of a free body has no symbol on its box: there the operator B
of a body that repeats itself takes its place, by the shortest way between two points (`HalfSpace.gap_operators`), and
what it lacks is lagged: `h - (A - B) p` of the last pass are the heights of the next. Within half a box both are the
same, so that one pass or two do as a rule.

A contact that fills its box may be softer on B than on A, in its mean or in waves whose ends meet across the edges. An
equilibrium that is stable on A then is none on B: passes jump over it, and go round between the two states beside it.
So a solve whose later passes jump or come off, or are too many, begins again from its start with the operator A itself,
whose inverse takes some iterations (`free_inverse`). Then E falls, and no equilibrium is passed over. Under a given
mean pressure P, `p = K (g + h - P A 1) + P` with the inverse K of A on pressures whose mean is 0.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...parallel.slab import Array
from ..contact import Contact
from ..problem import Approach, Control, MeanPressure, Operator
from ..workspace import Workspace
from . import gap_kernels
from .free_inverse import FreeInverse
from .gap_iterate import SHARPER, GapSolution
from .gap_solver import GapSolver
from .law import Law

MAX_PASSES = 12  # tuning: of a free body, before its own operator is used; one to three do as a rule
LEFT = 0.8  # accuracy: of the tolerance, for such a solve; the rest is for the inverse
DIGITS = 0.01  # accuracy: of the inverse, over the tolerance
UNSETTLED = "did not settle in a free box"
LEAST_SHARE, MOST_SHARE = 0.1, 4.0  # tuning: of a change of what is lagged


@dataclass
class AdhesiveSolver:
    """Solver of contacts that stick; `free` is the operator of a body with nothing around its box, else None."""

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
        """Solve from a gap, in whose place the solution will be, and put the pressure into `out`; collective.

        `free_correction` is `(A - B) p` of a free body, in whose place the new one will be. Returns the contact,
        and whether the surfaces have detached. The tolerance is `loose` times that of the run.
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
        """Repeat the solve of a free body until what is lagged changes no more; returns the solution, which has failed
        where it does not settle, and the iterations of all passes; collective."""
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
        """Solve with the operator of a free body itself, and find what is lagged; collective."""
        assert self.free is not None
        work, repeated = self.workspace, self.gaps.operators
        maps = (
            work.pressure,
            work.displacement,
            work.other_displacement,
            free_correction,
        )  # in double precision with adhesion
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
        """Put the pressure into `out`, and return by how much it moves a free body more than the solution says, also in
        its certificate; collective."""
        assert self.free is not None
        out[...] = found.p
        change = self.free.apply(out, self.workspace.displacement) - (heights + gap)
        change -= found.d
        found, worst = self._judge(control, found, out, change)
        return found, change, worst

    def _judge(self, control: Control, found: GapSolution, p: Array, change: Array) -> tuple[GapSolution, float]:
        """Say in the certificate by how much displacements have changed in a pass, but for what only changes the
        approach; returns this number too; collective."""
        certificate, slab = found.certificate, self.workspace.slab
        load, sum_change = slab.sum(*gap_kernels.weighted_sums(p, change))
        shift = sum_change / load if isinstance(control, MeanPressure) and load > 0.0 else 0.0
        (wrong,) = slab.sum(gap_kernels.weigh_off(p, change, shift))
        worst = SHARPER * wrong / load / certificate.length if load > 0.0 else 0.0
        certificate = replace(certificate, complementarity=max(certificate.complementarity, worst))
        return replace(found, certificate=certificate, d=found.d + shift), worst

    def _share(self, share: float, p: Array, change: Array, last: Array) -> float:
        """The share of a change to make, by Aitken's extrapolation of the last two, weighted by the pressure;
        collective."""
        weight, apart = np.abs(p), change - last
        along, size = self.workspace.slab.sum(float((weight * last * apart).sum()), float((weight * apart**2).sum()))
        wanted = -share * along / size if size > 0.0 else 1.0
        return min(max(wanted, LEAST_SHARE), MOST_SHARE)

    def _contact(self, found: GapSolution, p: Array, iterations: int) -> Contact:
        """The solution as a contact, whose displacement is in the workspace."""
        return Contact(p, self.workspace.displacement, found.d, found.certificate, iterations, found.failure)
