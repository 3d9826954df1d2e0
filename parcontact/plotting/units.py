"""Units with the prefix that suits the numbers on an axis: 1.04 kPa, not 0.00104167 MPa."""

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter

from ..printed import prefixed, text

__all__ = ["label", "prefixed", "text"]


def label(axis: Axis, name: str, unit: str) -> None:
    """Name an axis of SI values, and show its ticks in the unit that suits the range of the axis."""
    shown, size = prefixed(unit, max(map(abs, axis.get_view_interval())))
    axis.set_label_text(f"{name} [{shown}]" if shown else name)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / size:.10g}".replace("-", "−")))
