"""Frictionless contact of a body with a rigid surface: projected, preconditioned conjugate gradients.

Find the pressure p of an `ny x nx` map such that

    p >= 0,   g = A p - h - d >= 0,   p g = 0,   and either mean(p) = P0 (d unknown) or d given,

with A a symmetric positive operator. It is the minimum of `f(p) = <p, A p>/2 - <p, h + d>` over the admissible p. One
iteration, with `R` = keep the values on the working set and put 0 elsewhere, `C` = subtract the mean over it:

1. the working set is the contact (p > 0) and the points that penetrate (g < 0): these enter by the search direction;
2. residual `r = C R g`, preconditioned `z = C R E' K E r` with K close to the inverse of A, and E carrying r on beyond
   the set (`preconditioner`);
3. direction `t = C R (z + beta t)` with a beta that makes it conjugate to the last one and makes up for what the last
   step fell short of or went too far; or `t = z` where that is much less of a descent, or where much of the last step
   was cut off;
4. `p <- max(p - alpha t, 0)` with a step alpha that is nearly exact, the load that cutting off adds taken back near
   by if it is much (`local_load`), then scaled to the mean P0;
5. f must not rise: else the step is halved along this path, without the former, and the direction is forgotten.

The exact step would be `<r, t>/<t, A t>`, for one more application of the operator in each iteration. It is 0.95 within
0.03 at 0.4 to 60 % of contact, where K E is nearly the inverse, and 1 in full contact. Afterwards `A p` is known anyway
and `<t, A t>` with it: where the exact step is seen to be far from that, or steps do not help, the rest of the solve
makes exact ones. On lines of points, and with cells much longer than wide, all are exact.

With d given there is neither centring nor scaling. With P0 given, d is the mean of `A p - h` weighted by p, so that
`<p, g> = 0`: scaling p then does not change f to first order, and cutting t off at p = 0, which a small step does only
where g < 0, only helps. Thus f falls for every step that is small enough (D. P. Bertsekas, SIAM J. Control Optim. 20
(1982) 221, for d given). The unpreconditioned ancestor is I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206; K makes
the number of iterations nearly independent of the grid. Everything here is dimensionless.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array, Slab, dealt_to, reused
from . import kernels
from .certificate import Certificate
from .iterate import Iterate, certify, weigh
from .local_load import LEAST, LocalLoad
from .precision import precision_of_directions
from .preconditioner.extension import ExtendedPreconditioner
from .problem import Operator

MAX_STALLED_ITERATIONS = 60  # iterations without a better certificate after which a solve gives up
MAX_HALVINGS = 12  # of a step that raises f; then it is taken as it is
STEP = 0.95  # beside edges of contact, and 1 far from them
UNLIKE = 1.25  # times a step: an exact one that is longer, or shorter by as much, is far from it
PATIENCE = 5  # iterations without a better certificate until steps are exact
LEAST_DESCENT = 0.5  # over that without the last direction: with less it is one of a set of points that is no more
LARGE_CUT = 0.003  # of the load: if more is cut off a step at p = 0, the next one takes no notice of its direction
UNSEEN_RISE = 64 * float(np.finfo(np.float64).eps)  # of <p, A p>/2: a rise of f that cannot be told from none
LEAST_LOAD = float(np.finfo(np.float64).tiny)  # a smaller one than maps can hold is none
NOT_FINITE = "met numbers that are not finite"


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d follows."""

    value: float


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load follows."""

    value: float


@dataclass(frozen=True)
class Contact:
    """A solved (or given up) contact, maps of shape (rows of this rank, nx).

    `p` is the map that was given as the start, the caller's own; `u = A p` is the solver's, valid until its next solve.
    `failure` is empty, or says what the solve did instead of reaching the tolerance.
    """

    p: Array
    u: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


class ContactSolver:
    """Loop for contacts on one grid, and the maps that it works in: a pressure, two displacements, the direction, which
    is in single precision where the tolerance is loose, a byte per point, and those of `ExtendedPreconditioner`.

    Parameters: `slab`, who owns which rows; `operator` A and `preconditioner` K; `height` of the surface from its
    lowest to its highest point, in the unit of h; `tolerance` on the certificate; `max_iterations`; `grids` of
    larger cells by which a residual is extended (`extension.grids_for`); `kept`, the type of displacements, single
    precision where the operator has no more digits.
    """

    def __init__(
        self,
        slab: Slab,
        operator: Operator,
        preconditioner: Operator,
        height: float,
        tolerance: float,
        max_iterations: int,
        grids: int | None = None,
        kept: type[np.floating] = np.float64,
    ) -> None:
        self.slab, self.operator, self.preconditioner = slab, operator, preconditioner
        self.height, self.tolerance, self.max_iterations = height, tolerance, max_iterations
        self._u, self._w = (slab.zeros(kept) for _ in range(2))
        self._other = slab.zeros()
        self._t = slab.zeros(precision_of_directions(tolerance))
        self._working = slab.zeros(np.bool_)
        self._extended = ExtendedPreconditioner(slab, preconditioner, most=grids)
        self._rough_inverse = grids == 0 or min(slab.nx, slab.ny) == 1  # K E is no more than roughly the inverse
        self._local_load = LocalLoad(slab)

    @staticmethod
    def footprint(
        nx: int,
        ny: int,
        tolerance: float,
        ranks: int,
        rank: int,
        grids: int | None = None,
        kept: type[np.floating] = np.float64,
    ) -> int:
        """Bytes that it holds on a rank."""
        rows = dealt_to(ny, ranks, rank)
        maps = np.float64, kept, kept, precision_of_directions(tolerance)
        bytes_of_point = 1 + sum(np.dtype(each).itemsize for each in maps)
        cells = ExtendedPreconditioner.footprint(nx, ny, ranks, rank, grids)
        return bytes_of_point * (rows.stop - rows.start) * nx + cells

    def solve(self, h: Array, control: MeanPressure | Approach, start: Array, length: float = 1.0) -> Contact:
        """Solve for heights `h`, starting from the pressure `start`, none of it negative, in whose place the solution
        will be; collective.

        Under load control the start is scaled to the load, or uniform where it is zero everywhere. `length` is that of
        a step over the usual one. A solve that does not reach the tolerance says why in `failure`; its maps are then
        the last iterate, not a solution.
        """
        mean = control.value if isinstance(control, MeanPressure) else None
        if mean is not None and 0.0 <= mean < LEAST_LOAD:
            return self._separate(h, start)
        centred = mean is not None
        p, other = start, self._other
        iterate = self._begin(p, h, control)
        best, slope, iteration = (np.inf, 0), 0.0, 0
        exact = self._rough_inverse or length != 1.0
        while True:
            members, excess, certificate = self._certify(p, h, iterate, mean)
            best = min(best, (certificate.worst, iteration))
            failure = self._verdict(certificate.worst, iteration, *best)
            if failure is not None:
                if p is not start:
                    start[...] = p
                return Contact(start, self._u, iterate.d, certificate, iteration, failure)
            level = iterate.d + (excess / members if centred else 0.0)
            slope, ratio = self._turn(h, level, slope, members, centred, other)
            exact |= not 1.0 / UNLIKE < ratio < UNLIKE or iteration - best[1] > PATIENCE
            share = members / self.slab.points
            usual = None if exact else STEP + (1.0 - STEP) * share**3
            iterate, cut = self._descend(p, h, iterate, usual, length * slope, mean, other)
            p, other = other, p
            iteration += 1
            exact |= cut == math.inf
            if cut > LARGE_CUT:
                slope = 0.0

    def judge(self, h: Array, control: MeanPressure | Approach, p: Array, otherwise: str) -> Contact:
        """The pressure p, scaled to the load, as it is; `otherwise` is its failure unless it solves; collective."""
        mean = control.value if isinstance(control, MeanPressure) else None
        iterate = self._begin(p, h, control)
        *_, certificate = self._certify(p, h, iterate, mean)
        failure = "" if certificate.worst <= self.tolerance else otherwise
        return Contact(p, self._u, iterate.d, certificate, 0, failure)

    def displace(self, p: Array) -> Array:
        """`A p`, in a map that is valid until the next solve; collective."""
        return self.operator.apply(p, self._u)

    def lend(self) -> tuple[Array, Array, Array]:
        """Three maps for work between solves, of a pressure, a displacement and a direction: the next solve does not
        keep what is in them."""
        return self._other, self._w, self._t

    # -- the steps of a solve; `mean` is the mean pressure asked for, None with a given approach -----------------------

    def _begin(self, p: Array, h: Array, control: MeanPressure | Approach) -> Iterate:
        """Make the start admissible and forget the last solve's direction."""
        self._t.fill(0.0)
        if isinstance(control, MeanPressure):
            load = self.slab.sum(kernels.total(p))[0]
            if load > 0.0:
                kernels.scale(p, control.value * self.slab.points / load)
            else:
                p.fill(control.value)
        self.operator.apply(p, self._u)
        if isinstance(control, Approach):
            return weigh(self.slab, p, self._u, h, control.value)
        return weigh(self.slab, p, self._u, h, 0.0).settled()

    def _certify(self, p: Array, h: Array, iterate: Iterate, mean: float | None) -> tuple[float, float, Certificate]:
        """Mark the working set; its size, its sum of gaps, and the certificate."""
        return certify(self.slab, p, self._u, h, iterate, mean, self.height, self._working)

    def _verdict(self, worst: float, iteration: int, best: float, best_at: int) -> str | None:
        """None: go on; empty: solved; else what happened instead."""
        if worst <= self.tolerance:
            return ""
        if not np.isfinite(worst):
            return NOT_FINITE
        asked = f"{worst:.3g} where {self.tolerance:.3g} was asked for"
        if iteration - best_at >= MAX_STALLED_ITERATIONS:
            return f"stalled: no better certificate than {best:.3g} in {MAX_STALLED_ITERATIONS} iterations, now {asked}"
        if iteration >= self.max_iterations:
            return f"did not converge in max_iterations = {iteration}: the certificate is {asked}"
        return None

    def _turn(
        self, h: Array, level: float, slope: float, members: float, centred: bool, free: Array
    ) -> tuple[float, float]:
        """Put the new search direction into `_t`; returns its slope `<r, t>`, and the exact step over the last one.

        The residual is `u - h - level` on the working set; the last displacement is in `_w`. `slope` is that of the
        last direction, 0 for one to be forgotten. There is a map that is `free`.
        """
        z = reused(free, free.shape, self._t.dtype)
        kernels.residual(self._working, self._u, h, level, z)
        self._extended.apply(self._working, z)
        sums = kernels.products(self._working, self._u, h, level, self._w, z, self._t)
        sum_z, sum_t, sum_change, r_z, change_z, r_t = self.slab.sum(*sums)
        mean_z, mean_t = (sum_z / members, sum_t / members) if centred else (0.0, 0.0)
        beta, ratio, fallen = 0.0, 1.0, slope - r_t  # by how much the slope along the last direction fell in its step
        if slope > 0.0:
            ratio = slope / fallen if fallen > 0.0 else math.inf
            beta = (max(0.0, change_z - mean_z * sum_change) + r_t) / fallen if fallen > 0.0 else 0.0
        if r_z + beta * r_t <= LEAST_DESCENT * r_z:
            beta = 0.0
        kernels.turn(self._working, z, beta, mean_z + beta * mean_t, self._t)
        return r_z + beta * r_t, ratio

    def _descend(
        self, old_p: Array, h: Array, old: Iterate, usual: float | None, slope: float, mean: float | None, p: Array
    ) -> tuple[Iterate, float]:
        """Make the usual step from `old_p` against `_t` to p, or the exact one, which leaves the old displacement in
        `_w`; returns the new iterate and how much of its load was cut off at 0, infinity where the step was halved."""
        step = usual if usual is not None else self._exact(slope)
        for halvings in range(MAX_HALVINGS + 1):
            load, cut = self._local_load.advance(old_p, self._t, step, p)
            if mean is not None:
                self._local_load.restore(p, load, mean * self.slab.points, cut > LEAST * load and halvings == 0)
            self._u, self._w = self.operator.apply(p, self._w), self._u
            new = weigh(self.slab, p, self._u, h, old.d)
            if new.f - old.f <= UNSEEN_RISE * new.energy or halvings == MAX_HALVINGS:
                break
            self._u, self._w = self._w, self._u
            step *= 0.5
        return new if mean is None else new.settled(), cut / load if halvings == 0 and load > 0.0 else math.inf

    def _exact(self, slope: float) -> float:
        """The step that makes f the smallest, for a slope along `_t`; by one more application of the operator."""
        curvature = self.slab.sum(kernels.dot(self._t, self.operator.apply(self._t, self._w)))[0]
        return slope / curvature if curvature > 0.0 else 0.0

    def _separate(self, h: Array, p: Array) -> Contact:
        """No load: no pressure, the surface just touches the body."""
        p.fill(0.0)
        self._u.fill(0.0)
        highest = self.slab.reduce((), [float(h.max(initial=-np.inf))])[0]
        failure = "" if np.isfinite(highest) else NOT_FINITE
        return Contact(p, self._u, -highest, Certificate(0.0, 0.0, 0.0), 0, failure)
