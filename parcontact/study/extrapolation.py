"""Richardson extrapolation: the limit of values on finer and finer meshes, its order and its uncertainty.

For values `f(h) = f* + c h^p` at three sizes the order p follows from the ratio of their differences, and

f* = f1 + (f1 - f2)/((h2/h1)^p - 1)

with f1 at the finest size (paper, Eq. 14, with p = 1.4; I. B. Celik et al., J. Fluids Eng. 130 (2008) 078001 for
different ratios of sizes). The uncertainty is the larger change of the limit if the order changes by DOUBT, or if, with
four sizes, the finest one is left out; at least LEAST_DOUBT of the last difference.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

LEAST_ORDER, LARGEST_ORDER = 0.3, 6.0  # accuracy: range of orders of converging values
DOUBT = 0.5  # accuracy: uncertainty of the order
LEAST_DOUBT = 0.25  # accuracy: least uncertainty of the limit over the last difference


@dataclass(frozen=True)
class Limit:
    """The limit of a sequence, its order (NaN if none was found), and its uncertainty (NaN if unknown)."""

    value: float
    order: float
    uncertainty: float

    @property
    def doubt(self) -> float:
        """Return the relative uncertainty; 0 for a value of 0, such as friction at rest."""
        return abs(self.uncertainty / self.value) if self.value else 0.0


def extrapolate(sizes: Sequence[float], values: Sequence[float]) -> Limit:
    """Return the limit for size 0 of at least two values at decreasing sizes.

    If there are two values only, or values do not converge monotonically, the limit is the finest value, and its
    uncertainty the larger of the last two differences (NaN if they are 0).
    """
    last = abs(values[-1] - values[-2])
    order = _order(sizes[-3:], values[-3:]) if len(values) > 2 else math.nan
    if math.isnan(order):
        before = abs(values[-2] - values[-3]) if len(values) > 2 else last
        return Limit(values[-1], math.nan, max(last, before) or math.nan)
    value = _limit(sizes, values, order)
    doubts = [abs(_limit(sizes, values, max(order + more, LEAST_ORDER)) - value) for more in (-DOUBT, DOUBT)]
    doubts.append(LEAST_DOUBT * last)
    if len(values) > 3:
        doubts.append(abs(extrapolate(sizes[:-1], values[:-1]).value - value))
    return Limit(value, order, max(doubts))


def _limit(sizes: Sequence[float], values: Sequence[float], order: float) -> float:
    return values[-1] + (values[-1] - values[-2]) / ((sizes[-2] / sizes[-1]) ** order - 1.0)


def _order(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the order p of three values on `f* + c h^p`; NaN if it is outside of the range of orders."""
    before, after = values[0] - values[1], values[1] - values[2]
    if after == 0.0 or before / after <= 0.0:
        return math.nan
    wanted = before / after
    h3, h2, h1 = sizes

    def ratio(p: float) -> float:
        return float((h3**p - h2**p) / (h2**p - h1**p))

    if not ratio(LEAST_ORDER) <= wanted <= ratio(LARGEST_ORDER):
        return math.nan
    return float(brentq(lambda p: ratio(p) - wanted, LEAST_ORDER, LARGEST_ORDER))
