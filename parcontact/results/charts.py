"""Charts of runs and curves.

Charts of runs and friction curves: their numbers, and how they are drawn.

The results of a run, for pictures.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis as AnyAxis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from .. import printed
from ..errors import InputError
from ..files.fields import UNITS
from ..files.hdf5 import MEND
from ..job import Job
from ..job.history import Timeline
from ..job.reading import RESOLVED, shown_job
from ..parallel.slab import Array
from . import style
from .results import Results

SPIKE_SHARE = 0.02  # first part of the abscissa, whose spikes do not set the limits
SPIKE_HEIGHT = 1.5  # least height of a spike over the highest other value
STAGE_WHITE = 0.87  # share of white in the shade of a stage
MARKERS = "os^DvP*X<>"  # marks of the lines of a run in a comparison
MARK_EVERY = 0.15  # distance of the marks of a line of many points, over the diagonal of a panel
PALEST = 0.75  # share of white in the bars of the longest waves in a comparison
MOST_EDGES = 7  # most labels of the bar of colours of bands
HEADROOM, PEAK_ROOM = 1.08, 1.25  # upper limit over the highest value, without and with its name in the legend
FRACTION = "contact area /\nnominal area"
BAR_SHARE = 0.8  # width of a bar over the distance of bars, in the logarithm
LEAST = 0.99  # largest downward error bar over the value
ZERO_ROW = 0.05  # height of the row of marks at 0, over the height of the panel
SAME = 1e-9  # rounding: relative difference of equal values on a logarithmic axis
FEW_DECADES = 1.5  # decades of a logarithmic axis below which minor ticks have labels


@dataclass(frozen=True)
class ChartLine:
    """A line: its name (or ''), values in SI units, and their relative errors if known; or bars, which stand on those
    before in the same `stack`. A line without values is an entry of the legend only."""

    name: str
    x: Array
    y: Array
    look: dict[str, Any] = field(default_factory=lambda: style.line(0))
    error: Array | None = None
    stack: int | None = None


@dataclass(frozen=True)
class Axis:
    """The quantity of an axis and its SI unit."""

    name: str
    unit: str = ""


@dataclass(frozen=True)
class Chart:
    """A panel, chosen by its `key`.

    `spikes`: a spike at the beginning may be cut off. `stages`: names, starts and ends over `x`.
    `peak`: the legend names the highest point. `zeros`: label of values of 0 on a logarithmic axis. `edges` [m] are the
    longest and shortest waves of the bands of stacked bars, from the longest on, for a bar of colours.
    """

    key: str
    x: Axis
    y: Axis
    series: Sequence[ChartLine]
    bottom: bool = True
    spikes: bool = False
    peak: bool = False
    stages: Sequence[tuple[str, float, float]] = ()
    log_x: bool = False
    zeros: str = ""
    edges: Sequence[float] = ()


def draw(chart: Chart, axes: Axes, log: Sequence[str] = ()) -> None:
    """Draw a chart without its legend; `log` names its logarithmic axes, which are linear if there is no point for
    them."""
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
    _draw_bars(axes, series)
    if chart.edges:
        _draw_edges(axes, chart)
    for one in series:
        if one.stack is not None:
            continue
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
        style.label(axes.yaxis, chart.y.name, chart.y.unit)
    _mark_stages(axes, chart.stages)


def _draw_bars(axes: Axes, series: Sequence[ChartLine]) -> None:
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


def _draw_edges(axes: Axes, chart: Chart) -> None:
    """Draw the bar of colours of bands, with the waves between neighbouring bands."""
    colors = [one.look["color"] for one in chart.series if one.stack is not None]
    norm = BoundaryNorm(range(len(colors) + 1), len(colors))
    shown = range(0, len(chart.edges), -(-len(chart.edges) // MOST_EDGES))
    bar = axes.figure.colorbar(ScalarMappable(norm, ListedColormap(colors)), ax=axes, ticks=list(shown), aspect=15)
    bar.ax.set_yticklabels([printed.quantity(chart.edges[k], "m") for k in shown], fontsize=style.SMALL)
    bar.ax.minorticks_off()
    bar.ax.set_title("waves", fontsize=style.SMALL)
    axes.tick_params("x", labelsize=style.SMALL)  # the bar narrows the panel


def _drop_hidden_points(one: ChartLine, log_x: bool, log_y: bool) -> ChartLine:
    """Return a line without points that logarithmic axes cannot show."""
    x, y = np.asarray(one.x, dtype=float), np.asarray(one.y, dtype=float)
    there = np.isfinite(x) & ((x > 0.0) | (not log_x)) & ((y > 0.0) | (not log_y))
    return replace(one, x=np.where(there, x, np.nan), y=np.where(there, y, np.nan))


def _mark_zeros(axes: Axes, chart: Chart) -> None:
    """Mark zeros of the lines at the lower edge, with one row of marks per line."""
    label = chart.zeros  # one label for all lines
    for row, one in enumerate(one for one in chart.series if one.x.size):
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
        if unit == "s" and style.label_log_times(axis, name):
            return
        few = thin_log_ticks(axis)
    else:
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    if few:
        style.label(axis, name, unit)
    else:  # powers of ten need no prefix
        axis.set_label_text(f"{name} [{unit}]" if unit else name)


def thin_log_ticks(axis: AnyAxis) -> bool:
    """Set few ticks of a logarithmic axis; return True if it has few decades."""
    low, high = axis.get_view_interval()
    few = bool(high < 10.0**FEW_DECADES * low)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=5))
    axis.set_minor_formatter(NullFormatter())
    return few


def _set_limits(axes: Axes, chart: Chart, series: Sequence[ChartLine], log_x: bool) -> None:
    """Set limits that include 0 and error bars up to the value; cut off a spike, and print its height."""
    stacks = {one.stack for one in series} - {None}
    wholes = [np.sum([one.y for one in series if one.stack == stack], axis=0) for stack in stacks]
    ys = np.concatenate([*wholes, *(one.y for one in series)])
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
            label = f"↑ {printed.quantity(highest, chart.y.unit)}"
            axes.text(0.12, 0.97, label, transform=axes.transAxes, va="top", color=style.RED, fontsize=9)


def _highest(values: Array) -> float:
    """Return the highest positive value, or 0."""
    return float(values[np.isfinite(values)].max(initial=0.0))


def _name_peak(axes: Axes, one: ChartLine, unit: str) -> None:
    """Name the highest point of a line in the legend, if it is inside the range and the line falls after it."""
    height = np.nan_to_num(np.abs(one.y))
    at = int(np.argmax(height))
    if 0 < at < height.size - 1 and height[at] > 1.02 * height[-1]:
        label = f"{one.y[at]:.3g} at {printed.quantity(one.x[at], unit)}"
        axes.plot(one.x[at], one.y[at], "o", color=style.RED, label=label, scalex=False, scaley=False)


def _mark_stages(axes: Axes, stages: Sequence[tuple[str, float, float]]) -> None:
    """Shade several stages, each name in its colour, and mark their starts."""
    shown = [stage for stage in stages if stage[1] < stage[2]]
    names = list(dict.fromkeys(name for name, _, _ in shown))
    shades = dict(zip(names, style.sequence(len(names)), strict=True))
    limits = axes.get_xlim()
    for number, (name, start, end) in enumerate(shown if len(shown) > 1 else ()):
        axes.axvspan(start, end, color=style.mix(shades[name], STAGE_WHITE), lw=0, zorder=-1, label=name or None)
        if number:
            axes.axvline(start, color=style.GREY, lw=0.8, ls=":", zorder=0)
    axes.set_xlim(limits)


def hide_stages(chart: Chart) -> Chart:
    """Return a chart whose stages keep their colours, but have names that Matplotlib leaves out of legends."""
    return replace(chart, stages=[(f"_{name}", start, end) for name, start, end in chart.stages])


def compare(runs: Sequence[tuple[str, Sequence[Chart]]], least: int = 1) -> list[Chart]:
    """Return the charts that at least `least` of several runs have. The colour is the run; the lines of each run have
    marks, and bands are shares of its bar. If no run has several lines in a chart, each has its own dashes."""
    found: dict[tuple[str, Axis, Axis], list[tuple[int, Chart]]] = {}
    for number, (_, charts) in enumerate(runs):
        for chart in charts:
            found.setdefault((chart.key, chart.x, chart.y), []).append((number, chart))
    names = [name for name, _ in runs]
    lonely = all(len(chart.series) == 1 for group in found.values() for _, chart in group)
    merge = _merge_lonely if lonely else _merge
    return [_join(group, merge(group, names)) for group in found.values() if len(group) >= least]


def _join(group: Sequence[tuple[int, Chart]], series: Sequence[ChartLine]) -> Chart:
    charts = [chart for _, chart in group]
    spikes, log_x = (all(getattr(chart, name) for chart in charts) for name in ("spikes", "log_x"))
    return replace(charts[0], series=series, stages=(), peak=False, spikes=spikes, log_x=log_x, edges=())


def _merge_lonely(group: Sequence[tuple[int, Chart]], names: Sequence[str]) -> list[ChartLine]:
    """Return the only line of each run, with the colour and the dashes of the run."""
    lines = ((number, chart.series[0]) for number, chart in group)
    return [
        replace(
            one, name=", ".join(filter(None, (names[number], one.name))), look=one.look | style.line(number, len(names))
        )
        for number, one in lines
    ]


def _merge(group: Sequence[tuple[int, Chart]], names: Sequence[str]) -> list[ChartLine]:
    """Return all lines of the runs in a chart, and entries of the legend for the runs and for the names of lines."""
    colors, empty = style.colors(len(names)), np.zeros(0)
    whole = [one for _, chart in group for one in chart.series]
    marked = dict.fromkeys(one.name for one in whole if one.name and one.x.size and one.stack is None)
    marks = dict(zip(marked, itertools.cycle(MARKERS), strict=False)) if len(marked) > 1 else {}
    entries = [ChartLine(names[number], empty, empty, {"color": colors[number]}) for number, _ in group]
    for name, mark in marks.items():
        entries.append(ChartLine(name, empty, empty, {"color": style.GREY, "marker": mark, "linestyle": "none"}))
    entries += {one.name: one for one in whole if not one.x.size}.values()
    for number, chart in group:
        bars = sum(one.stack is not None for one in chart.series)
        for k, one in enumerate(chart.series):
            look = one.look | {"color": colors[number]}
            if one.stack is not None:
                look["color"] = style.mix(colors[number], PALEST * (1.0 - (k + 1) / bars))
            elif one.name in marks:
                few = "marker" in one.look
                look |= {"linestyle": "-", "marker": marks[one.name], **({} if few else {"markevery": MARK_EVERY})}
            entries.append(replace(one, name="", look=look, stack=None if one.stack is None else number))
    return entries


MEASURED = (
    *("step", "time", "distance", "pressure", "friction", "friction_x", "contact_area", "contact_area_corrected"),
    *("approach", "mean_gap", "max_pressure", "work", "stored", "dissipated"),
)
DIGITS = 6  # significant digits of values that count as equal
NEAREST = 3  # number of nearest steps with maps in a message


class PlottedRun(Results):
    """The job and the rows of a run, without the unloaded rows at the beginning."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory, "run")
        self.area = self.job.grid.lx * self.job.grid.ly  # of the box [m^2]
        self.free = self.job.grid.boundary == "free"
        self._all = self.table.arrays(MEASURED)
        if not self._all["step"].size:
            raise InputError(f"{directory} has no step yet")
        first = int(self._all["pressure"][0] == 0.0 and self._all["step"].size > 1)
        self.columns = {name: values[first:] for name, values in self._all.items()}
        self.lasts, self.slides = self._all["time"][-1] > 0.0, self._all["distance"][-1] > 0.0

    @cached_property
    def job(self) -> Job:
        """Job of the run."""
        return shown_job(self.path / RESOLVED)

    @property
    def load(self) -> tuple[Axis, Array]:
        return to_load(self.columns["pressure"], self.area * self.free)

    @property
    def in_contact(self) -> tuple[Axis, Array]:
        """Return the contact area corrected for cells at its edges."""
        return to_contact_area(self.columns["contact_area_corrected"], self.area * self.free)

    @property
    def backwards(self) -> bool:
        """Return True if the surface moves along x only and reverses, where the magnitude of friction would have a
        cusp."""
        velocities = [stage.velocity for stage in self.job.history]
        turns = any(stage.speed and not stage.slides for stage in self.job.history)
        return (turns or any(x < 0.0 for x, _ in velocities)) and not any(y for _, y in velocities)

    @property
    def curves(self) -> bool:
        """Return True if there is more than one solve, so that there is a history to draw."""
        return bool(self.lasts) or len(set(self.columns["pressure"])) > 1

    @cached_property
    def timeline(self) -> Timeline:
        """Return the stage of each step."""
        steps, times = self._all["step"].astype(int).tolist(), self._all["time"].tolist()
        return Timeline.from_job(self.job, times[-1]).follow(dict(zip(steps, times, strict=True)))

    @property
    def telling_step(self) -> int:
        """Return the step whose maps show the contact: the last one, or after a detachment the step of the pull-off or
        of the largest load."""
        return int(self._all["step"][self.telling_row])

    @property
    def rows_of_stages(self) -> dict[int, list[int]]:
        """Return the rows of each stage, by its index; the initial state belongs to the first stage."""
        found: dict[int, list[int]] = {}
        for row, step in enumerate(self.columns["step"].astype(int).tolist()):
            if (stage := self._stage(step)) >= 0:
                found.setdefault(stage, []).append(row)
        return found

    def _stage(self, step: int) -> int:
        """Return the stage of a step, -1 if the job does not have this step."""
        step = max(step, 1)
        return self.timeline.span(step).index if step <= len(self.timeline) else -1

    def instant(self, step: int, time: float) -> str:
        """Return time and load of a saved map as text: `2.1 ms, 100 kPa`, `150 mN`, `2.1 ms, approach 20 µm`."""
        when = printed.quantity(time, "s", 4) if self.lasts else ""
        return ", ".join(filter(None, (when, self.pressed(step))))

    def pressed(self, step: int) -> str:
        """Return the load after a step as text, as its stage prescribes it; '' if the step has no row."""
        rows, stage = np.flatnonzero(self._all["step"] == step), self._stage(step)
        if not rows.size:
            return ""
        if stage >= 0 and self.job.history[stage].control == "approach":
            return f"approach {printed.quantity(self._all['approach'][rows[-1]], 'm')}"
        axis, loads = to_load(self._all["pressure"], self.area * self.free)
        return printed.quantity(loads[rows[-1]], axis.unit)

    def name_stage(self, step: int) -> str:
        """Return the name of the stage of a step; '' if it has none."""
        stage = self._stage(step)
        name = self.job.history[stage].name if stage >= 0 else ""
        return "" if name == f"stage {stage + 1}" else name

    def moved(self, step: int) -> tuple[float, float]:
        """Return the position of the surface after a step [m]; the initial one if the job does not have this step."""
        return self.timeline[step].position if 1 <= step <= len(self.timeline) else (0.0, 0.0)


