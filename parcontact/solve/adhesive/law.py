"""Laws of adhesion: the attraction sigma of two points over their gap, its energy gamma and its slope.

A law is three numbers: its `kind` (EXPONENTIAL or DUGDALE), its strength s and its range rho,

    exponential  sigma(g) = s exp(-g/rho),            gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s where g < rho, else 0,  gamma(g) = s max(rho - g, 0).

The exponential is the dearest part of a loop. So it is calculated once for each gap, and energy and slope from it.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import loop

EXPONENTIAL, DUGDALE = 0, 1
LOG_TWO = math.log(2.0)
TAYLOR = tuple(1.0 / math.factorial(power) for power in range(14))  # of exp; for numbers up to LOG_TWO/2, to rounding
FARTHEST = 700.0  # accuracy: of decays: beyond, they are 1e-304, and taken as 0
POWERS = 2.0 ** -np.arange(FARTHEST / LOG_TWO + 2.0)


class Law(NamedTuple):
    """A law in the units of a solve."""

    kind: int
    strength: float
    range: float


@loop
def decay(x):
    """`exp(-x)` for x >= 0, to some units of rounding, by loops over vector units, which that of a library is not."""
    near = x if x < FARTHEST else FARTHEST
    whole = math.floor(near / LOG_TWO + 0.5)
    rest = whole * LOG_TWO - near
    result = TAYLOR[13]
    for power in range(12, -1, -1):
        result = result * rest + TAYLOR[power]
    return result * POWERS[int(whole)] if x < FARTHEST else 0.0


@loop
def attraction(kind, s, rho, g):
    """sigma at a gap."""
    if kind == EXPONENTIAL:
        return s * decay(g / rho)
    return s if g < rho else 0.0


@loop
def energy(kind, rho, g, sigma):
    """The energy gamma per area that it takes to open a gap from g on, where the attraction is sigma."""
    return rho * sigma if kind == EXPONENTIAL else (rho - g) * sigma


@loop
def softening(kind, rho, sigma):
    """`-d sigma/dg`, where the attraction is sigma."""
    return sigma / rho if kind == EXPONENTIAL else 0.0
