"""Frictionless contact of a body with a rigid surface: projected, preconditioned conjugate gradients.

Find the pressure p of an `ny x nx` map such that

    p >= 0,   g = A p - h - d >= 0,   p g = 0,   and either mean(p) = P0 (d unknown) or d given,

with A a symmetric positive operator. It is the minimum of `f(p) = <p, A p>/2 - <p, h + d>` over the admissible p. One
iteration, with `R` = keep the values on the working set and put 0 elsewhere, `C` = subtract the mean over it:

1. the working set is the contact (p > 0) and the points that penetrate (g < 0): these enter by the search direction;
2. residual `r = C R g`, preconditioned `z = C R K r` with K close to the inverse of A;
3. direction `t = C R (z + beta t)` with Polak and Ribiere's beta, or `t = z` where that is no descent;
4. `p <- max(p - alpha t, 0)` with the exact step `alpha = <r, t>/<t, A t>`, then scaled to the mean P0;
5. f must not rise but for a few times and less and less, as cutting a warm start to the new contact may do: else the step
   is shortened along the projected path and the direction is forgotten.

With d given there is neither centring nor scaling. The unpreconditioned ancestor is I. A. Polonsky and L. M. Keer, Wear
231 (1999) 206; K makes the number of iterations nearly independent of the grid. Everything here is dimensionless.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..parallel.slab import Array, Slab
from . import kernels

STALL = 60  # iterations without a better certificate after which a solve gives up
SHORTENINGS = 12  # halvings of a step along the projected path
LEEWAY = 1e-2  # of <p, A p>/2: by how much the first step that raises f may do so; each later one by half as much


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
    """How well a returned pressure meets the contact conditions, all three recomputed from it.

    complementarity: `sum(p |g|) / sum(p)`, the gap where there is pressure, weighted by it, over the surface's height;
    penetration: `max(-g, 0)` over all points, over the surface's height;
    load: `|mean(p)/P0 - 1|` (0 with a given approach).
    """

    complementarity: float
    penetration: float
    load: float

    @property
    def worst(self) -> float:
        return max(self.complementarity, self.penetration, self.load)


@dataclass(frozen=True)
class Contact:
    """A solved (or given up) contact: maps `p` and `u = A p` are the solver's own, valid until its next solve."""

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


