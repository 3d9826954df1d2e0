"""Data of the solver of gaps: its operators, its result, and an iterate with its errors."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...parallel.slab import Array, Slab
from ...solve.certificate import Certificate
from ...solve.iterate import LEAST_SHARE
from ...solve.problem import Control, Operator
from . import gap_kernels
from .law import Law

# accuracy
SHARPER = 10.0  # factor on the complementarity; with it loads are as accurate as without adhesion
SPURIOUS, NET = 2.0, 5.0  # factors on pressures that violate the law: on their magnitude, and on their sum
LEAST_TRACTION = 1e-3  # load below which errors are not scaled by it, over the strength of the law at one point


class GapOperators(NamedTuple):
    """Operator of a body and its inverse K, which is 0 for mean values.

    `mean` is the displacement over a uniform pressure, 0 if there is none; `least_mean` is a positive compliance of
    mean values. Both are infinite if K also inverts mean values.
    """

    operator: Operator
    inverse: Operator
    mean: float
    least_mean: float


@dataclass(frozen=True)
class GapSolution:
    """Solved gap (the map of the start) and pressure (a map of the solver, valid until its next solve).

    `failure` is empty, or states why the solve failed. `detached`: no equilibrium exists under the load. `jumped`:
    the solve passed through unstable states.
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
    """Numbers of an iterate: mean and lowest gap, uniform part m of the pressure, approach d, the control, and the
    operators; `given` is the prescribed mean gap or None.

    The last step went a `share` of its way, which changes the mean gap by `moved`, and m by `change`. It was a
    Newton step if `stable`. The next way is first tried with the length `step`.
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
    """Return the errors of the gap: z, weighted by the pressure, over a length, and the load; collective.

    The length is the variation of the deformation in the contact, at most the range of the law and at least a tenth
    of it. The error of the load consists of pressures that violate the law: their magnitudes count SPURIOUS times,
    their sum NET times.
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
    load_error = max(SPURIOUS * spurious, NET * abs(net)) / load
    return Certificate(SHARPER * wrong / load / length, 0.0, load_error, length)
