"""A picture of a rigid surface: its map, the distribution of its heights, and its spectra with the grid's limits."""

from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..parallel.slab import Array
from ..road.statistics import Statistics
from . import style
from .units import labelled, scaled

BINS = 60
RESOLVED = 8  # cells that a wave needs to be resolved in a contact
COARSEST = 800  # points of a map along a side: a finer one is drawn from every second, third, ... point


@dataclass(frozen=True)
class Sketch:
    """Heights [m] of shape (ny, nx) on a box of `size` [m], and what they are like; `measured` has the spectrum of the
    map that they come from, if they do."""

    heights: Array
    size: tuple[float, float]
    found: Statistics
    measured: Statistics | None = None


def draw(sketch: Sketch, file: BinaryIO, kind: str) -> None:
    """Write the picture, a png, pdf or svg."""
    with style.drawing():
        figure = Figure(figsize=(style.WIDTH, 2 * style.HEIGHT), layout="constrained")
        for axes, panel in zip(figure.subplots(2, 2).ravel(), PANELS.values(), strict=True):
            panel(axes, sketch)
        style.save(figure, file, kind)


def _map(axes: Axes, sketch: Sketch) -> None:
    ny, nx = sketch.heights.shape
    step = max(1, -(-max(nx, ny) // COARSEST))
    unit, (heights,) = scaled("m", sketch.heights[::step, ::step])
    length, (size,) = scaled("m", np.array(sketch.size))
    image = axes.imshow(heights, origin="lower", extent=(0.0, size[0], 0.0, size[1]), cmap="cividis", aspect="auto")
    axes.figure.colorbar(image, ax=axes, label=labelled("height", unit))
    axes.grid(False)
    axes.set(xlabel=labelled("x", length), ylabel=labelled("y", length))


def _distribution(axes: Axes, sketch: Sketch) -> None:
    unit, (heights,) = scaled("m", sketch.heights.ravel() - sketch.heights.mean())
    axes.hist(heights, bins=BINS, density=True, color=style.BLUE, alpha=0.6, label="heights")
    rms = float(heights.std())
    if rms > 0.0:
        x = np.linspace(-4 * rms, 4 * rms, 200)
        axes.plot(x, np.exp(-0.5 * (x / rms) ** 2) / (rms * np.sqrt(2 * np.pi)), color=style.RED, label="normal")
    axes.set(xlabel=labelled("height over mean", unit), ylabel=f"density [1/{unit}]")
    axes.margins(y=0.45)
    axes.legend(loc="upper right")


def _limits(axes: Axes, sketch: Sketch) -> None:
    cell = max(length / n for length, n in zip(sketch.size, sketch.heights.shape[::-1], strict=True))
    axes.axvline(2 * np.pi / (RESOLVED * cell), color=style.GREY, ls=":", label=f"{RESOLVED} cells")
    axes.axvline(np.pi / cell, color=style.GREY, ls="--", label="2 cells")


def _profiles(axes: Axes, sketch: Sketch) -> None:
    found = sketch.found
    for number, (name, q, psd) in enumerate((("x", found.qx, found.psd_x), ("y", found.qy, found.psd_y))):
        axes.plot(q[psd > 0.0], psd[psd > 0.0], label=f"along {name}", **style.line(number))
    _limits(axes, sketch)
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [1/m]", ylabel="PSD of profiles [m³]")
    axes.legend(loc="lower left", fontsize=8)


def _over_directions(axes: Axes, sketch: Sketch) -> None:
    if sketch.measured is not None:
        seen = sketch.measured.psd_2d > 0.0
        axes.plot(sketch.measured.q[seen], sketch.measured.psd_2d[seen], label="measured", **style.line(1))
    seen = sketch.found.psd_2d > 0.0
    axes.plot(sketch.found.q[seen], sketch.found.psd_2d[seen], label="on the grid", **style.line(0))
    _limits(axes, sketch)
    axes.set(xscale="log", yscale="log", xlabel="wavenumber [1/m]", ylabel="PSD over directions [m⁴]")
    axes.legend(loc="lower left", fontsize=8)


PANELS = {
    "map of the heights": _map,
    "distribution of the heights": _distribution,
    "spectra of profiles": _profiles,
    "spectrum over directions": _over_directions,
}
