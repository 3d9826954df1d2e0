"""A measured map as the heights of a box on a grid: read, cut to the box, treated, resampled; and what was done."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..job import Grid, Topography
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab
from ..printed import per_cent, quantity
from . import map_files, statistics, treatment
from .treatment import Treated

SLACK = 1e-6  # accuracy: of a length: a box this much longer than the map is as long
LARGEST = 1.0  # m: a map that is longer is doubted
FLATTEST = 1e-5  # physics: range of heights over the shorter side; a polished wafer has some 1e-5
OBLONG = 1.5  # of the sides of a pixel: instruments have squares, with few exceptions


@dataclass(frozen=True)
class Prepared:
    """Heights [m] on the grid, shape (ny, nx), without mean; the map that they come from, as cut and as treated, with
    its size [m]; sentences on what was done, and doubts."""

    heights: Array
    cut: Array
    treated: Treated
    size: tuple[float, float]
    notes: tuple[str, ...]
    doubts: tuple[str, ...]


def prepare(part: Topography, grid: Grid) -> Prepared:
    """Return the map of a job on its grid; root only. Raises InputError for a map that cannot be read or is smaller
    than the box."""
    found = map_files.read(part)
    periodic = part.periodic or ("smooth" if grid.boundary == "periodic" else "none")
    copies = 2 if periodic == "mirror" else 1
    rows, columns = (
        _range(part, axis, grid.size[axis] / copies, found.size[axis], found.heights.shape[1 - axis], grid.points[axis])
        for axis in (1, 0)
    )
    cut, size = found.heights[rows, columns], (grid.lx / copies, grid.ly / copies)
    if np.isnan(cut).any() and not part.fill:
        raise InputError(f"{part.path}: {int(np.isnan(cut).sum())} of its points are missing; give fill: true")
    clip, short = part.outliers == "clip", part.short_wavelength
    done = treatment.treat(cut, part.detrend, periodic, clip)
    most = (grid.ly / short * (1.0 + SLACK), grid.lx / short * (1.0 + SLACK)) if short else None
    heights = treatment.resample(done.heights, (grid.ny, grid.nx), periodic != "none", most)
    doubts = [*_doubt_sizes(part, found), *([] if clip else _doubt_outliers(cut, done, size))]
    notes = tuple(_notes(part, cut, done, size))
    return Prepared(heights - heights.mean(), cut, done, size, notes, tuple(doubts))


def _notes(part: Topography, cut: Array, done: Treated, size: tuple[float, float]) -> list[str]:
    """Return sentences on what was done."""
    (ny, nx), (lx, ly), odd = cut.shape, (quantity(length, "m", 4) for length in size), int(done.outliers.sum())
    lines = [f"road: {nx} x {ny} points of the map, {lx} x {ly}, are used"]
    if done.missing:
        lines.append(f"road: {done.missing} missing points ({per_cent(done.missing / cut.size)}) were filled")
    if odd and part.outliers == "clip":
        lines.append(f"road: {odd} points that stuck out were set to the median of their neighbours")
    if len(done.trend) > 1:
        tilt = [2.0 * slope / length for slope, length in zip(done.trend[1:3], size, strict=True)]
        lines.append(f"road: a tilt of {tilt[0]:.3g} along x and {tilt[1]:.3g} along y was taken off")
    if done.enlarged > 1.0:
        lines.append(
            f"road: the window fades out {per_cent(treatment.TAPER)} of each side. Heights and slopes inside are "
            f"{per_cent(done.enlarged - 1.0)} larger than measured, so that the rms height of the box stays"
        )
    if part.short_wavelength:
        lines.append(
            f"road: waves shorter than {quantity(part.short_wavelength, 'm', 4)} were taken out (ideal low-pass)"
        )
    return lines


def _doubt_sizes(part: Topography, found: map_files.Map) -> list[str]:
    """Return doubts about the size of a map, in which units may be confused."""
    (ny, nx), (lx, ly), doubts = found.heights.shape, found.size, []
    dx, dy = lx / nx, ly / ny
    span = float(np.nanmax(found.heights) - np.nanmin(found.heights))
    if max(lx, ly) > LARGEST:
        doubts.append(f"the map is {lx:.4g} x {ly:.4g} m; are lengths in m?")
    if 0.0 < span < FLATTEST * min(lx, ly):
        doubts.append(
            f"the map is {quantity(lx, 'm', 4)} x {quantity(ly, 'm', 4)}, and its heights differ by "
            f"{quantity(span, 'm', 3)} only; do heights and lengths have the right units?"
        )
    if max(dx, dy) > OBLONG * min(dx, dy):
        doubts.append(
            f"points of the map are {quantity(dx, 'm', 4)} apart along x and {quantity(dy, 'm', 4)} along y; is the "
            "order of x and y right?"
        )
    return [f"surface: {part.path.name}: {text}" for text in doubts]


def _doubt_outliers(cut: Array, done: Treated, size: tuple[float, float]) -> list[str]:
    """Return a doubt about points that stick out of their neighbours, if there are any."""
    odd = done.outliers
    if not odd.any():
        return []
    slope, without = (
        statistics.describe(treatment.treat(heights, "tilt", "smooth").heights, size).rms_slope
        for heights in (cut, np.where(odd, np.nan, cut))
    )
    height, count = treatment.repeated(cut)
    repeated = f"; {quantity(height, 'm', 4)}, far from all others, occurs {count} times" if count else ""
    return [
        f"surface: {odd.sum()} points of the map stick out of their neighbours by more than {treatment.OUTLIER:g} "
        f"times the median deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, "
        "and they carry load; where they are no part of the surface, give outliers: clip, or nodata: NUMBER if one "
        "number marks missing points"
    ]


def _range(part: Topography, axis: int, length: float, available: float, count: int, points: int) -> slice:
    """Return the points of the map around its centre that are as long as the box, which has `points` of its own."""
    name = "xy"[axis]
    if length > available * (1.0 + SLACK):
        raise InputError(
            f"{part.path}: the box is {length:.6g} m along {name}, the map only {available:.6g} m; make the box "
            "smaller, or give periodic: mirror, which needs half of it"
        )
    wanted = min(count, max(1, round(count * length / available)))
    if wanted < 2 <= points:
        raise InputError(
            f"{part.path}: the box is {length:.3g} m along {name}, and points of the map are {available / count:.3g} m "
            "apart: it would be flat; make the box larger (grid.size), or take a finer map"
        )
    if part.centre is None:
        first = (count - wanted) // 2
        return slice(first, first + wanted)
    first = round(part.centre[axis] / available * count - wanted / 2)
    if not 0 <= first <= count - wanted:
        raise InputError(
            f"{part.path}: a box of {length:.6g} m around {part.centre[axis]:.6g} m along {name} leaves the map, which "
            f"has {available:.6g} m; {length / 2:.6g} to {available - length / 2:.6g} m would do"
        )
    return slice(first, first + wanted)


def rows_of(part: Topography, grid: Grid, slab: Slab) -> tuple[Array, list[str], list[str], bool]:
    """Return this rank's rows of the heights [m], on root notes on what was done, on every rank doubts, and whether
    points stick out; collective. Raises InputError on every rank."""
    found: list[Prepared] = []

    def make() -> tuple[list[str], bool]:
        found.append(prepare(part, grid))
        return list(found[0].doubts), part.outliers == "keep" and bool(found[0].treated.outliers.any())

    doubts, spiky = on_root(slab.comm, make)
    rows = slab.from_root(found[0].heights if found else None)
    return rows, list(found[0].notes) if found else [], doubts, spiky
