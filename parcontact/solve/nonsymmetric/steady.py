"""Contact with an operator that is not symmetric: steady sliding, seen from the rigid surface.

Find p >= 0 with mean P0 and `g = A p - h - d >= 0`, `p g = 0`, where A is positive but, for a lossy body sliding at a
constant velocity, not symmetric: there is no energy to minimize. Projected steps (`projected`) come first: they are
cheap, three applications of A or K each, and reach most solutions. Where they no longer help, an active set with an
inexact linear solve goes on:

1. on the set c, with x = 0 elsewhere, generalized conjugate residuals towards `A x - h = d` under the load, where the
   body is soft along stripes with the preconditioner of `stripes`;
2. the new set: points with `x > kappa g`, that is x > 0 where the gap is closed, and g < 0 where there is no pressure;
3. when x and its gap look solved, the admissible pressure `p = max(x, 0)`, scaled to the load, is certified with a new
   application of A.

In both only the certificate of an admissible pressure counts: an iteration that cycles may look finished. A start from
coarser grids makes it cheap; with stripes, sets shrink on the coarsest from full contact. From far away it may cycle,
and then it says so.
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
from ..iterate import certify, form_iterate
from ..local_load import LEAST_CUT
from ..precision import precision_of_directions
from ..problem import Operator
from .gcr import GcrBasis, gaps_on
from .projected import Projected
from .stripes import OnSet, Plain, Stripes

MAX_STEPS_TO_HALVE, STRIPED_STEPS_TO_HALVE = 20, 8  # tuning: projected steps in which the certificate must halve; the
# latter where the body is soft along stripes
REDUCTION, LEAST_REDUCTION = 0.05, 1e-3  # tuning: what linear steps on a set reduce its residual to, at first and at
# least
SETTLING = 0.7  # tuning: sets settle while each has at most so many times the new points of the last one
ROUNDS = 3  # tuning: of linear steps on a set
MAX_DIRECTIONS = 10  # tuning: of the linear steps on a set
LOST = 1.0 / float(np.finfo(np.float64).eps)  # accuracy: a guess with which no digit of the load is left
LOOSE = 1.5e-3  # accuracy: tolerance with which directions beyond the projected steps' are in single precision: with a
# smaller one rounded directions took up to half as many steps more where a body is a thousand times as stiff at once
KAPPA = 0.1  # tuning: times the stiffness of a point
MAX_STALLED_SETS = 25  # tuning: changes of the set without coming nearer to a solution after which sets have stalled


@dataclass(frozen=True)
class SteadyContact:
    """A solved (or given up) steady contact; p is the map of its start, `u = A p` the solver's, valid until it solves
    again.

    It took so many projected steps and, where these did not do, so many contact sets with so many linear steps in all.
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
    """Loop on one grid, and the maps that it works in: seven, a byte per point, and those of its preconditioner; where
    the active set goes on, one more and two for each linear step on a set beyond the third, in single precision where
    the tolerance is loose.

    Parameters: `operator` A and `preconditioner` K near its inverse; `height` of the surface; `tolerance` on the
    certificate; `max_steps` of the linear solves in all; `directions` kept in each; the axis `along` which the surface
    slides where the body is far softer along stripes (`stripes`), else None; `pairs` that make square cells
    (`extension.pairs_for`); `least_cut` of the load, which is taken back near by (`local_load`).
    """

    constraint = NonNegative()  # the only law that there is

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
    ) -> None:
        self.slab, self.operator = slab, operator
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
        """Make all maps that are needed where the active set changes, as otherwise the first of these solves does."""
        self._linear.hold_all()

    def solve(self, h: Array, mean: float, start: Array) -> SteadyContact:
        """Solve for heights h under the mean pressure, starting from the pressure `start`, in whose place the solution
        will be; from a uniform one where it is zero everywhere. Collective."""
        try:
            return self._solve(h, mean, start)
        except ZeroDivisionError:  # by the load or the points of a set, sums which all ranks have
            nothing = Certificate(math.nan, math.nan, math.nan)
            start.fill(0.0)
            return SteadyContact(start, self._u, math.nan, nothing, 0, 0, 0, "no point is left that carries load")

    def check(self, operator: Operator, p: Array, h: Array, mean: float) -> tuple[float, Certificate]:
        """The approach and the certificate of an admissible pressure, such as a solution, for another operator, whose
        image of it is then `u`. Collective."""
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
        """Projected steps as long as they help: in one way and, but where the active set is as good, in the other."""
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
        """The active set, from the marked one, under the pressure x.

        What a linear solve leaves of its residual makes wrong points of the next set. So where the sets do not settle,
        linear solves go further. Sets may stall still, as single points are left out that should be in contact and make
        the linear solves slow. Then all points as near as the solution seems to be wrong are taken in, once. The set of
        a certified pressure that is no solution is no better than the one marked: that one goes on.
        """
        marked = self._projected.t[0]  # is free between linear steps
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
        """Make x 0 outside the set, and its sum that of the load: by the same on all points of the set, or in
        proportion where waves as long as the box are far softer than others; and u its image."""
        slab, working = self.slab, self._working
        np.copyto(x, 0.0, where=~working)
        total, members = slab.sum(kernels.sum_of(x), float(np.count_nonzero(working)))
        if self._striped:
            self.constraint.rescale_to_load(slab, x, total, mean * slab.points)
        else:
            np.add(x, (mean * slab.points - total) / members, out=x, where=working)
        self.operator.apply(x, self._u)

    def _solve_on_set(self, x: Array, h: Array, reduction: float) -> int:
        """Linear steps on the set, and how many."""
        linear, steps = self._linear, 0
        for _ in range(ROUNDS):
            made = linear.improve(x, self._u, h, self._working, linear.count, reduction)
            steps += max(1, made)
            if made < linear.count:
                break
        return steps

    def _stiffness(self) -> float:
        """Pressure on one point over the displacement it causes there; collective."""
        impulse, answer = self._projected.pairs[0]
        impulse.fill(0.0)
        owner = self.slab.rows.start == 0 < self.slab.rows.stop
        if owner:
            impulse[0, 0] = 1.0
        self.operator.apply(impulse, answer)
        displacement = self.slab.sum(float(answer[0, 0]) if owner else 0.0)[0]
        return 1.0 / displacement if displacement else 0.0  # one point, whose mean displacement is not counted

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
        """Mark the next set; returns how far from a solution x seems to be, and how many points came or went."""
        count, gaps = self.slab.sum(*gaps_on(self._working, self._u, h))
        *sums, deepest = self.constraint.choose_active(x, self._u, h, gaps / count, kappa, self._working)
        positive, negative, wrong, members, changed, deepest = self.slab.reduce(sums, [deepest])
        if members == 0.0 or positive <= 0.0:
            return np.inf, changed
        return max(wrong / positive / self._length, deepest / self._length, negative / positive), changed

    def _take_in(self, h: Array, gap: float) -> None:
        """Add the points to the set that are at most this far from the surface."""
        count, gaps = self.slab.sum(*gaps_on(self._working, self._u, h))
        self._working |= self._u - h <= gaps / count + gap

    def _admit(self, x: Array, mean: float) -> None:
        """Make x admissible: not negative, under the load; and u its image."""
        load = self.slab.sum(self.constraint.clip(x))[0]
        self.constraint.rescale_to_load(self.slab, x, load, mean * self.slab.points)
        self.operator.apply(x, self._u)

    def _certify(self, p: Array, h: Array, mean: float) -> tuple[float, Certificate]:
        """The approach and the certificate of an admissible pressure, whose set is marked."""
        iterate = form_iterate(self.slab, self.constraint, p, self._u, h, 0.0).settled()
        found = certify(self.slab, self.constraint, p, self._u, h, iterate, mean, self.height, self._working)
        certificate = found[-1]
        self._length = certificate.length
        return iterate.d, certificate
