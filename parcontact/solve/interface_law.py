"""A law of the interface: by how much finer roughness lets the mean planes of two surfaces approach under a pressure.

Roughness that no grid resolves is squeezed by the closing c(p), which rises with the pressure p. The conditions of
contact with it are

    p >= 0,    w = A p + c(p) - h - d >= 0,    p w = 0,

so that a point with pressure is `h + d - c(p)` deep. As c rises the problem is monotone and has one solution.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..compiled import loop
from ..errors import InputError
from ..parallel.slab import Array

STEPS = 6  # accuracy: pieces of a straight line in each interval of a table, equal in the logarithm of the pressure


@dataclass(frozen=True)
class InterfaceLaw:
    """The closing c(p) as a line of straight pieces from `c(0) = 0`: `pressures` from 0 on, rising, and `closings`,
    rising or level, in any units. Beyond its last point it stays level."""

    pressures: Array
    closings: Array

    @classmethod
    def of_table(cls, pressures: Array, closings: Array) -> "InterfaceLaw":
        """Return the law through the points of a table, shape (n,), n >= 2, of rising positive pressures.

        Between them c is a monotone cubic in the logarithm of p (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput.
        5 (1984) 300); below the first it goes on linearly in p with the same slope.
        Only differences of closings count: c(0) is made 0. Raises InputError for a table that does not rise.
        """
        if len(pressures) < 2 or pressures[0] <= 0.0 or np.any(np.diff(pressures) <= 0.0):
            raise InputError("an interface law needs two positive pressures or more, which rise")
        if np.any(np.diff(closings) < 0.0):
            raise InputError("an interface law needs closings that do not fall while the pressure rises")
        logs = np.log(pressures)
        count = STEPS * (len(logs) - 1) + 1
        fine = np.interp(np.linspace(0, len(logs) - 1, count), np.arange(len(logs)), logs)
        known = PchipInterpolator(logs, closings)
        values = np.maximum.accumulate(known(fine))  # but for rounding they rise
        slope = float(known(logs[0], 1))  # dc/d(log p), so that p dc/dp is c(p) - c(0) below
        return cls(np.concatenate([[0.0], np.exp(fine)]), np.concatenate([[0.0], values - closings[0] + slope]))

    def in_units(self, pressure: float, length: float) -> "InterfaceLaw":
        """Return the law in these units of pressure and of length."""
        return InterfaceLaw(self.pressures / pressure, self.closings / length)

    def closing(self, p: Array) -> Array:
        """Return c(p), of the shape of p."""
        return np.interp(p, self.pressures, self.closings)


HARD = InterfaceLaw(np.array([0.0, 1.0]), np.zeros(2))  # nothing gives way


@loop
def resolve(s, h, gamma, pressures, sums, p, reflected):
    """`p >= 0` with `p + gamma c(p) = s + gamma h` where that is positive, 0 elsewhere, and `2 p - s`; returns the sum
    of the latter. `sums` is `pressures + gamma c` at the points of the law, which rises."""
    total, last = 0.0, sums.size - 1
    for j in range(s.shape[0]):
        row = 0.0
        for i in range(s.shape[1]):
            value = s[j, i] + gamma * h[j, i]
            if value <= 0.0:
                found = 0.0
            elif value >= sums[last]:
                found = pressures[last] + value - sums[last]
            else:
                low, high = 0, last
                while high - low > 1:
                    middle = (low + high) // 2
                    if sums[middle] <= value:
                        low = middle
                    else:
                        high = middle
                share = (value - sums[low]) / (sums[high] - sums[low])
                found = pressures[low] + share * (pressures[high] - pressures[low])
            p[j, i] = found
            reflected[j, i] = 2.0 * found - s[j, i]
            row += reflected[j, i]
        total += row
    return total


@loop
def update_split(s, y, p, shift):
    """`s <- s + y + shift - p`."""
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            s[j, i] += y[j, i] + shift - p[j, i]
