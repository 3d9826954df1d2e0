"""Read measured maps and line scans: `.npy` and tables of text; all other formats by SurfaceTopography, if installed.

Heights point up, out of the road: the highest points touch first.
"""

import re
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from .. import datafiles
from ..errors import InputError
from ..job import Topography
from ..parallel.slab import Array

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
UNITS |= {"km": 1e3, "cm": 1e-2, "Å": 1e-10, "A": 1e-10, "pm": 1e-12, "in": 0.0254}
TO_GIVE = "m | mm | um | nm"  # as a job writes them; files may have the others
OF_NUMPY = ("npy", "npz")  # formats that SurfaceTopography reads with the first axis along x
LARGEST_FILE = 4_000_000_000  # tuning: largest file of a map [bytes]
LONGEST_HEAD = 200  # tuning: most lines before the first number of a text
IRREGULAR = 0.1  # accuracy: largest relative difference between steps of rounded positions
FEWEST = 4  # tuning: least points along a direction


@dataclass(frozen=True)
class Map:
    """Heights [m] of shape (ny, nx), NaN where nothing was measured, on a box of `size` = (lx, ly) [m]. A line scan has
    one row."""

    heights: Array
    size: tuple[float, float]

    @property
    def is_line(self) -> bool:
        return len(self.heights) == 1


@dataclass(frozen=True)
class MapContents:
    """Heights in a file, shape (ny, nx) or (nx,), with their unit [m], the size of the map along x and y (or of the
    line), and the unit of the size [m], as far as the file gives them."""

    values: Array
    unit: float | None = None
    size: tuple[float, ...] | None = None
    unit_xy: float | None = None


def read_map(part: Topography) -> Map:
    """Read a map. The job must give units and size if the file does not, and must not otherwise. Raises InputError."""
    path = part.path
    try:
        if not path.is_file():
            raise InputError(f"{path} is not a file; a map of heights was expected")
        if not path.stat().st_size:
            raise InputError(f"{path} cannot be read: it is empty")
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path} has more than {LARGEST_FILE / 1e9:g} GB; crop the map first")
        ending = path.suffix.lower()
        readers = {".npy": _array, **dict.fromkeys(datafiles.TEXTS, _text)}
        found = _in_metres(part, readers.get(ending, _instrument)(part))
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise anything
        said = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(f"{path} cannot be read: {said}") from error
    if found.heights.shape[1] < FEWEST or (len(found.heights) < FEWEST and not found.is_line):
        raise InputError(f"{path} has {found.heights.shape[::-1]} points; at least {FEWEST} each way were expected")
    if np.isfinite(found.heights).sum() < found.heights.size / 2:
        raise InputError(f"{path}: more than half of its points are missing")
    return found


def _in_metres(part: Topography, found: MapContents) -> Map:
    """Return the map in m, with missing points as NaN."""
    path, given = part.path, UNITS.get(part.unit_of_heights or "")
    if found.unit is not None and given not in (None, found.unit):
        raise InputError(f"{path} gives its own unit: leave out unit")
    if (unit := found.unit or given) is None:
        both = found.size is not None
        whose, more = ("positions and heights", ", or units: {xy: UNIT, z: UNIT}") if both else ("heights", "")
        raise InputError(f"{path} does not say the unit of its {whose}: give unit: {TO_GIVE}{more}")
    values = np.ma.masked_invalid(np.asarray(found.values, dtype=np.float64)).filled(np.nan)
    if (values := np.atleast_2d(values)).ndim != 2:
        raise InputError(f"{path} has {values.ndim} dimensions; a map of two, or a line, was expected")
    if found.size is not None:
        if part.size or part.pixel:
            raise InputError(f"{path} gives its own size: leave out {'size' if part.size else 'pixel'}")
        unit_xy = found.unit_xy or (UNITS[part.units.xy] if part.units else unit)
        lx, ly = float(found.size[0] * unit_xy), float(found.size[-1] * unit_xy)
    elif given_size := part.size_of(values.shape[::-1]):
        lx, ly = given_size
    else:
        raise InputError(f"{path} does not say how large its map is: give size: [lx, ly], or pixel [m]")
    if not (0.0 < lx < np.inf and 0.0 < ly < np.inf):
        raise InputError(f"{path}: the map would be {lx:g} x {ly:g} m; two positive lengths were expected")
    heights = np.where(values == part.nodata, np.nan, values) * unit
    largest = float(np.abs(heights, where=np.isfinite(heights), out=np.zeros_like(heights)).max(initial=0.0))
    datafiles.refuse_extreme(path, largest)
    return Map(np.ascontiguousarray(heights), (lx, ly))


def _array(part: Topography) -> MapContents:
    return MapContents(datafiles.open_numbers(part.path))


