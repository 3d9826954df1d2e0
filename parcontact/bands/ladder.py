"""Ladders of pressures, and distributions of pressure as weights of their rungs.

A result f(p) of a band is known at the rungs p_j of a ladder. Between them f(p)/p is the cubic in log p through the
four nearest rungs, `f(p) = p sum_j psi_j(p) f(p_j)/p_j`; below the first and above the last rung it is constant. A
distribution P(p) is represented by `W_j = int P(p) p psi_j(p) dp/p_j`. As the psi_j add up to 1,

    int P(p) f(p) dp = sum_j W_j f(p_j),    sum_j W_j p_j = int P(p) p dp:

the load is conserved. Functions linear in p would conserve it, too, but underestimate a concave f.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array

RUNGS, LOWEST = 14, 5e-4  # accuracy: number of rungs, and the first one over the last
NODES = 4  # accuracy: rungs per interpolation
ROUNDING = 1e-9  # accuracy: rounding of the position of a pressure on the ladder
ABOVE = 4.0  # accuracy: last rung above the mean, over the rms pressure
BELOW = 4.5  # accuracy: first rung below the mean, over the rms pressure, near full contact


@dataclass(frozen=True)
class PressureLadder:
    """Rungs: rising pressures [Pa], shape (n,)."""

    rungs: Array

    @classmethod
    def over(cls, mean: float, rms: float) -> "PressureLadder":
        """Return the ladder for pressures of this mean and rms deviation in full contact [Pa], equally spaced in the
        logarithm; one rung without deviation."""
        if not rms > 0.0:
            return cls(np.array([mean]))
        top = mean + ABOVE * rms
        bottom = max(LOWEST * top, mean - BELOW * rms)
        count = max(NODES, int(np.ceil(1 + (RUNGS - 1) * np.log(top / bottom) / -np.log(LOWEST) - 1e-9)))
        return cls(np.geomspace(bottom, top, count))

    def weights_of_rungs(self, pressures: Array) -> tuple[Array, float]:
        """Return the weights of rungs for a map of pressures [Pa], and the share of the load above the last rung."""
        p, rungs = pressures[pressures > 0.0], self.rungs
        count = len(rungs)
        if count == 1 or not p.size:
            return np.full(count, float(p.sum()) / rungs[-1] / pressures.size), 0.0
        steps = np.log(p / rungs[0]) / np.log(rungs[1] / rungs[0])
        place = np.clip(steps, 0.0, count - 1.0)
        first = np.clip(np.floor(place).astype(np.intp) - 1, 0, count - NODES)
        sums = np.zeros(count)
        for node in range(NODES):
            others = [other for other in range(NODES) if other != node]
            psi = np.prod([(place - first - other) / (node - other) for other in others], axis=0)
            sums += np.bincount(first + node, p * psi, count)
        beyond = float(p[steps > count - 1 + ROUNDING].sum())
        return sums / rungs / pressures.size, beyond / float(p.sum())
