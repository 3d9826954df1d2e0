"""The `sweep` section: many cases of one job.

A sweep is a list of mappings from keys of the job to lists of values. Keys within one mapping change together; cases
are all combinations of the mappings, numbered from 0, with the last mapping changing fastest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from ..sections.quantities import log_range
from .fault import quote, shorten
from .places import Key, Place, Source

SWEEP: Key = ("sweep",)
MAX_CASES = 1000  # tuning: most cases of a sweep
FIXED = ("sweep", "output.directory")  # keys that cannot be swept


class Setting(NamedTuple):
    """A value for a key, from a sweep, the command line or Python, with the places of both."""

    name: str
    value: Any
    key_place: Place
    place: Place

    @property
    def path(self) -> Key:
        return tuple(self.name.split("."))

    def __str__(self) -> str:
        return f"{self.name} = {self.value}"


Axis = list[tuple[Setting, ...]]  # of one mapping: for each of its values, the settings of all its keys


class Sweep:
    """The mappings of a sweep; without a sweep there are none."""

    def __init__(self, axes: list[Axis], place: Place) -> None:
        self.axes, self.place = axes, place

    def __len__(self) -> int:
        """Return the number of cases; 0 if the job has no sweep."""
        return math.prod(map(len, self.axes)) if self.axes else 0

    def case(self, index: int) -> tuple[Setting, ...]:
        """Return the settings of a case."""
        moves = next(itertools.islice(itertools.product(*self.axes), index, None))
        return tuple(itertools.chain(*moves))


def take_sweep(source: Source) -> Sweep | None:
    """Remove the sweep from the data of a job and return it; None if it has mistakes, which are noted in `source`."""
    data = source.data if isinstance(source.data, dict) else {}
    section, place = data.get("sweep"), source.locate(SWEEP).place
    mistakes = len(source.mistakes)
    sweep = Sweep([] if section is None else list(_axes(section, source)), place)
    count = math.prod(map(len, sweep.axes)) if sweep.axes else 0  # may be too large for len()
    if count > MAX_CASES:
        source.note(place, f"sweep has {quote(count)} cases; at most {MAX_CASES} are allowed")
    sound = len(source.mistakes) == mistakes and source.locate(SWEEP).readable
    data.pop("sweep", None)
    return sweep if sound else None


def _axes(section: Any, source: Source) -> Iterator[Axis]:
    seen: dict[str, Place] = {}
    listed = isinstance(section, list)
    for index, mapping in enumerate(section if listed else [section]):
        path: Key = (*SWEEP, index) if listed else SWEEP
        if not isinstance(mapping, dict) or not mapping:
            what = "sweep must be a list of mappings from keys to lists of values"
            source.note(source.locate(path).place, f"{what}, got {quote(mapping)}")
            continue
        columns = [_column(name, values, path, source, seen) for name, values in mapping.items()]
        if all(columns) and len({len(column) for column in columns}) > 1:
            counts = ", ".join(f"{len(column)} of {shorten(column[0].name)}" for column in columns)
            what = "keys of one mapping change together and need equal numbers of values"
            source.note(source.locate(path).place, f"{what}, got {counts}")
            continue
        yield list(zip(*columns, strict=False))  # lengths are equal, unless one column has mistakes


def _column(name: str, values: Any, path: Key, source: Source, seen: dict[str, Place]) -> list[Setting]:
    """Return the settings of one key; an empty list, and a mistake in `source`, if its values are wrong."""
    at = source.locate((*path, name))
    place, key_place = at.place, at.key_place
    settings: list[Setting] = []
    if any(name == fixed or name.startswith(f"{fixed}.") for fixed in FIXED):
        source.note(key_place, f"{shorten(name)} cannot be swept")
    elif other := next((one for one in seen if _overlap(one, name)), ""):
        source.note(key_place, f"{shorten(name)} is swept a second time, first as {shorten(other)} at {seen[other]}")
    elif not all(name.split(".")):
        source.note(key_place, f"must be a key of the job like grid.points, got {quote(name)}")
    elif isinstance(values, list) and values:
        places = [source.locate((*path, name, index)).place for index in range(len(values))]
        settings = [Setting(name, value, key_place, one) for value, one in zip(values, places, strict=True)]
    else:
        try:
            numbers = [float(f"{value:.12g}") for value in log_range(str(values))]  # 1e5, not 99999.99999999999
            settings = [Setting(name, value, key_place, place) for value in numbers]
        except ValueError:
            sentence = f"{shorten(name)} needs a list of values or a range first:last:count, got {quote(values)}"
            source.note(place, sentence)
    seen[name] = key_place
    return settings


def _overlap(one: str, other: str) -> bool:
    """Return True if one key is equal to the other or within it."""
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


def refuse_overrides(sweep: Sweep, overrides: list[Setting], source: Source) -> None:
    """Note a mistake for each override of a key that is swept."""
    names = {setting.name for axis in sweep.axes for setting in axis[0]}
    for override in overrides:
        if found := next((swept for swept in names if _overlap(swept, override.name)), ""):
            advice = f"change the sweep instead, like --set 'sweep=[{{{shorten(found)}: [...]}}]'"
            source.note(override.place, f"{shorten(found)} is swept; {advice}")
