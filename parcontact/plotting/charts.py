"""Charts of runs and friction curves: their numbers, and how they are drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.textpath import TextPath
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from ..parallel.slab import Array
from . import prefixes, style

SPIKE_SHARE = 0.02  # first part of the abscissa, whose spikes do not set the limits
SPIKE_HEIGHT = 1.5  # least height of a spike over the highest other value
AXES_SHARE = 0.72  # width of the axes over the width of a panel
NAMES, LINE = 9, 12  # size of the names of stages, and height of their lines [points]
MAX_NAME = 24  # most letters of the name of a stage
LEVELS = 3  # most rows of horizontal names of stages
FEW_NAMES, MANY_NAMES = 2, 4  # most lines for a legend inside a narrow and a wide panel
SMALL, NAMES_PER_ROW = 5.0, 2  # width of a small picture [inch]; names per row in its legend
HEADROOM, PEAK_ROOM = 1.08, 1.25  # upper limit over the highest value, without and with its name in the legend
FRACTION = "contact area /\nnominal area"
BAR_SHARE = 0.8  # width of a bar over the distance of bars, in the logarithm
LEAST = 0.99  # largest downward error bar over the value
ZERO_ROW = 0.05  # height of the row of marks at 0, over the height of the panel
SAME = 1e-9  # rounding: relative difference of equal values on a logarithmic axis
FEW_DECADES = 1.5  # decades of a logarithmic axis below which minor ticks have labels


@dataclass(frozen=True)
class ChartLine:
    """A line: its name (or ''), values in SI units, and their relative errors if known."""

    name: str
    x: Array
    y: Array
    look: dict[str, Any] = field(default_factory=lambda: style.line(0))
    error: Array | None = None


@dataclass(frozen=True)
class Axis:
    """The quantity of an axis and its SI unit."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Chart:
    """A panel, chosen by its `key`.

    `spikes`: a spike at the beginning may be cut off. `stages`: names, starts and ends over `x`, shown if `named`.
    `peak`: the legend names the highest point. `zeros`: label of values of 0 on a logarithmic axis. The first `stacked`
    series are stacked bars.
    """

    key: str
    x: Axis
    y: Axis
    series: Sequence[ChartLine]
    bottom: bool = True
    spikes: bool = False
    peak: bool = False
    stages: Sequence[tuple[str, float, float]] = ()
    named: bool = False
    legend_title: str = ""
    log_x: bool = False
    zeros: str = ""
    stacked: int = 0


def draw(chart: Chart, axes: Axes, log: Sequence[str] = ()) -> None:
    """Draw a chart; `log` names its logarithmic axes, which stay linear if the chart has no point for them. A legend of
    many lines is drawn outside of a panel of full width."""
    log_x, log_y = (
        "none" not in log and (chart.log_x or "x" in log),
        "none" not in log and bool(chart.zeros or "y" in log),
    )
    marks_zeros = chart.zeros and log_y
    series = [_drop_hidden_points(one, log_x, log_y) for one in chart.series]
    if not any(np.isfinite(one.x * one.y).any() for one in series):
        log_x = log_y = False
        series = [_drop_hidden_points(one, log_x, log_y) for one in chart.series]
    lonely = all(np.isfinite(one.x * one.y).sum() < 2 for one in series)
    if chart.stacked:
        _draw_bars(axes, series[: chart.stacked])
    for one in series[chart.stacked :]:
        axes.plot(one.x, one.y, label=one.name or None, **one.look | ({"marker": "o"} if lonely else {}))
        if one.error is not None:
            _draw_errors(axes, one, one.error)
    if marks_zeros:
        _mark_zeros(axes, chart)
    set_scale(axes, "x", chart.x.name, chart.x.unit, log_x)
    set_scale(axes, "y", chart.y.name, chart.y.unit, log_y)
    if not log_y:
        _set_limits(axes, chart, series, log_x)
        if chart.peak:
            _name_peak(axes, series[0], chart.x.unit)
        prefixes.label(axes.yaxis, chart.y.name, chart.y.unit)
    _mark_stages(axes, chart.stages, chart.named)
    if names := len(axes.get_legend_handles_labels()[1]):
        axes.legend(title=chart.legend_title or None, **_place_legend(axes, names))


def _place_legend(axes: Axes, names: int) -> dict[str, Any]:
    """Return the place of a legend with this number of names: inside the panel, or at its side, above or below."""
    small = axes.figure.bbox.width / axes.figure.dpi < SMALL
    if names > (MANY_NAMES if small else FEW_NAMES) and _panels_per_row(axes) == 1:
        return style.BELOW | {"ncols": NAMES_PER_ROW} if small else style.AT_SIDE
    return style.ABOVE if names > MANY_NAMES else {}


