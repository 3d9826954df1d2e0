"""Steady contact in a free box: projected steps, followed by proximal points where these do not help.

The symbol of a padded box has waves with a negative real part, so that its resolvents may not exist (`splitting`). If
projected steps fail, the contact is the limit of contacts with less loss: with S symmetric and positive, the contact p'
of the operator `A + S` for heights `h + S p` satisfies

    A p' - h - d = S (p - p') where there is pressure,

which is the contact for A and h when p' = p. As A is positive, each step reduces the error of p, measured by S, also
if p' is only accurate to a share of the change (proximal points: R. T. Rockafellar, SIAM J. Control Optim. 14 (1976)
877). S is the smallest that limits the loss tangent of `A + S` to 1: `|Im A| - Re A` for waves whose tangent is
larger, 0 for the others.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array
from ...physics.convolution import Convolution
from ..problem import MeanPressure
from .judge import Judge, SteadyContact, describe_failure
from .projected import Projected

PATIENCE = 20  # tuning: limit on projected steps in which the certificate must halve
LEAST_CUT = 1.5e-5  # tuning: as in `local_load`, share of the load, for contacts with less loss
INNER_PATIENCE = 12  # tuning: limit on projected steps of a contact with less loss in which its certificate must halve
SHARE, MOST = 0.3, 0.5  # tuning: tolerance of the next contact over the last certificate; up to MOST after a failure
LEAST = 0.3  # tuning: least tolerance of a contact, over the tolerance of the solve
MAX_CONTACTS_TO_HALVE = 20  # tuning: limit on contacts in which the certificate must halve
Symbol = NDArray[np.inexact]


class FreeSteadySolver:
    """Solver on one grid with the interface of `SteadySolver`. It holds the maps of `Projected`; where that fails, also
    those of `_Points`."""

    def __init__(
        self, judge: Judge, operator: Convolution, preconditioner: Convolution, tolerance: float, pairs: int
    ) -> None:
        self._judge, self._operator, self._preconditioner = judge, operator, preconditioner
        self._tolerance, self._pairs = tolerance, pairs
        self._projected = Projected(judge, operator, preconditioner, pairs)

    def hold_all(self) -> "_Points":
        """Allocate all maps that a solve may need."""
        return _Points(self._judge, self._operator, self._preconditioner, self._pairs)

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure `start`.
        A start that is 0 everywhere is replaced by a uniform pressure."""
        for near_by in (True, False):
            contact = self._projected.solve(h, mean, start, self._tolerance, PATIENCE, near_by)
            if contact.converged:
                return contact
        return self.hold_all().solve(h, mean, start, self._tolerance)


class _Points:
    """Proximal points. They hold the symbols of `A + S`, of its inverse and of S, and three maps."""

    def __init__(self, judge: Judge, operator: Convolution, preconditioner: Convolution, pairs: int) -> None:
        kind = operator.dtype
        nearer, nearer_inverse = operator.mapped(_nearer, kind), preconditioner.mapped(_nearer_inverse, kind)
        self._judge, self._operator, self._pull = judge, operator, operator.mapped(_pull, np.float64)
        self._inner = Projected(judge, nearer, nearer_inverse, pairs, LEAST_CUT)
        self._h, self._kept, self._u = (judge.slab.empty() for _ in range(3))
        self._working: NDArray[Any] = judge.slab.zeros(np.bool_)

    def solve(self, h: Array, mean: float, start: Array, tolerance: float) -> SteadyContact:
        """Solve as `FreeSteadySolver.solve`; `steps` is the sum over all contacts. Collective."""
        worst, best, since, share, steps = 1.0, math.inf, 0, SHARE, 0
        while True:
            self._kept[...] = start
            self._pull.apply(start, self._h)
            self._h += h
            contact = self._inner.solve(self._h, mean, start, max(share * worst, LEAST * tolerance), INNER_PATIENCE)
            if not math.isfinite(contact.certificate.worst):
                return contact
            steps, since = steps + contact.steps, since + 1
            self._operator.apply(start, self._u)
            d, certificate = self._judge.certify(start, self._u, h, MeanPressure(mean), self._working)
            if contact.failure and best < certificate.worst and share < MOST and since < MAX_CONTACTS_TO_HALVE:
                share *= 2.0
                start[...] = self._kept
                continue
            worst, share = certificate.worst, max(SHARE, 0.5 * share)
            best, since = (worst, 0) if worst <= 0.5 * best else (best, since)
            if worst <= tolerance or since >= MAX_CONTACTS_TO_HALVE:
                failure = describe_failure(f"no progress in {since} contacts", certificate, tolerance)
                return SteadyContact(start, self._u, d, certificate, steps, failure)


def _pull(symbol: Symbol) -> Symbol:
    """Return the symbol of S from that of A."""
    return np.maximum(np.abs(symbol.imag) - symbol.real, 0.0)


def _nearer(symbol: Symbol) -> Symbol:
    """Return the symbol of `A + S` from that of A."""
    return symbol + _pull(symbol)


def _nearer_inverse(symbol: Symbol) -> Symbol:
    """Return the symbol of the inverse of `A + S` from that of the inverse of A; 0 where that is 0."""
    square = np.abs(symbol) ** 2
    own = np.divide(_pull(symbol), square, out=np.zeros_like(square), where=square > 0.0)
    return symbol / (1.0 + own * symbol)
