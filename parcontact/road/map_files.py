"""Measured maps from files: .npy, .txt and .xyz, and all other formats by SurfaceTopography where that is installed.

Heights point up, out of the road: what sticks out touches first.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import datafiles
from ..errors import InputError
from ..job import Topography
from ..parallel.slab import Array

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
TO_GIVE = "m | mm | um | nm"  # as a job writes them; files may say the others too
PLAIN = (".npy", ".txt", ".xyz")  # formats without units
OF_NUMPY = ("npy", "npz")  # which SurfaceTopography reads with the first direction along x
LARGEST_FILE = 4_000_000_000  # tuning: bytes
IRREGULAR = 1e-3  # accuracy: of a step: positions of a .xyz file further from a grid than this are on none
FEWEST = 4  # tuning: points along a direction
MOST_POSITIONS = 10**6  # tuning: along a direction
MOST_MISSING = 2  # tuning: times as many points of the grid as of the file
LOWEST, HIGHEST = 1e-70, 1e70  # accuracy: of the largest height: its fourth power is a number of double precision


@dataclass(frozen=True)
class Map:
    """Heights [m] of shape (ny, nx), NaN where nothing was measured, on a box of `size` = (lx, ly) [m]."""

    heights: Array
    size: tuple[float, float]


def read(path: Path, unit: str | None, size: tuple[float, float] | None, channel: str | None) -> Map:
    """Read a map. `unit` of the heights (of a .xyz file: of all lengths) and the `size` [m] must be given for formats
    that have none, and only for those. Raises InputError, in one sentence."""
    try:
        if not path.is_file():
            raise InputError(f"{path} is not a file; a map of heights was expected")
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path} has more than {LARGEST_FILE / 1e9:g} GB; crop the map first")
        headed = path.suffix == ".txt" and unit is None and size is None  # its header may say both
        plain = path.suffix in PLAIN and not headed
        found = _plain(path, unit, size) if plain else _of_instrument(path, unit, size, channel)
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise anything
        said = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(f"{path} cannot be read: {datafiles.foreign_numbers(path) or said}") from error
    _refuse_odd_numbers(path, found)
    if min(found.heights.shape) < FEWEST:
        raise InputError(f"{path} has {found.heights.shape[::-1]} points; at least {FEWEST} each way were expected")
    if np.isfinite(found.heights).sum() < found.heights.size / 2:
        raise InputError(f"{path}: more than half of its points are missing")
    return found


def _refuse_odd_numbers(path: Path, found: Map) -> None:
    if not all(0.0 < length < np.inf for length in found.size):
        raise InputError(f"{path}: its map would be {found.size[0]:g} x {found.size[1]:g} m, which is no size")
    largest = float(np.abs(found.heights, where=np.isfinite(found.heights), out=np.zeros_like(found.heights)).max())
    if largest and not LOWEST <= largest <= HIGHEST:
        raise InputError(f"{path}: its largest height is {largest:.3g} m, which cannot be computed with")


def _plain(path: Path, unit: str | None, size: tuple[float, float] | None) -> Map:
    if unit is None:
        raise InputError(f"{path} does not say the unit of its heights: give unit: {TO_GIVE}")
    if path.suffix == ".xyz":
        if size is not None:
            raise InputError(f"{path} has positions of its own: give no size")
        return _positions(path, np.loadtxt(path, ndmin=2, dtype=np.float64), UNITS[unit])
    if size is None:
        raise InputError(f"{path} does not say how large its map is: give size: [lx, ly] [m]")
    values = datafiles.open_numbers(path) if path.suffix == ".npy" else _text(path)
    masked = np.ma.masked_invalid(np.asarray(values, dtype=np.float64))
    if masked.ndim != 2:
        raise InputError(f"{path} has {masked.ndim} dimensions; a map of two was expected")
    return Map(masked.filled(np.nan) * UNITS[unit], size)


def _text(path: Path) -> Array:
    if foreign := datafiles.foreign_numbers(path):
        raise InputError(f"{path} cannot be read: {foreign}")
    try:
        return np.genfromtxt(path, dtype=np.float64)
    except ValueError as error:
        raise InputError(f"{path} cannot be read: its lines do not have as many numbers each") from error


def _positions(path: Path, table: Array, unit: float) -> Map:
    """A map from rows of x, y and z in any order; points that are not there are missing."""
    if table.shape[1] != 3:
        raise InputError(f"{path} has {table.shape[1]} columns; x, y and z were expected")
    if (wrong := np.flatnonzero(~np.isfinite(table[:, :2]).all(axis=1))).size:
        x, y = table[wrong[0], :2]
        raise InputError(f"{path}: its point {wrong[0] + 1} is at x = {x:g}, y = {y:g}, which is no position")
    (x, nx, dx), (y, ny, dy) = (_steps(path, name, values) for name, values in zip("xy", table.T[:2], strict=True))
    if nx * ny > MOST_MISSING * len(table):
        far = max((np.abs(values - np.median(values)).argmax() for values in table.T[:2]), key=lambda n: x[n] * y[n])
        raise InputError(
            f"{path}: its {len(table)} points reach over a grid of {nx} x {ny}, of which more than half would be "
            f"missing; is point {far + 1}, at x = {table[far, 0]:g}, y = {table[far, 1]:g}, one of them?"
        )
    heights = np.full((ny, nx), np.nan)
    heights[y, x] = table[:, 2]
    return Map(heights * unit, (nx * dx * unit, ny * dy * unit))


def _steps(path: Path, name: str, values: Array) -> tuple[NDArray[np.intp], int, float]:
    """Indices, their number, and the step of positions on a regular grid."""
    distinct = np.unique(values)
    if distinct.size < FEWEST:
        raise InputError(f"{path} has {distinct.size} positions along {name}; at least {FEWEST} were expected")
    step = float(np.median(np.diff(distinct)))
    index = (values - distinct[0]) / step
    if not index.max() < MOST_POSITIONS:
        raise InputError(
            f"{path}: its positions along {name} reach from {distinct[0]:g} to {distinct[-1]:g} in steps of {step:g}, "
            f"which is more than {MOST_POSITIONS:.0e} of them"
        )
    if np.abs(index - np.round(index)).max() > IRREGULAR:
        raise InputError(f"{path}: its positions along {name} are not equally spaced")
    whole = np.round(index).astype(np.intp)
    return whole, int(whole.max()) + 1, step


def _of_instrument(path: Path, unit: str | None, size: tuple[float, float] | None, channel: str | None) -> Map:
    try:
        import SurfaceTopography
        from SurfaceTopography.Exceptions import CannotDetectFileFormat, CorruptFile, UnknownFileFormat
    except ImportError as error:
        raise InputError(
            f"{path}: files of instruments are read by SurfaceTopography, which is not installed: "
            "pip install 'parcontact[topography]', or save the map as .npy"
        ) from error
    try:
        reader = SurfaceTopography.open_topography(str(path))
    except (CannotDetectFileFormat, CorruptFile, UnknownFileFormat) as error:
        why = datafiles.foreign_numbers(path) or "it is damaged, or of no format that SurfaceTopography knows"
        raise InputError(f"{path} cannot be read: {why}") from error
    if reader.format() in OF_NUMPY:
        raise InputError(f"{path} may have x or y first; save its array by numpy.save as .npy, whose rows are along x")
    names = [found.name for found in reader.channels]
    if channel is not None and channel not in names:
        raise InputError(f"{path} has no channel {channel!r}; it has {', '.join(map(str, names))}")
    chosen = reader.channels[names.index(channel)] if channel is not None else reader.default_channel
    own_unit, own_size = chosen.unit, chosen.physical_sizes
    _refuse_twice(path, unit is not None and own_unit is not None, "a unit", "unit")
    _refuse_twice(path, size is not None and own_size is not None, "a size", "size")
    if own_unit is None and unit is None:
        raise InputError(f"{path} does not say the unit of its heights: give unit: {TO_GIVE}")
    topography = chosen.topography(**({"physical_sizes": size} if own_size is None and size is not None else {}))
    if len(topography.nb_grid_pts) != 2:
        raise InputError(f"{path} is a line scan; a map was expected")
    scale = UNITS[unit] if unit is not None else _scale(path, own_unit)
    if topography.physical_sizes is None:
        raise InputError(f"{path} does not say how large its map is: give size: [lx, ly] [m]")
    lengths = size if own_size is None and size is not None else tuple(s * scale for s in topography.physical_sizes)
    heights = np.ma.filled(np.ma.masked_invalid(topography.heights()), np.nan)
    return Map(np.ascontiguousarray(np.asarray(heights, dtype=np.float64).T) * scale, (lengths[0], lengths[1]))


def _refuse_twice(path: Path, both: bool, what: str, key: str) -> None:
    if both:
        raise InputError(f"{path} has {what} of its own: give no {key}")


def _scale(path: Path, unit: object) -> float:
    from SurfaceTopography.Support.UnitConversion import get_unit_conversion_factor

    factor = get_unit_conversion_factor(str(unit), "m")
    if factor is None:
        raise InputError(f"{path}: its unit {unit} is no length")
    return float(factor)


def extent_of(part: Topography, box: Any = None) -> tuple[tuple[int, int], tuple[float, float]]:
    """Points along x and y and size (lx, ly) [m] of a map, or of the part of it that is as large as a `box` [m]; a
    mirrored map is twice as long. Raises InputError."""
    points, size = _extent(part.path, part.path.stat().st_mtime_ns, part.unit, part.size, part.channel)
    copies = 2 if part.periodic == "mirror" else 1
    size = copies * size[0], copies * size[1]
    lengths = box if isinstance(box, list | tuple) and len(box) == 2 else (box, box)
    x, y = (
        max(1, round(copies * n * (length / whole if isinstance(length, int | float) and length > 0 else 1.0)))
        for n, length, whole in zip(points, lengths, size, strict=True)
    )
    return (x, y), size


@lru_cache(maxsize=4)  # the cases of a sweep have the same map
def _extent(
    path: Path, _: int, unit: str | None, size: tuple[float, float] | None, channel: str | None
) -> tuple[tuple[int, int], tuple[float, float]]:
    found = read(path, unit, size, channel)
    ny, nx = found.heights.shape
    return (nx, ny), found.size
