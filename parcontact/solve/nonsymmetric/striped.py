"""Steady contacts of bodies that are far softer along stripes than elsewhere: those under a surface that slides fast.

As `steady`, with other linear solves on sets: their preconditioner has means along stripes, so that they are fast, and
go further where the sets do not settle. From a cold start the first set is full contact, from which sets shrink.
"""

import math
from typing import Any

import numpy as np

from ...parallel.slab import Array, dealt_to
from .. import kernels
from ..problem import Operator
from .steady import KAPPA, LOST, MAX_STALLED_SETS, SteadyContact, SteadySolver
from .stripes import OnSet, Stripes

MAX_STEPS_TO_HALVE = 8  # tuning: projected steps in which the certificate must halve
REDUCTION, LEAST_REDUCTION = 0.05, 1e-3  # tuning: what linear steps on a set reduce its residual to, at first and at
# least
FURTHER, SETTLING = 0.3, 0.7  # tuning: they go so many times further unless each set has at most so many times the new
# points of the last one
ROUNDS = 3  # tuning: of linear steps on a set


def applies(velocity: tuple[float, float], points: tuple[int, int]) -> bool:
    """Return whether a surface slides along an axis of a grid that is no line."""
    return any(velocity) and not all(velocity) and 1 not in points


class StripedSolver(SteadySolver):
    """Loop on one grid for a surface that slides along the axis `along` of an array of rows; where it changes sets, it
    holds another byte per point."""

    def __init__(self, along: int, *given: Any) -> None:
        """The rest is given as to `SteadySolver`."""
        self._along = along
        super().__init__(*given)

    @staticmethod
    def footprint(nx: int, ny: int, tolerance: float, ranks: int, rank: int, sets: bool = False) -> int:
        """Bytes that it holds on a rank at most."""
        rows = dealt_to(ny, ranks, rank)
        return SteadySolver.footprint(nx, ny, tolerance, ranks, rank, sets) + sets * (rows.stop - rows.start) * nx

    def _on_sets(self, preconditioner: Operator) -> OnSet:
        return Stripes(self.slab, preconditioner, self._projected.extended, self._along)

    def _solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        cold = not self.slab.sum(kernels.total(start))[0] > 0.0
        if cold:
            start.fill(mean)
        d, certificate, projections = self._project(start, h, mean, (True,), MAX_STEPS_TO_HALVE)
        if certificate.worst <= self.tolerance:
            return SteadyContact(start, self._u, d, certificate, projections, 0, 0, "")
        if cold:
            start.fill(mean)
            self._working.fill(True)
        return self._change_sets(start, h, mean, projections)

    def _change_sets(self, x: Array, h: Array, mean: float, projections: int) -> SteadyContact:
        """The active set, from the marked one, under the pressure x.

        What a linear solve leaves of its residual makes wrong points of the next set. So where the sets do not settle,
        linear solves go further.
        """
        slab, working, linear = self.slab, self._working, self._linear
        last = slab.empty(np.bool_)
        kappa, reduction = KAPPA * self._stiffness(), REDUCTION
        best, since, sets, steps, before = math.inf, 0, 0, 0, math.inf
        while True:
            np.copyto(x, 0.0, where=~working)
            self.constraint.give_load(slab, x, slab.sum(kernels.total(x))[0], mean * slab.points)
            self.operator.apply(x, self._u)
            for _ in range(ROUNDS):
                made = linear.improve(x, self._u, h, working, linear.count, reduction)
                steps += max(1, made)
                if made < linear.count:
                    break
            sets += 1
            last[...] = working
            guess = self._next_set(x, h, kappa)
            changed = slab.sum(float(np.count_nonzero(last != working)))[0]
            if changed > SETTLING * before:
                reduction = max(FURTHER * reduction, LEAST_REDUCTION)
            before = changed
            since = 0 if guess < best else since + 1
            best = min(best, guess)
            stopped = not guess < LOST or since >= MAX_STALLED_SETS or steps >= self.max_steps
            if guess <= self.tolerance or stopped:
                last[...] = working
                self._admit(x, mean)
                d, certificate = self._certify(x, h, mean)
                failure = self._failure(certificate, since, steps)
                if stopped or not failure:
                    return SteadyContact(x, self._u, d, certificate, projections, sets, steps, failure)
                working[...] = last
