"""`parcontact surface`: sentences and picture of a rigid surface.

Sentences and picture of the rigid surface of a job, for `parcontact surface`.

Picture of a rigid surface: its map, the distribution of its heights, and its spectra with the limits of the grid.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .. import printed
from ..errors import InputError
from ..files import hdf5
from ..job import Job, Topography, map_files, measured_maps
from ..job.measured_maps import prepare
from ..parallel.slab import Array
from ..physics import surface_statistics
from ..physics.surface_statistics import Statistics
from ..printed import per_cent, quantity, with_error
from . import charts, style

BINS = 60
FEW, OUTLYING = (1e-3, 1.5)  # share of outlying points on either side, and the drawn range over the range of the others
RESOLVED = 8  # cells of a wave that is resolved in a contact
COARSEST = 800  # most points of the drawn map along a side
ROUNDING = 1e-20  # rounding: smallest drawn power over the largest


@dataclass(frozen=True)
class Sketch:
    """Heights [m] of shape (ny, nx) on a box of `size` [m], with their statistics; `measured` is the spectrum of the
    original map, if any."""

    heights: Array
    size: tuple[float, float]
    found: Statistics
    measured: Statistics | None = None


def draw_surface(sketch: Sketch, path: Path) -> None:
    """Write the picture, a png, pdf or svg; raises OSError."""
    with style.drawing():
        figure = style.figure_of("", [[partial(panel, sketch=sketch) for panel in PANELS.values()]])
        style.save_figure(figure, path, path.suffix[1:])


def _draw_map(axes: Axes, sketch: Sketch) -> None:
    step = max(1, -(-max(sketch.heights.shape) // COARSEST))
    lx, ly = sketch.size
    heights, place = sketch.heights[::step, ::step], (0.0, lx, 0.0, ly)
    low, high = _find_ends(heights)
    look: dict[str, Any] = {"origin": "lower", "extent": place, "cmap": "cividis"}
    image = axes.imshow(heights, vmin=low, vmax=high, **look)
    axes.grid(False)
    height = style.label_map(axes, sketch.size)
    style.label(axes.figure.colorbar(image, ax=axes, shrink=height).ax.yaxis, "height", "m")


def _find_ends(heights: Array) -> tuple[float, float]:
    """Return the range of heights that is drawn, which ignores a few outliers."""
    low, most, highest, high = (float(end) for end in np.quantile(heights, [0.0, FEW, 1.0 - FEW, 1.0]))
    middle = 0.5 * (most + highest)
    low, high = max(low, middle - OUTLYING * (middle - most)), min(high, middle + OUTLYING * (highest - middle))
    return (low, high) if low < high else (float(heights.min()), float(heights.max()))


def _draw_distribution(axes: Axes, sketch: Sketch) -> None:
    heights = sketch.heights.ravel() - sketch.heights.mean()
    ends = np.array(_find_ends(heights))
    unit, size = printed.prefixed("m", np.abs(ends).max())
    heights, rms, (low, high) = heights / size, sketch.heights.std() / size, ends / size
    axes.hist(np.clip(heights, low, high), bins=BINS, density=True, color=style.BLUE, alpha=0.6, label="heights")
    if rms > 0.0:
        x = np.linspace(-4 * rms, 4 * rms, 200)
        axes.plot(x, np.exp(-0.5 * (x / rms) ** 2) / (rms * np.sqrt(2 * np.pi)), color=style.RED, label="normal")
    axes.margins(y=0.45)
    axes.set(xlabel=f"height over mean [{unit}]", ylabel=f"density [1/{unit}]")


def _draw_spectra(axes: Axes, sketch: Sketch, spectra: list[tuple[str, Array, Array, int]], name: str) -> None:
    """Draw spectra, each with name, wavenumbers, powers and number, and the limits of the grid."""
    for label, q, power, number in spectra:
        drawn = power > ROUNDING * power.max(initial=0.0)
        axes.loglog(q[drawn], power[drawn], label=label, **style.line(number))
    cell = max(length / n for length, n in zip(sketch.size, sketch.heights.shape[::-1], strict=True))
    axes.axvline(2 * np.pi / (RESOLVED * cell), color=style.GREY, ls=":", label=f"waves of {RESOLVED} cells")
    axes.axvline(np.pi / cell, color=style.GREY, ls="--", label="waves of 2 cells")
    axes.set(xlabel="wavenumber [1/m]", ylabel=name)
    for axis in (axes.xaxis, axes.yaxis):
        charts.thin_log_ticks(axis)


def _draw_profiles(axes: Axes, sketch: Sketch) -> None:
    found = sketch.found
    spectra = [("along x", found.qx, found.psd_x, 0), ("along y", found.qy, found.psd_y, 1)]
    _draw_spectra(axes, sketch, spectra, "PSD of profiles [m³]")


def _draw_over_directions(axes: Axes, sketch: Sketch) -> None:
    kinds = [("measured", sketch.measured, 1), ("on the grid", sketch.found, 0)]
    spectra = [(name, each.q, each.psd_2d, number) for name, each, number in kinds if each is not None]
    _draw_spectra(axes, sketch, spectra, "PSD over directions [m⁴]")


PANELS = {
    "map of the heights": _draw_map,
    "distribution of the heights": _draw_distribution,
    "spectra of profiles": _draw_profiles,
    "spectrum over directions": _draw_over_directions,
}


NOT_SELF_AFFINE = "no self-affine range was found"


def describe_surface(
    job: Job, heights: Array, remarks: list[str], shortest: float | None, picture: Path
) -> Iterator[str]:
    """Draw the picture and yield sentences on the heights [m], shape (ny, nx); root only. `shortest` [m] is the
    shortest wave of a measured surface, else None. Raises InputError and RunError."""
    if picture.suffix[1:] not in style.MARKED:
        raise InputError(f"--out must end in .{', .'.join(style.MARKED)}, got {str(picture)!r}")
    found, part, measured = surface_statistics.surface_statistics(heights, job.grid.size), job.surface[0], None
    lines = []
    whole = map_files.read_map(part) if isinstance(part, Topography) and len(job.surface) == 1 else None
    if isinstance(part, Topography) and whole and not whole.is_line:  # at its own points, its edges joined smoothly
        prepared = prepare(part, job.grid, whole)
        (ny, nx), (lx, ly) = prepared.cut.shape, prepared.size
        measured = surface_statistics.surface_statistics(
            measured_maps.treat(prepared.cut, part.detrend, "smooth").heights, prepared.size
        )
        lines = [f"size           {quantity(lx, 'm', 5)} x {quantity(ly, 'm', 5)}", f"points         {nx} x {ny}"]
        lines.append(f"pixel          {quantity(lx / nx, 'm', 4)} x {quantity(ly / ny, 'm', 4)}")
        lines.append(f"missing        {per_cent(float(np.isnan(prepared.cut).mean()))} of its points")
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        draw_surface(Sketch(heights, job.grid.size, found, measured), picture)
    except OSError as error:
        raise InputError(f"{picture} cannot be written: {hdf5.reason(error)}") from error
    yield from (*lines, *remarks)
    yield f"rms height     {quantity(found.rms_height, 'm', 4)}"
    yield f"rms slope      {found.rms_slope:.4g}"
    yield f"rms curvature  {found.rms_curvature:.4g} 1/m"
    yield f"Nayak          {found.nayak:.4g}"
    longest, two_cells = max(job.grid.size), 2.0 * max(job.grid.dx, job.grid.dy)
    yield f"spectrum       waves of {quantity(longest, 'm', 4)} to {quantity(two_cells, 'm', 4)}"
    own = measured or found  # a measured map at its own points, which no mirror has made twice as long
    yield f"Hurst          {with_error(own.hurst, own.hurst_error) if own.hurst == own.hurst else NOT_SELF_AFFINE}"
    if shortest is not None:
        cells = shortest / max(length / n for length, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1)
        yield f"shortest wave  {quantity(shortest, 'm', 4)}, {cells:.3g} cells"
    yield f"picture: {picture}"
