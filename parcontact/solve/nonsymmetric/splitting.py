"""Contact with a law of the interface, in steady sliding or at rest, by Douglas-Rachford splitting.

Find p >= 0 with given mean P0 or given d, and `w = A p + c(p) - h - d >= 0`, `p w = 0` (`solve.interface_law`). A is
diagonal in Fourier space and c in real space, so that each is inverted exactly. With J_A(x) = (1 + gamma A)^-1 x scaled
to the mean P0, or (1 + gamma A)^-1 (x + gamma d), with J_c the pressure of `interface_law.resolve`, and with a map s,

    p = J_c(s),    y = J_A(2 p - s),    s <- s + y - p

(J. Douglas, H. H. Rachford, Trans. Amer. Math. Soc. 82 (1956) 421; P.-L. Lions, B. Mercier, SIAM J. Numer. Anal. 16
(1979) 964). It converges for every gamma > 0 and every A with a real part >= 0, also for very large loss tangents. It
ends when the certificate of an admissible pressure, with the displacement `A p + c(p)`, meets the tolerance.
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

LEAST_STEPS, LATER = 10, 0.1  # tuning: steps between certificates: at least, and as a share of all steps
SLOWEST, FASTEST, AT_UNIT = 0.35, 16.0, 8.0  # tuning: least, largest and unit value of gamma in `step_for`


def step_for(stiffest: float, softest: float, ratio: float) -> float:
    """Return gamma for an operator with magnitudes of its symbol between `stiffest` and `softest`, and a mean pressure
    of `ratio` times the rms pressure in full contact."""
    return min(max(AT_UNIT * math.sqrt(ratio), SLOWEST), FASTEST) / math.sqrt(stiffest * softest)


@dataclass(frozen=True)
class Splitting:
    """Solver on one grid.

    `operator` is A, 0 for the mean; `resolvent(gamma)` makes J_A without the mean; `height` of the surface;
    `tolerance` on the certificate; `most` limits the steps. Laws and pressures are in the units of A.
    """

    slab: Slab
    operator: Operator
    resolvent: Callable[[float], Operator]
    height: float
    tolerance: float
    most: int

    def solve(
        self, h: Array, control: Control, law: InterfaceLaw, gamma: float, start: tuple[Array, float] | None = None
    ) -> SteadyContact:
        """Solve for heights h, from the pressure and approach `start` or from a uniform pressure; collective.

        The solution overwrites the pressure of the start; its displacement `u = A p`, without the closing, is a new
        map. A prescribed mean pressure must be positive.
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
        """Put the first map of the iteration into s: `p - gamma (A p - d)`, for which `p = J_c(s)` and `p = J_A(2 p -
        s)`."""
        if start is not None:
            p, d = start
            self.operator.apply(p, s)
            np.subtract(p, gamma * (s - d), out=s)
        elif isinstance(control, Approach):
            np.subtract(gamma * control.value, 0.0 * h, out=s)
        else:
            np.subtract(control.value, gamma * h, out=s)

    def _loads(self, p: Array, control: Control) -> bool:
        """Scale a pressure to the given mean if it nearly has it, else return False; collective."""
        if isinstance(control, Approach):
            return True
        (load,) = self.slab.sum(kernels.sum_of(p))
        wanted = control.value * self.slab.points
        if not load > 0.0 or abs(load / wanted - 1.0) > self.tolerance:
            return False
        p *= wanted / load
        return True

    def _certify(self, h: Array, control: Control, law: InterfaceLaw, p: Array, u: Array) -> tuple[float, Certificate]:
        """Return the approach and the certificate of an admissible pressure, and put its displacement into u."""
        slab, constraint, given = self.slab, NonNegative(), isinstance(control, Approach)
        self.operator.apply(p, u)
        whole = u + law.closing(p)
        iterate = form_iterate(slab, constraint, p, whole, h, control.value if given else 0.0)
        iterate, mean = (iterate, None) if given else (iterate.settled(), control.value)
        found = certify(slab, constraint, p, whole, h, iterate, mean, self.height, np.zeros(slab.shape, np.bool_))
        return iterate.d, found[-1]
