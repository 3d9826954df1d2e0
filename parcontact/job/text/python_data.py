"""Jobs given as Python data instead of a file: as good as a file, and a mistake names the key.

Keys have no place but their names. Numbers may be of numpy, and texts that PyYAML's own `safe_load` leaves for numbers
(`1.0e6`, `1e-3`) are numbers wherever a number is due.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, cast

from .fault import quote
from .source import Key, Mistake, Place, Source, shorten
from .yamltext import parse

DEEPEST = 50  # mappings and lists in each other
NOWHERE = Place("")


def source_of(data: Any, place: Place = NOWHERE) -> Source:
    """Plain data as a `Source` all of which was written at one place."""
    source = Source(values={(): place}, mistakes=[])
    source.data = _plain(data, (), source, place)
    return source


def numbers_for_texts(source: Source, paths: list[Key]) -> bool:
    """Put numbers where Python data has texts that read as such, at those of the paths; whether there were any."""
    given = [path for path in dict.fromkeys(paths) if source.place(path).line == 0]
    found = [path for path in given if _number(source, path) is not None]
    for path in found:
        holder: Any = source.data
        for step in path[:-1]:
            holder = holder[cast(Any, step)]
        holder[path[-1]] = _number(source, path)
    return bool(found)


def _number(source: Source, path: Key) -> int | float | None:
    """The number that a text at a path stands for."""
    node = source.data
    for step in path:
        try:
            node = node[cast(Any, step)]
        except (KeyError, IndexError, TypeError):
            return None
    if not path or not isinstance(node, str) or len(node) > 400:
        return None
    value = parse(node, "").data
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def _plain(value: Any, path: Key, source: Source, place: Place) -> Any:
    """A value as what YAML could have been read as; what cannot be is a mistake."""
    if is_array(value) and _is_map(value, path):
        return value
    if hasattr(value, "tolist"):  # numpy's numbers and arrays
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if len(path) > DEEPEST:
        return _refuse(source, path, place, "is nested too deeply")
    if isinstance(value, Mapping):
        return {key: _plain(item, (*path, key), source, place) for key, item in _entries(value, path, source, place)}
    if isinstance(value, list | tuple | range):
        return [_plain(item, (*path, index), source, place) for index, item in enumerate(value)]
    return _refuse(source, path, place, f"must be numbers, texts, lists or mappings, got {shorten(repr(value), 60)}")


def is_array(value: Any) -> bool:
    """Whether a value of Python data is an array, of numpy or as good as one."""
    return hasattr(value, "__array__") and getattr(value, "ndim", 0) > 0


def _is_map(value: Any, path: Key) -> bool:
    """Whether an array stands where heights are due; one without a key is the value of an override."""
    return path == ("surface",) or path[-1:] == ("heights",) or (value.ndim == 2 and path[:-1] in ((), ("surface",)))


def _entries(value: Mapping[Any, Any], path: Key, source: Source, place: Place) -> list[tuple[str, Any]]:
    for key in value:
        if not isinstance(key, str):
            _refuse(source, path, place, f"has a key that is no word, {quote(key)}")
    return [(key, item) for key, item in value.items() if isinstance(key, str)]


def _refuse(source: Source, path: Key, place: Place, predicate: str) -> None:
    source.mistakes.append(Mistake(place, f"{'.'.join(map(str, path)) or 'the job'} {predicate}"))
    source.broken.add(path)
