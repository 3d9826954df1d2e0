"""Steady contacts of a body that loses nearly all work: each is approached by those of one that loses less.

A solves for contact where a body stores work; where it loses far more than it stores (tan(delta) far above 3, as with a
body a thousand times as stiff at once as in the end) A is nearly skew, and sets of points come and go without an end.
With S symmetric and positive, the contact p' of the operator `A + S` for heights `h + S p` is

    A p' - h - d = S (p - p') where there is pressure,

that is solved for A and h once p' = p. As A is positive, p comes nearer to the solution in every step, measured by S,
also where p' is only good to a share of the change (proximal points: R. T. Rockafellar, SIAM J. Control Optim. 14
(1976) 877). S is as small as makes the loss tangent of `A + S` 1 at most: `|Im A| - Re A` of each wave whose own is
larger, and 0 of the others. In full contact the error of a wave then falls to 2^(-1/2) of it or less.
"""

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array
from ..problem import Operator
from .steady import SteadyContact, SteadySolver

Symbol = NDArray[np.inexact]
LEAST_CUT = 1.5e-5  # tuning, of the load, as in `local_load`: with more, contacts take up to three times the calls here
SHARE, MOST = 0.3, 0.5  # tuning: of the certificate, as the tolerance of the next contact; up to MOST where that fails
# and is tried again
LEAST = 0.3  # tuning: of the tolerance asked for, the same: more digits are not needed
MAX_STEPS_TO_HALVE = 20  # tuning: in which the certificate must halve
STEPS_TO_HALVE = 12  # tuning: the same of the projected steps of a contact
MOST_STEPS = 3  # tuning: times the steps that one contact may take, in all


def pull(symbol: Symbol) -> Symbol:
    """The symbol of S, of that of A."""
    return np.maximum(np.abs(symbol.imag) - symbol.real, 0.0)


def nearer(symbol: Symbol) -> Symbol:
    """The symbol of `A + S`, of that of A."""
    return symbol + pull(symbol)


def nearer_inverse(symbol: Symbol) -> Symbol:
    """The symbol of the inverse of `A + S`, of that of the inverse of A: 0 where that is 0."""
    square = np.abs(symbol) ** 2
    own = np.divide(pull(symbol), square, out=np.zeros_like(square), where=square > 0.0)
    return symbol / (1.0 + own * symbol)


class Proximal:
    """A `solver` for the operator `A + S` and the tolerance asked for, A itself, S, and two maps: heights of a contact,
    and the pressure before it.

    It solves as a `SteadySolver` of A does.
    """

    def __init__(self, solver: SteadySolver, operator: Operator, pull: Operator) -> None:
        self.solver, self.operator, self.pull = solver, operator, pull
        self.tolerance, solver.steps_to_halve = solver.tolerance, STEPS_TO_HALVE
        self._h, self._kept = solver.slab.empty(), solver.slab.empty()

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """As `SteadySolver.solve`; its numbers of steps are those of all contacts. Collective."""
        worst, best, since, share = 1.0, np.inf, 0, SHARE
        projections, sets, steps = 0, 0, 0
        while True:
            self._kept[...] = start
            self.pull.apply(start, self._h)
            self._h += h
            self.solver.tolerance = max(share * worst, LEAST * self.tolerance)
            contact = self.solver.solve(self._h, mean, start)
            if not np.isfinite(contact.certificate.worst):
                return contact
            projections, sets, steps = projections + contact.projections, sets + contact.sets, steps + contact.steps
            d, certificate = self.solver.check(self.operator, start, h, mean)
            since += 1
            if contact.failure and best < certificate.worst and share < MOST and since < MAX_STEPS_TO_HALVE:
                share *= 2.0
                start[...] = self._kept
                continue
            worst, share = certificate.worst, max(SHARE, 0.5 * share)
            if worst <= 0.5 * best:
                best, since = worst, 0
            if worst <= self.tolerance or since >= MAX_STEPS_TO_HALVE or steps >= MOST_STEPS * self.solver.max_steps:
                failure = "" if worst <= self.tolerance else f"no progress in {since} contacts: residual {worst:.3g}"
                return SteadyContact(start, contact.u, d, certificate, projections, sets, steps, failure)
