"""Jobs given as Python data instead of a file; messages about mistakes name the key."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from .fault import quote, shorten
from .places import NOWHERE, UNREADABLE, Key, Place, Source


def source_of(data: Any, place: Place = NOWHERE) -> Source:
    """Return Python data as a `Source` with one place."""
    source = Source(place=place)
    try:
        source.data = _plain(data, (), source)
    except RecursionError:
        source.data = UNREADABLE
        source.note(place, "is nested too deeply")
    return source


def is_array(value: Any) -> bool:
    """Return True for an array of numpy, or of a library with the same interface."""
    return hasattr(value, "__array__") and getattr(value, "ndim", 0) > 0


def _plain(value: Any, path: Key, source: Source) -> Any:
    """Return a value as plain data, as read from YAML; note a mistake if this is impossible."""
    if is_array(value) and _is_map(value, path):
        return value
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list | tuple | range):
        return [_plain(item, (*path, index), source) for index, item in enumerate(value)]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, (*path, key), source) for key, item in value.items()}
    if isinstance(value, Mapping):
        wrong = f"has a key that is not a text, {quote(next(key for key in value if not isinstance(key, str)))}"
    else:
        wrong = f"must be numbers, texts, lists or mappings, got {shorten(repr(value), 60)}"
    source.note(source.place, f"{'.'.join(map(str, path)) or 'the job'} {wrong}")
    return UNREADABLE


def _is_map(value: Any, path: Key) -> bool:
    """Return True if an array is at the path of heights, or is the value of an override (an empty path)."""
    return path == ("surface",) or path[-1:] == ("heights",) or (value.ndim == 2 and path[:-1] in ((), ("surface",)))
