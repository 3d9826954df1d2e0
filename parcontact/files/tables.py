"""Tables of an output directory: how they are read, extended and checked.

Tables of numbers are csv files, which may be read while they grow. A growing table must have all rows that the marker
or a checkpoint states, and a table that is written at once must end with a whole line; else it is refused as
incomplete.

A friction curve continues with the points that its table lacks. Points that could not be solved are in
steady.lost.json, with the reasons.
"""

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import NamedTuple, NoReturn

from ..errors import InputError
from ..printed import quantity
from . import files, outputs

MEND = "correct the line, or move the file away to continue without its rows"


class GrowingTable:
    """A csv table that grows while others read it; a last line without newline is incomplete."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Open the file to append, or create it with the names of the columns. Raises OSError."""
        self.path = path
        self._file = files.open_to_append(path)
        if self._file.tell() == 0:
            self.append(names)

    def append(self, cells: Sequence[str]) -> None:
        """Append a line; after an error the file is unchanged."""
        rest, size = memoryview(f"{','.join(cells)}\n".encode()), self._file.tell()
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(size)
            raise

    def sync(self) -> None:
        """Flush all lines to disk."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file. Raises nothing."""
        with suppress(OSError):
            self._file.close()


def whole_lines(path: Path) -> Iterator[list[str]]:
    """Yield the cells of each whole line, first the names of the columns. Raises InputError for unequal lengths."""
    count = 0
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            if not line.endswith(b"\n"):
                return
            cells = line.decode(errors="replace").rstrip("\r\n").split(",")
            if len(cells) != (count or len(cells)):
                raise InputError(f"{path}, line {number}, has {len(cells)} values instead of {count}; {MEND}")
            count = len(cells)
            yield cells


class Columns(dict[str, list[float]]):
    """The columns of a table by name; access to a missing column raises InputError."""

    def __init__(self, path: Path, found: Iterable[tuple[str, list[float]]]) -> None:
        super().__init__(found)
        self.path = path

    def __missing__(self, name: str) -> NoReturn:
        raise InputError(f"{self.path}, line 1, has no column {name}; correct it, or move the file away")


def read_columns(path: Path) -> Columns:
    """Return the columns of a table by name. The table may be growing. Empty cells are NaN.

    Raises InputError, with the line, for a cell that is no number.
    """
    rows = whole_lines(path)
    names = next(rows, [])
    if not names:
        raise InputError(f"{path} is empty; a line with the names of columns was expected")
    series: list[list[float]] = [[] for _ in names]
    for number, texts in enumerate(rows, 2):
        for name, text, values in zip(names, texts, series, strict=True):
            try:
                values.append(float(text or "nan"))
            except ValueError:
                raise InputError(f"{path}, line {number}: {name} is {text[:20]!r}, not a number; {MEND}") from None
    return Columns(path, zip(names, series, strict=True))


CLOSE = 1e-6  # rounding: relative difference below which speeds and pressures are the same

Place = tuple[float, ...]  # speed [m/s], mean pressure [Pa], and temperature [deg C]


class Wanted(NamedTuple):
    """Parameters of a steady state: speed [m/s], mean pressure [Pa] and temperature [deg C]. If the temperature is NaN,
    the body has the temperature of its material."""

    speed: float
    pressure: float
    temperature: float = math.nan

    def __str__(self) -> str:
        heated = "" if math.isnan(self.temperature) else f" at {self.temperature:g} C"
        return f"{self.speed:.4g} m/s under {quantity(self.pressure, 'Pa', 4)}{heated}"


def requested_points(
    speeds: Sequence[float], pressures: Sequence[float], temperatures: Sequence[float] = ()
) -> list[Wanted]:
    """Return all combinations of speeds, pressures and temperatures, without repetition, in the order of solution."""
    order = product(temperatures or (math.nan,), pressures, speeds)
    return list(dict.fromkeys(Wanted(speed, pressure, temperature) for temperature, pressure, speed in order))


def of_table(columns: Mapping[str, Sequence[float]]) -> list[Wanted]:
    """Return the points of a friction curve from the columns of its table."""
    speeds = columns["velocity"]
    degrees = columns.get("temperature", [math.nan] * len(speeds))
    return list(map(Wanted, speeds, columns["pressure"], degrees))


def lacking_points(points: Sequence[Place], there: Sequence[Place]) -> list[int]:
    """Return the indices of the `points` that are not among the points `there`."""
    return [number for number, point in enumerate(points) if not any(is_same(point, other) for other in there)]


def is_same(one: Place, other: Place) -> bool:
    """Return True if two points are the same; NaN temperatures are equal."""
    pairs = zip(one, other, strict=True)
    return all(math.isclose(a, b, rel_tol=CLOSE) or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


SHOWN = 4  # most lost points of a reason, and reasons, in a message
PLACE = ("velocity", "pressure", "temperature")


class LostPoint(NamedTuple):
    """A point of a friction curve that could not be solved, and the reason."""

    at: Wanted
    why: str


def read(directory: Path) -> list[LostPoint]:
    """Return the lost points of a curve, except points that were solved later. Raises InputError for a damaged file."""
    path = directory / outputs.LOST
    if not path.is_file():
        return []
    try:
        found = [
            LostPoint(Wanted(one["velocity"], one["pressure"], one.get("temperature", math.nan)), str(one["why"]))
            for one in json.loads(path.read_text(encoding="utf-8"))
        ]
        return without(found, of_table(read_columns(directory / outputs.STEADY.table)))
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"{path} cannot be read ({error}); move it away") from None


