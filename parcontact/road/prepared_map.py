"""A measured map as the heights of a box on a grid: read, cut to the box, treated, resampled."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..job import Grid, Topography
from ..parallel.slab import Array
from . import map_files, treatment
from .treatment import Treated

SLACK = 1e-6  # accuracy: of a length: a box this much longer than the map is as long


@dataclass(frozen=True)
class Prepared:
    """Heights [m] on the grid, shape (ny, nx), without mean; the part of a job, the map that it names, and the part of
    the map in the box, with its size [m], as cut and as treated."""

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
    heights = treatment.resample(done.heights, (grid.ny, grid.nx), periodic != "none", most)
    return Prepared(heights - heights.mean(), part, found, cut, done, size)


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
