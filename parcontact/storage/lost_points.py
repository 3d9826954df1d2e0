"""steady.lost.json: points of a friction curve that could not be solved, with the reasons."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError
from . import curve_points, files, tables
from .curve_points import Wanted

FILE = "steady.lost.json"
PLACE = ("velocity", "pressure", "temperature")
SHOWN = 4  # tuning: most states of one reason, and most reasons, in a sentence


class LostPoint(NamedTuple):
    """A point that could not be solved, and the reason."""

    at: Wanted
    why: str


def read(directory: Path) -> list[LostPoint]:
    """Return the lost points of a curve, without those that were solved later; raises InputError for a damaged file."""
    path = directory / FILE
    if not path.is_file():
        return []
    try:
        found = [
            LostPoint(Wanted(one["velocity"], one["pressure"], one.get("temperature", math.nan)), str(one["why"]))
            for one in json.loads(path.read_text(encoding="utf-8"))
        ]
        return without(found, curve_points.of_table(tables.read_columns(directory / "steady.csv")))
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"{path} cannot be read ({error}); move it away") from None


def without(lost: Sequence[LostPoint], solved: Sequence[Wanted]) -> list[LostPoint]:
    """Return the points that are not among the solved ones."""
    return [lost[k] for k in curve_points.lacking([one.at for one in lost], solved)]


def write(directory: Path, lost: Sequence[LostPoint]) -> None:
    """Write the lost points of a curve, or remove the file if there is none; raises OSError."""
    if not lost:
        (directory / FILE).unlink(missing_ok=True)
        return
    data = [dict(zip((*PLACE, "why"), (*at, why), strict=True)) for at, why in lost]
    known = [{name: value for name, value in one.items() if value == value} for one in data]  # without NaN
    files.replace_file(directory / FILE, json.dumps(known, indent=1) + "\n")


def name_lost(directory: Path) -> str:
    """Return a text on the lost points of a curve: "13 of 15 points, without 10 m/s under 200 kPa at 20, 60 C: why"; ''
    if there is none. Raises InputError for a damaged file."""
    if not (lost := read(directory)):
        return ""
    solved = len(tables.read_columns(directory / "steady.csv")["velocity"])
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