def _draw_bars(axes: Axes, series: Sequence[ChartLine]) -> None:
    """Draw stacked bars at common places, the first series at the bottom."""
    x = series[0].x
    half = (float(np.diff(np.log(x)).min()) if x.size > 1 else 1.0) * BAR_SHARE / 2.0
    left, width, bottom = x * np.exp(-half), x * (np.exp(half) - np.exp(-half)), np.zeros_like(x)
    for one in series:
        axes.bar(left, one.y, width, bottom, align="edge", label=one.name, color=one.look["color"])
        bottom = bottom + one.y


def _drop_hidden_points(one: ChartLine, log_x: bool, log_y: bool) -> ChartLine:
    """Return a line without points that logarithmic axes cannot show."""
    x, y = np.asarray(one.x, dtype=float), np.asarray(one.y, dtype=float)
    there = np.isfinite(x) & ((x > 0.0) | (not log_x)) & ((y > 0.0) | (not log_y))
    return replace(one, x=np.where(there, x, np.nan), y=np.where(there, y, np.nan))


def _mark_zeros(axes: Axes, chart: Chart) -> None:
    """Mark zeros of the lines at the lower edge, with one row of marks per line."""
    label = chart.zeros  # one label for all lines
    for row, one in enumerate(chart.series):
        zeros = np.asarray(one.x)[np.asarray(one.y) == 0.0]
        if zeros.size:
            height = np.full(zeros.size, ZERO_ROW * (row + 0.5))
            look: dict[str, Any] = {"color": one.look["color"], "marker": "x", "linestyle": "none", "ms": 4}
            axes.plot(zeros, height, transform=axes.get_xaxis_transform(), label=label or None, **look)
            label = ""


def _draw_errors(axes: Axes, one: ChartLine, share: Array) -> None:
    """Draw bars of the known errors; a bar of more than the value ends just above 0."""
    size = np.where(np.isfinite(share), np.abs(share * one.y), 0.0)
    look: dict[str, Any] = {"ecolor": one.look["color"], "elinewidth": 1.0, "capsize": 2.5, "alpha": 0.7}
    axes.errorbar(one.x, one.y, yerr=[np.minimum(size, LEAST * np.abs(one.y)), size], fmt="none", **look)


def set_scale(axes: Axes, which: str, name: str, unit: str, log: bool) -> None:
    """Set name, unit and scale of an axis, with few ticks so that labels do not overlap."""
    axis, few = axes.xaxis if which == "x" else axes.yaxis, True
    if log:
        low, high = axis.get_data_interval()
        if 0.0 < low < high < low * (1.0 + SAME):  # Matplotlib finds no limits for values that differ by rounding
            axes.set(**{f"{which}lim": (low / 10.0, 10.0 * low)})
        axes.set(**{f"{which}scale": "log"})
        low, high = axis.get_view_interval()
        if unit == "s" and prefixes.label_log_times(axis, name):
            return
        few = high < 10.0**FEW_DECADES * low
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=5))
        axis.set_minor_formatter(NullFormatter())
    else:
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    if few:
        prefixes.label(axis, name, unit)
    else:  # powers of ten need no prefix
        axis.set_label_text(f"{name} [{unit}]" if unit else name)


def _set_limits(axes: Axes, chart: Chart, series: Sequence[ChartLine], log_x: bool) -> None:
    """Set limits that include 0 and error bars up to the value; cut off a spike, and print its height."""
    whole = np.sum([one.y for one in series[: chart.stacked]], axis=0) if chart.stacked else np.zeros(0)
    ys = np.concatenate([whole, *(one.y for one in series)])
    highest = _highest(ys)
    if chart.bottom and not (ys < 0.0).any():
        bars = [one.y * (1.0 + np.nan_to_num(np.minimum(one.error, 1.0))) for one in series if one.error is not None]
        axes.set_ylim(0.0, (PEAK_ROOM if chart.peak else HEADROOM) * max(highest, *map(_highest, bars), 0.0) or 1.0)
        if not highest:
            axes.set_yticks([0.0])  # there are no values for a scale
    if chart.spikes and not log_x:
        xs = np.concatenate([one.x for one in series])
        late = xs > np.nanmin(xs) + SPIKE_SHARE * (np.nanmax(xs) - np.nanmin(xs))
        rest = _highest(ys[late])
        if 0.0 < SPIKE_HEIGHT * rest < highest:
            axes.set_ylim(top=1.25 * rest)
            label = f"↑ {prefixes.quantity(highest, chart.y.unit)}"
            axes.text(0.12, 0.97, label, transform=axes.transAxes, va="top", color=style.RED, fontsize=9)


