"""The strains of a steady state and its softened moduli, which depend on each other: a fixed point.

A round solves the state with the factors of the last strains, and finds its strains (`strain`). Strains change by a
power mean, `gamma <- gamma_new^0.7 gamma^0.3`, until friction changes by less than a share of the accuracy.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...doubts import Doubt
from ...errors import RunError
from ...parallel.slab import Array
from ...scene import Setup
from ...steady_sliding.losses import count_octaves
from ...steady_sliding.point import Point, in_rounds
from .strain import strains_at_octaves
from .strain_table import Softened

Vector = tuple[float, float]

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


def settle(first: Softened, solve: Callable[[Softened], Round], accuracy: float) -> None:
    """Solve rounds until friction changes by less than SHARE of `accuracy`, or factors do not change. Raises RunError
    if friction does not settle."""
    softened, last = first, math.nan
    for _ in range(MOST_ROUNDS):
        found = solve(softened)
        change = abs(found.friction - last) / found.friction if found.friction > 0.0 else 0.0
        following = replace(softened, strains=tuple(softened.table.mixed(found.strains, softened.strains).tolist()))
        if change <= SHARE * accuracy or following.same_factors(softened):
            return
        softened, last = following, found.friction
    sentence = f"the strain that softens the rubber did not settle in {MOST_ROUNDS} rounds: friction changes by"
    raise RunError(f"{sentence} {100 * change:.2g} % in the last one")


class StrainLoop:
    """The fixed point of the strains of the octaves on one grid; the next state starts from those of the last."""

    def __init__(self, setup: Setup) -> None:
        section = setup.job.section("softening")
        self.softened = Softened(section.made, max(setup.size), (section.made.start,) * count_octaves(setup))

    def solve(self, sliding: Any, solve: Callable[[Vector, float], Point], velocity: Vector, pressure: float) -> Point:
        """Return the steady state with the moduli at its strain; collective. `solve` solves one with the `setup` of
        `sliding`, a `steady_sliding.sliding.SteadySliding`. Raises RunError."""
        points, rounds = list[Point](), list[Round]()

        def once(softened: Softened) -> Round:
            self.softened, sliding.setup = softened, replace(sliding.setup, factors=softened.factors)
            points.append(solve(velocity, pressure))
            found = strains_at_octaves(sliding.setup, softened, sliding.contact.u, velocity)
            strains = found.of_octaves(np.array(softened.strains))
            rounds.append(Round(points[-1].friction, strains, found.power))
            return rounds[-1]

        settle(self.softened, once, sliding.setup.job.numerics.asked.both[0])
        return replace(in_rounds(points), strain_amplitude=rounds[-1].amplitude)


def loops(setup: Setup) -> Iterator[StrainLoop]:
    """Yield the loop around steady states of a job with softening."""
    if setup.job.section("softening") is not None:
        yield StrainLoop(setup)


def doubts_of_points(points: Sequence[Point], job: Any) -> Iterator[Doubt]:
    """Yield a warning if strains of a curve are outside of the table."""
    section = job.section("softening")
    strained = [point for point in points if section and point.strain_amplitude > 0.0]  # NaN without friction
    beyond = [point for point in strained if not section.made.reaches(point.strain_amplitude)]
    if beyond:
        low, high = section.made.strain[0], section.made.strain[-1]
        worst = max(beyond, key=lambda point: abs(math.log(point.strain_amplitude / math.sqrt(low * high))))
        facts = {"strain": worst.strain_amplitude, "speed": worst.speed, "low": low, "high": high}
        yield Doubt("strains beyond the sweep", "softening", {**facts, "count": len(beyond), "points": len(points)})
