"""A gap and its pressure in numbers, with what a solve is given and returns, and how wrong it is."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...parallel.slab import Array, Slab
from ..certificate import Certificate
from ..iterate import LEAST_SHARE
from ..problem import Control, Operator
from . import gap_kernels
from .law import Law

# accuracy
SHARPER = 10.0  # times the certificate of contacts that do not stick: with it the load is as right as theirs
SPURIOUS, NET = 2.0, 5.0  # times pressures that are not those of the law: with them loads and pressures are right
LEAST_TRACTION = 1e-3  # of the strength of a point: pressures that add up to less are none


class GapOperators(NamedTuple):
    """The operator of a body and its inverse K, which is 0 for mean values; `mean` is the displacement over a uniform
    pressure, 0 where there is none, and `least_mean` that by which the operator moves mean values, always positive.
    Both are infinite where K is the inverse for mean values, too."""

    operator: Operator
    inverse: Operator
    mean: float
    least_mean: float


@dataclass(frozen=True)
class GapSolution:
    """Solved gap (the map that was given as the start) and pressure (the solver's map, valid until the next solve).

    `failure` is empty, or says what happened instead; `detached` says that no equilibrium was left under the load,
    `jumped` that it went through states that are not stable.
    """

    gap: Array
    p: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str
    detached: bool = False
    jumped: bool = False


@dataclass
class GapIterate:
    """A gap in numbers: its mean and its lowest value, the uniform part m of the pressure, the approach; under which
    load or mean gap; on which body.

    The last step went `share` of its way, which moves the mean gap by `moved`, and m by `change`; it was that of Newton
    if it was `stable`. The next one is first tried with the length `step`.
    """

    law: Law
    heights: Array
    mean_height: float
    control: Control
    operators: GapOperators
    given: float | None
    mean_gap: float
    m: float = 0.0
    d: float = 0.0
    lowest: float = 0.0
    share: float = 0.0
    moved: float = 0.0
    change: float = 0.0
    stable: bool = True
    step: float = 1.0


def certify_gap(slab: Slab, it: GapIterate, working: Array, g: Array, q: Array, sigma: Array, z: Array) -> Certificate:
    """Return how wrong the gap is: by z, weighted by the pressure, over a length; and the load; collective.

    The length is by how much the body is deformed in the contact, at most the range, and at least a tenth of it. Wrong
    of the load are pressures that are not those of the law: their magnitudes, of which waves of a few points hardly
    move the gap, count twice, and their sum five times.
    """
    *sums, spurious, net = slab.sum(*gap_kernels.certificate_sums(working, g, it.heights, q, it.m, sigma, z))
    load, first, second, wrong = sums
    least = LEAST_TRACTION * it.law.strength
    spread, mean = 0.0, 0.0
    if load > 0.0:
        mean = first / load
        spread = math.sqrt(max(second / load - mean**2, 0.0))
    length = min(max(spread, LEAST_SHARE * abs(mean + it.d), LEAST_SHARE * it.law.range), it.law.range)
    load = max(load, least)
    beside = max(SPURIOUS * spurious, NET * abs(net)) / load
    return Certificate(SHARPER * wrong / load / length, 0.0, beside, length)
