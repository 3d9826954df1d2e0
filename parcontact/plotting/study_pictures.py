"""Pictures of a study: how errors fall with mesh and time (the paper's Fig. 6), and what accuracy costs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator, ScalarFormatter

from ..parallel.slab import Array
from . import charts, style

NAMES = {"mu_max": "largest friction", "mu_end": "friction in the end", "area_corrected": "contact area, corrected"}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "o-", "mesh alone": "s--", "time alone": "^:"}
INTEGRATORS = {"exponential": style.BLUE, "exponential-linear": style.GREEN, "backward-euler": style.RED}
COSTS = {"work": "transforms × N log₂ N", "seconds": "CPU time"}
BAND = 5.0  # times the upper edge of the grey band over its lower one
LEAST = 1e-7  # smaller errors are drawn here


@dataclass(frozen=True)
class StudyCurve:
    """Errors of one quantity along one ladder; sizes over that of the box."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]


@dataclass(frozen=True)
class StudyPoint:
    """One case: its work, its time [s], its relative error, and whether none is both cheaper and more accurate."""

    work: float
    seconds: float
    error: float
    integrator: str
    best: bool


def plot_study(
    directory: Path,
    curves: Sequence[StudyCurve],
    points: Mapping[str, Sequence[StudyPoint]],
    doubts: Mapping[str, float],
) -> list[Path]:
    """Draw `convergence.png`, if anything is refined, and `work_precision.png`; returns their paths.

    `doubts` are the relative uncertainties of the references, shown as grey bands: what lies in them is not known.
    """
    drawn = [curve for curve in curves if any(0.0 < error < math.inf for error in curve.errors)]
    with style.drawing():
        figures = {"convergence.png": _convergence(drawn, doubts)} if drawn else {}
        figures["work_precision.png"] = _work_precision(points)
        return [style.save_figure(figure, directory / name) for name, figure in figures.items()]


def _convergence(curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Figure:
    own: dict[str, list[StudyCurve]] = {}
    for curve in curves:
        own.setdefault(curve.quantity, []).append(curve)
    panels = [partial(_draw_ladders, name=name, curves=found, doubt=doubts[name]) for name, found in own.items()]
    return style.figure_of("", [[panel] for panel in panels], legend=True)


def _draw_ladders(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over how many times as fine a mesh or a step is as the coarsest."""
    for curve in curves:
        x = [max(curve.sizes) / size for size in curve.sizes]
        label, color = f"{curve.ladder}, {curve.integrator}", INTEGRATORS[curve.integrator]
        axes.plot(x, _per_cent(curve.errors), MARKS[curve.ladder], color=color, label=label)
    axes.set(xscale="log", xlabel="refinement, coarsest = 1", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, [error for curve in curves for error in curve.errors if math.isfinite(error)])
    if 0.0 < doubt < math.inf:  # grey from below up to what is not known of the reference
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


def _work_precision(points: Mapping[str, Sequence[StudyPoint]]) -> Figure:
    """Draw a row for each quantity that is known, over both costs; study.csv has the settings of the points."""
    known = {name: [one for one in found if math.isfinite(one.error)] for name, found in points.items()}
    groups = [
        [partial(_draw_points, name=name, points=found, cost=cost) for cost in COSTS]
        for name, found in known.items()
        if found
    ]
    return style.figure_of("", groups, legend=True)


def _draw_points(axes: Axes, name: str, points: Sequence[StudyPoint], cost: str) -> None:
    """Draw errors of a quantity over one cost; over the work with a line through the best points."""
    for integrator, color in INTEGRATORS.items():
        mine = [one for one in points if one.integrator == integrator]
        if mine:
            axes.plot(*_places(mine, cost), "o", color=color, label=integrator)
    if cost == "work":
        front = sorted((one for one in points if one.best), key=lambda one: one.work)
        axes.plot(*_places(front, cost), "-", color=style.GREY, lw=1.0, zorder=0)
        axes.set_ylabel(f"{NAMES[name]}:\nerror [%]")
    axes.margins(x=0.1)
    charts.set_scale(axes, "x", COSTS[cost], "s" if cost == "seconds" else "", log=True)
    _scale_errors(axes, [one.error for one in points])


def _scale_errors(axes: Axes, errors: Sequence[float]) -> None:
    """Set a logarithmic axis of errors [%], of at least a decade, with few ticks."""
    low, high = _per_cent(errors).min(), _per_cent(errors).max()
    middle, half = math.sqrt(low * high), max((high / low) ** 0.62, math.sqrt(10.0))
    axes.set_ylim(middle / half, middle * half)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if half < 10.0 else (1.0,), numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _per_cent(errors: Sequence[float]) -> Array:
    return 100 * np.maximum(errors, LEAST)


def _places(points: Sequence[StudyPoint], cost: str) -> tuple[list[float], Array]:
    return [getattr(one, cost) for one in points], _per_cent([one.error for one in points])
