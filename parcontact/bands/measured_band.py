"""The coarsest band of a job whose surface starts with a measured map: the map itself, without finer waves.

A road is not Gaussian, so that a spectrum alone does not describe its long waves.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..doubts import Doubt
from ..errors import InputError
from ..job import Grid, Job, Topography
from ..job.checks.cells import fast_length
from ..parallel.slab import Array
from ..road import map_files
from ..road.prepared_map import prepare
from ..scene import map_sentences

FEWEST_WAVES = 4  # accuracy: least number of shortest waves along a map
RESOLVED = 8  # accuracy: points of a map per wave that it resolves


@dataclass(frozen=True)
class MapBand:
    """Heights [m] of the map on its `grid`, shape (ny, nx), its rms slope, notes on its preparation, and warnings."""

    grid: Grid
    heights: Array
    rms_slope: float
    notes: tuple[str, ...]
    doubts: tuple[Doubt, ...]


def band_of_map(job: Job, shortest: float, cells: float) -> MapBand | None:
    """Return the measured map with which a job's surface starts, with waves down to `shortest` [m], of `cells` cells;
    None without a map. Raises InputError for a map that cannot be read."""
    part = job.surface[0]
    if not isinstance(part, Topography):
        return None
    whole = map_files.read_map(part)
    if whole.is_line:
        raise InputError(f"{part.path} is a line scan; bands take a map, or the spectrum of the scan in a table")
    size = part.copies * whole.size[0], part.copies * whole.size[1]
    nx, ny = (fast_length(cells * length / shortest) for length in size)
    grid = Grid(points=(nx, ny), size=size)
    smooth = part.model_copy(update={"short_wavelength": max(shortest, part.short_wavelength or 0.0)})
    found = prepare(smooth, grid, whole)
    doubts = [*map_sentences.doubt_sizes(found), *map_sentences.doubt_outliers(found)]
    if shortest > max(size) / FEWEST_WAVES:
        cells = max(length / n for length, n in zip(whole.size, whole.heights.shape[::-1], strict=True))
        seam = {"longest": shortest, "side": max(size), "points": RESOLVED, "seam": RESOLVED * cells}
        doubts.append(Doubt("no waves of the map", "surface", seam))
    waves = np.fft.fft2(found.heights) / found.heights.size
    qy, qx = (2.0 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip((ny, nx), size[::-1], strict=True))
    slope = math.sqrt(float(np.sum(np.abs(waves) ** 2 * (qx[None, :] ** 2 + qy[:, None] ** 2))))
    return MapBand(grid, found.heights, slope, tuple(map_sentences.describe_treatment(found)), tuple(doubts))
