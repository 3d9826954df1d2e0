"""Tractions of a contact that sticks and slips, by projected, preconditioned conjugate gradients on discs.

With A the operator of the body, from tractions to displacements, and bounds f of the tractions, find t with

    |t| <= f,     w = e - A t,     w = 0 where |t| < f,     w along t where |t| = f.

w is the slip in a step in which a point that sticks ends at the displacement e. The solution minimizes the convex
function `J(t) = <t, A t>/2 - <t, e>` over the product of discs |t| <= f. One iteration:

1. Points are free where |t| < f or w points inwards; the others slip.
2. At free points the direction is `d = E' K E w + beta d`. K is close to the inverse of A, and E extends w beyond
   these points (`preconditioner.extension`); beta makes d conjugate to the last direction, from the change of w in
   the last step.
3. Free tractions move by STEP d, and slipping ones by `TURN kappa w`, both shortened to their discs. kappa is a
   stiffness of the contact as a whole. If slip is large against f/kappa, this turns a traction into the direction of
   slip.

If J rises, both steps are halved. The certificate compares a traction with the traction that the slip w gives:

    sum |P(t + kappa w) - t| / sum |t|,     P(t) = t shortened to its disc.

It is 0 for the solution alone, and the relative error of tractions whose waves have the stiffness kappa. For the
related constraint p >= 0 the method is that of `solve.contact`.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array, Slab
from ...physics.shear_operator import components, stacked
from ..preconditioner.extension import ExtendedPreconditioner, Grids
from ..problem import Operator
from . import discs

STEP = 0.55  # tuning: step of free tractions; waves along q have half the stiffness that K assumes
TURN = 2.0  # tuning: step of slipping tractions; with 4 or more, many iterations raise J
MOST = 4.0  # tuning: largest step of slipping tractions over the last one
LARGE_CUT = 0.003  # tuning: share of the sum of tractions; if more is cut off, the direction is forgotten
LEAST_DESCENT = 0.5  # tuning: least slope along d over that along z; below it the last direction is forgotten
ENERGY_ROUNDING = 64 * float(np.finfo(np.float64).eps)  # accuracy: share of <t, A t>/2 that is rounding
MAX_STALLED = 60  # tuning: limit on iterations without a smaller certificate


@dataclass(frozen=True)
class Tractions:
    """Solved tractions, in the caller's map. `displacement = A t` belongs to the solver and is valid until its next
    solve.

    `failure` is empty, or states why the tolerance was not reached.
    """

    displacement: Array
    certificate: float
    iterations: int
    stuck: int
    failure: str = ""


class TangentialSolver:
    """Solver on one grid, with the `operator` of the body for stacked tractions and a `preconditioner` for one
    component."""

    def __init__(
        self, slab: Slab, operator: Operator, preconditioner: Operator, grids: Grids, tolerance: float, limit: int
    ) -> None:
        self.slab, self.tolerance, self._limit = slab, tolerance, limit
        self._operator, self._preconditioner = operator, preconditioner
        self._extended = ExtendedPreconditioner(slab, larger=grids)
        both = stacked(slab)
        self._u, self._other, self._z, self._d = (both.zeros() for _ in range(4))
        self.free = slab.zeros(np.bool_)

    def solve(self, bound: Array, aim: Array, kappa: float, t: Array) -> Tractions:
        """Solve for bounds f and stacked displacements e of points that stick, from the tractions t, which are
        overwritten by the solution; collective. `kappa` is a stiffness of the contact, in the unit of t over the
        unit of e."""
        (t_x, t_y), e = components(t), components(aim)
        discs.shorten_to_bounds(bound, t_x, t_y)
        if self._is_at_rest(bound, aim, t):
            return self._rest(bound)
        self._operator.apply(t, self._u)
        best, energy, iteration, begins = (math.inf, 0), math.inf, 0, True
        touching = self.slab.sum(float(np.count_nonzero(bound > 0.0)))[0]
        step, turn = STEP, TURN * kappa
        while True:
            found = discs.examine(bound, t_x, t_y, *components(self._u), *e, kappa, self.free)
            size, moved, residual, now, work, stuck = self.slab.sum(*found)
            certificate = residual / (max(size, moved) or 1.0)
            best = min(best, (certificate, iteration))
            failure = self._verdict(certificate, iteration, best)
            if failure is not None:
                return Tractions(self._u, certificate, iteration, round(stuck), failure)
            if now > energy + ENERGY_ROUNDING * work:
                step, turn, begins = 0.5 * step, 0.5 * turn, True
            if iteration and stuck < touching:
                turn = self._turn_again(bound, step, turn)
            energy, iteration = now, iteration + 1
            if stuck:
                self._redirect(e, begins)
            moves = step, *components(self._d), turn, *components(self._u), *e
            size, cut = self.slab.sum(*discs.move_tractions(bound, self.free, *moves, t_x, t_y))
            begins = cut > LARGE_CUT * size or not stuck
            self._u, self._other = self._other, self._u
            self._operator.apply(t, self._u)

    def _turn_again(self, bound: Array, step: float, turn: float) -> float:
        """Return the step of tractions that slip, by the compliance that they had in the last one; collective."""
        sums = np.zeros(2)
        for d, u, old in zip(*(components(one) for one in (self._d, self._u, self._other)), strict=True):
            sums += discs.turn_products(bound, self.free, d, u, old)
        square, work = self.slab.sum(*sums)
        return min(step * square / work, MOST * turn) if work > 0.0 else turn

    def _redirect(self, e: tuple[Array, Array], begins: bool) -> None:
        """Make the next direction of free tractions; if it `begins`, the last one is forgotten; collective."""
        sums = np.zeros(4)
        u, old, z, d = (components(one) for one in (self._u, self._other, self._z, self._d))
        for each in range(2):
            discs.slip_of(self.free, u[each], e[each], z[each])
            self._extended.apply(self._preconditioner, self.free, z[each])
            if not begins:
                sums += discs.direction_products(self.free, u[each], old[each], e[each], z[each], d[each])
        beta = 0.0
        if not begins:
            w_z, c_z, w_d, c_d = self.slab.sum(*sums)
            beta = max(0.0, -c_z / c_d) if c_d > 0.0 else 0.0
            beta = beta if w_z + beta * w_d > LEAST_DESCENT * w_z else 0.0
        for each in range(2):
            discs.redirect(self.free, z[each], beta, d[each])

    def _verdict(self, certificate: float, iteration: int, best: tuple[float, int]) -> str | None:
        """Return None to continue, an empty string if solved, else why the solve has failed."""
        if certificate <= self.tolerance:
            return ""
        asked = f"{certificate:.3g} where {self.tolerance:.3g} was asked for"
        if iteration >= self._limit or not math.isfinite(certificate):
            return f"the tractions did not converge in {iteration} iterations: the residual is {asked}"
        if iteration - best[1] >= MAX_STALLED:
            return f"the tractions stalled: no residual below {best[0]:.3g} in {MAX_STALLED} iterations, now {asked}"
        return None

    def _is_at_rest(self, bound: Array, aim: Array, t: Array) -> bool:
        """Return whether tractions and displacements are 0 at all points in contact; collective."""
        touching = bound > 0.0
        parts = *components(aim), *components(t)
        largest = max(float(np.abs(part).max(where=touching, initial=0.0)) for part in parts)
        return self.slab.reduce((), [largest])[0] == 0.0

    def _rest(self, bound: Array) -> Tractions:
        """Return the result without tractions, in which all points stick; collective."""
        np.greater(bound, 0.0, out=self.free)
        self._u.fill(0.0)
        return Tractions(self._u, 0.0, 0, round(self.slab.sum(float(np.count_nonzero(self.free)))[0]))
