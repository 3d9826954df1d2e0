"""Panels of pictures: what they contain, and how they are drawn.

A picture is a list of panels. A panel contains lines with bars of their errors, stacks of bars, shaded ranges of its
axes, or a map. `draw` draws it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator

from .. import printed
from ..capabilities import Axis as Axis
from ..capabilities import ColumnPanel as ColumnPanel
from ..capabilities import stated
from ..job.listing import answers
from ..parallel.slab import Array
from . import style

SPIKE_SHARE = 0.02  # first part of the abscissa, whose spikes do not set the limits
SPIKE_HEIGHT = 1.5  # least height of a spike over the highest other value
MOST_EDGES = 7  # most labels of the bar of colours of bands
LEAST_RANGE = 0.01  # least range of an axis over its largest value
HEADROOM, PEAK_ROOM = 1.08, 1.25  # upper limit over the highest value, without and with its name in the legend
BAR_SHARE = 0.8  # width of a bar over the distance of bars, in the logarithm
LEAST = 0.99  # largest downward error bar over the value
ZERO_ROW = 0.05  # height of the row of marks at 0, over the height of the panel
SAME = 1e-9  # rounding: relative difference of equal values on a logarithmic axis
COARSEST = 800  # most points of a drawn map along a side
COLOR_BAR = 0.9  # height of a bar of colours over that of its map
TICKS = 5  # most intervals of ticks of a bar of colours


@dataclass(frozen=True)
class Line:
    """A line, or bars, of a panel: its name ('' if it has no entry in the legend), values `x` and `y` in SI units, and
    relative errors of y if they are known.

    Lines with the same number `stack` are bars, which stand on each other in their order.
    """

    name: str
    x: Array
    y: Array
    look: dict[str, Any] = field(default_factory=lambda: style.line(0))
    error: Array | None = None
    stack: int | None = None


def entry(name: str, look: dict[str, Any]) -> Line:
    """Return a line without values, which is only an entry of the legend."""
    return Line(name, np.zeros(0), np.zeros(0), look)


def offered(name: str) -> list[ColumnPanel]:
    """Return the panels of columns that effects have in a constant called `name`: RUN_PANELS, CURVE_PANELS, BAND_PANELS
    or SWEEP_PANELS."""
    return [one for found in (*stated(name), *answers("pictures", name)) for one in found]


@dataclass(frozen=True)
class Shade:
    """A shaded range of an axis, x or y, with its name in the legend. All ranges but the first begin at a dotted
    line."""

    name: str
    low: float
    high: float
    axis: str = "x"
    color: str = style.mix(style.GREY, 0.8)


@dataclass(frozen=True)
class Colors:
    """A map of `values`, shape (ny, nx), on the box with the `ends` x0, x1, y0, y1 [m], in colours from the value `low`
    to the value `high`. A map in which no point has a value has low > high, and gets no colour bar.

    Points without a value are NaN. They have the colour `blank`, or the grey shade of the map `behind` if it is given.
    If values above `high` exist, `clipped` is True; they get the last colour.
    """

    values: Array
    ends: tuple[float, float, float, float]
    of: Axis
    low: float
    high: float
    palette: str = style.SEQUENCE
    blank: str = "0.92"
    clipped: bool = False
    log: bool = False
    behind: Array | None = None


@dataclass(frozen=True)
class Panel:
    """A panel of a picture: the lines `series` against the axis `x`, on a map `colors` if it has one. Options of a
    picture choose panels by their `key`.

    If `spikes` is True, the vertical axis may end below a spike at the beginning, whose height is then printed. If
    `peak` is True, the legend names the highest point. On a logarithmic axis, values of 0 are marked with the label
    `zeros`. `edges` are the wavelengths [m] between the bands of stacked bars, from the longest down, for a bar of
    their colours. `x_range` and `y_range` are limits of the axes.
    """

    key: str
    x: Axis
    y: Axis
    series: Sequence[Line] = ()
    title: str = ""
    bottom: bool = True
    spikes: bool = False
    peak: bool = False
    shades: Sequence[Shade] = ()
    log_x: bool = False
    log_y: bool = False
    zeros: str = ""
    edges: Sequence[float] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    colors: Colors | None = None


def draw(panel: Panel, axes: Axes, log: Sequence[str] = ()) -> None:
    """Draw a panel without its legend. `log` names the axes to be logarithmic ("x", "y", or "none" for neither). An
    axis without positive points is drawn linear."""
    log_x = "none" not in log and (panel.log_x or "x" in log)
    log_y = "none" not in log and bool(panel.log_y or panel.zeros or "y" in log)
    series = [_drop_hidden_points(one, log_x, log_y) for one in panel.series]
    if not any(np.isfinite(one.x * one.y).any() for one in series):
        log_x = log_y = False
        series = [_drop_hidden_points(one, log_x, log_y) for one in panel.series]
    if panel.colors is not None:
        show_colors(axes, panel.colors)
    _draw_bars(axes, series)
    if panel.edges:
        _draw_edges(axes, panel)
    _draw_lines(axes, series)
    if panel.zeros and log_y:
        _mark_zeros(axes, panel)
    if panel.colors is None:
        _set_scales(axes, panel, series, log_x, log_y)
    _draw_shades(axes, panel.shades)
    axes.set_title(panel.title)


def _draw_lines(axes: Axes, series: Sequence[Line]) -> None:
    """Draw lines with the bars of their known errors; with marks if none has two points. A bar of more than the value
    ends just above 0."""
    lonely = all(np.isfinite(one.x * one.y).sum() < 2 for one in series)
    for one in series:
        if one.stack is None:
            axes.plot(one.x, one.y, label=one.name or None, **one.look | ({"marker": "o"} if lonely else {}))
            if one.error is not None:
                size = np.where(np.isfinite(one.error), np.abs(one.error * one.y), 0.0)
                look: dict[str, Any] = {"ecolor": one.look["color"], "elinewidth": 1.0, "capsize": 2.5, "alpha": 0.7}
                axes.errorbar(one.x, one.y, yerr=[np.minimum(size, LEAST * np.abs(one.y)), size], fmt="none", **look)


def _set_scales(axes: Axes, panel: Panel, series: Sequence[Line], log_x: bool, log_y: bool) -> None:
    """Set scales, limits and labels of the axes."""
    ranges = {"xlim": panel.x_range, "ylim": panel.y_range}
    axes.set(**{name: ends for name, ends in ranges.items() if ends})
    set_scale(axes, "x", panel.x, log_x)
    set_scale(axes, "y", panel.y, log_y)
    if not log_y and series:
        if panel.y_range is None:
            _set_limits(axes, panel, series, log_x)
        if panel.peak:
            _name_peak(axes, series[0], panel.x.unit)
        style.label(axes.yaxis, panel.y.name, panel.y.unit)


def _draw_shades(axes: Axes, shades: Sequence[Shade]) -> None:
    limits = axes.get_xlim()
    for number, one in enumerate(shades):
        fill = axes.axvspan if one.axis == "x" else axes.axhspan
        fill(one.low, one.high, color=one.color, lw=0, zorder=-1, label=one.name or None)
        if number:
            axes.axvline(one.low, color=style.GREY, lw=0.8, ls=":", zorder=0)
    axes.set_xlim(limits)


def show_colors(axes: Axes, one: Colors) -> AxesImage:
    """Draw a map with its colour bar. If all points have the same value, the bar has one tick."""
    axes.set_facecolor(one.blank)
    axes.grid(False)
    if one.behind is not None:
        _show(axes, one, one.behind, cmap="Greys_r", alpha=0.5)
    low, high = one.low, one.high
    width = 1.0 if high < low else (high - low or abs(high) or 1.0)
    start = low if low <= high else 0.0
    norm = LogNorm(low, high) if one.log and low < high else Normalize(start, start + width)
    image = _show(axes, one, one.values, cmap=one.palette, norm=norm)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    x0, x1, y0, y1 = one.ends
    height = style.label_map(axes, (x1 - x0, y1 - y0))
    if low <= high:
        _draw_color_bar(axes, image, one, COLOR_BAR * height)
    return image


def _draw_color_bar(axes: Axes, image: AxesImage, one: Colors, height: float) -> None:
    ticks = [one.low] if one.low == one.high else MaxNLocator(TICKS, steps=[1, 2, 5, 10])
    bar = axes.figure.colorbar(
        image, ax=axes, shrink=height, extend="max" if one.clipped else "neither", ticks=None if one.log else ticks
    )
    if one.log:
        style.thin_log_ticks(bar.ax.yaxis)
        bar.ax.set_ylabel(one.of.name)
    else:
        style.label(bar.ax.yaxis, one.of.name, one.of.unit)


def _show(axes: Axes, one: Colors, values: Array, **look: Any) -> AxesImage:
    return axes.imshow(drawn_points(values), extent=one.ends, origin="lower", interpolation="nearest", **look)


def drawn_points(values: Array) -> Array:
    """Return the points of a map that are drawn, thinned to at most COARSEST along a side."""
    step = max(1, -(-max(values.shape) // COARSEST))
    return values[::step, ::step]


def _draw_bars(axes: Axes, series: Sequence[Line]) -> None:
    """Draw stacks of bars side by side, each from its first series at the bottom."""
    stacked = [(one.stack, one) for one in series if one.stack is not None]
    if not stacked:
        return
    stacks = sorted({stack for stack, _ in stacked})
    steps = [float(np.diff(np.log(one.x)).min()) for _, one in stacked if one.x.size > 1]
    width = min(steps, default=1.0) * BAR_SHARE / len(stacks)
    bottoms = {stack: np.zeros(1) for stack in stacks}
    for stack, one in stacked:
        left = one.x * np.exp(width * (stacks.index(stack) - 0.5 * len(stacks)))
        look: dict[str, Any] = {"color": one.look["color"], "edgecolor": "white", "linewidth": 0.3}
        axes.bar(left, one.y, left * np.expm1(width), bottoms[stack], align="edge", label=one.name or None, **look)
        bottoms[stack] = bottoms[stack] + one.y


def _draw_edges(axes: Axes, panel: Panel) -> None:
    """Draw the bar of colours of bands, with the waves between neighbouring bands."""
    colors = [one.look["color"] for one in panel.series if one.stack is not None]
    norm = BoundaryNorm(range(len(colors) + 1), len(colors))
    shown = range(0, len(panel.edges), -(-len(panel.edges) // MOST_EDGES))
    bar = axes.figure.colorbar(ScalarMappable(norm, ListedColormap(colors)), ax=axes, ticks=list(shown), aspect=15)
    bar.ax.set_yticklabels([printed.quantity(panel.edges[k], "m") for k in shown], fontsize=style.SMALL)
    bar.ax.minorticks_off()
    bar.ax.set_title("waves", fontsize=style.SMALL)
    axes.tick_params("x", labelsize=style.SMALL)  # the bar narrows the panel


def _drop_hidden_points(one: Line, log_x: bool, log_y: bool) -> Line:
    """Return a line without points that logarithmic axes cannot show."""
    x, y = np.asarray(one.x, dtype=float), np.asarray(one.y, dtype=float)
    there = np.isfinite(x) & ((x > 0.0) | (not log_x)) & ((y > 0.0) | (not log_y))
    return replace(one, x=np.where(there, x, np.nan), y=np.where(there, y, np.nan))


def _mark_zeros(axes: Axes, panel: Panel) -> None:
    """Mark zeros of the lines at the lower edge, with one row of marks per line."""
    label = panel.zeros  # one label for all lines
    for row, one in enumerate(one for one in panel.series if one.x.size):
        zeros = np.asarray(one.x)[np.asarray(one.y) == 0.0]
        if zeros.size:
            height = np.full(zeros.size, ZERO_ROW * (row + 0.5))
            look: dict[str, Any] = {"color": one.look["color"], "marker": "x", "linestyle": "none", "ms": 4}
            axes.plot(zeros, height, transform=axes.get_xaxis_transform(), label=label or None, **look)
            label = ""


def set_scale(axes: Axes, which: str, of: Axis, log: bool) -> None:
    """Set name, unit and scale of an axis; few ticks keep labels from overlapping."""
    axis, few = axes.xaxis if which == "x" else axes.yaxis, True
    if log:
        low, high = axis.get_data_interval()
        if 0.0 < low < high < low * (1.0 + SAME):  # Matplotlib finds no limits for values that differ by rounding
            axes.set(**{f"{which}lim": (low / 10.0, 10.0 * low)})
        axes.set(**{f"{which}scale": "log"})
        if of.unit == "s" and style.label_log_times(axis, of.name):
            return
        few = style.thin_log_ticks(axis)
    else:
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    if few:
        style.label(axis, of.name, of.unit)
    else:  # powers of ten need no prefix
        axis.set_label_text(f"{of.name} [{of.unit}]" if of.unit else of.name)


def _set_limits(axes: Axes, panel: Panel, series: Sequence[Line], log_x: bool) -> None:
    """Set limits that include 0 and error bars up to the value; cut off a spike, and print its height. A panel without
    0 shows at least the share LEAST_RANGE of its values: smaller changes are errors of the mesh."""
    stacks = {one.stack for one in series} - {None}
    wholes = [np.sum([one.y for one in series if one.stack == stack], axis=0) for stack in stacks]
    ys = np.concatenate([*wholes, *(one.y for one in series)])
    highest = _highest(ys)
    if panel.bottom and not (ys < 0.0).any():
        bars = [one.y * (1.0 + np.nan_to_num(np.minimum(one.error, 1.0))) for one in series if one.error is not None]
        axes.set_ylim(0.0, (PEAK_ROOM if panel.peak else HEADROOM) * max(highest, *map(_highest, bars), 0.0) or 1.0)
        if not highest:
            axes.set_yticks([0.0])  # there are no values for a scale
    ends = float(np.nanmin(ys, initial=np.inf)), float(np.nanmax(ys, initial=-np.inf))
    least = LEAST_RANGE * max(map(abs, ends))
    if not panel.bottom and 0.0 < ends[1] - ends[0] < least < np.inf:
        axes.set_ylim(0.5 * (sum(ends) - least), 0.5 * (sum(ends) + least))
    if panel.spikes and not log_x:
        xs = np.concatenate([one.x for one in series])
        late = xs > np.nanmin(xs) + SPIKE_SHARE * (np.nanmax(xs) - np.nanmin(xs))
        rest = _highest(ys[late])
        if 0.0 < SPIKE_HEIGHT * rest < highest:
            axes.set_ylim(top=1.25 * rest)
            label = f"↑ {printed.quantity(highest, panel.y.unit)}"
            axes.text(0.12, 0.97, label, transform=axes.transAxes, va="top", color=style.RED, fontsize=9)


def _highest(values: Array) -> float:
    """Return the highest positive value, or 0."""
    return float(values[np.isfinite(values)].max(initial=0.0))


def _name_peak(axes: Axes, one: Line, unit: str) -> None:
    """Name the highest point of a line in the legend, if it is inside the range and the line falls after it."""
    height = np.nan_to_num(np.abs(one.y))
    at = int(np.argmax(height))
    if 0 < at < height.size - 1 and height[at] > 1.02 * height[-1]:
        label = f"{one.y[at]:.3g} at {printed.quantity(one.x[at], unit)}"
        axes.plot(one.x[at], one.y[at], "o", color=style.RED, label=label, scalex=False, scaley=False)


def picture(
    title: str, groups: Sequence[Sequence[Panel]], maps: Sequence[Panel] = (), log: Sequence[str] = ()
) -> Figure:
    """Return a picture with groups of panels below each other, and below them the panels `maps`, which are all of one
    size."""
    drawn = [[partial(draw, panel, log=log) for panel in group] for group in (*groups, maps)]
    return style.figure_of(title, drawn[:-1], drawn[-1])
