"""Steady contact of a body with a very large loss tangent, by a sequence of contacts with less loss.

If the body loses far more energy than it stores (tan(delta) far above 3), A is nearly skew, and sets of points
cycle. With S symmetric and positive, the contact p' of the operator `A + S` for heights `h + S p` satisfies

    A p' - h - d = S (p - p') where there is pressure,

which is the contact for A and h when p' = p. As A is positive, each step reduces the error of p, measured by S, also
if p' is only accurate to a share of the change (proximal points: R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)
877). S is the smallest that limits the loss tangent of `A + S` to 1: `|Im A| - Re A` for waves whose tangent is
larger, 0 for the others. In full contact each step multiplies the error of a wave by at most 2^(-1/2).
"""

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array
from ..problem import Operator
from .steady import SteadyContact, SteadySolver

Symbol = NDArray[np.inexact]
LEAST_CUT = 1.5e-5  # tuning: as in `local_load`, share of the load
SHARE, MOST = 0.3, 0.5  # tuning: tolerance of the next contact over the last certificate; up to MOST after a failure
LEAST = 0.3  # tuning: least tolerance of a contact, over the tolerance of the solve
MAX_STEPS_TO_HALVE = 20  # tuning: limit on contacts in which the certificate must halve
STEPS_TO_HALVE = 12  # tuning: limit on projected steps of a contact in which its certificate must halve
MOST_STEPS = 3  # tuning: limit on linear steps of all contacts, over that of one


def pull(symbol: Symbol) -> Symbol:
    """Return the symbol of S from that of A."""
    return np.maximum(np.abs(symbol.imag) - symbol.real, 0.0)


def nearer(symbol: Symbol) -> Symbol:
    """Return the symbol of `A + S` from that of A."""
    return symbol + pull(symbol)


def nearer_inverse(symbol: Symbol) -> Symbol:
    """Return the symbol of the inverse of `A + S` from that of the inverse of A; 0 where that is 0."""
    square = np.abs(symbol) ** 2
    own = np.divide(pull(symbol), square, out=np.zeros_like(square), where=square > 0.0)
    return symbol / (1.0 + own * symbol)


class Proximal:
    """Solver for A with the interface of `SteadySolver`. It has a `solver` for `A + S`, A, S, and two maps."""

    def __init__(self, solver: SteadySolver, operator: Operator, pull: Operator) -> None:
        self.solver, self.operator, self.pull = solver, operator, pull
        self.tolerance, solver.steps_to_halve = solver.tolerance, STEPS_TO_HALVE
        self._h, self._kept = solver.slab.empty(), solver.slab.empty()

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """Solve as `SteadySolver.solve`; the numbers of steps are sums over all contacts. Collective."""
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
