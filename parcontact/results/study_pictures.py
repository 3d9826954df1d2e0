"""Picture of a study: errors over the refinement of mesh and time step (as Fig. 6 of the paper), and over time."""

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
from . import style

NAMES = {"mu_max": "largest friction", "mu_dyn": "dynamic friction", "contact_area_corrected": "contact area"}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "D-", "mesh alone": "s--", "time alone": "^:"}
INTEGRATORS = {"exponential": style.BLUE, "exponential-linear": style.GREEN, "backward-euler": style.RED}
WIDE = 100.0  # ratio of the longest to the shortest time above which only powers of ten are labelled
BAND = 5.0  # ratio of the edges of the grey band
LEAST = 1e-7  # smallest error on the axis; smaller ones are drawn there


@dataclass(frozen=True)
class StudyCurve:
    """Errors of one quantity along one ladder of sizes (over the size of the box), and times of all steps [s]."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]
    seconds: Sequence[float]

    def draw(self, axes: Axes, x: Sequence[float]) -> None:
        label, color = f"{self.ladder}, {self.integrator}", INTEGRATORS[self.integrator]
        axes.plot(x, _per_cent(self.errors), MARKS[self.ladder], color=color, label=label)


def plot_study(directory: Path, curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Path | None:
    """Draw `convergence.png` and return its path; None if nothing is refined.

    `doubts` are the relative uncertainties of the references; errors below them are in grey bands.
    """
    drawn = [curve for curve in curves if any(0.0 < error < math.inf for error in curve.errors)]
    if not drawn:
        return None
    with style.drawing():
        return style.save_figure(_convergence(drawn, doubts), directory / "convergence.png")


def _convergence(curves: Sequence[StudyCurve], doubts: Mapping[str, float]) -> Figure:
    own: dict[str, list[StudyCurve]] = {}
    for curve in curves:
        own.setdefault(curve.quantity, []).append(curve)
    panels = [
        partial(draw, name=name, curves=found, doubt=doubts[name])
        for name, found in own.items()
        for draw in (_draw_ladders, _draw_times)
    ]
    return style.figure_of("", [panels])


def _draw_ladders(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over the refinement of mesh or step with respect to the coarsest."""
    for curve in curves:
        curve.draw(axes, [max(curve.sizes) / size for size in curve.sizes])
    axes.set(xscale="log", xlabel="refinement, coarsest = 1", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, curves, doubt)
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


def _draw_times(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over the time of all steps."""
    for curve in curves:
        curve.draw(axes, curve.seconds)
    axes.set(xscale="log", xlabel="time of all steps [s]", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, curves, doubt)
    few = max(axes.get_xlim()) < WIDE * min(axes.get_xlim())
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=5))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _scale_errors(axes: Axes, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Set a logarithmic axis of errors [%], of at least a decade, with few ticks; grey up to the uncertainty `doubt` of
    the reference."""
    errors = [error for curve in curves for error in curve.errors if math.isfinite(error)]
    low, high = _per_cent(errors).min(), _per_cent(errors).max()
    middle, half = math.sqrt(low * high), max((high / low) ** 0.62, math.sqrt(10.0))
    axes.set_ylim(middle / half, middle * half)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if half < 10.0 else (1.0,), numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    if 0.0 < doubt < math.inf:
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))


def _per_cent(errors: Sequence[float]) -> Array:
    return 100 * np.maximum(errors, LEAST)
