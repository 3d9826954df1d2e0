"""Frictionless contact of a body with a rigid surface: projected, preconditioned conjugate gradients.

Find the pressure p of an `ny x nx` map such that

    p >= 0,   g = A p - h - d >= 0,   p g = 0,   and either mean(p) = P0 (d unknown) or d given,

with A a symmetric positive operator. It is the minimum of `f(p) = <p, A p>/2 - <p, h + d>` over the admissible p. One
iteration, with `R` = keep the values on the working set and put 0 elsewhere, `C` = subtract the mean over it:

1. the working set is the contact (p > 0) and the points that penetrate (g < 0): these enter by the search direction;
2. residual `r = C R g`, preconditioned `z = C R K r` with K close to the inverse of A;
3. direction `t = C R (z + beta t)` with Polak and Ribiere's beta, or `t = z` where that is no descent;
4. `p <- max(p - alpha t, 0)` with the exact step `alpha = <r, t>/<t, A t>`, then scaled to the mean P0;
5. f must not rise: else the step is halved along this path and the direction is forgotten.

With d given there is neither centring nor scaling. With P0 given, d is the mean of `A p - h` weighted by p, so that
`<p, g> = 0`: scaling p then does not change f to first order, and cutting t off at p = 0, which a small step does only
where g < 0, only helps. Thus f falls for every step that is small enough (D. P. Bertsekas, SIAM J. Control Optim. 20
(1982) 221, for d given). The unpreconditioned ancestor is I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206; K makes
the number of iterations nearly independent of the grid. Everything here is dimensionless.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..parallel.slab import Array, Slab
from . import kernels

STALL = 60  # iterations without a better certificate after which a solve gives up
HALVINGS = 12  # of a step that raises f; then it is taken as it is
ROUND_OFF = 64  # times the precision of maps, times <p, A p>/2: a rise of f that cannot be told from none
NOT_FINITE = "met numbers that are not finite"


class Operator(Protocol):
    """A linear map from maps to maps; applying it is collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d follows."""

    value: float


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load follows."""

    value: float


@dataclass(frozen=True)
class Certificate:
    """How well a returned pressure meets the contact conditions, all three computed from it.

    complementarity: `sum(p |g|) / sum(p)`, the gap where there is pressure, weighted by it, over the surface's height;
    penetration: `max(-g, 0)` over all points, over the surface's height;
    load: `|mean(p)/P0 - 1|` (0 with a given approach).
    """

    complementarity: float
    penetration: float
    load: float

    @property
    def worst(self) -> float:
        total = self.complementarity + self.penetration + self.load
        return total if math.isnan(total) else max(self.complementarity, self.penetration, self.load)


@dataclass(frozen=True)
class Contact:
    """A solved (or given up) contact: maps `p` and `u = A p` are the solver's own, valid until its next solve.

    `failure` is empty, or says what the solve did instead of reaching the tolerance; `shortened` counts the iterations
    in which the step was halved.
    """

    p: Array
    u: Array
    d: float
    load: float
    certificate: Certificate
    iterations: int
    shortened: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


@dataclass(frozen=True)
class Balance:
    """An iterate in numbers, for an approach d: the sums of p and of p g, and `energy = <p, A p>/2`."""

    d: float
    load: float
    gaps: float
    energy: float

    @property
    def f(self) -> float:
        """`<p, A p>/2 - <p, h + d>`, with `h + d = A p - g`: no large numbers where h has a large offset."""
        return self.gaps - self.energy

    def settled(self) -> "Balance":
        """The same iterate, for the d at which `<p, g> = 0`, but for the rounding of d."""
        d = self.d + self.gaps / self.load
        return replace(self, d=d, gaps=self.gaps - (d - self.d) * self.load)


