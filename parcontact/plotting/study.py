"""Pictures of a study: how errors fall with mesh and time (the paper's Fig. 6), and what accuracy costs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator, ScalarFormatter

from ..storage import files
from . import layout, style

NAMES = {"mu_max": "largest friction", "mu_dyn": "friction in the end", "area_corrected": "contact area, corrected"}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "o-", "mesh alone": "s--", "time alone": "^:"}
INTEGRATORS = ("exponential", "backward-euler")
COSTS = {"work": "transforms × N log₂ N", "seconds": "CPU time [s]"}
BAND = 5.0  # times the upper edge of the grey band over its lower one
LEAST = 1e-7  # smaller errors are drawn here
FALL = 0.7  # of the error from one corner of the front to the next that is numbered
KEY = "mesh, cells per step, tolerance, precision"


@dataclass(frozen=True)
class Curve:
    """Errors of one quantity along one ladder; sizes over that of the box."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]


@dataclass(frozen=True)
class Point:
    """One case: what it cost, its error, its settings, and whether it is on the front."""

    work: float
    seconds: float
    error: float
    integrator: str
    settings: str
    best: bool


def plot(
    directory: Path, curves: Sequence[Curve], points: Mapping[str, Sequence[Point]], doubts: Mapping[str, float]
) -> list[Path]:
    """Draw `convergence.png`, if anything is refined, and `work_precision.png`; returns their paths.

    `doubts` are the relative uncertainties of the references, shown as grey bands: what lies in them is not known.
    """
    drawn = [curve for curve in curves if any(0.0 < error < math.inf for error in curve.errors)]
    with style.drawing():
        figures = {"convergence.png": _convergence(drawn, doubts)} if drawn else {}
        figures["work_precision.png"] = _work_precision(points)
        for name, figure in figures.items():
            with files.replaced(directory / name, files.is_marked) as file:
                style.save(figure, file)
    return [directory / name for name in figures]


def _convergence(curves: Sequence[Curve], doubts: Mapping[str, float]) -> Figure:
    quantities = list(dict.fromkeys(curve.quantity for curve in curves))
    own = {name: [curve for curve in curves if curve.quantity == name] for name in quantities}
    panels = [partial(_draw_ladders, name=name, curves=own[name], doubt=doubts[name]) for name in quantities]
    return layout.figure_of("", [[panel] for panel in panels], legend=True)


def _draw_ladders(axes: Axes, name: str, curves: Sequence[Curve], doubt: float) -> None:
    """Errors of a quantity over how many times as fine a mesh or a step is as the coarsest."""
    for curve in curves:
        x = [max(curve.sizes) / size for size in curve.sizes]
        label, color = f"{curve.ladder}, {curve.integrator}", _color(curve.integrator)
        axes.plot(x, _per_cent(curve.errors), MARKS[curve.ladder], color=color, label=label)
    axes.set(xscale="log", xlabel="refinement, coarsest = 1", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, _per_cent([error for curve in curves for error in curve.errors if math.isfinite(error)]))
    _shade(axes, doubt)
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


def _shade(axes: Axes, doubt: float) -> None:
    """Grey from below up to what is not known of the reference."""
    if 0.0 < doubt < math.inf:
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))


def _work_precision(points: Mapping[str, Sequence[Point]]) -> Figure:
    """A row for each quantity that is known, over both costs; the settings behind numbers are named below."""
    known = {name: [one for one in found if math.isfinite(one.error)] for name, found in points.items()}
    known = {name: found for name, found in known.items() if found}
    numbers: dict[str, int] = {}
    for found in known.values():
        for one in _corners(found):
            numbers.setdefault(one.settings, len(numbers) + 1)
    groups = [
        [partial(_draw_points, name=name, points=found, cost=cost, numbers=numbers) for cost in COSTS]
        for name, found in known.items()
    ]
    figure = layout.figure_of("", groups, legend=True)
    figure.set_figheight(figure.get_figheight() + layout.LEGEND_LINE * (2 + (len(numbers) + 1) // 2))
    named = [f"{number}: {settings}" for settings, number in numbers.items()]
    blank = [Rectangle((0, 0), 0, 0, alpha=0.0) for _ in named]
    figure.legend(blank, named, loc="outside lower center", ncols=2, title=KEY, handlelength=0, handletextpad=0)
    return figure


def _draw_points(axes: Axes, name: str, points: Sequence[Point], cost: str, numbers: Mapping[str, int]) -> None:
    """Errors of a quantity over one cost; over the work with the front and its numbers."""
    for integrator in INTEGRATORS:
        if mine := [one for one in points if one.integrator == integrator]:
            axes.plot(*_places(mine, cost), "o", color=_color(integrator), label=integrator)
    if cost == "work":
        best = sorted((one for one in points if one.best), key=lambda one: one.work)
        axes.plot(*_places(best, cost), "-", color="0.4", lw=1.0, zorder=0)
        for one in _corners(points):
            place = one.work, _per_cent([one.error])[0]
            look: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "va": "top", "fontsize": 9}
            axes.annotate(str(numbers[one.settings]), place, xytext=(-2, -2), **look)
    axes.set(xscale="log", xlabel=COSTS[cost])
    if cost == "work":
        axes.set_ylabel(f"{NAMES[name]}:\nerror [%]")
    axes.margins(x=0.1)
    _scale_errors(axes, _per_cent([one.error for one in points]))


def _corners(points: Sequence[Point]) -> list[Point]:
    """Those of the front whose error has fallen to FALL of that of the corner before."""
    corners: list[Point] = []
    for one in sorted((one for one in points if one.best), key=lambda one: one.work):
        if not corners or max(one.error, LEAST) <= FALL * corners[-1].error:
            corners.append(one)
    return corners


def _scale_errors(axes: Axes, errors: Sequence[float]) -> None:
    """A logarithmic axis of errors [%], of at least a decade, with few ticks."""
    low, high = min(errors), max(errors)
    middle, half = math.sqrt(low * high), max((high / low) ** 0.62, math.sqrt(10.0))
    axes.set_ylim(middle / half, middle * half)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if half < 10.0 else (1.0,), numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _per_cent(errors: Sequence[float]) -> list[float]:
    return [100 * max(error, LEAST) for error in errors]


def _places(points: Sequence[Point], cost: str) -> tuple[list[float], list[float]]:
    return [getattr(one, cost) for one in points], _per_cent([one.error for one in points])


def _color(integrator: str) -> str:
    return style.COLORS[INTEGRATORS.index(integrator)]
