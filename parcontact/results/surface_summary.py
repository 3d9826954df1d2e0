"""`parcontact surface`: sentences and picture of the rigid surface of a job.

The picture shows the map of the heights, their distribution, and their spectra with the limits of the grid.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import printed
from ..errors import InputError
from ..files import files
from ..job import Job, Topography, map_files, measured_maps
from ..job.measured_maps import prepare
from ..parallel.slab import Array
from ..physics.roughness import Statistics, surface_statistics
from ..printed import per_cent, quantity, with_error
from . import style
from .panels import Axis, Colors, Line, Panel, drawn_points, picture

BINS = 60
FEW, OUTLYING = (1e-3, 1.5)  # share of outlying points on either side, and the drawn range over the range of the others
RESOLVED = 8  # cells of a wave that is resolved in a contact
BARS = {"color": style.BLUE, "drawstyle": "steps-mid"}
ROUNDING = 1e-20  # rounding: smallest drawn power over the largest


@dataclass(frozen=True)
class Sketch:
    """Data of a surface's picture: heights [m] of shape (ny, nx) on a box of `size` [m], and their statistics;
    `measured` is the spectrum of the original map, if any."""

    heights: Array
    size: tuple[float, float]
    found: Statistics
    measured: Statistics | None = None


def draw_surface(sketch: Sketch, path: Path) -> None:
    """Write the picture of a surface, a png, pdf or svg; raises OSError."""
    with style.drawing():
        style.save_figure(picture("", [list(panels_of(sketch).values())]), path, path.suffix[1:])


def panels_of(sketch: Sketch) -> dict[str, Panel]:
    """Return the panels of a rigid surface, each by a text on what it shows."""
    found, (lx, ly) = sketch.found, sketch.size
    ends = _find_ends(drawn_points(sketch.heights))
    colors = Colors(sketch.heights, (0.0, lx, 0.0, ly), Axis("height", "m"), *ends, "cividis")
    profiles = [("along x", found.qx, found.psd_x, 0), ("along y", found.qy, found.psd_y, 1)]
    kinds = [("measured", sketch.measured, 1), ("on the grid", found, 0)]
    directions = [(name, each.q, each.psd_2d, number) for name, each, number in kinds if each is not None]
    return {
        "map of the heights": Panel("map", Axis("x", "m"), Axis("y", "m"), colors=colors),
        "distribution of the heights": _distribution(sketch),
        "spectra of profiles": _spectra(sketch, profiles, Axis("PSD of profiles", "m³")),
        "spectrum over directions": _spectra(sketch, directions, Axis("PSD over directions [m⁴]")),
    }


def _find_ends(heights: Array) -> tuple[float, float]:
    """Return the range of heights that is drawn, which ignores a few outliers."""
    low, most, highest, high = (float(end) for end in np.quantile(heights, [0.0, FEW, 1.0 - FEW, 1.0]))
    middle = 0.5 * (most + highest)
    low, high = max(low, middle - OUTLYING * (middle - most)), min(high, middle + OUTLYING * (highest - middle))
    return (low, high) if low < high else (float(heights.min()), float(heights.max()))


def _distribution(sketch: Sketch) -> Panel:
    heights = sketch.heights.ravel() - sketch.heights.mean()
    low, high = _find_ends(heights)
    unit, size = printed.prefixed("m", max(abs(low), abs(high)))
    density, edges = np.histogram(np.clip(heights, low, high), BINS, density=True)
    lines = [Line("heights", 0.5 * (edges[1:] + edges[:-1]), size * density, BARS)]
    if (rms := float(heights.std())) > 0.0:
        x = np.linspace(-4 * rms, 4 * rms, 200)
        normal = np.exp(-0.5 * (x / rms) ** 2) / (rms / size * np.sqrt(2 * np.pi))
        lines.append(Line("normal", x, normal, {"color": style.RED}))
    return Panel("distribution", Axis("height over mean", "m"), Axis(f"density [1/{unit}]"), lines)


def _spectra(sketch: Sketch, spectra: list[tuple[str, Array, Array, int]], of: Axis) -> Panel:
    """Return the panel of spectra, each with name, wavenumbers, powers and number, and the limits of the grid."""
    lines, seen = list[Line](), list[float]()
    for label, q, power, number in spectra:
        drawn = power > ROUNDING * power.max(initial=0.0)
        lines.append(Line(label, q[drawn], power[drawn], style.line(number)))
        seen += power[drawn].tolist()
    cell = max(length / n for length, n in zip(sketch.size, sketch.heights.shape[::-1], strict=True))
    ends = np.array([min(seen, default=1.0), max(seen, default=1.0)])
    for cells, dashes in ((RESOLVED, ":"), (2, "--")):
        at = np.full(2, 2 * np.pi / (cells * cell))
        lines.append(Line(f"waves of {cells} cells", at, ends, {"color": style.GREY, "linestyle": dashes}))
    return Panel("spectrum", Axis("wavenumber [1/m]"), of, lines, log_x=True, log_y=True)


NOT_SELF_AFFINE = "no self-affine range was found"


def describe_surface(
    job: Job, heights: Array, remarks: list[str], shortest: float | None, picture: Path
) -> Iterator[str]:
    """Draw the picture of a surface and yield sentences on its heights [m], shape (ny, nx). `remarks` are sentences on
    how the heights were made, `shortest` [m] is the shortest wave of a measured surface, else None. Only the root rank
    may call this function. Raises InputError and RunError."""
    if picture.suffix[1:] not in style.MARKED:
        raise InputError(f"--out must end in .{', .'.join(style.MARKED)}, got {str(picture)!r}")
    found, part, measured = surface_statistics(heights, job.grid.size), job.surface[0], None
    lines = []
    whole = map_files.read_map(part) if isinstance(part, Topography) and len(job.surface) == 1 else None
    if isinstance(part, Topography) and whole and not whole.is_line:  # at its own points, its edges joined smoothly
        prepared = prepare(part, job.grid, whole)
        (ny, nx), (lx, ly) = prepared.cut.shape, prepared.size
        treated = measured_maps.treat(prepared.cut, part.detrend, "smooth")
        measured = surface_statistics(treated.heights, prepared.size)
        lines = [f"size           {quantity(lx, 'm', 5)} x {quantity(ly, 'm', 5)}", f"points         {nx} x {ny}"]
        lines.append(f"pixel          {quantity(lx / nx, 'm', 4)} x {quantity(ly / ny, 'm', 4)}")
        lines.append(f"missing        {per_cent(float(np.isnan(prepared.cut).mean()))} of its points")
    with files.writing(picture):
        draw_surface(Sketch(heights, job.grid.size, found, measured), picture)
    yield from (*lines, *remarks)
    own = measured or found  # a measured map at its own points, which no mirror has made twice as long
    *heights_and_slopes, (name, hurst) = list_statistics(replace(found, hurst=own.hurst, hurst_error=own.hurst_error))
    yield from (f"{one:15}{text}" for one, text in heights_and_slopes)
    longest, two_cells = max(job.grid.size), 2.0 * max(job.grid.dx, job.grid.dy)
    yield f"spectrum       waves of {quantity(longest, 'm', 4)} to {quantity(two_cells, 'm', 4)}"
    yield f"{name:15}{hurst}"
    if shortest is not None:
        cells = shortest / max(length / n for length, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1)
        yield f"shortest wave  {quantity(shortest, 'm', 4)}, {cells:.3g} cells"
    yield f"picture: {picture}"


def list_statistics(found: Statistics) -> list[tuple[str, str]]:
    """Return the names and values of statistics of a surface as text."""
    return [
        ("rms height", quantity(found.rms_height, "m", 4)),
        ("rms slope", f"{found.rms_slope:.4g}"),
        ("rms curvature", f"{found.rms_curvature:.4g} 1/m"),
        ("Nayak", f"{found.nayak:.4g}"),
        ("Hurst", NOT_SELF_AFFINE if np.isnan(found.hurst) else with_error(found.hurst, found.hurst_error)),
    ]
