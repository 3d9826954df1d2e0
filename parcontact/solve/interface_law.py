"""Law of the interface: how far unresolved roughness lets the mean planes of two surfaces approach under a pressure.

Roughness finer than the grid is squeezed by the closing c(p), which rises with p. The conditions of contact are

    p >= 0,    w = A p + c(p) - h - d >= 0,    p w = 0,

so that a point with pressure penetrates by `h + d - c(p)`. As c rises, the problem is monotone and has one solution.
"""

from dataclasses import dataclass

import numpy as np

from ..compiled import loop
from ..errors import InputError
from ..parallel.slab import Array

STEPS = 6  # accuracy: linear pieces in each interval of a table, equal in the logarithm of the pressure


@dataclass(frozen=True)
class InterfaceLaw:
    """Piecewise linear closing c(p) with `c(0) = 0`: `pressures` rise from 0, and `closings` do not fall. Both have any
    unit.

    Beyond the last point c is constant.
    """

    pressures: Array
    closings: Array

    @classmethod
    def of_table(cls, pressures: Array, closings: Array) -> "InterfaceLaw":
        """Return the law through the points of a table, shape (n,), n >= 2, of rising positive pressures.

        Between the points c is a monotone cubic in log p (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5
        (1984) 300); below the first it is linear in p with the same slope, and c(0) = 0. Raises InputError for a
        table that does not rise.
        """
        if len(pressures) < 2 or pressures[0] <= 0.0 or np.any(np.diff(pressures) <= 0.0):
            raise InputError("an interface law needs two positive pressures or more, which rise")
        if np.any(np.diff(closings) < 0.0):
            raise InputError("an interface law needs closings that do not fall while the pressure rises")
        from scipy.interpolate import PchipInterpolator  # slow to import, and of use to few

        logs = np.log(pressures)
        count = STEPS * (len(logs) - 1) + 1
        fine = np.interp(np.linspace(0, len(logs) - 1, count), np.arange(len(logs)), logs)
        known = PchipInterpolator(logs, closings)
        values = np.maximum.accumulate(known(fine))  # removes rounding errors
        slope = float(known(logs[0], 1))  # dc/d(log p) = p dc/dp, which is c(p) - c(0) below the first point
        return cls(np.concatenate([[0.0], np.exp(fine)]), np.concatenate([[0.0], values - closings[0] + slope]))

    def in_units(self, pressure: float, length: float) -> "InterfaceLaw":
        """Return the law in the given units of pressure and length."""
        return InterfaceLaw(self.pressures / pressure, self.closings / length)

    def closing(self, p: Array) -> Array:
        """Return c(p), of the shape of p."""
        return np.interp(p, self.pressures, self.closings)


HARD = InterfaceLaw(np.array([0.0, 1.0]), np.zeros(2))  # no closing


@loop
def resolve(s, h, gamma, pressures, sums, p, reflected):
    """Solve `p + gamma c(p) = s + gamma h` for `p >= 0` where the right side is positive, else p = 0. Put `2 p - s`
    into `reflected` and return its sum. `sums` is `pressures + gamma c` at the points of the law."""
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
def begin_split(p, closing, u, h, d, gamma, s):
    """Put `p + gamma c(p) - gamma h` where there is pressure, and `-gamma (u - d)` elsewhere, into s."""
    for j in range(s.shape[0]):
        for i in range(s.shape[1]):
            pressed = p[j, i] + gamma * (closing[j, i] - h[j, i])
            s[j, i] = pressed if p[j, i] > 0.0 else gamma * (d - u[j, i])
