"""Charts: what is drawn over something, as numbers, and how it is drawn. Runs and friction curves both give charts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.textpath import TextPath
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from ..parallel.slab import Array
from . import style, units

SPIKE_SHARE = 0.02  # of the abscissa, at its beginning: what stands out there only does not set the limits
SPIKE_HEIGHT = 1.5  # over the highest of the rest: less is no spike
AXES_SHARE = 0.72  # of the width of a panel, about: the rest is for labels
NAMES, LINE = 9, 12  # size of the names of stages, and of their lines [points]
FEW_NAMES = 2  # of lines, for which a key finds room among them
HEADROOM = 1.08  # of a panel over its highest point
FRACTION = "contact area /\nnominal area"
MAX_NAME = 24  # letters of the name of a stage: longer ones would leave no room for the curve
LEAST = 0.99  # of a value, which its bar of errors leaves at most
HALO: list[AbstractPathEffect] = [withStroke(linewidth=2.5, foreground="white")]  # of words that lines may cross
LEVELS = 3  # of names above each other, before they are turned


@dataclass(frozen=True)
class Series:
    """One line: its name, or '', and numbers in SI, with their errors as shares of them if these are known."""

    name: str
    x: Array
    y: Array
    look: dict[str, Any] = field(default_factory=lambda: style.line(0))
    error: Array | None = None


@dataclass(frozen=True)
class Axis:
    """What an axis measures, in which SI unit."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Chart:
    """One panel. `key` is how users ask for it; `spikes`: whether one at the beginning may leave the picture; `stages`
    are names, starts and ends over `x`; `peak`: whether the highest point is told, and so stays in the picture;
    `beside`: whether the key is beside the panel, which then needs the whole width."""

    key: str
    x: Axis
    y: Axis
    series: Sequence[Series]
    bottom: bool = True
    spikes: bool = False
    peak: bool = False
    stages: Sequence[tuple[str, float, float]] = ()
    named: bool = False
    legend_title: str = ""
    log_x: bool = False
    beside: bool = False

    def __call__(self, axes: Axes) -> None:
        draw(self, axes)


def with_key_beside(chart: Chart) -> Chart:
    """A chart that stands alone: the key of many lines is beside them, where it hides none."""
    return replace(chart, beside=sum(bool(one.name) for one in chart.series) > FEW_NAMES)


def draw(chart: Chart, axes: Axes, log: Sequence[str] = ()) -> None:
    """Draw a chart; `log` names the axes of logarithmic scale."""
    log_x, log_y = "none" not in log and (chart.log_x or "x" in log), "y" in log
    xs = [_shown(one.x, log_x) for one in chart.series]
    there = [np.where(np.isfinite(x), one.y, np.nan) for x, one in zip(xs, chart.series, strict=True)]
    ys = [_shown(y, log_y) for y in there]
    highest = max(map(_highest, ys))
    top = _below_spike(xs, ys) if chart.spikes and not (chart.peak or log_x or log_y) else math.inf
    x_unit, xs = (chart.x.unit, xs) if log_x else units.scaled(chart.x.unit, *xs)  # powers of ten need no prefix
    y_unit = chart.y.unit if log_y else units.scaled(chart.y.unit, *(y[y <= top] for y in ys))[0]
    size = units.size_of(y_unit, chart.y.unit) if y_unit else 1.0
    ys, highest, top = [y / size for y in ys], highest / size, top / size
    lonely = all(np.isfinite(x * y).sum() < 2 for x, y in zip(xs, ys, strict=True))
    for one, x, y in zip(chart.series, xs, ys, strict=True):
        axes.plot(x, y, label=one.name or None, **{**one.look, **({"marker": "o"} if lonely else {})})
        if one.error is not None:
            _draw_errors(axes, x, y, one.error, one.look["color"])
    axes.set(xlabel=units.labelled(chart.x.name, x_unit), ylabel=units.labelled(chart.y.name, y_unit))
    _scale(axes, "x", xs, log_x)
    _scale(axes, "y", ys, log_y)
    if chart.bottom and not log_y and not any((y < 0.0).any() for y in ys):
        roofs = [_highest(_with_bar(y, one.error)) for y, one in zip(ys, chart.series, strict=True)]
        axes.set_ylim(0.0, HEADROOM * max(highest, *roofs) or 1.0)
        if not highest:
            axes.set_yticks([0.0])  # a scale would be made up
    if top < math.inf:
        axes.set_ylim(top=top)
        told = f"↑ {highest:.3g} {y_unit}".rstrip()
        axes.text(0.12, 0.97, told, transform=axes.transAxes, va="top", color=style.RED, fontsize=9)
    if chart.peak and not log_y:
        _tell_peak(axes, xs[0], ys[0], x_unit)
    width = units.size_of(x_unit, chart.x.unit) if x_unit else 1.0
    _mark(axes, [(name, a / width, b / width) for name, a, b in chart.stages], chart.named)
    if any(one.name for one in chart.series):
        place: dict[str, Any] = {"ncols": 1 + (len(chart.series) > 4)}
        legend = axes.legend(
            title=chart.legend_title or None, title_fontsize=9, **(style.BESIDE if chart.beside else place)
        )
        for text in legend.get_texts():
            text.set_path_effects(HALO)


