"""Richardson extrapolation: the limit of values on finer and finer meshes, the order found, and how sure it is.

For values `f(h) = f* + c h^p` at three sizes the order p follows from the ratio of their differences, and

    f* = f1 + (f1 - f2)/((h2/h1)^p - 1)

with f1 at the finest size (paper, Eq. 14, where p = 1.4 was assumed; I. B. Celik et al., J. Fluids Eng. 130 (2008)
078001 for sizes whose ratios differ). The order is taken as known to a half, and with four sizes the limit from the
finest three is compared with that from the three before: the larger of what these do to the limit is its uncertainty,
at least a quarter of the last difference.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

LEAST_ORDER, LARGEST_ORDER = 0.3, 6.0  # accuracy: orders outside tell of values that do not converge yet
DOUBT = 0.5  # accuracy: of the order
LEAST_DOUBT = 0.25  # accuracy: of the last difference


@dataclass(frozen=True)
class Limit:
    """The limit of a sequence, the order in which it is approached (NaN if none was found), and its uncertainty (NaN if
    nothing is known of it)."""

    value: float
    order: float
    uncertainty: float

    @property
    def doubt(self) -> float:
        """The uncertainty over the value; 0 where the value is, as the friction of a body that does not slide."""
        return abs(self.uncertainty / self.value) if self.value else 0.0


def extrapolate(sizes: Sequence[float], values: Sequence[float]) -> Limit:
    """The limit for size 0 of values at decreasing sizes; at least two of them.

    Two values, or values that do not come nearer to each other from one side, have the finest one as their limit and
    the larger of the last two differences as its uncertainty: NaN where they do not differ at all, as nothing is then
    known of their error.
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
    """The p for which three values lie on `f* + c h^p`; NaN if there is none in the range of orders."""
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
