"""Contacts that stick, for the body of a run: on a body that repeats itself, or on one with nothing around its box.

The solver of gaps needs the inverse of its operator. That of a free body has none on its box: there the operator B of a
body that repeats itself takes its place, by the shortest way between two points (`HalfSpace.gap_operators`), and what
it lacks is lagged: `h - (A - B) p` of the last pass are the heights of the next. Within half a box both are the same,
so that one pass or two do as a rule.

A contact that fills its box is softer on B than on A. Near a snap a pass may then jump over an equilibrium, and the
passes go round between two states. Under an approach they begin again with half of the compliance of B for mean values:
a stiffer body takes shorter ways, and passes settle wherever an equilibrium is stable.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...parallel.slab import Array
from ..contact import Contact
from ..problem import Approach, Control, MeanPressure, Operator
from ..workspace import Workspace
from . import kernels
from .iterate import SHARPER, GapSolution
from .law import Law
from .solver import GapSolver

MAX_PASSES = 100  # accuracy: of a free body; one to three do as a rule, and many where it is about to snap
MANY = 12  # tuning: passes after which a solve under an approach begins again, on a stiffer body
STIFFER = 0.5  # tuning: share of the compliance of B for mean values
LEAST_SHARE, MOST_SHARE = 0.1, 4.0  # tuning: of a change of what is lagged


@dataclass
class StickingSolver:
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
        lag: Array | None,
        out: Array,
        loose: float = 1.0,
    ) -> tuple[Contact, bool]:
        """Solve from a gap, in whose place the solution will be, and put the pressure into `out`; collective.

        `lag` is `(A - B) p` of a free body, in whose place the new one will be. Returns the contact, and whether the
        surface has come off. The tolerance is `loose` times that of the run.
        """
        tolerance = loose * self.tolerance
        if self.free is None or lag is None:
            found = self.gaps.solve(law, heights, control, gap, tolerance)
            out[...] = found.p
            u = self.workspace.displacement
            np.add(gap, heights, out=u)
            u += found.d
            return self._contact(found, out, found.iterations), found.detached
        if isinstance(control, MeanPressure):
            found, iterations = self._settle(law, heights, control, gap, lag, out, tolerance)
            return self._contact(found, out, iterations), found.detached
        start = self.workspace.pressure, self.workspace.other_displacement  # in double precision with adhesion
        start[0][...], start[1][...] = gap, lag
        found, iterations = self._settle(law, heights, control, gap, lag, out, tolerance, most=MANY)
        if found.failure:
            gap[...], lag[...] = start
            lag += (1.0 - STIFFER) * self._mean_way(heights - lag, control, gap)
            found, more = self._settle(law, heights, control, gap, lag, out, tolerance, STIFFER)
            lag -= (1.0 / STIFFER - 1.0) * self._mean_way(heights - lag, control, gap)
            iterations += more
        return self._contact(found, out, iterations), found.detached

    def _mean_way(self, heights: Array, control: Approach, gap: Array) -> float:
        """By how much the uniform part of the pressure moves a body with such heights; collective."""
        slab = self.workspace.slab
        return slab.sum(float((gap + heights).sum()))[0] / slab.points + control.value

    def _settle(
        self,
        law: Law,
        heights: Array,
        control: Control,
        gap: Array,
        lag: Array,
        out: Array,
        tolerance: float,
        compliance: float = 1.0,
        most: int = MAX_PASSES,
    ) -> tuple[GapSolution, int]:
        """Repeat the solve of a free body until what is lagged changes no more, in so many passes at most; returns the
        solution and the iterations of all passes; collective."""
        assert self.free is not None
        iterations, share, last = 0, 1.0, lag
        for passes in range(1, most + 1):
            found = self.gaps.solve(law, heights - lag, control, gap, tolerance, compliance)
            iterations += found.iterations
            out[...] = found.p
            change = self.free.apply(out, self.workspace.displacement) - (heights + gap)
            change -= found.d
            found, worst = self._judge(control, found, out, change)
            share = self._share(share, out, change, last) if passes > 1 else 1.0
            last = change
            lag += share * change
            if found.failure or found.detached or worst <= tolerance:
                return found, iterations
        asked = f"{worst:.3g} where {tolerance:.3g} was asked for"
        failure = f"did not settle in {most} passes of a free body: changes are {asked}"
        return replace(found, failure=failure), iterations

    def _judge(self, control: Control, found: GapSolution, p: Array, change: Array) -> tuple[GapSolution, float]:
        """Say in the certificate by how much displacements have changed in a pass, but for what only changes the
        approach; returns this number too; collective."""
        certificate, slab = found.certificate, self.workspace.slab
        load, sum_change = slab.sum(*kernels.weigh(p, change))
        shift = sum_change / load if isinstance(control, MeanPressure) and load > 0.0 else 0.0
        (wrong,) = slab.sum(kernels.weigh_off(p, change, shift))
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
