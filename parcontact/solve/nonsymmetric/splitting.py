"""Contact with a law of the interface, or with an operator that is not symmetric, by accelerated splitting.

Find p >= 0 with given mean P0 or given d, and `w = A p + c(p) - h - d >= 0`, `p w = 0` (`solve.interface_law`). A is
diagonal in Fourier space and c in real space, so that each is inverted exactly. With J_A(x) = (1 + gamma A)^-1 x
shifted to the mean P0, or (1 + gamma A)^-1 (x + gamma d), with J_c the pressure of `interface_law.resolve`, and with a
map s,

    p = J_c(s),    y = J_A(2 p - s),    f = y - p,    s <- s + f

(J. Douglas, H. H. Rachford, Trans. Amer. Math. Soc. 82 (1956) 421; P.-L. Lions, B. Mercier, SIAM J. Numer. Anal. 16
(1979) 964). It converges for every gamma > 0 and every A with a real part >= 0, also for very large loss tangents, and
is accelerated (`acceleration`). gamma is a multiple of pressure over displacement of the start, from which

    s = p + gamma c(p) - gamma h where there is pressure,    s = -gamma (A p - d) elsewhere.

Only the certificate of an admissible pressure with the displacement `A p + c(p)` ends a solve. As it takes an
application of A, it is made when the rms of f is small enough, judged by the last certificate over the rms of f.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...parallel.slab import Array
from ...physics.convolution import Convolution
from .. import kernels
from ..certificate import Certificate
from ..interface_law import HARD, InterfaceLaw, begin_split, resolve
from ..problem import Control, MeanPressure, Operator
from .acceleration import Acceleration
from .judge import Judge, SteadyContact, describe_failure

GAMMA = 4.0  # tuning: gamma over the ratio of the spreads of pressure and displacement of the start
MAX_LEVELS = 20  # accuracy: limit on steps to the level of a start with the load; about five are usual
LEVEL_EXCESS = 1.1  # tuning: load of that start over the given one at which the level is left
SLOW, FALL, LARGER = 500, 0.3, 16.0  # tuning: steps in which the rms of f must fall by a factor, or gamma is raised
WORSE = 2.0  # tuning: rms of f over the least one, above which earlier changes are forgotten
STALLED = 25  # tuning: limit on steps without a smaller rms of f
PLAIN, PLAIN_AFTER_STALL = 3, 25  # tuning: steps without acceleration that follow


class Splitting:
    """Solver on one grid.

    `operator` is A, not that of a free box, whose padded symbol has waves with a negative real part; `inverse` K is
    near its inverse; `tolerance` on the certificate; `most` limits the steps. Laws and pressures are in the units of A.
    It holds two maps, a byte per point, the maps of `Acceleration` and, during a solve, a symbol.
    """

    def __init__(self, judge: Judge, operator: Convolution, inverse: Operator, tolerance: float, most: int) -> None:
        self.judge, self.operator, self.inverse = judge, operator, inverse
        self.tolerance, self.most, self.slab = tolerance, most, judge.slab
        self._s, self._y = self.slab.empty(), self.slab.empty()
        self._working: NDArray[Any] = self.slab.zeros(np.bool_)
        self._acceleration = Acceleration(self.slab)

    def resolvent(self, gamma: float) -> Convolution:
        """Return `(1 + gamma A)^-1`."""
        return self.operator.mapped(lambda symbol: 1.0 / (1.0 + gamma * symbol), self.operator.dtype)

    def solve(
        self, h: Array, control: Control, law: InterfaceLaw, start: Array, tolerance: float | None = None
    ) -> SteadyContact:
        """Solve for heights h from the pressure `start`, which is overwritten by the solution; collective. `tolerance`
        replaces the tolerance of the solver.

        A start that is 0 everywhere is replaced by the pressure of full contact, lowered to the load. A prescribed mean
        pressure must be positive. The displacement `u = A p` of the contact is without the closing.
        """
        given, p, steps = _Given(h, control, law, tolerance or self.tolerance), start, 0
        self._begin(given, p)
        d, certificate = self._certify(given, p)
        gamma = self._gamma(p)
        while certificate.worst > given.tolerance and steps < self.most:
            begin_split(p, law.closing(p), self._y, h, d, gamma, self._s)
            made, d, certificate = self._iterate(given, p, gamma, d, certificate, self.most - steps)
            steps, gamma = steps + made, LARGER * gamma
        failure = describe_failure(f"has not converged in {steps} steps", certificate, given.tolerance)
        return SteadyContact(p, self._y, d, certificate, steps, failure)

    def _iterate(
        self, given: "_Given", p: Array, gamma: float, d: float, certificate: Certificate, most: int
    ) -> tuple[int, float, Certificate]:
        """Make up to `most` steps, fewer if they are slow. Return their number, and the approach and the certificate of
        the pressure, which are `d` and `certificate` before."""
        y, accelerated, guard, law = self._y, self._acceleration, _Guard(), given.law
        inverse, sums = self.resolvent(gamma), law.pressures + gamma * law.closings
        uniform, step, ratio, last = inverse.mean(), 0, 0.0, math.inf
        accelerated.forget()
        while certificate.worst > given.tolerance and step < most:
            step += 1
            (total,) = self.slab.sum(resolve(self._s, given.h, gamma, law.pressures, sums, p, y))
            inverse.apply(y, y)
            rms = accelerated.residual(y, p, given.shift(uniform * gamma, uniform * total / self.slab.points))
            ratio = ratio or certificate.worst / (rms or math.inf)
            slow = not rms < last if step % SLOW == 0 else not math.isfinite(rms)
            if (rms * ratio <= given.tolerance or slow or step == most) and self._loads(given, p):
                d, certificate = self._certify(given, p)
                ratio = certificate.worst / (rms or math.inf)
            if slow:
                break
            last = FALL * rms if step % SLOW == 0 else last
            if guard.distrusts(rms):
                accelerated.forget()
            accelerated.advance(self._s, guard.plain > 0)
        return step, d, certificate

    def _begin(self, given: "_Given", p: Array) -> None:
        """Replace a start that is 0 everywhere, and scale the start to a given mean."""
        slab, mean = self.slab, given.mean or 0.0
        (load,) = slab.sum(kernels.sum_of(p))
        if not load > 0.0:
            self.inverse.apply(given.h, p)
            level = slab.sum(kernels.sum_of(p))[0] / slab.points - mean
            for _ in range(MAX_LEVELS):
                load, members = slab.sum(float(np.maximum(p - level, 0.0).sum()), float(np.count_nonzero(p > level)))
                if not mean or load <= LEVEL_EXCESS * mean * slab.points:
                    break
                level += (load - mean * slab.points) / (members or math.nan)
            np.maximum(p - level, 0.0, out=p)
            (load,) = slab.sum(kernels.sum_of(p))
        if mean:
            p *= mean * slab.points / (load or math.nan)

    def _gamma(self, p: Array) -> float:
        """Return gamma for a start p with the displacement in y; 1 if one of them is uniform, where any gamma does."""
        maps = p, self._y
        sums = self.slab.sum(*(float(each.sum()) for each in maps), *(float(np.vdot(each, each)) for each in maps))
        p_square, u_square = (sums[2 + k] - sums[k] ** 2 / self.slab.points for k in (0, 1))
        return GAMMA * math.sqrt(p_square / u_square) if p_square > 0.0 and u_square > 0.0 else 1.0

    def _loads(self, given: "_Given", p: Array) -> bool:
        """Scale a pressure to a given mean, or return False if it has no load; collective."""
        (load,) = self.slab.sum(kernels.sum_of(p))
        if given.mean is not None and load > 0.0:
            p *= given.mean * self.slab.points / load
        return load > 0.0 or given.mean is None

    def _certify(self, given: "_Given", p: Array) -> tuple[float, Certificate]:
        """Return the approach and the certificate of an admissible pressure, and put its displacement into y."""
        self.operator.apply(p, self._y)
        whole = self._y if given.law is HARD else self._y + given.law.closing(p)
        return self.judge.certify(p, whole, given.h, given.control, self._working)


class _Given(NamedTuple):
    """Input of a solve."""

    h: Array
    control: Control
    law: InterfaceLaw
    tolerance: float

    @property
    def mean(self) -> float | None:
        """The prescribed mean pressure; None with a given approach."""
        return self.control.value if isinstance(self.control, MeanPressure) else None

    def shift(self, by_approach: float, mean: float) -> float:
        """Return what is added to `(1 + gamma A)^-1 (2 p - s)`, which has this `mean`, to make J_A; `by_approach` is
        the result for `gamma d` with d = 1."""
        return by_approach * self.control.value if self.mean is None else self.mean - mean


class _Guard:
    """Watches the rms of f. `plain` is the number of further steps without acceleration."""

    def __init__(self) -> None:
        self._least, self._since, self.plain = math.inf, 0, 0

    def distrusts(self, rms: float) -> bool:
        """Return whether earlier changes are to be forgotten: the rms has risen, or no longer falls."""
        self.plain -= 1
        self._since = 0 if rms < self._least else self._since + 1
        stalls = self._since > STALLED
        if rms <= WORSE * self._least and not stalls:
            self._least = min(self._least, rms)
            return False
        self.plain = PLAIN_AFTER_STALL if stalls else PLAIN
        self._least, self._since = rms, 0
        return True