def _highest(values: Array) -> float:
    """Return the highest positive value, or 0."""
    return float(values[np.isfinite(values)].max(initial=0.0))


def _name_peak(axes: Axes, one: ChartLine, unit: str) -> None:
    """Name the highest point of a line in the legend, if it is inside the range and the line falls after it."""
    height = np.nan_to_num(np.abs(one.y))
    at = int(np.argmax(height))
    if 0 < at < height.size - 1 and height[at] > 1.02 * height[-1]:
        label = f"{one.y[at]:.3g} at {prefixes.quantity(one.x[at], unit)}"
        axes.plot(one.x[at], one.y[at], "o", color=style.RED, label=label, scalex=False, scaley=False)


def _mark_stages(axes: Axes, stages: Sequence[tuple[str, float, float]], named: bool) -> None:
    """Mark the starts of stages, with names above in several rows, or turned if there are too many."""
    for _, start, _ in stages[1:]:
        axes.axvline(start, color=style.GREY, lw=0.8, ls=":", zorder=0)
    if not named or len(stages) < 2:
        return
    width = AXES_SHARE * 72.0 * axes.figure.bbox.width / axes.figure.dpi / _panels_per_row(axes)
    places = (axes.transScale + axes.transLimits).transform([(x, 1.0) for _, *ends in stages for x in ends])[:, 0]
    ends = np.clip(places, 0.0, 1.0).reshape(-1, 2)  # from 0 at the left to 1 at the right
    names = [style.plain(name, MAX_NAME) for name, _, _ in stages]
    middles = width * ends.mean(axis=1)
    widths = [TextPath((0, 0), name, size=NAMES).get_extents().width + NAMES / 2 for name in names]
    levels = _choose_levels(middles, widths)
    turned = max(levels) >= LEVELS
    if turned:  # names of the longest stages, as near to them as possible
        longest = np.sort(np.argsort(ends[:, 0] - ends[:, 1], kind="stable")[: int(width / LINE)])
        names, offsets = [names[k] for k in longest], LINE * np.arange(longest.size)
        middles = np.maximum.accumulate(middles[longest] - offsets) + offsets
        middles, levels = np.minimum(middles, width - offsets[::-1]), [0] * len(names)
    look: dict[str, Any] = {"ha": "center", "va": "bottom", "color": style.GREY, "fontsize": NAMES}
    look |= {"xycoords": "axes fraction", "textcoords": "offset points", "rotation": 90 if turned else 0}
    for name, x, level in zip(names, middles, levels, strict=True):
        axes.annotate(name, (x / width, 1.0), (0, 2 + LINE * level), **look)


def _panels_per_row(axes: Axes) -> int:
    place = axes.get_subplotspec()
    return place.get_gridspec().ncols if place else 1


def _choose_levels(middles: Array, widths: Sequence[float]) -> list[int]:
    """Return the lowest rows in which texts of given middles and widths, in order, do not overlap."""
    ends: list[float] = []
    levels = []
    for middle, width in zip(middles, widths, strict=True):
        level = next((k for k, end in enumerate(ends) if end <= middle - width / 2), len(ends))
        ends[level : level + 1] = [middle + width / 2]
        levels.append(level)
    return levels


def compare(runs: Sequence[tuple[str, Sequence[Chart]]]) -> list[Chart]:
    """Return charts that compare several runs: the lines of each run have its colour and its name."""
    found: dict[tuple[str, Axis, Axis], Chart] = {}
    for number, (name, charts) in enumerate(runs):
        for chart in charts:
            key = chart.key, chart.x, chart.y
            known = found.get(key, replace(chart, series=(), stages=(), peak=False, legend_title=""))
            lines = list(known.series)
            for k, one in enumerate(chart.series):
                dashes = style.line(number + k)["linestyle"]
                look = one.look | {"color": style.line(number)["color"], "linestyle": dashes}
                lines.append(replace(one, name=", ".join(filter(None, (style.plain(name), one.name))), look=look))
            spikes, log_x = known.spikes and chart.spikes, known.log_x and chart.log_x
            found[key] = replace(known, series=lines, spikes=spikes, log_x=log_x)
    return list(found.values())
