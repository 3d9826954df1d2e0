"""Units with the prefix that suits the numbers: 1.04 kPa, not 0.00104167 MPa."""

import math

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def prefixed(unit: str, largest: float) -> tuple[str, float]:
    """Return the unit with the prefix that suits the largest value, and its size in the unit without one.

    Squares, m², go up by a million; they keep the larger unit down to a thousandth of it. No unit and degrees have no
    prefix, and there are no kiloseconds.
    """
    if unit in ("", "°C") or not largest:
        return unit, 1.0
    square = unit == "m²"
    order = math.log10(abs(largest)) + 1e-9
    power = 3 * math.floor((order + 3.0) / 6.0 if square else order / 3.0)
    power = min(max(power, min(PREFIXES)), 0 if unit == "s" else max(PREFIXES))
    return PREFIXES[power] + unit, 10.0 ** (2 * power if square else power)


def text(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit."""
    rounded = float(f"{value:.{digits}g}")
    shown, size = prefixed(unit, rounded)
    return f"{rounded / size:g} {shown}".rstrip()


def label(axis: Axis, name: str, unit: str) -> None:
    """Name an axis of SI values, and show its ticks in the unit that suits the range of the axis."""
    shown, size = prefixed(unit, max(map(abs, axis.get_view_interval())))
    axis.set_label_text(f"{name} [{shown}]" if shown else name)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / size:.10g}".replace("-", "−")))