class ContactSolver:
    """Buffers and loop for contacts on one grid.

    Parameters: `slab`, who owns which rows; `operator` A and `preconditioner` K; `height` of the surface from its
    lowest to its highest point, in the unit of h: what gaps are compared with; `tolerance` on the certificate;
    `max_iterations`; `dtype` of maps.
    """

    def __init__(
        self,
        slab: Slab,
        operator: Operator,
        preconditioner: Operator,
        height: float,
        tolerance: float,
        max_iterations: int,
        dtype: type[np.floating] = np.float64,
    ) -> None:
        self.slab, self.operator, self.preconditioner = slab, operator, preconditioner
        self.height, self.tolerance, self.max_iterations = height, tolerance, max_iterations
        self.round_off = ROUND_OFF * float(np.finfo(dtype).eps)
        self.least = float(np.finfo(dtype).tiny)  # a smaller load than maps can hold is none
        self.p, self.u, self.w, self.t, self.r, self.spare = (slab.zeros(dtype) for _ in range(6))
        self.working = slab.zeros(np.bool_)

    def solve(self, h: Array, control: MeanPressure | Approach, length: float = 1.0) -> Contact:
        """Solve for heights `h`, starting from the pressure in `self.p` (no value of it negative); collective.

        Under load control the start is scaled to the load, or uniform where it is zero everywhere. `length` is that of
        a step over the exact one. A solve that does not reach the tolerance says why in `failure`; its maps are then
        the last iterate, not a solution.
        """
        mean = control.value if isinstance(control, MeanPressure) else None
        if mean is not None and 0.0 <= mean < self.least:
            return self._separated(h)
        centred = mean is not None
        self._begin(mean)
        balance = self._weigh(h, 0.0).settled() if centred else self._weigh(h, control.value)
        best, old_product, shortened, iteration = (np.inf, 0), 0.0, 0, 0
        while True:
            members, excess, certificate = self._certify(h, balance, mean)
            best = min(best, (certificate.worst, iteration))
            failure = self._verdict(certificate.worst, iteration, *best)
            if failure is not None:
                load = balance.load / self.slab.points
                return Contact(self.p, self.u, balance.d, load, certificate, iteration, shortened, failure)
            self.r, self.spare = self.spare, self.r
            kernels.residual(self.working, self.u, h, balance.d + (excess / members if centred else 0.0), self.r)
            slope, old_product = self._turn(old_product, members, centred)
            balance, halvings = self._descend(h, balance, length * slope, mean)
            iteration += 1
            if halvings:
                shortened += 1
                old_product = 0.0

    def judge(self, h: Array, control: MeanPressure | Approach, otherwise: str) -> Contact:
        """The pressure in `self.p`, scaled to the load, as it is; `otherwise` is its failure unless it is a solution.

        Also marks its working set: the contact and what penetrates. Collective.
        """
        mean = control.value if isinstance(control, MeanPressure) else None
        self._begin(mean)
        balance = self._weigh(h, control.value) if mean is None else self._weigh(h, 0.0).settled()
        *_, certificate = self._certify(h, balance, mean)
        failure = "" if certificate.worst <= self.tolerance else otherwise
        return Contact(self.p, self.u, balance.d, balance.load / self.slab.points, certificate, 0, 0, failure)

    # -- the steps of a solve; `mean` is the mean pressure asked for, None with a given approach -----------------------

    def _begin(self, mean: float | None) -> None:
        """Make the start admissible and forget the last solve's direction."""
        self.t.fill(0.0)
        self.r.fill(0.0)
        if mean is not None:
            load = self.slab.sum(kernels.total(self.p))[0]
            if load > 0.0:
                kernels.scale(self.p, mean * self.slab.points / load)
            else:
                self.p.fill(mean)
        self.operator.apply(self.p, self.u)

    def _weigh(self, h: Array, d: float) -> Balance:
        load, work, gaps = self.slab.sum(*kernels.weigh(self.p, self.u, h, d))
        return Balance(d, load, gaps, 0.5 * work)

    def _certify(self, h: Array, balance: Balance, mean: float | None) -> tuple[float, float, Certificate]:
        """Mark the working set; returns its size, its sum of gaps, and the certificate."""
        *sums, deepest = kernels.certify(self.p, self.u, h, balance.d, self.working)
        wrong, members, excess, deepest = self.slab.reduce(sums, [deepest])
        complementarity = wrong / (balance.load or 1.0) / self.height
        penetration = max(deepest / self.height, 0.0)
        load = 0.0 if mean is None else abs(balance.load / self.slab.points / mean - 1.0)
        return members, excess, Certificate(complementarity, penetration, load)

    def _verdict(self, worst: float, iteration: int, best: float, best_at: int) -> str | None:
        """None: go on; empty: solved; else what happened instead."""
        if worst <= self.tolerance:
            return ""
        if not np.isfinite(worst):
            return NOT_FINITE
        asked = f"{worst:.3g} where {self.tolerance:.3g} was asked for"
        if iteration - best_at >= STALL:
            return f"stalled: no better certificate than {best:.3g} in {STALL} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the certificate is {asked}"
        return None

    def _turn(self, old_product: float, members: float, centred: bool) -> tuple[float, float]:
        """Put the new search direction into `self.t`; returns `<r, t>` and `<r, z>`."""
        z = self.preconditioner.apply(self.r, self.w)
        sums = kernels.products(self.working, self.r, self.spare, z, self.t)
        sum_z, sum_t, sum_old, r_z, old_z, r_t = self.slab.sum(*sums)
        mean_z, mean_t = (sum_z / members, sum_t / members) if centred else (0.0, 0.0)
        beta = max(0.0, (r_z - old_z + mean_z * sum_old) / old_product) if old_product > 0.0 else 0.0
        if r_z + beta * r_t <= 0.0:
            beta = 0.0
        kernels.turn(self.working, z, beta, mean_z + beta * mean_t, self.t)
        return r_z + beta * r_t, r_z

    def _descend(self, h: Array, old: Balance, slope: float, mean: float | None) -> tuple[Balance, int]:
        """Step against `self.t`; returns the new balance and how often the step was halved."""
        curvature = self.slab.sum(kernels.dot(self.t, self.operator.apply(self.t, self.w)))[0]
        step = slope / curvature if curvature > 0.0 else 0.0
        self.p, self.spare = self.spare, self.p
        for halvings in range(HALVINGS + 1):
            load, cut = self.slab.sum(*kernels.advance(self.spare, self.t, step, self.p))
            if cut and mean is not None:
                kernels.scale(self.p, mean * self.slab.points / load)
            self.u, self.w = self.operator.apply(self.p, self.w), self.u
            new = self._weigh(h, old.d)
            if new.f - old.f <= self.round_off * new.energy or halvings == HALVINGS:
                break
            self.u, self.w = self.w, self.u
            step *= 0.5
        return new if mean is None else new.settled(), halvings

    def _separated(self, h: Array) -> Contact:
        """No load: no pressure, the surface just touches the body."""
        self.p.fill(0.0)
        self.u.fill(0.0)
        highest = self.slab.reduce((), [float(h.max(initial=-np.inf))])[0]
        failure = "" if np.isfinite(highest) else NOT_FINITE
        return Contact(self.p, self.u, -highest, 0.0, Certificate(0.0, 0.0, 0.0), 0, 0, failure)