def _draw_errors(axes: Axes, x: Array, y: Array, share: Array, color: str) -> None:
    """Bars of the errors that are known; of more than all of a value down to next to nothing, on any axis."""
    size = np.where(np.isfinite(share), np.abs(share * y), 0.0)
    below = np.minimum(size, LEAST * np.abs(y))
    axes.errorbar(x, y, yerr=[below, size], fmt="none", ecolor=color, elinewidth=1.0, capsize=2.5, alpha=0.7)


def _with_bar(y: Array, share: Array | None) -> Array:
    """The upper ends of bars of errors; those of more than all of a value may leave the picture."""
    return y if share is None else y * (1.0 + np.where(np.isfinite(share), np.minimum(share, 1.0), 0.0))


def _shown(values: Array, log: bool) -> Array:
    """Without what a logarithmic axis cannot show."""
    return np.where(values > 0.0, values, np.nan) if log else np.asarray(values, dtype=float)


def _scale(axes: Axes, which: str, series: Sequence[Array], log: bool) -> None:
    """Few ticks, so that their labels do not touch; room around a single value."""
    values = np.concatenate([one[np.isfinite(one)] for one in series])
    axis, limit = (axes.xaxis, axes.set_xlim) if which == "x" else (axes.yaxis, axes.set_ylim)
    if log and values.size and values.min() == values.max():
        limit(0.5 * values[0], 1.5 * values[0])
        axis.set_ticks([values[0]], [f"{values[0]:.{units.DIGITS}g}"])
    elif log and values.size:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
        axis.set_major_locator(LogLocator(numticks=5))
        axis.set_minor_formatter(NullFormatter())
        if values.max() < 30.0 * values.min():  # hardly a decade
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))


def _below_spike(xs: Sequence[Array], ys: Sequence[Array]) -> float:
    """Where a picture ends that leaves out what stands out in the first moments only; inf where nothing does."""
    start, end = min(np.nanmin(x) for x in xs), max(np.nanmax(x) for x in xs)
    early = [x <= start + SPIKE_SHARE * (end - start) for x in xs]
    rest = max(_highest(y[~first]) for y, first in zip(ys, early, strict=True))
    return 1.25 * rest if end > start and rest > 0.0 and max(map(_highest, ys)) > SPIKE_HEIGHT * rest else math.inf


def _highest(values: Array) -> float:
    """The highest of what is positive and known."""
    return float(values[np.isfinite(values)].max(initial=0.0))


def _tell_peak(axes: Axes, x: Array, y: Array, unit: str) -> None:
    """The highest point of a line, if it is inside and the line has come down from it."""
    size = np.where(np.isfinite(x * y), np.abs(y), 0.0)
    peak = int(np.argmax(size))
    if 0 < peak < size.size - 1 and size[peak] > 1.02 * size[-1]:
        axes.plot(x[peak], y[peak], "o", color=style.RED)
        share = (x[peak] - np.nanmin(x)) / (float(np.ptp(x[np.isfinite(x)])) or 1.0)
        side = "left" if share < 0.4 else "center" if share < 0.6 else "right"
        below, aside = y[peak] < 0.0, {"left": 6, "center": 0, "right": -6}[side]
        told = f"{y[peak]:.3g} at {x[peak]:.3g} {unit}".rstrip()
        look: dict[str, Any] = {"ha": side, "va": "top" if below else "bottom", "color": style.RED, "fontsize": 9}
        look["path_effects"] = HALO
        axes.annotate(told, (x[peak], y[peak]), (aside, -5 if below else 5), textcoords="offset points", **look)
        low, high = axes.get_ylim()
        room = 0.15 * (high - low)
        axes.set_ylim(low - room * below, high + room * (not below))