class Fields:
    """The saved maps of a run: `shown` are the instants to draw, `chosen` is the one whose maps are drawn (default: the
    last).

    `at` is a step (a whole number), whose maps must be saved, or a time [s], for which the nearest maps are taken.
    """

    def __init__(self, file: h5py.File, at: str = "", until: int | None = None) -> None:
        self.file = file
        self.steps: NDArray[np.int64] = file["step"][...]
        self.x, self.y = file["x"][...], file["y"][...]
        self.times: Array = file["t"][...]
        lengths = self.times.shape, self.y.shape, self.x.shape
        maps = [file[name] for name in UNITS if name in file]
        if self.steps.shape != lengths[0] or any(one.shape != sum(lengths, ()) for one in maps):
            raise InputError(f"{file.filename} is damaged: the numbers of its maps and coordinates differ; {MEND}")
        self.saved = np.flatnonzero(~np.isnan(self.times)).tolist()
        self.shown = [self._index(at)] if at else self.saved
        before = [k for k in self.shown if until is None or self.steps[k] <= until]
        self.chosen = (before or self.shown or [-1])[-1]

    def read(self, name: str) -> Array | None:
        """Return the named map at the chosen instant, or None."""
        field = self.file[name][self.chosen] if name in self.file and self.shown else None
        return field if field is not None and np.isfinite(field).all() else None

    def _index(self, at: str) -> int:
        """Return the index of the instant `at`; raises InputError if no map is saved then."""
        if not self.saved:
            raise InputError(f"--at {at}: no map is saved yet")
        steps, times = self.steps[self.saved], self.times[self.saved]
        if not at.isdecimal() and not times[0] <= float(at) <= times[-1]:
            raise InputError(f"--at {at}: maps are saved from {times[0]:g} to {times[-1]:g} s")
        order = np.argsort(np.abs(steps - int(at) if at.isdecimal() else times - float(at)), kind="stable")
        if at.isdecimal() and int(at) not in steps:
            near = ", ".join(map(str, sorted(steps[order[:NEAREST]])))
            raise InputError(f"--at {at}: no map is saved after step {at}; the nearest steps with maps are {near}")
        return int(self.saved[order[0]])