def _text(part: Topography) -> MapContents:
    """Read a matrix of heights, rows of x, y, z, an ESRI grid, or a line (rows of x, z or z); a text with any other
    header is read by SurfaceTopography."""
    with part.path.open(encoding="latin-1") as file:
        start = [*islice(file, LONGEST_HEAD)]
    first = next((number for number, line in enumerate(start) if _numbers(line)), None)
    if first is None:
        return _instrument(part)
    if datafiles.has_decimal_commas(start[first]):
        raise InputError(f"{part.path} cannot be read: its numbers have decimal commas; write them with points")
    head, columns = [line.strip() for line in start[:first] if line.strip()], len(_numbers(start[first]))
    said = {line.split()[0].lower(): _numbers(line.partition(" ")[2]) for line in head}
    known = all(line.startswith("#") for line in head) and part.unit_of_heights and (part.size or part.pixel)
    if head and columns > 3 and "cellsize" not in said and not known:
        return _instrument(part)
    mark = next((mark for mark in ";," if mark in start[first]), None)
    table = np.loadtxt(part.path, delimiter=mark, skiprows=first, ndmin=2, usecols=range(columns), encoding="latin-1")
    if "cellsize" in said:  # an ESRI grid, whose first row has the largest y
        missing, (cell,) = said.get("nodata_value") or [np.nan], said["cellsize"]
        return MapContents(np.where(table == missing, np.nan, table)[::-1], None, (cell * columns, cell * len(table)))
    if columns > 3 or columns == 1:
        return MapContents(table.squeeze())
    words = re.findall(r"[\[(]\s*([mnuµμ]?m)\s*[\])]", head[-1] if head else "")
    units = [UNITS[word] for word in words] if len(words) == columns else [None, None]
    return _positions(part.path, table, units[0], units[-1])


def _numbers(line: str) -> list[float]:
    """Return the numbers of a line; none if it holds anything else."""
    try:
        return [float(word) for word in re.split(r"[,;\s]+", line.strip(" ,;\t\r\n"))]
    except ValueError:
        return []


def _positions(path: Path, table: Array, unit_xy: float | None, unit: float | None) -> MapContents:
    """Return a map from rows of x, y, z, or a line from rows of x, z, in any order; positions without a row are
    missing. Positions may be rounded, but must be equally spaced."""
    axes = [np.unique(column, return_inverse=True) for column in table.T[:-1]]
    for name, (places, _) in zip("xy", axes, strict=False):
        if places.size < FEWEST:
            raise InputError(f"{path} has {places.size} positions along {name}; at least {FEWEST} were expected")
        if not np.ptp(gaps := np.diff(places)) <= IRREGULAR * np.mean(gaps):
            raise InputError(f"{path}: its positions along {name} are not equally spaced")
    heights = np.full([places.size for places, _ in axes[::-1]], np.nan)
    heights[tuple(index for _, index in axes[::-1])] = table[:, -1]
    size = tuple(float(np.ptp(places)) * places.size / (places.size - 1) for places, _ in axes)
    return MapContents(heights, unit, size, unit_xy)


def _instrument(part: Topography) -> MapContents:
    path = part.path
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
        raise InputError(
            f"{path} cannot be read: it is damaged, or in a format that SurfaceTopography does not know"
        ) from error
    if reader.format() in OF_NUMPY:
        raise InputError(f"{path} may have x or y first; save its array by numpy.save as .npy, whose rows are along x")
    names = [found.name for found in reader.channels]
    if not names or (reader.format() == "hgt" and path.suffix.lower() != ".hgt"):  # this reader accepts any file
        raise InputError(f"{path} has no channel of heights")
    if part.channel is not None and part.channel not in names:
        raise InputError(f"{path} has no channel {part.channel!r}; it has {', '.join(map(str, names))}")
    chosen = reader.channels[names.index(part.channel)] if part.channel is not None else reader.default_channel
    size = chosen.physical_sizes
    unsized = size is None and chosen.is_uniform
    topography = chosen.topography(**({"physical_sizes": chosen.nb_grid_pts} if unsized else {}))
    unit = _scale(path, chosen.unit) if chosen.unit is not None else None
    if not topography.is_uniform:
        x, z = topography.positions_and_heights()
        places = np.linspace(x[0], x[-1], len(x))
        return MapContents(np.interp(places, x, z), unit, (places[1] * len(x) - x[0] * len(x),), unit)
    heights = np.ma.filled(np.ma.masked_invalid(topography.heights()), np.nan).T
    return MapContents(heights, unit, None if size is None else tuple(topography.physical_sizes), unit)


def _scale(path: Path, unit: Any) -> float:
    """Return the size of a unit [m]."""
    if unit not in UNITS:
        raise InputError(f"{path}: its unit is {unit}; one of {', '.join(UNITS)} was expected")
    return UNITS[unit]