def _mark(axes: Axes, stages: Sequence[tuple[str, float, float]], named: bool) -> None:
    """Show where stages begin, and their names above: on several levels where they would touch, else turned."""
    for _, start, _ in stages[1:]:
        axes.axvline(start, color=style.GREY, lw=0.8, ls=":", zorder=0)
    if not named or len(stages) < 2:
        return
    width = _panel_width(axes) * AXES_SHARE
    middles = [width * share for share in _shares(axes, stages)]
    levels = _levels([(x, _width(name)) for (name, *_), x in zip(stages, middles, strict=True)])
    turned = max(levels) >= LEVELS
    if turned:
        names = sorted(sorted(range(len(stages)), key=lambda k: stages[k][1] - stages[k][2])[: int(width / LINE)])
        stages, levels = [stages[k] for k in names], [0] * len(names)
        middles = _spread([middles[k] for k in names], width)
    look: dict[str, Any] = {"ha": "center", "va": "bottom", "color": style.GREY, "fontsize": NAMES}
    for (name, *_), x, level in zip(stages, middles, levels, strict=True):
        place: dict[str, Any] = {
            "xycoords": "axes fraction",
            "textcoords": "offset points",
            "rotation": 90 if turned else 0,
        }
        axes.annotate(style.plain(name, MAX_NAME), (x / width, 1.0), (0, 2 + LINE * level), **place, **look)


def _panel_width(axes: Axes) -> float:
    """Of the panel of axes, with what is beside them [points]."""
    place = axes.get_subplotspec()
    return 72.0 * axes.figure.bbox.width / axes.figure.dpi / (place.get_gridspec().ncols if place else 1)


def _width(name: str) -> float:
    """Of the name of a stage, with a blank [points]."""
    return float(TextPath((0, 0), style.plain(name, MAX_NAME), size=NAMES).get_extents().width) + NAMES / 2


def _shares(axes: Axes, stages: Sequence[tuple[str, float, float]]) -> list[float]:
    """Where the middles of stages are, from 0 at the left to 1 at the right."""
    log = axes.get_xscale() == "log"
    low, high = axes.get_xlim()
    edges = np.clip([stage[1:] for stage in stages], low, high)
    if log:
        edges, low, high = np.log10(edges), float(np.log10(low)), float(np.log10(high))
    return [float(share) for share in (edges.mean(axis=1) - low) / (high - low)]


def _spread(middles: Sequence[float], width: float) -> list[float]:
    """Places of turned names: as near to their stages as they may be without touching."""
    places = list(middles)
    for k in range(1, len(places)):
        places[k] = max(places[k], places[k - 1] + LINE)
    for k in reversed(range(len(places))):
        places[k] = min(places[k], width - LINE * (len(places) - 1 - k))
    return places


def _levels(texts: Sequence[tuple[float, float]]) -> list[int]:
    """The lowest levels on which texts of given middles and widths, in order, do not touch."""
    ends: list[float] = []
    levels = []
    for middle, width in texts:
        level = next((k for k, end in enumerate(ends) if end <= middle - width / 2), len(ends))
        ends[level : level + 1] = [middle + width / 2]
        levels.append(level)
    return levels


def compared(runs: Sequence[tuple[str, Sequence[Chart]]]) -> list[Chart]:
    """Charts of several runs: the same measures in one, the lines of each run in its colour, named after it."""
    found: dict[tuple[str, Axis, Axis], Chart] = {}
    for number, (name, charts) in enumerate(runs):
        for chart in charts:
            lines = [
                replace(
                    one,
                    name=", ".join(filter(None, (style.plain(name), one.name))),
                    look={**one.look, **_look(number, k)},
                )
                for k, one in enumerate(chart.series)
            ]
            key = chart.key, chart.x, chart.y
            known = found.get(key, replace(chart, series=(), stages=(), peak=False, legend_title=""))
            spikes, log_x = known.spikes and chart.spikes, known.log_x and chart.log_x
            found[key] = replace(known, series=(*known.series, *lines), spikes=spikes, log_x=log_x)
    return list(found.values())


def _look(run: int, part: int) -> dict[str, Any]:
    return {"color": style.COLORS[run % len(style.COLORS)], "linestyle": style.DASHES[(run + part) % len(style.DASHES)]}
