"""Pictures of a study: convergence with mesh and time step (as Fig. 6 of the paper), and error over cost."""

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

NAMES = {"mu_max": "largest friction", "mu_end": "friction in the end", "area_corrected": "contact area, corrected"}
MARKS = {"mesh and time together": "o-", "mesh with auto steps": "D-", "mesh alone": "s--", "time alone": "^:"}
INTEGRATORS = {"exponential": style.BLUE, "exponential-linear": style.GREEN, "backward-euler": style.RED}
BAND = 5.0  # ratio of the edges of the grey band
LEAST = 1e-7  # smallest error on the axis; smaller ones are drawn there


@dataclass(frozen=True)
class StudyCurve:
    """Errors of one quantity along one ladder of sizes (over the size of the box)."""

    quantity: str
    integrator: str
    ladder: str
    sizes: Sequence[float]
    errors: Sequence[float]


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
    panels = [partial(_draw_ladders, name=name, curves=found, doubt=doubts[name]) for name, found in own.items()]
    return style.figure_of("", [panels])


def _draw_ladders(axes: Axes, name: str, curves: Sequence[StudyCurve], doubt: float) -> None:
    """Draw errors of a quantity over the refinement of mesh or step with respect to the coarsest."""
    for curve in curves:
        x = [max(curve.sizes) / size for size in curve.sizes]
        label, color = f"{curve.ladder}, {curve.integrator}", INTEGRATORS[curve.integrator]
        axes.plot(x, _per_cent(curve.errors), MARKS[curve.ladder], color=color, label=label)
    axes.set(xscale="log", xlabel="refinement, coarsest = 1", ylabel=f"{NAMES[name]}:\nerror [%]")
    _scale_errors(axes, [error for curve in curves for error in curve.errors if math.isfinite(error)])
    if 0.0 < doubt < math.inf:  # grey up to the uncertainty of the reference
        low, high = axes.get_ylim()
        low = min(max(low, 100 * doubt / BAND), 100 * doubt)
        axes.axhspan(low, 100 * doubt, color="0.92", zorder=0)
        axes.set_ylim(low, max(high, 200 * doubt))
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(FixedLocator([2.0**k for k in range(-1, 12) if low <= 2.0**k <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


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
