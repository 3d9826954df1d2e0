"""Pictures of a study: how errors fall with mesh and time (the paper's Fig. 6), and what accuracy costs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import files
from .pictures.style import drawing, save

TITLES = {
    "mu_max": "largest friction",
    "mu_dyn": "friction in the end",
    "area": "contact area, counted",
    "area_corrected": "contact area, corrected",
}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "o-", "mesh alone": "s--", "time alone": "^:"}
COLOURS = {"exponential": "C0", "backward-euler": "C1"}
ALIKE = 1.01  # ratio of errors below which one number is all that their axis has to show
BAND = 5.0  # times the upper edge of the grey band over its lower one
LEAST = 1e-7  # smaller errors are drawn here
FALL = 0.7  # of the error from one corner of the front to the next that is named


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
    pictures = []
    with drawing({}):
        if drawn := [curve for curve in curves if any(error > 0.0 for error in curve.errors)]:
            pictures.append(_convergence(directory / "convergence.png", drawn, doubts))
        pictures.append(_work_precision(directory / "work_precision.png", points))
    return pictures


def _convergence(path: Path, curves: Sequence[Curve], doubts: Mapping[str, float]) -> Path:
    from matplotlib.figure import Figure  # slow to import, and for pictures only

    quantities = list(dict.fromkeys(curve.quantity for curve in curves))
    figure = Figure(figsize=(4.3 * len(quantities), 4.2), layout="constrained")
    for axes, quantity in zip(figure.subplots(1, len(quantities), squeeze=False)[0], quantities, strict=True):
        for curve in (curve for curve in curves if curve.quantity == quantity):
            coarsest = max(curve.sizes)
            x = [coarsest / size for size in curve.sizes]
            y = [100 * max(error, LEAST) for error in curve.errors]
            style, colour = MARKS[curve.ladder], COLOURS[curve.integrator]
            axes.plot(x, y, style, color=colour, ms=4, label=f"{curve.ladder}, {curve.integrator}")
        axes.set(xscale="log", yscale="log", title=TITLES[quantity], xlabel="refinement, coarsest = 1")
        axes.grid(alpha=0.3)
        _shade(axes, doubts[quantity])
        _plain_ticks(axes)
    first = figure.axes[0]
    first.set_ylabel("error [%]")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    with files.replaced(path, files.is_marked) as file:
        save(figure, file, dpi=150)
    return path


def _shade(axes: Any, doubt: float) -> None:
    """Grey from below up to what is not known of the reference."""
    if doubt > 0.0:
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))


def _plain_ticks(axes: Any) -> None:
    """Refinements and per cents as numbers that one reads at once."""
    from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())
    _per_cents(axes)


def _per_cents(axes: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _work_precision(path: Path, points: Mapping[str, Sequence[Point]]) -> Path:
    from matplotlib.figure import Figure  # slow to import, and for pictures only

    drawn = {name: found for name, found in points.items() if any(not math.isnan(one.error) for one in found)}
    figure = Figure(figsize=(4.6 * max(len(drawn), 1), 8.0), layout="constrained")
    grid = figure.subplots(2, max(len(drawn), 1), squeeze=False)
    costs = (("work", "transforms x N log2 N"), ("seconds", "CPU time [s]"))
    for column, (quantity, found) in enumerate(drawn.items()):
        for row, (cost, label) in enumerate(costs):
            axes = grid[row][column]
            axes.set(xscale="log", yscale="log", xlabel=label)
            errors = [error for error in _places(found, cost)[1] if math.isfinite(error)]
            if max(errors) < ALIKE * min(errors):
                axes.set_ylim(0.5 * min(errors), 2.0 * max(errors))
            for integrator, colour in COLOURS.items():
                if mine := [one for one in found if one.integrator == integrator]:
                    axes.scatter(*_places(mine, cost), s=14, color=colour, label=integrator)
            axes.grid(alpha=0.3)
            axes.margins(x=0.22, y=0.08)
            _per_cents(axes)
        best = sorted((one for one in found if one.best), key=lambda one: one.work)
        grid[0][column].plot(*_places(best, "work"), "-", color="0.4", lw=1.0, zorder=0)
        _name_corners(grid[0][column], best)
        grid[0][column].set_title(TITLES[quantity])
    for row in range(2):
        grid[row][0].set_ylabel("error [%]")
    grid[0][0].legend(frameon=False, fontsize=8, loc="upper right")
    with files.replaced(path, files.is_marked) as file:
        save(figure, file, dpi=150)
    return path


def _places(points: Sequence[Point], cost: str) -> tuple[list[float], list[float]]:
    return [getattr(one, cost) for one in points], [100 * max(one.error, LEAST) for one in points]


def _name_corners(axes: Any, best: Sequence[Point]) -> None:
    """The settings of the front beside it, wherever the error has fallen to FALL of that named before."""
    named = math.inf
    for one in best:
        if one.error > FALL * named:
            continue
        named = one.error
        place = one.work, 100 * max(one.error, LEAST)
        axes.annotate(one.settings, place, xytext=(5, 3), textcoords="offset points", fontsize=6)
