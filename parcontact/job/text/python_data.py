"""Jobs given as Python data instead of a file: as good as a file, and a mistake names the key."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from .fault import quote, shorten
from .places import NOWHERE, UNREADABLE, Key, Place, PlacedDict, PlacedList, Source
from .yamltext import MAX_DEPTH


def source_of(data: Any, place: Place = NOWHERE) -> Source:
    """Return plain data as a `Source` all of which was written at one place."""
    source = Source(place=place)
    source.data = _plain(data, (), source)
    return source


def is_array(value: Any) -> bool:
    """Return whether a value is an array, of numpy or as good as one."""
    return hasattr(value, "__array__") and getattr(value, "ndim", 0) > 0


def _plain(value: Any, path: Key, source: Source) -> Any:
    """Return a value as what YAML could have been read as; what cannot be is a mistake."""
    if is_array(value) and _is_map(value, path):
        return value
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    wrong = f"must be numbers, texts, lists or mappings, got {shorten(repr(value), 60)}"
    if len(path) > MAX_DEPTH:
        wrong = "is nested too deeply"
    elif isinstance(value, Mapping):
        if all(isinstance(key, str) for key in value):
            return PlacedDict((key, _plain(item, (*path, key), source)) for key, item in value.items())
        wrong = f"has a key that is no word, {quote(next(key for key in value if not isinstance(key, str)))}"
    elif isinstance(value, list | tuple | range):
        return PlacedList(_plain(item, (*path, index), source) for index, item in enumerate(value))
    source.note(source.place, f"{'.'.join(map(str, path)) or 'the job'} {wrong}")
    return UNREADABLE


def _is_map(value: Any, path: Key) -> bool:
    """Return whether an array stands where heights are due; one without a key is the value of an override."""
    return path == ("surface",) or path[-1:] == ("heights",) or (value.ndim == 2 and path[:-1] in ((), ("surface",)))