class ContactSolver:
    """Buffers and loop for contacts on one grid.

    Parameters: `slab`, who owns which rows; `operator` A and `preconditioner` K; `height` of the surface from its
    lowest to its highest point, in the unit of h: what gaps are compared with; `tolerance` on the certificate; `max_iterations`; `dtype` of maps.
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
        self.round_off = 8 * float(np.finfo(dtype).eps)
        self.p, self.u, self.w, self.t, self.r, self.spare = (slab.zeros(dtype) for _ in range(6))
        self.working = np.zeros(slab.shape, dtype=np.bool_)

    def solve(self, h: Array, control: MeanPressure | Approach) -> Contact:
        """Solve for heights `h`, starting from the pressure in `self.p`; collective.

        Under load control the start is scaled to the load, or uniform where it is zero everywhere. A solve that does
        not reach the tolerance says why in `failure`; its maps are then the last iterate, not a solution.
        """
        if isinstance(control, MeanPressure) and control.value == 0.0:
            return self._separated(h)
        centred = isinstance(control, MeanPressure)
        gaps, count = self._begin(h, control)
        old_product, best, best_at, shortened, iteration = 0.0, np.inf, 0, 0, 0
        while True:
            d = gaps / count if centred else control.value
            load, members, excess, certificate = self._certify(h, d, control)
            if certificate.worst < best:
                best, best_at = certificate.worst, iteration
            failure = self._verdict(certificate, iteration, iteration - best_at)
            if failure is not None:
                return Contact(self.p, self.u, d, load, certificate, iteration, shortened, failure)
            self.r, self.spare = self.spare, self.r
            kernels.residual(self.working, self.u, h, d + (excess / members if centred else 0.0), self.r)
            slope, old_product = self._turn(old_product, members, centred)
            gaps, count, halvings = self._descend(h, d, slope, control)
            iteration += 1
            if halvings:
                shortened += 1
                old_product = 0.0

    # -- the steps of one iteration -----------------------------------------------------------------------------------

    def _begin(self, h: Array, control: MeanPressure | Approach) -> tuple[float, float]:
        """Make the start admissible; returns the sum of `u - h` over the contact and its points."""
        self.t.fill(0.0)
        self.r.fill(0.0)
        self.leeway = LEEWAY
        if isinstance(control, MeanPressure):
            load = self.slab.sum(kernels.total(self.p))[0] / self.slab.points
            if load > 0.0:
                kernels.scale(self.p, control.value / load)
            else:
                self.p.fill(control.value)
        self.operator.apply(self.p, self.u)
        gaps, count = self.slab.sum(*kernels.touching(self.p, self.u, h))
        return gaps, count

    def _certify(self, h: Array, d: float, control: MeanPressure | Approach) -> tuple[float, float, float, Certificate]:
        """Mark the working set; returns the load, the set's size and sum of gaps, and the certificate."""
        *sums, deepest = kernels.certify(self.p, self.u, h, d, self.working)
        total, wrong, members, excess, deepest = self.slab.reduce(sums, [deepest])
        load = total / self.slab.points
        error = abs(load / control.value - 1.0) if isinstance(control, MeanPressure) else 0.0
        complementarity = wrong / total / self.height if total > 0.0 else 0.0
        penetration = max(deepest / self.height, 0.0)
        return load, members, excess, Certificate(complementarity, penetration, error)

    def _verdict(self, certificate: Certificate, iteration: int, unimproved: int) -> str | None:
        """None: go on; empty: solved; else why the solve is given up."""
        if certificate.worst <= self.tolerance:
            return ""
        if not np.isfinite(certificate.worst):
            return "the pressure is not finite"
        if unimproved >= STALL:
            return f"stalled: no better certificate than {certificate.worst:.3g} in {STALL} iterations"
        if iteration >= self.max_iterations:
            return f"not converged after max_iterations = {iteration}: certificate {certificate.worst:.3g}"
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

    def _descend(self, h: Array, d: float, slope: float, control: MeanPressure | Approach) -> tuple[float, float, int]:
        """Step against `self.t`; returns the sum of `u - h` over the contact, its points, and how often it was halved."""
        w = self.operator.apply(self.t, self.w)
        curvature = self.slab.sum(kernels.dot(self.t, w))[0]
        step = slope / curvature if curvature > 0.0 else 0.0
        self.p, self.spare = self.spare, self.p
        for halvings in range(SHORTENINGS):
            load, cut = self.slab.sum(*kernels.advance(self.spare, self.t, step, self.p))
            if cut == 0.0:  # the exact minimum along t, and A p is known
                kernels.subtract(self.u, step, w if halvings == 0 else self.operator.apply(self.t, self.w))
                return *self.slab.sum(*kernels.touching(self.p, self.u, h)), halvings
            if isinstance(control, MeanPressure):
                kernels.scale(self.p, control.value * self.slab.points / load)
            self.operator.apply(self.p, self.w)
            rise, energy, gaps, count = self.slab.sum(*kernels.change(self.p, self.spare, self.w, self.u, h, d))
            if rise <= self.round_off * energy:
                break
            if rise <= self.leeway * energy:
                self.leeway *= 0.5
                break
            step *= 0.5
        self.u, self.w = self.w, self.u
        return gaps, count, halvings

    def _separated(self, h: Array) -> Contact:
        """No load: no pressure, the surface just touches the body."""
        self.p.fill(0.0)
        self.u.fill(0.0)
        highest = self.slab.reduce((), [float(h.max(initial=-np.inf))])[0]
        return Contact(self.p, self.u, -highest, 0.0, Certificate(0.0, 0.0, 0.0), 0, 0, "")
