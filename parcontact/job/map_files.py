"""Reading of measured maps and line scans.

Arrays (`.npy`, `.h5`, `.mat`) and texts of numbers are read here. SurfaceTopography reads formats of instruments, and
texts in whose header an instrument has written the size or the unit. Heights point up, out of the road: the highest
points touch first.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .. import text_tables
from ..errors import InputError
from ..parallel.slab import Array
from . import Topography

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
UNITS |= {"km": 1e3, "cm": 1e-2, "Å": 1e-10, "A": 1e-10, "pm": 1e-12, "in": 0.0254}
TO_GIVE = "m | mm | um | nm"  # as a job writes them; files may have the others
SIZED = r"(?i)\b(width|height|[xy]-(length|unit|pixels)|pixel[_ ]size|(unit|scale) [xy]|wyko ascii|file format)\b"
ARRAYS = ("npy", "npz", "h5", "mat")  # formats without axes: SurfaceTopography has x first, and y is first here
NUMBERS = ("xyz", "asc")  # its names of texts
LARGEST_FILE = 4_000_000_000  # tuning: largest file of a map [bytes]
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
    """Contents of a file of heights: the heights `values`, of shape (ny, nx) or (nx,), and the length of their `unit`
    [m]. `size` is the size of the map along x and y, or the length of a line scan. `unit_xy` is the length of the unit
    of this size [m]. A value that the file does not state is None."""

    values: Array
    unit: float | None = None
    size: tuple[float, ...] | None = None
    unit_xy: float | None = None


def read_map(part: Topography) -> Map:
    """Return the map in the file of a shape. Raises InputError for an unreadable file, if neither the file nor the
    shape gives units and size, and if both give them."""
    path = part.path
    try:
        if not path.is_file():
            raise InputError(f"{path} is not a file; a map of heights was expected")
        if not path.stat().st_size:
            raise InputError(f"{path} cannot be read: it is empty")
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path} has more than {LARGEST_FILE / 1e9:g} GB; crop the map first")
        ending = path.suffix.lower()
        readers = {".npy": _array, ".h5": _hdf5, ".mat": _matlab, **dict.fromkeys(text_tables.TEXTS, _text)}
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
    text_tables.refuse_extreme(path, largest)
    return Map(np.ascontiguousarray(heights), (lx, ly))


def _refuse_channel(part: Topography) -> None:
    if part.channel is not None:
        raise InputError(f"{part.path} has no channel {part.channel!r}: it holds one map; leave out channel")


def _array(part: Topography) -> MapContents:
    _refuse_channel(part)
    return MapContents(text_tables.open_numbers(part.path))


def _hdf5(part: Topography) -> MapContents:
    found: dict[str, Any] = {}
    with h5py.File(part.path) as file:
        file.visititems(lambda name, node: found.update({name: node}))
        return _named_array(part, found)


def _matlab(part: Topography) -> MapContents:
    import scipy.io  # slow import

    return _named_array(part, scipy.io.loadmat(part.path))


def _named_array(part: Topography, found: dict[str, Any]) -> MapContents:
    """Return the array that the job names, or else the first one, of those with numbers and two axes."""
    flat = {name: each for name, each in found.items() if len(getattr(each, "shape", ())) == 2}
    maps = {name: each for name, each in flat.items() if each.size and each.dtype.kind in "biuf"}
    _check_channel(part, list(maps))
    return MapContents(maps[part.channel or next(iter(maps))][()])


def _check_channel(part: Topography, names: list[str]) -> None:
    """Raise InputError unless a file has a channel, and that of the job."""
    if not names:
        raise InputError(f"{part.path} has no channel of heights")
    if part.channel not in (None, *names):
        raise InputError(f"{part.path} has no channel {part.channel!r}; it has {', '.join(map(str, names))}")


def _text(part: Topography) -> MapContents:
    """Read a matrix of heights, rows of x, y, z, an ESRI grid, or a line (rows of x, z or z)."""
    path = part.path
    with text_tables.open_text(path) as file:
        head, rows = text_tables.number_rows(path, file)
        head = [line.strip() for line in head if line.strip()]
        first = next(rows, None)
        columns = len(first[1]) if first else 0
        esri = {line.split()[0].lower(): line.split()[1:] for line in head}
        if first is None or (columns > 3 and "cellsize" not in esri and re.search(SIZED, "\n".join(head))):
            return _instrument(part)
        _refuse_channel(part)
        table = _table(path, chain([first], rows), columns in (2, 3))
    if "cellsize" in esri:  # an ESRI grid, whose first row has the largest y
        missing, cell = (float(esri.get(key, ["nan"])[0]) for key in ("nodata_value", "cellsize"))
        return MapContents(np.where(table == missing, np.nan, table)[::-1], None, (cell * columns, cell * len(table)))
    if columns not in (2, 3):
        return MapContents(table.squeeze())
    named = text_tables.header_of(head[-1], columns) if head else []
    axes, units = "xyz" if columns == 3 else "xz", [UNITS.get(column.unit or "") for column in named]
    names = [column.name.lower() for column in named]
    if sorted(names) == list(axes):
        places = [names.index(name) for name in axes]
        table, units = table[:, places], [units[k] for k in places]
    if None in units or not units:
        units = [None, None]
    if units[0] != units[-2 if columns == 3 else 0]:
        raise InputError(f"{path}: its positions along x and y have two units; one was expected")
    return _positions(path, table, units[0], units[-1])


def _table(path: Path, rows: Iterable[tuple[int, list[float]]], positions: bool) -> Array:
    """Return rows of numbers as an array; rows of a matrix must be one block. Raises InputError."""
    numbers, values = [], []
    for number, row in rows:
        numbers.append(number)
        values.append(np.array(row))
        if len(row) != len(values[0]):
            wanted = f"{len(values[0])} were expected, as in line {numbers[0]}"
            raise InputError(f"{path}:{number}: {len(row)} numbers; {wanted}")
    breaks = np.flatnonzero(np.diff(numbers) > 1)
    if not positions and 0 < breaks.size < len(values) - 1:  # text between all rows makes no blocks
        raise InputError(
            f"{path}:{numbers[breaks[0] + 1]}: a second block of numbers begins after a blank line or a comment; a map "
            "is one block: keep one of them"
        )
    return np.stack(values)


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
    where = tuple(index for _, index in axes[::-1])
    count = np.bincount(np.ravel_multi_index(where, heights.shape))
    if count.max() > 1:
        raise InputError(f"{path}: {np.count_nonzero(count > 1)} positions have two heights or more; one was expected")
    heights[where] = table[:, -1]
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
    kind, ending = reader.format(), path.suffix.lower()
    if kind in ARRAYS or (kind in NUMBERS and ending not in text_tables.TEXTS):
        raise InputError(
            f"{path} holds an array or a text of numbers: rename it to end in {', '.join(text_tables.OWN_FORMATS)}; "
            "save an array of another kind by numpy.save, with rows along x"
        )
    accepts_any = kind == "hgt" and ending != ".hgt"
    names = [] if accepts_any else [found.name for found in reader.channels]
    _check_channel(part, names)
    chosen = reader.channels[names.index(part.channel)] if part.channel is not None else reader.default_channel
    size = chosen.physical_sizes
    unsized = size is None and chosen.is_uniform
    topography = chosen.topography(**({"physical_sizes": chosen.nb_grid_pts} if unsized else {}))
    unit = _scale(path, chosen.unit) if chosen.unit is not None else None
    if not topography.is_uniform:
        x, z = topography.positions_and_heights()
        places = np.linspace(x[0], x[-1], len(x))
        return MapContents(np.interp(places, x, z), unit, (places[1] * len(x) - x[0] * len(x),), unit)
    heights = np.ma.filled(np.ma.masked_invalid(topography.heights()), np.nan)
    return MapContents(heights.T, unit, None if size is None else tuple(topography.physical_sizes), unit)


def _scale(path: Path, unit: Any) -> float:
    """Return the size of a unit [m]."""
    if unit not in UNITS:
        raise InputError(f"{path}: its unit is {unit}; one of {', '.join(UNITS)} was expected")
    return UNITS[unit]
