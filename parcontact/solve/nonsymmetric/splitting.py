"""Contact with a law of the interface, in steady sliding or at rest, by Douglas and Rachford's splitting.

Find p >= 0 with mean P0, or of a given d, and `w = A p + c(p) - h - d >= 0`, `p w = 0` (`solve.interface_law`). A is a
multiplication in Fourier space, and c acts point by point, so that each of them alone is inverted exactly. With
J_A = (1 + gamma A)^-1 under the mean P0, or of what it is given and gamma d, J_c the pressure of
`interface_law.resolve`, and a map s,

    p = J_c(s),    y = J_A(2 p - s),    s <- s + y - p

(J. Douglas, H. H. Rachford, Trans. Amer. Math. Soc. 82 (1956) 421; P.-L. Lions, B. Mercier, SIAM J. Numer. Anal. 16
(1979) 964). It converges for every gamma > 0 and every A whose real part is not negative, also where the body loses
nearly all work. Only the certificate of an admissible pressure ends it, with `A p + c(p)` as its displacement.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array, Slab
from .. import kernels
from ..certificate import Certificate
from ..constraint import NonNegative
from ..interface_law import InterfaceLaw, resolve, update_split
from ..iterate import certify, form_iterate
from ..problem import Approach, Control, Operator
from .steady import SteadyContact

LEAST_STEPS, LATER = 10, 0.1  # tuning: steps before a certificate, and the share of all steps before the next one
SLOWEST, FASTEST, AT_UNIT = 0.35, 16.0, 8.0  # tuning: of `step_for`, found on bands of six decades at 1 mm/s to 10 m/s


def step_for(stiffest: float, softest: float, ratio: float) -> float:
    """Return gamma for an operator whose symbol is between `stiffest` and `softest` in size, and a mean pressure that
    is `ratio` times the rms pressure of full contact."""
    return min(max(AT_UNIT * math.sqrt(ratio), SLOWEST), FASTEST) / math.sqrt(stiffest * softest)


@dataclass(frozen=True)
class Splitting:
    """Solver on one grid: `operator` A, which moves nothing in the mean, `resolvent` that makes J_A (without the mean)
    for a gamma, the `height` of the surface, the `tolerance` on the certificate, and `most` steps. A law and pressures
    are in the units of A."""

    slab: Slab
    operator: Operator
    resolvent: Callable[[float], Operator]
    height: float
    tolerance: float
    most: int

    def solve(
        self, h: Array, control: Control, law: InterfaceLaw, gamma: float, start: tuple[Array, float] | None = None
    ) -> SteadyContact:
        """Solve for heights h, from the pressure and the approach `start`, or from a uniform pressure; collective.

        The contact has the pressure in the map of its start, and its displacement `u = A p`, without the closing of the
        law, in a new one. A mean pressure must be positive.
        """
        slab, inverse, sums = self.slab, self.resolvent(gamma), law.pressures + gamma * law.closings
        p = slab.empty() if start is None else start[0]
        y, u, s = (slab.empty() for _ in range(3))
        self._begin(h, control, gamma, start, s)
        steps, due = 0, LEAST_STEPS
        d, certificate = math.nan, Certificate(math.nan, math.nan, math.nan)
        for steps in range(1, self.most + 1):
            (total,) = slab.sum(resolve(s, h, gamma, law.pressures, sums, p, u))
            if steps >= due or steps == self.most:
                due = steps + max(LEAST_STEPS, int(LATER * steps))
                if self._loads(p, control):
                    d, certificate = self._certify(h, control, law, p, u)
                    if certificate.worst <= self.tolerance:
                        return SteadyContact(p, u, d, certificate, 0, 0, steps, "")
                    (total,) = slab.sum(resolve(s, h, gamma, law.pressures, sums, p, u))
            inverse.apply(u, y)
            given = isinstance(control, Approach)
            update_split(s, y, p, gamma * control.value if given else control.value - total / slab.points)
        reached = f"the residual is {certificate.worst:.3g} where {self.tolerance:.3g} was asked for"
        return SteadyContact(p, u, d, certificate, 0, 0, steps, f"has not converged in {steps} steps: {reached}")

    def _begin(self, h: Array, control: Control, gamma: float, start: tuple[Array, float] | None, s: Array) -> None:
        """Put the map from which the iteration starts into s: with `p = J_c(s)` and `p = J_A(2 p - s)` it is
        `p - gamma (A p - d)`."""
        if start is not None:
            p, d = start
            self.operator.apply(p, s)
            np.subtract(p, gamma * (s - d), out=s)
        elif isinstance(control, Approach):
            np.subtract(gamma * control.value, 0.0 * h, out=s)
        else:
            np.subtract(control.value, gamma * h, out=s)

    def _loads(self, p: Array, control: Control) -> bool:
        """Scale a pressure to its mean where that is given and nearly reached; returns whether it is; collective."""
        if isinstance(control, Approach):
            return True
        (load,) = self.slab.sum(kernels.sum_of(p))
        wanted = control.value * self.slab.points
        if not load > 0.0 or abs(load / wanted - 1.0) > self.tolerance:
            return False
        p *= wanted / load
        return True

    def _certify(self, h: Array, control: Control, law: InterfaceLaw, p: Array, u: Array) -> tuple[float, Certificate]:
        """Return the approach and the certificate of an admissible pressure, and leave its displacement in u."""
        slab, constraint, given = self.slab, NonNegative(), isinstance(control, Approach)
        self.operator.apply(p, u)
        whole = u + law.closing(p)
        iterate = form_iterate(slab, constraint, p, whole, h, control.value if given else 0.0)
        iterate, mean = (iterate, None) if given else (iterate.settled(), control.value)
        found = certify(slab, constraint, p, whole, h, iterate, mean, self.height, np.zeros(slab.shape, np.bool_))
        return iterate.d, found[-1]
