"""Steady contact with a law of the interface or an operator that is not symmetric, by accelerated splitting.

Find p >= 0 with given mean P0 or given d, and `w = A p + c(p) - h - d >= 0`, `p w = 0` (`problem.InterfaceLaw`). A is
diagonal in Fourier space and c in real space, so that `1 + gamma A` and `1 + gamma c` are each inverted exactly. J_c(s)
is the pressure of `problem.Constraint.resolve`. With given d, J_A(x) is `(1 + gamma A)^-1 (x + gamma d)`. With given
P0, J_A(x) is `(1 + gamma A)^-1 x` plus the constant that gives the mean P0. Iterations change a map s:

    p = J_c(s),    y = J_A(2 p - s),    f = y - p,    s <- s + f

(J. Douglas, H. H. Rachford, Trans. Amer. Math. Soc. 82 (1956) 421; P.-L. Lions, B. Mercier, SIAM J. Numer. Anal. 16
(1979) 964). The iteration converges for every gamma > 0 and every A with a real part >= 0, also for very large loss
tangents. gamma is a multiple of the pressure of the start divided by its displacement, or by the sum of its
displacement and closing if the start is near the solution: in light contact the law is softer than the body. The first
map is

    s = p + gamma c(p) - gamma h where there is pressure,    s = -gamma (A p - d) elsewhere.

Anderson acceleration takes the last changes ds_j of s and df_j of f into account,

    theta = argmin |f - sum_j theta_j df_j|,    s <- s + R f - sum_j theta_j (ds_j + R df_j),

with the relaxation R (D. G. Anderson, J. ACM 12 (1965) 547; H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715).
Without earlier changes the step is `s <- s + R f`. Changes are stored in single precision: s is advanced by the change
that is stored. Earlier changes are forgotten where f rises or stalls. The mean of p may differ from the load by decades
before convergence. s is never rescaled to the load, because solves fail then.

A solve ends when the certificate of an admissible pressure p and its displacement `A p + c(p)` is small enough. As a
certificate takes an application of A, the certificate is computed only when the rms of f is small enough, judged by the
last ratio of certificate to rms.

For a lossy body sliding at constant velocity, seen from the rigid surface, A is positive but not symmetric, and there
is no energy to minimize. `SteadySolver` solves this contact in a periodic box. In light contact, and from a start that
is 0, projected steps (`projected`) come first as long as they help: they take fewer applications of A there.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.slab import Array, Slab, allocate
from ..physics.convolution import Convolution
from ..physics.records import Certificate
from . import kernels
from .certificate import Judge, describe_failure
from .preconditioner import ALL, Grids
from .problem import Box, Constraint, Contact, Control, MeanPressure, Operator
from .projected import Projected

DEPTH = 5  # tuning: number of earlier changes
RELAXATION = 1.5  # tuning: relaxation of the residual; below 2, so that the plain iteration converges, too
TRACE_SHARE = 1e-8  # accuracy: share of the mean square of changes that is added to each, above their rounding


class Acceleration:
    """Anderson acceleration on one grid, with the residual f and the map s of the module. It holds f and, in single
    precision, the last DEPTH changes of s and of f."""

    def __init__(self, slab: Slab) -> None:
        self.slab, self.f = slab, slab.empty()
        shape = DEPTH, *slab.shape
        self._ds, self._df = (allocate(shape, np.float32, slab.tally) for _ in range(2))
        self.forget()

    def forget(self) -> None:
        """Discard the stored changes of s and f."""
        self._gram = np.zeros((DEPTH, DEPTH))
        self._count, self._last = 0, -1  # number of complete changes, and place of the last change of s
        self._against = np.zeros(DEPTH)

    def residual(self, y: Array, p: Array, shift: float) -> float:
        """Compute the residual `f = y + shift - p` and store its change. Return the rms of f; collective. `shift` is
        the constant for which `y + shift` is J_A(2 p - s)."""
        if self._last < 0:
            square = self.slab.sum(_first(y, p, shift, self.f))[0]
            return math.sqrt(square / self.slab.points)
        self._count = max(self._count, self._last + 1)
        square, *sums = self.slab.sum(*_change(y, p, shift, self.f, self._df, self._last, self._count))
        self._against[: self._count], row = sums[: self._count], sums[self._count :]
        self._gram[self._last, : self._count] = self._gram[: self._count, self._last] = row
        return math.sqrt(square / self.slab.points)

    def advance(self, s: Array, plain: bool) -> None:
        """Replace s by the next iterate. If `plain` is True, the step is not accelerated."""
        theta = _smallest(self._gram, self._against, 0 if plain else self._count)
        self._last = (self._last + 1) % DEPTH
        _advance(s, self.f, self._ds, self._df, theta, self._last)


@loop
def _smallest(gram, against, count):
    """Return the `count` theta that make the residual smallest, by elimination of the normal equations."""
    theta, left = against[:count].copy(), gram[:count, :count].copy()
    added = 0.0
    for k in range(count):
        added += TRACE_SHARE * gram[k, k] / count
    if not added > 0.0:
        return np.zeros(count)
    for k in range(count):
        left[k, k] += added
    for k in range(count):
        for j in range(k + 1, count):
            factor = left[j, k] / left[k, k]
            for i in range(k, count):
                left[j, i] -= factor * left[k, i]
            theta[j] -= factor * theta[k]
    for k in range(count - 1, -1, -1):
        for j in range(k + 1, count):
            theta[k] -= left[k, j] * theta[j]
        theta[k] /= left[k, k]
    return theta


@loop
def _first(y, p, shift, f):
    """Put `y + shift - p` into f. Return its sum of squares."""
    total = 0.0
    for j in range(f.shape[0]):
        row = 0.0
        for i in range(f.shape[1]):
            f[j, i] = y[j, i] + shift - p[j, i]
            row += f[j, i] * f[j, i]
        total += row
    return total


@loop
def _change(y, p, shift, f, df, last, count):
    """Put `y + shift - p` into f and its change into df[last]. Return the sum of f^2, the products of f with `count`
    changes, and those of the last change with them."""
    total, sums = 0.0, np.zeros(1 + 2 * count)
    for j in range(f.shape[0]):
        row = 0.0
        for i in range(f.shape[1]):
            new = y[j, i] + shift - p[j, i]
            df[last, j, i] = new - f[j, i]
            f[j, i] = new
            row += new * new
        total += row
        for k in range(count):
            with_f, with_last = 0.0, 0.0
            for i in range(f.shape[1]):
                here = np.float64(df[k, j, i])
                with_f += here * f[j, i]
                with_last += here * df[last, j, i]
            sums[1 + k] += with_f
            sums[1 + count + k] += with_last
    sums[0] = total
    return sums


@loop
def _advance(s, f, ds, df, theta, last):
    """Add `R f - sum theta (ds + R df)` to s, and put it into ds[last]."""
    line = np.empty(s.shape[1])
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            line[i] = RELAXATION * f[j, i]
        for k in range(theta.size):
            for i in range(s.shape[1]):
                line[i] -= theta[k] * (ds[k, j, i] + RELAXATION * df[k, j, i])
        for i in range(s.shape[1]):
            ds[last, j, i] = line[i]
            s[j, i] += ds[last, j, i]


GAMMA = 4.0  # tuning: gamma over the ratio of the spreads of pressure and displacement of the start
MAX_LEVELS = 20  # accuracy: limit on steps to the level of a start with the load; about five are usual
LEVEL_EXCESS = 1.1  # tuning: load of that start over the given one at which the level is left
LARGEST = 1e16  # rounding: gamma over the first one, above which it hides the pressures
SLOW, FALL, LARGER = 500, 0.3, 16.0  # tuning: steps in which the rms of f must fall by a factor, or gamma is raised
WORSE = 2.0  # tuning: rms of f over the least one, above which earlier changes are forgotten
STALLED = 25  # tuning: limit on steps without a smaller rms of f
PLAIN, PLAIN_AFTER_STALL = 3, 25  # tuning: steps without acceleration that follow


class Splitting:
    """Solver of steady contact by accelerated splitting on one grid.

    `operator` is A of a periodic box: the symbol of the padded operator of a free box may have a negative real part at
    some waves. `inverse` is an operator K that is close to the inverse of A. `tolerance` limits the errors of a
    solution (`Certificate`), and `most` the number of steps of a solve. Interface laws and pressures are in the units
    of A. The solver holds two maps, a byte for each point, and the maps of `Acceleration`. During a solve, the solver
    also holds the symbol of `resolvent`.
    """

    def __init__(self, judge: Judge, operator: Convolution, inverse: Operator, tolerance: float, most: int) -> None:
        self.judge, self.operator, self.inverse = judge, operator, inverse
        self.tolerance, self.most, self.slab = tolerance, most, judge.slab
        self._s, self._y = self.slab.empty(), self.slab.empty()
        self._working: NDArray[Any] = self.slab.zeros(np.bool_)
        self._acceleration = Acceleration(self.slab)

    def resolvent(self, gamma: float) -> Convolution:
        """Return the operator `(1 + gamma A)^-1`."""
        return self.operator.mapped(lambda symbol: 1.0 / (1.0 + gamma * symbol), self.operator.dtype)

    def solve(
        self, h: Array, control: Control, law: Constraint, start: Array, tolerance: float | None = None
    ) -> Contact:
        """Solve for heights h and the constraint `law` from the pressure `start`, which is overwritten by the solution;
        collective.

        `tolerance` replaces the tolerance of the solver. A start that is 0 everywhere is replaced by K h less a
        constant, limited to the bounds and scaled to a given mean pressure, which must be positive. The displacement of
        the result is `u = A p`, without the approach c(p) of the mean planes.
        """
        given, p, steps = _Given(h, control, law, tolerance or self.tolerance), start, 0
        cold = self._begin(given, p)
        last = self._certify(given, p)
        gamma = self._gamma(p, self._y if cold else last.whole)
        highest = LARGEST * gamma
        while last.certificate.worst > given.tolerance and steps < self.most and gamma < highest:
            _begin_split(p, last.whole, self._y, h, last.d, gamma, self._s)
            made, last = self._iterate(given, p, gamma, last, self.most - steps)
            steps, gamma = steps + made, LARGER * gamma
        d, certificate = last.d, last.certificate
        failure = describe_failure(f"has not converged in {steps} steps", certificate, given.tolerance)
        return Contact(p, self._y, d, certificate, steps, failure)

    def _iterate(
        self, given: "_Given", p: Array, gamma: float, known: "_Certified", most: int
    ) -> tuple[int, "_Certified"]:
        """Make up to `most` steps, fewer if they are slow. Return their number, and the pressure's certificate, which
        is `known` before."""
        y, accelerated, guard, inverse = self._y, self._acceleration, _Guard(), self.resolvent(gamma)
        uniform, step, ratio, last = inverse.mean(), 0, 0.0, math.inf
        accelerated.forget()
        while known.certificate.worst > given.tolerance and step < most:
            step += 1
            (total,) = self.slab.sum(given.law.resolve(self._s, given.h, gamma, p, y))
            inverse.apply(y, y)
            rms = accelerated.residual(y, p, given.shift(uniform * gamma, uniform * total / self.slab.points))
            ratio = ratio or known.certificate.worst / (rms or math.inf)
            slow = not rms < last if step % SLOW == 0 else not math.isfinite(rms)
            if (rms * ratio <= given.tolerance or slow or step == most) and self._loads(given, p):
                known = self._certify(given, p)
                ratio = known.certificate.worst / (rms or math.inf)
            if slow:
                break
            last = FALL * rms if step % SLOW == 0 else last
            if guard.distrusts(rms):
                accelerated.forget()
            accelerated.advance(self._s, guard.plain > 0)
        return step, known

    def _begin(self, given: "_Given", p: Array) -> bool:
        """Replace a start that is 0 everywhere, and scale the start to a given mean. Return whether it was 0."""
        slab, mean = self.slab, given.control.mean or 0.0
        (load,) = slab.sum(kernels.sum_of(p))
        cold = not load > 0.0
        if cold:
            self.inverse.apply(given.h, p)
            level = slab.sum(kernels.sum_of(p))[0] / slab.points - mean
            for _ in range(MAX_LEVELS):
                load, members = slab.sum(float(np.maximum(p - level, 0.0).sum()), float(np.count_nonzero(p > level)))
                if not mean or load <= LEVEL_EXCESS * mean * slab.points:
                    break
                level += (load - mean * slab.points) / (members or math.nan)
            p -= level
            given.law.project(p)
            (load,) = slab.sum(kernels.sum_of(p))
        if mean:
            p *= mean * slab.points / (load or math.nan)
        return cold

    def _gamma(self, p: Array, u: Array) -> float:
        """Return gamma for a start p with the displacement u; 1 if one of them is uniform, where any gamma does."""
        maps = p, u
        sums = self.slab.sum(*(float(each.sum()) for each in maps), *(float(np.vdot(each, each)) for each in maps))
        p_square, u_square = (sums[2 + k] - sums[k] ** 2 / self.slab.points for k in (0, 1))
        return GAMMA * math.sqrt(p_square / u_square) if p_square > 0.0 and u_square > 0.0 else 1.0

    def _loads(self, given: "_Given", p: Array) -> bool:
        """Scale a pressure to a given mean, or return False if it has no load; collective."""
        (load,) = self.slab.sum(kernels.sum_of(p))
        mean = given.control.mean
        if mean is not None and load > 0.0:
            p *= mean * self.slab.points / load
        return load > 0.0 or mean is None

    def _certify(self, given: "_Given", p: Array) -> "_Certified":
        """Return the certificate of an admissible pressure, and put its displacement into y."""
        whole = given.law.add_closing(self.operator.apply(p, self._y), p)
        return _Certified(*self.judge.certify(p, whole, given.h, given.control, self._working), whole)


class _Certified(NamedTuple):
    """Approach and certificate of a pressure, and its displacement with the closing."""

    d: float
    certificate: Certificate
    whole: Array


class _Given(NamedTuple):
    """Input of a solve."""

    h: Array
    control: Control
    law: Constraint
    tolerance: float

    def shift(self, by_approach: float, mean: float) -> float:
        """Return the constant that is added to `(1 + gamma A)^-1 (2 p - s)`, which has this `mean`, to make J_A.
        `by_approach` is `(1 + gamma A)^-1 (gamma d)` for d = 1."""
        return by_approach * self.control.value if self.control.mean is None else self.control.mean - mean


@loop
def _begin_split(p, whole, u, h, d, gamma, s):
    """Put `p + gamma (c - h)` where there is pressure, c = whole - u, and `-gamma (u - d)` elsewhere, into s."""
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            pressed = p[j, i] + gamma * (whole[j, i] - u[j, i] - h[j, i])
            s[j, i] = pressed if p[j, i] > 0.0 else gamma * (d - u[j, i])


class _Guard:
    """Watches the rms of f. `plain` is the number of further steps without acceleration."""

    def __init__(self) -> None:
        self._least, self._since, self.plain = math.inf, 0, 0

    def distrusts(self, rms: float) -> bool:
        """Return True if earlier changes must be discarded: the rms of f has risen, or no longer falls."""
        self.plain -= 1
        self._since = 0 if rms < self._least else self._since + 1
        stalls = self._since > STALLED
        if rms <= WORSE * self._least and not stalls:
            self._least = min(self._least, rms)
            return False
        self.plain = PLAIN_AFTER_STALL if stalls else PLAIN
        self._least, self._since = rms, 0
        return True


LIGHT = 0.05  # tuning: share of the points with pressure in the start, below which projected steps come first
PATIENCE = 5  # tuning: limit on projected steps in which the certificate must halve


class SteadySolver:
    """Solver of steady sliding in a periodic box. It holds the maps of `Projected` during projected steps, and the maps
    of `Splitting` afterwards.

    Parameters:

    * operator: A of the body;
    * preconditioner: K, which is close to the inverse of A;
    * tolerance: largest error with which a solve ends (`records.Certificate`);
    * most: limit on the steps of `Splitting`;
    * grids: coarser grids of projected steps (`preconditioner.grids_for`).
    """

    def __init__(
        self,
        judge: Judge,
        operator: Convolution,
        preconditioner: Convolution,
        tolerance: float,
        most: int,
        grids: Grids = ALL,
    ) -> None:
        self.judge, self.operator, self.preconditioner = judge, operator, preconditioner
        self.tolerance, self.most, self.grids = tolerance, most, grids

    def hold_all(self) -> tuple[Splitting, Convolution]:
        """Allocate all maps that a solve may need, and return the objects that hold these maps: the `Splitting` solver
        and an operator `(1 + gamma A)^-1`. Projected steps alone need fewer maps."""
        splitting = Splitting(self.judge, self.operator, self.preconditioner, self.tolerance, self.most)
        return splitting, splitting.resolvent(1.0)

    def solve(self, h: Array, mean: float, start: Array) -> Contact:
        """Solve for heights h under the mean pressure `mean`; collective. The solution overwrites the pressure
        `start`, which may be 0 everywhere."""
        (touching,) = self.judge.slab.sum(float((start > 0.0).sum()))
        if touching < LIGHT * self.judge.slab.points:
            projected = Projected(self.judge, self.operator, self.preconditioner, self.grids)
            contact = projected.solve(h, mean, start, self.tolerance, PATIENCE)
            if contact.converged:
                return contact
            del projected, contact  # frees their maps before others are made
        splitting = Splitting(self.judge, self.operator, self.preconditioner, self.tolerance, self.most)
        return splitting.solve(h, MeanPressure(mean), Box(), start)
