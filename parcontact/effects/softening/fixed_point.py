"""The strains of a steady state and its softened moduli, which depend on each other: a fixed point.

A round solves the state with the factors of the last strains, and finds its strains (`strain`). Strains change by a
power mean, `gamma <- gamma_new^0.7 gamma^0.3`, until friction changes by less than a share of the accuracy.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ...errors import RunError
from ...parallel.slab import Array
from .strain_table import Softened

START = 0.02  # tuning: strain of the first round
MIXED = 0.7  # tuning: exponent of the new strain in the next one
SHARE = 0.2  # accuracy: allowed change of friction in a round over the accuracy of the job
MOST_ROUNDS = 40  # tuning: limit on rounds


@dataclass(frozen=True)
class Round:
    """Friction of a round, and the strains of its octaves with their power."""

    friction: float
    strains: Array
    power: Array

    @property
    def amplitude(self) -> float:
        """Return the root of the mean square strain, weighted by power [-]; NaN without power."""
        whole = float(self.power.sum())
        return math.sqrt(float(self.power @ self.strains**2) / whole) if whole > 0.0 else math.nan


def mixed(found: ArrayLike, before: ArrayLike) -> Array:
    """Return the strains of the next round; a strain that was not found (NaN, without power) stays."""
    found, before = np.asarray(found, float), np.asarray(before, float)
    return np.where(found > 0.0, found**MIXED * before ** (1.0 - MIXED), before)


def settle(first: Softened, solve: Callable[[Softened], Round], accuracy: float) -> None:
    """Solve rounds until friction changes by less than SHARE of `accuracy`, or factors do not change. Raises RunError
    if friction does not settle."""
    softened, last = first, math.nan
    for _ in range(MOST_ROUNDS):
        found = solve(softened)
        change = abs(found.friction - last) / found.friction if found.friction > 0.0 else 0.0
        following = replace(softened, strains=tuple(mixed(found.strains, softened.strains).tolist()))
        if change <= SHARE * accuracy or following.same_factors(softened):
            return
        softened, last = following, found.friction
    sentence = f"the strain that softens the rubber did not settle in {MOST_ROUNDS} rounds: friction changes by"
    raise RunError(f"{sentence} {100 * change:.2g} % in the last one")
