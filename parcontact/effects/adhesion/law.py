"""Laws of adhesion: attraction sigma of two surfaces as a function of their gap g, its energy gamma, and its slope.

A law has a `kind` (EXPONENTIAL or DUGDALE), a strength s, a range rho and a ramp r,

    exponential  sigma(g) = s exp(-g/rho),            gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s ((rho - g)/r + 1/2), limited to 0..s, and -d gamma/dg = sigma.

Over the ramp, at most 2 rho, a constant attraction falls to 0: in a cell where the gap rises by r it is the mean of
the law without ramp, with the same energy gamma(0) = s rho. The exponential is the most expensive part of a loop, so
energy and slope are computed from sigma.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import loop
from ...parallel.slab import Array
from ...solve.constraint import Mask

EXPONENTIAL, DUGDALE = 0, 1
LOG_TWO = math.log(2.0)
TAYLOR = tuple(1.0 / math.factorial(power) for power in range(14))  # series of exp, exact to rounding up to LOG_TWO/2
FARTHEST = 700.0  # accuracy: largest exponent; exp(-x) of a larger x, below 1e-304, is taken as 0
POWERS = 2.0 ** -np.arange(FARTHEST / LOG_TWO + 2.0)


class Law(NamedTuple):
    """Law in the units of a solve. Only DUGDALE has a ramp."""

    kind: int
    strength: float
    range: float
    ramp: float = 0.0

    @staticmethod
    def touches(gap: Array) -> Mask:
        """Return True where the gap is 0: surfaces touch there under pressure and under tension."""
        return gap == 0.0


@loop
def decay(x):
    """Return `exp(-x)` for x >= 0, to a few units of rounding, in a form that compilers vectorize."""
    near = x if x < FARTHEST else FARTHEST
    whole = math.floor(near / LOG_TWO + 0.5)
    rest = whole * LOG_TWO - near
    result = TAYLOR[13]
    for power in range(12, -1, -1):
        result = result * rest + TAYLOR[power]
    return result * POWERS[int(whole)] if x < FARTHEST else 0.0


@loop
def attraction(law, g):
    """Return sigma at the gap g."""
    if law.kind == EXPONENTIAL:
        return law.strength * decay(g / law.range)
    return law.strength * min(max((law.range - g) / law.ramp + 0.5, 0.0), 1.0)


@loop
def energy(law, g, sigma):
    """Return gamma(g), the energy per area that opens the gap from g to infinity; sigma is the attraction at g."""
    if law.kind == EXPONENTIAL:
        return law.range * sigma
    end = law.range + 0.5 * law.ramp
    return sigma * (law.range - g if sigma == law.strength else 0.5 * (end - g))


@loop
def softening(law, sigma):
    """Return `-d sigma/dg` where the attraction is sigma."""
    if law.kind == EXPONENTIAL:
        return sigma / law.range
    return law.strength / law.ramp if 0.0 < sigma < law.strength else 0.0