def choose_evenly(labels: dict[int, str], most: int) -> dict[int, str]:
    """Return at most `count` evenly spaced instants, including the first and the last."""
    indices = list(labels)
    kept = np.linspace(0, len(indices) - 1, min(len(indices), most)).astype(int)
    return {indices[k]: labels[indices[k]] for k in kept}


def label_frames(run: PlottedRun, file: h5py.File) -> dict[int, str]:
    """Return time and load of each map of a run as text, by its index."""
    fields = Fields(file)
    saved = ((k, int(fields.steps[k]), float(fields.times[k])) for k in fields.saved)
    return {k: f"{run.instant(step, time)} (step {step})".lstrip() for k, step, time in saved}


def round_digits(values: Array) -> Array:
    """Return values that count as equal as equal numbers."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def count_different(values: Array) -> int:
    """Return the number of values that differ by more than rounding."""
    return np.unique(round_digits(values)).size


def to_load(pressure: Array, area: float) -> tuple[Axis, Array]:
    """Return the load: the force on the box of a free scene of area `box` [m^2], else the mean pressure."""
    return (Axis("force", "N"), pressure * area) if area else (Axis("pressure", "Pa"), pressure)


def to_contact_area(fraction: Array, area: float) -> tuple[Axis, Array]:
    """Return the contact area of a free scene, whose box has this area, else the nominal fraction."""
    return (Axis("contact area", "m²"), fraction * area) if area else (Axis(FRACTION), fraction)