def without(lost: Sequence[LostPoint], solved: Sequence[Wanted]) -> list[LostPoint]:
    """Return the lost points that are not among the solved ones."""
    return [lost[k] for k in lacking_points([one.at for one in lost], solved)]


def write(directory: Path, lost: Sequence[LostPoint]) -> None:
    """Write the lost points of a curve, or remove the file if there is none. Raises OSError."""
    if not lost:
        (directory / outputs.LOST).unlink(missing_ok=True)
        return
    data = [dict(zip((*PLACE, "why"), (*at, why), strict=True)) for at, why in lost]
    known = [{name: value for name, value in one.items() if value == value} for one in data]  # without NaN
    files.replace_file(directory / outputs.LOST, json.dumps(known, indent=1) + "\n")


def name_lost(directory: Path) -> str:
    """Return a text on the lost points of a curve, such as "13 of 15 points, without 10 m/s under 200 kPa at 20, 60 C:
    why". Return '' if there is none. Raises InputError for a damaged file."""
    if not (lost := read(directory)):
        return ""
    solved = len(read_columns(directory / outputs.STEADY.table)["velocity"])
    reasons: dict[str, list[Wanted]] = {}
    for at, why in lost:
        reasons.setdefault(why.split("; ")[0].split(". ")[0], []).append(at)
    parts = [f"{_shorten(list(_states(places)), ', ')}: {why}" for why, places in reasons.items()]
    return f"{solved} of {solved + len(lost)} points, without {_shorten(parts, '; without ')}"


def _states(points: Sequence[Wanted]) -> Iterator[str]:
    """Yield each velocity and pressure as text, with all its temperatures."""
    warm: dict[Wanted, list[str]] = {}
    for at in points:
        warm.setdefault(Wanted(at.speed, at.pressure), []).append(f"{at.temperature:g}")
    for state, degrees in warm.items():
        yield str(state) if degrees == ["nan"] else f"{state} at {', '.join(degrees)} C"


def _shorten(texts: Sequence[str], mark: str) -> str:
    more = f" and {len(texts) - SHOWN} more" if len(texts) > SHOWN else ""
    return mark.join(texts[:SHOWN]) + more


GROWING = (outputs.RUN.table, outputs.STEADY.table, outputs.BANDS, outputs.WAVES)
OF_THEORY = ("time", "distance", "friction", "contact_area")
MEND_CUT = "correct it, or move it away"


def read_results(path: Path) -> Columns:
    """Return the columns of a table of results by name. Raises InputError if the table is damaged, foreign or
    incomplete."""
    lasts = list(_find_ends(path))  # read before the table, which may grow
    columns = read_columns(path)
    if path.name not in GROWING:
        refuse_cut(path)
    if path.name == outputs.THEORY.table and (without := [name for name in OF_THEORY if name not in columns]):
        raise InputError(
            f"{path} has no column {', '.join(without)}: it was not written by `parcontact theory`; move it away"
        )
    for end, what in lasts:
        count = [-1.0, *columns["step"]][-1] if path.name == outputs.RUN.table else len(columns["velocity"])
        if count < end:
            raise InputError(f"{path} is damaged: {what}, and the table lacks rows; {MEND_CUT}")
    curve = path.with_name(outputs.STEADY.table)
    if path.name == outputs.BANDS and "velocity" in columns and curve.is_file():
        points = [of_table(one) for one in (read_columns(curve), columns)]
        if lacking := lacking_points(*points):
            raise InputError(f"{path} is damaged: it lacks {points[0][lacking[0]]}, which {curve.name} has; {MEND_CUT}")
    return columns


def refuse_cut(path: Path) -> None:
    """Raise InputError for a text that does not end with a whole line."""
    if not path.read_bytes().endswith(b"\n"):
        raise InputError(f"{path} is incomplete: it does not end with a whole line; write it again, or move it away")


def find_lost_rows(directory: Path) -> str:
    """Return a message if the table of a finished run is damaged or lacks rows, or ''. Raises InputError for an
    unreadable marker."""
    claim = outputs.sound_claims(directory).get("run")
    if claim is None or claim.finished is None:
        return ""
    path = directory / outputs.RUN.table
    with suppress(InputError, OSError):
        read_results(path)
        return ""
    return (
        f"{path} is damaged: its run has finished with step {claim.finished[0]}, and the table lacks rows; "
        f"correct it, or move {directory} away to run the job again"
    )


def _find_ends(path: Path) -> Iterator[tuple[float, str]]:
    """Yield the last step, or the number of points, that a table must have, with the reason. Raises InputError for an
    unreadable marker."""
    for verb, each in outputs.BY_VERB.items():
        claim = outputs.sound_claims(path.parent).get(verb) if each.complete and path.name == each.table else None
        if claim is not None and claim.finished is not None:
            yield claim.finished[0], each.complete.format(claim.finished[0])
    if path.name == outputs.RUN.table:
        for step, _ in outputs.find_checkpoints(path.parent)[:1]:
            yield step, f"its run has a checkpoint after step {step}"
