"""A measured map as the heights of a box on a grid: read, cut to the box, treated, resampled."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..job import Grid, Topography
from ..parallel.slab import Array
from . import map_files, treatment
from .treatment import Treated

SLACK = 1e-6  # rounding: relative excess of the box over the map that is ignored


@dataclass(frozen=True)
class Prepared:
    """Heights [m] on the grid, shape (ny, nx), of zero mean; the section of the job, the whole map, and the part of the
    map in the box as cut and as treated, with its size [m]."""

    heights: Array
    part: Topography
    whole: map_files.Map
    cut: Array
    treated: Treated
    size: tuple[float, float]


def prepare(part: Topography, grid: Grid, found: map_files.Map) -> Prepared:
    """Return the map of a job on its grid; root only. Raises InputError for a map that is smaller than the box."""
    periodic = part.periodic or ("smooth" if any(grid.cyclic) else "none")
    copies = part.copies
    rows, columns = (
        _range(part, axis, grid.size[axis] / copies, found.size[axis], found.heights.shape[1 - axis], grid.points[axis])
        for axis in (1, 0)
    )
    cut, size = found.heights[rows, columns], (grid.lx / copies, grid.ly / copies)
    if np.isnan(cut).any() and not part.fill:
        raise InputError(f"{part.path}: {int(np.isnan(cut).sum())} of its points are missing; give fill: true")
    done, short = treatment.treat(cut, part.detrend, periodic, part.outliers == "clip"), part.short_wavelength
    most = (grid.ly / short * (1.0 + SLACK), grid.lx / short * (1.0 + SLACK)) if short else None
    joined = periodic != "none" or (all(grid.cyclic) and treatment.is_periodic(done.heights))
    heights = treatment.resample(done.heights, (grid.ny, grid.nx), joined, most)
    return Prepared(heights - heights.mean(), part, found, cut, done, size)


def _range(part: Topography, axis: int, length: float, available: float, count: int, points: int) -> slice:
    """Return the range of points of the map along an axis that is as long as the box with its `points`."""
    name = "xy"[axis]
    if length > available * (1.0 + SLACK):
        raise InputError(
            f"{part.path}: the box is {length:.6g} m along {name}, but the map only {available:.6g} m; use a smaller "
            "grid.size, or periodic: mirror, which needs half the length"
        )
    wanted = min(count, max(1, round(count * length / available)))
    if wanted < 2 <= points:
        raise InputError(
            f"{part.path}: the box is {length:.3g} m along {name}, below the spacing of points of the map, "
            f"{available / count:.3g} m; use a larger grid.size, or a finer map"
        )
    if part.centre is None:
        first = (count - wanted) // 2
        return slice(first, first + wanted)
    first = round(part.centre[axis] / available * count - wanted / 2)
    if not 0 <= first <= count - wanted:
        raise InputError(
            f"{part.path}: a box of {length:.6g} m around {part.centre[axis]:.6g} m along {name} leaves the map of "
            f"{available:.6g} m; a centre of {length / 2:.6g} to {available - length / 2:.6g} m was expected"
        )
    return slice(first, first + wanted)
