"""Units of axes with the prefix that suits their numbers: 1.04 kPa, not 0.00104167 MPa."""

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from ..printed import LONG_TIME, TIMES, prefixed, quantity

__all__ = ["label", "label_log_times", "label_map", "prefixed", "quantity"]

MARKS = {"1 ns": 1e-9, "1 µs": 1e-6, "1 ms": 1e-3, "1 s": 1.0, "1 min": 60.0, "1 h": 3600.0}
MARKS |= {"1 day": TIMES["days"], "1 year": TIMES["years"]}  # ticks of a logarithmic axis [s]
LETTER = 0.085  # width of a letter of a tick label [inch]
LONGEST, TALLEST = 4.0, 1.25  # most width over height of a map, and most height over width, without stretching
FEW_MARKS = 3  # least number of ticks


def label(axis: Axis, name: str, unit: str) -> None:
    """Set the label of an axis of SI values, with ticks in the unit that suits its range."""
    shown, size = prefixed(unit, max(map(abs, axis.get_view_interval())))
    if shown in TIMES and axis.get_scale() == "linear":
        axis.set_major_locator(_RoundTimes(size))
    axis.set_label_text(f"{name} [{shown}]" if shown else name)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / size:.10g}".replace("-", "−")))


def label_map(axes: Axes, size: tuple[float, float]) -> float:
    """Set the labels and the aspect of a map of a `size` [m], and return its height over that of its panel; the short
    side of a long map is stretched, and its label says so."""
    ratio = size[0] / size[1]
    stretched = "y" * bool(ratio > LONGEST) + "x" * bool(ratio < 1.0 / TALLEST)
    axes.set_aspect("auto" if stretched else "equal")
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        label(axis, f"{name}, stretched" if name == stretched else name, "m")
    return 1.0 if stretched else min(1.0, 1.0 / ratio)


def label_log_times(axis: Axis, name: str) -> bool:
    """Set the label of a logarithmic axis of long times with ticks at 1 s, 1 min, 1 h, ...; return False for other
    axes."""
    low, high = axis.get_view_interval()
    marks = {size: mark for mark, size in MARKS.items() if low <= size <= high}
    if high < LONG_TIME * TIMES["min"] or len(marks) < FEW_MARKS:
        return False
    marks = _thin_out(marks, axis.axes.get_position().width * axis.axes.figure.bbox.width / axis.axes.figure.dpi)
    axis.set_major_locator(FixedLocator(list(marks)))
    axis.set_major_formatter(FixedFormatter(list(marks.values())))
    axis.set_minor_locator(NullLocator())
    axis.set_label_text(name)
    return True


def _thin_out(marks: dict[float, str], width: float) -> dict[float, str]:
    """Return the ticks of a logarithmic axis of a `width` [inch] that do not overlap, from the longest time on."""
    kept, scale = dict[float, str](), width / math.log(max(marks) / min(marks))
    for size, mark in sorted(marks.items(), reverse=True):
        nearest = min(kept, default=math.inf)
        room = 0.5 * LETTER * (len(mark) + len(kept.get(nearest, ""))) + LETTER
        if scale * math.log(nearest / size) >= room:
            kept[size] = mark
    return dict(sorted(kept.items()))


class _RoundTimes(MaxNLocator):
    """Ticks at round numbers of a unit of time of `size` seconds."""

    def __init__(self, size: float) -> None:
        super().__init__("auto", steps=[1, 2, 5, 10])
        self._size = size

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Return times [s] from about `vmin` to `vmax` [s]."""
        found: Any = super().tick_values(vmin / self._size, vmax / self._size)
        return found * self._size
