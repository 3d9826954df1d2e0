"""Ladders of pressures, and distributions of pressure as weights of their rungs.

A distribution P(p) is known by `W_j = int P(p) hat_j(p) dp` with hats that are linear between neighbouring rungs p_j. A
pressure below the first rung is shared with no pressure at all, one above the last counts as more of the last, so that

    sum_j W_j p_j = int P(p) p dp:

the load is kept.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array

RUNGS, LOWEST = 14, 5e-4  # accuracy: 8 rungs erred by up to 9 %, 20 gained nothing; the first one over the top
ABOVE = 4.0  # accuracy: rms pressures above the mean that the top is; 1.4 % of the load was beyond at most
BELOW = 4.5  # accuracy: rms pressures below the mean, less than which full contact has


@dataclass(frozen=True)
class Ladder:
    """Rungs: rising pressures [Pa], shape (n,)."""

    rungs: Array

    @classmethod
    def over(cls, mean: float, rms: float) -> "Ladder":
        """Return the ladder for pressures of this mean and of this rms deviation in full contact [Pa], equally spaced
        in the logarithm; of one rung where nothing deviates."""
        if not rms > 0.0:
            return cls(np.array([mean]))
        top = mean + ABOVE * rms
        bottom = max(LOWEST * top, mean - BELOW * rms)
        count = max(3, int(np.ceil(1 + (RUNGS - 1) * np.log(top / bottom) / -np.log(LOWEST) - 1e-9)))
        return cls(np.geomspace(bottom, top, count))

    def weigh(self, pressures: Array) -> tuple[Array, float]:
        """Return the weights of rungs for a map of pressures [Pa], and the share of the load above the last rung."""
        p, rungs = pressures[pressures > 0.0], self.rungs
        place = np.clip(np.searchsorted(rungs, p), 0, len(rungs))
        weights = np.zeros(len(rungs))
        low, high = p[place == 0], p[place == len(rungs)]
        weights[0] += float(low.sum()) / rungs[0]
        weights[-1] += float(high.sum()) / rungs[-1]
        inside = (place > 0) & (place < len(rungs))
        upper, q = place[inside], p[inside]
        share = (q - rungs[upper - 1]) / (rungs[upper] - rungs[upper - 1])
        weights += np.bincount(upper, share, len(rungs)) + np.bincount(upper - 1, 1.0 - share, len(rungs))
        return weights / pressures.size, float(high.sum() / p.sum()) if p.size else 0.0
