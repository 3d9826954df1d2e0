"""Laws of adhesion: the attraction sigma of two points over their gap, its energy gamma and its slope.

A law is four numbers: its `kind` (EXPONENTIAL or DUGDALE), its strength s, its range rho and its ramp r,

    exponential  sigma(g) = s exp(-g/rho),            gamma(g) = s rho exp(-g/rho),
    dugdale      sigma(g) = s ((rho - g)/r + 1/2), at least 0 and at most s, and -d gamma/dg = sigma.

The ramp, up to 2 rho, is the width over which a constant attraction ends: in a cell where the gap rises by r, it is the
mean of the law without ramp. Its energy is the same, gamma(0) = s rho.
The exponential is the dearest part of a loop. So it is calculated once for each gap, and energy and slope from it.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import loop
from ...parallel.slab import Array
from ..constraint import Mask

EXPONENTIAL, DUGDALE = 0, 1
LOG_TWO = math.log(2.0)
TAYLOR = tuple(1.0 / math.factorial(power) for power in range(14))  # of exp; for numbers up to LOG_TWO/2, to rounding
FARTHEST = 700.0  # accuracy: of decays: beyond, they are 1e-304, and taken as 0
POWERS = 2.0 ** -np.arange(FARTHEST / LOG_TWO + 2.0)


class Law(NamedTuple):
    """A law in the units of a solve; only the kind DUGDALE has a ramp."""

    kind: int
    strength: float
    range: float
    ramp: float = 0.0

    @staticmethod
    def touches(gap: Array) -> Mask:
        """Return where the surfaces touch: at points whose gap is 0, under pressure and under tension."""
        return gap == 0.0


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
def attraction(law, g):
    """sigma at a gap."""
    if law.kind == EXPONENTIAL:
        return law.strength * decay(g / law.range)
    return law.strength * min(max((law.range - g) / law.ramp + 0.5, 0.0), 1.0)


@loop
def energy(law, g, sigma):
    """The energy gamma per area that it takes to open a gap from g on, where the attraction is sigma."""
    if law.kind == EXPONENTIAL:
        return law.range * sigma
    end = law.range + 0.5 * law.ramp
    return sigma * (law.range - g if sigma == law.strength else 0.5 * (end - g))


@loop
def softening(law, sigma):
    """`-d sigma/dg`, where the attraction is sigma."""
    if law.kind == EXPONENTIAL:
        return sigma / law.range
    return law.strength / law.ramp if 0.0 < sigma < law.strength else 0.0
