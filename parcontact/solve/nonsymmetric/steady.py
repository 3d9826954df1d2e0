"""Contact with an operator that is not symmetric: steady sliding in the frame of the rigid surface.

Find p >= 0 with mean P0 and `g = A p - h - d >= 0`, `p g = 0`. For a lossy body sliding at constant velocity, A is
positive but not symmetric, and there is no energy to minimize. Projected steps (`projected`) come first: each takes
three applications of A or K, and they reach most solutions. If they no longer help, an active set with inexact
linear solves continues:

1. On the set c, with x = 0 elsewhere, generalized conjugate residuals approach `A x - h = d` under the load. Where
   the body is soft along stripes they use the preconditioner of `stripes`.
2. The new set has the points with `x > kappa g`: x > 0 where the gap is closed, and g < 0 where there is no
   pressure.
3. When x and its gap seem solved, the admissible pressure `max(x, 0)`, scaled to the load, is certified with a new
   application of A.

Only the certificate of an admissible pressure ends a solve, as an iteration that cycles may seem converged. A start
from coarser grids makes solves cheap; with stripes, sets on the coarsest grid shrink from full contact. From a poor
start the sets may cycle; then the solve fails.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array, Slab
from .. import kernels
from ..certificate import Certificate
from ..constraint import NonNegative
from ..iterate import Lines, certify, form_iterate
from ..local_load import LEAST_CUT
from ..precision import precision_of_directions
from ..problem import Operator
from .gcr import GcrBasis, gaps_on
from .projected import Projected
from .stripes import OnSet, Plain, Stripes

MAX_STEPS_TO_HALVE = 20  # tuning: limit on projected steps in which the certificate must halve
STRIPED_STEPS_TO_HALVE = 8  # tuning: the same where the body is soft along stripes
REDUCTION, LEAST_REDUCTION = 0.05, 1e-3  # tuning: factor on the residual of a linear solve, at first and at least
SETTLING = 0.7  # tuning: changed points of a set over those of the last one, above which linear solves go further
ROUNDS = 3  # tuning: limit on restarts of the linear solve on a set
MAX_DIRECTIONS = 10  # tuning: number of directions of a linear solve
LOST = 1.0 / float(np.finfo(np.float64).eps)  # accuracy: estimated error above which the load is only rounding
LOOSE = 1.5e-3  # accuracy: least tolerance with which directions beyond the projected ones are in single precision
KAPPA = 0.1  # tuning: kappa over the stiffness of a point
MAX_STALLED_SETS = 25  # tuning: limit on sets without a smaller estimated error


@dataclass(frozen=True)
class SteadyContact:
    """A steady contact, solved or given up. p is the map of the start; `u = A p` belongs to the solver and is valid
    until its next solve.

    `projections`, `sets` and `steps` count projected steps, contact sets, and linear steps on all sets.
    """

    p: Array
    u: Array
    d: float
    certificate: Certificate
    projections: int
    sets: int
    steps: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


class SteadySolver:
    """Solver on one grid. It holds seven maps, a byte per point, and the maps of its preconditioner. If the active set
    is used, it holds one map more, and two for each direction beyond the third, in single precision for tolerances
    >= LOOSE.

    Parameters: `operator` A; `preconditioner` K near its inverse; `height` of the surface; `tolerance` on the
    certificate; `max_steps`, a limit on linear steps; `directions` of each linear solve; `along`, the axis of
    sliding where the body is far softer along stripes (`stripes`), else None; `pairs` of doublings that make cells
    square (`extension.pairs_for`); `least_cut` (`local_load`); `lines` along which the body is stiffer, if gaps are to
    be certified for them.
    """

    constraint = NonNegative()  # steady sliding has no other constraint

    def __init__(
        self,
        slab: Slab,
        operator: Operator,
        preconditioner: Operator,
        height: float,
        tolerance: float,
        max_steps: int,
        directions: int = MAX_DIRECTIONS,
        along: int | None = None,
        pairs: int = 0,
        least_cut: float = LEAST_CUT,
        lines: Lines | None = None,
    ) -> None:
        self.slab, self.operator, self.lines = slab, operator, lines
        self.height, self.tolerance, self.max_steps = height, tolerance, max_steps
        self._projected = Projected(slab, operator, preconditioner, self.constraint, pairs, least_cut)
        kept = precision_of_directions(tolerance, LOOSE)
        self._striped = along is not None
        self.steps_to_halve = STRIPED_STEPS_TO_HALVE if self._striped else MAX_STEPS_TO_HALVE
        on_sets: OnSet = Plain(preconditioner)
        if along is not None:
            on_sets = Stripes(slab, preconditioner, self._projected.extended, along)
        self._linear = GcrBasis(slab, operator, on_sets, directions, kept, self._projected.pairs)
        self._u = slab.zeros()
        self._length = height  # of the last certificate
        self._working: NDArray[Any] = slab.zeros(np.bool_)

    def hold_all(self) -> None:
        """Allocate all maps that the active set may need."""
        self._linear.hold_all()

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure `start`.
        A start that is 0 everywhere is replaced by a uniform pressure."""
        try:
            return self._solve(h, mean, start)
        except ZeroDivisionError:  # no load or no points in a set; all ranks have the same sums
            nothing = Certificate(math.nan, math.nan, math.nan)
            start.fill(0.0)
            return SteadyContact(start, self._u, math.nan, nothing, 0, 0, 0, "no point is left that carries load")

    def check(self, operator: Operator, p: Array, h: Array, mean: float) -> tuple[float, Certificate]:
        """Return the approach and the certificate of an admissible pressure for another operator, and put its image
        into `u`; collective."""
        operator.apply(p, self._u)
        return self._certify(p, h, mean)

    def _solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        cold = not self.slab.sum(kernels.sum_of(start))[0] > 0.0
        if cold:
            start.fill(mean)
        d, certificate, projections = self._project(start, h, mean)
        if certificate.worst <= self.tolerance:
            return SteadyContact(start, self._u, d, certificate, projections, 0, 0, "")
        if cold and self._striped:
            start.fill(mean)
            self._working.fill(True)
        return self._change_sets(start, h, mean, projections)

    def _project(self, p: Array, h: Array, mean: float) -> tuple[float, Certificate, int]:
        """Make projected steps as long as they help, first with the load restored near by and then, except with
        stripes, from all points."""
        self._admit(p, mean)
        d, certificate = self._certify(p, h, mean)
        steps = 0
        for near_by in (True,) if self._striped else (True, False):
            best, since = certificate.worst, 0
            self._projected.begin(near_by)
            while certificate.worst > self.tolerance and since < self.steps_to_halve:
                self._projected.step(p, self._u, h, self._working, mean * self.slab.points)
                d, certificate = self._certify(p, h, mean)
                steps += 1
                halved = certificate.worst <= 0.5 * best
                best, since = (certificate.worst, 0) if halved else (best, since + 1)
        return d, certificate, steps

    def _change_sets(self, x: Array, h: Array, mean: float, projections: int) -> SteadyContact:
        """Iterate active sets, from the marked one and the pressure x.

        The residual of a linear solve makes wrong points of the next set. So if the sets do not settle, linear
        solves go further. Sets may stall because single missing points make linear solves slow; then all points
        whose gap is within the estimated error are added, once. If a certified pressure is not a solution, the
        iteration continues with the set before it.
        """
        marked = self._projected.t[0]  # unused between linear steps
        kappa, reduction = KAPPA * self._stiffness(), REDUCTION
        best, since, sets, steps, before, taken_in = np.inf, 0, 0, 0, np.inf, False
        while True:
            self._load(x, mean)
            steps += self._solve_on_set(x, h, reduction)
            sets += 1
            guess, changed = self._next_set(x, h, kappa)
            if changed > SETTLING * before:
                reduction = max(0.3 * reduction, LEAST_REDUCTION)
            before = changed
            since = 0 if guess < best else since + 1
            best = min(best, guess)
            if since >= MAX_STALLED_SETS and not taken_in:
                self._take_in(h, best * self._length)
                best, since, taken_in = np.inf, 0, True
            stopped = not guess < LOST or since >= MAX_STALLED_SETS or steps >= self.max_steps
            if stopped or guess <= self.tolerance:
                marked[...] = self._working
                self._admit(x, mean)
                d, certificate = self._certify(x, h, mean)
                failure = self._failure(certificate, since, steps)
                if stopped or not failure:
                    return SteadyContact(x, self._u, d, certificate, projections, sets, steps, failure)
                np.not_equal(marked, 0.0, out=self._working)

    def _load(self, x: Array, mean: float) -> None:
        """Put x to 0 outside the set, scale its sum to the load, and update its image u. The load is made up for by the
        same pressure on all points of the set, or with stripes in proportion to x."""
        slab, working = self.slab, self._working
        np.copyto(x, 0.0, where=~working)
        total, members = slab.sum(kernels.sum_of(x), float(np.count_nonzero(working)))
        if self._striped:
            self.constraint.rescale_to_load(slab, x, total, mean * slab.points)
        else:
            np.add(x, (mean * slab.points - total) / members, out=x, where=working)
        self.operator.apply(x, self._u)

    def _solve_on_set(self, x: Array, h: Array, reduction: float) -> int:
        """Make linear steps on the set. Return their number."""
        linear, steps = self._linear, 0
        for _ in range(ROUNDS):
            made = linear.improve(x, self._u, h, self._working, linear.count, reduction)
            steps += max(1, made)
            if made < linear.count:
                break
        return steps

    def _stiffness(self) -> float:
        """Return the pressure on one point over the displacement it causes there; collective."""
        impulse, answer = self._projected.pairs[0]
        impulse.fill(0.0)
        owner = self.slab.rows.start == 0 < self.slab.rows.stop
        if owner:
            impulse[0, 0] = 1.0
        self.operator.apply(impulse, answer)
        displacement = self.slab.sum(float(answer[0, 0]) if owner else 0.0)[0]
        return 1.0 / displacement if displacement else 0.0  # 0 on a grid of one point

    def _failure(self, certificate: Certificate, since: int, steps: int) -> str:
        if certificate.worst <= self.tolerance:
            return ""
        reason = (
            f"no progress in {since} sets of points"
            if since >= MAX_STALLED_SETS
            else f"not converged in {steps} linear steps"
        )
        return f"{reason}: the residual is {certificate.worst:.3g} where {self.tolerance:.3g} was asked for"

    def _next_set(self, x: Array, h: Array, kappa: float) -> tuple[float, float]:
        """Mark the next set. Return the estimated error of x, and the number of changed points."""
        count, gaps = self.slab.sum(*gaps_on(self._working, self._u, h))
        *sums, deepest = self.constraint.choose_active(x, self._u, h, gaps / count, kappa, self._working)
        positive, negative, wrong, members, changed, deepest = self.slab.reduce(sums, [deepest])
        if members == 0.0 or positive <= 0.0:
            return np.inf, changed
        return max(wrong / positive / self._length, deepest / self._length, negative / positive), changed

    def _take_in(self, h: Array, gap: float) -> None:
        """Add all points to the set whose gap is at most `gap`."""
        count, gaps = self.slab.sum(*gaps_on(self._working, self._u, h))
        self._working |= self._u - h <= gaps / count + gap

    def _admit(self, x: Array, mean: float) -> None:
        """Limit x to x >= 0, scale it to the load, and update its image u."""
        load = self.slab.sum(self.constraint.clip(x))[0]
        self.constraint.rescale_to_load(self.slab, x, load, mean * self.slab.points)
        self.operator.apply(x, self._u)

    def _certify(self, p: Array, h: Array, mean: float) -> tuple[float, Certificate]:
        """Mark the working set of an admissible pressure. Return its approach and certificate."""
        iterate = form_iterate(self.slab, self.constraint, p, self._u, h, 0.0).settled()
        found = certify(self.slab, self.constraint, p, self._u, h, iterate, mean, self.height, self._working)
        certificate = found[-1]
        if self.lines is not None and iterate.load > 0.0:
            certificate = certificate.shortened(self.lines.share_of_length(self.slab, p, self._u, iterate))
        self._length = certificate.length
        return iterate.d, certificate
