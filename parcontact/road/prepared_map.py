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


@dataclass(frozen=True)
class Prepared:
    """Heights [m] on the grid, shape (ny, nx), without mean; the map that they come from, as cut and as treated, with
    its size [m]."""

    heights: Array
    cut: Array
    treated: Treated
    size: tuple[float, float]

    @property
    def notes(self) -> list[str]:
        """Return sentences on what was done."""
        (ny, nx), done = self.cut.shape, self.treated
        lx, ly = (quantity(length, "m", 4) for length in self.size)
        lines = [f"road: {nx} x {ny} points of the map, {lx} x {ly}, are used"]
        if done.missing:
            lines.append(f"road: {done.missing} missing points ({per_cent(done.missing / self.cut.size)}) were filled")
        if len(done.trend) > 1:
            tilt = [2.0 * slope / length for slope, length in zip(done.trend[1:3], self.size, strict=True)]
            lines.append(f"road: a tilt of {tilt[0]:.3g} along x and {tilt[1]:.3g} along y was taken off")
        if done.enlarged > 1.0:
            lines.append(
                f"road: the window fades out {per_cent(treatment.TAPER)} of each side. Heights and slopes inside are "
                f"{per_cent(done.enlarged - 1.0)} larger than measured, so that the rms height of the box stays"
            )
        return lines

    @property
    def doubt(self) -> str:
        """Return what to say of points that stick out of their neighbours, or ''."""
        odd = self.treated.outliers
        if not odd.any():
            return ""
        slope, without = (
            statistics.describe(treatment.treat(heights, "tilt", "smooth").heights, self.size).rms_slope
            for heights in (self.cut, np.where(odd, np.nan, self.cut))
        )
        height, count = treatment.repeated(self.cut)
        repeated = f"; {quantity(height, 'm', 4)}, far from all others, occurs {count} times" if count else ""
        return (
            f"surface: {odd.sum()} points of the map stick out of their neighbours by more than {treatment.OUTLIER:g} "
            f"times the median deviation{repeated}. Its rms slope is {slope:.3g} with them and {without:.3g} without, "
            "and they carry load; where they are no part of the surface, write nan for them in the file, and they are "
            "filled"
        )


def prepare(part: Topography, grid: Grid) -> Prepared:
    """Root's work. Raises InputError for a map that cannot be read or is smaller than the box."""
    found = map_files.read(part.path, part.unit, part.size, part.channel)
    periodic = part.periodic or ("smooth" if grid.boundary == "periodic" else "none")
    copies = 2 if periodic == "mirror" else 1
    rows, columns = (
        _range(part, axis, grid.size[axis] / copies, found.size[axis], found.heights.shape[1 - axis], grid.points[axis])
        for axis in (1, 0)
    )
    cut = found.heights[rows, columns]
    if np.isnan(cut).any() and not part.fill:
        raise InputError(f"{part.path}: {int(np.isnan(cut).sum())} of its points are missing; give fill: true")
    done = treatment.treat(cut, part.detrend, periodic)
    shape = (grid.ny, grid.nx)
    heights = (treatment.resample_open if periodic == "none" else treatment.resample)(done.heights, shape)
    return Prepared(heights - heights.mean(), cut, done, (grid.lx / copies, grid.ly / copies))


def _range(part: Topography, axis: int, length: float, available: float, count: int, points: int) -> slice:
    """The points of the map around its centre that are as long as the box, which has so many `points` of its own."""
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


def rows_of(part: Topography, grid: Grid, slab: Slab) -> tuple[Array, list[str], str]:
    """This rank's rows of the heights [m], on root what was done, and what to doubt; collective. Raises InputError on
    every rank."""
    found: list[Prepared] = []

    def make() -> str:
        found.append(prepare(part, grid))
        return found[0].doubt

    doubt = on_root(slab.comm, make)
    rows = slab.from_root(found[0].heights if found else None)
    return rows, found[0].notes if found else [], doubt
