"""Plain data that remembers where each key and value was written, so that a mistake found later points at the text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

Key = tuple[str | int, ...]  # the way to a value: ("history", 0, "pressure")


class Place(NamedTuple):
    """Where something was written. `line` 0 means that `origin` says it all (a command-line override)."""

    origin: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.origin}:{self.line}:{self.column}" if self.line else self.origin


class Mistake(NamedTuple):
    """One sentence about what is wrong at a place."""

    place: Place
    sentence: str

    def __str__(self) -> str:
        return f"{self.place}: {self.sentence}" if self.place.origin else self.sentence


class _Unreadable:
    def __repr__(self) -> str:
        return "something unreadable"


UNREADABLE: Final = _Unreadable()  # stands for a value whose mistake is known already
NOWHERE: Final = Place("")


class PlacedDict(dict[str, Any]):
    """A mapping with the places of its keys and of their values."""

    def __init__(self, data: Iterable[tuple[str, Any]] = ()) -> None:
        super().__init__(data)
        self.keys_at: dict[str, Place] = {}
        self.values_at: dict[str, Place] = {}


class PlacedList(list[Any]):
    """A list with the places of its values."""

    def __init__(self, data: Iterable[Any] = (), values_at: Iterable[Place] = ()) -> None:
        super().__init__(data)
        self.values_at = dict(enumerate(values_at))


def put(node: Any, key: str | int, value: Any, key_at: Place, value_at: Place) -> None:
    """Set a value of a mapping or a list, and where it and its key were written."""
    node[key] = value
    if isinstance(node, PlacedDict | PlacedList):
        node.values_at[key] = value_at  # type: ignore[index]
    if isinstance(node, PlacedDict):
        node.keys_at[str(key)] = key_at


class Located(NamedTuple):
    """The end of a path: the path as the user wrote it, the value, and the places of key and value.

    Where something is missing, place and value are those of what should hold it.
    """

    path: Key
    value: Any
    place: Place
    key_place: Place
    readable: bool


@dataclass
class Source:
    """The data of a file, of a mapping or of an override, where all of it was written, and the mistakes in it."""

    data: Any = None
    place: Place = NOWHERE
    mistakes: list[Mistake] = field(default_factory=list)

    def note(self, place: Place, sentence: str) -> None:
        """Add a mistake."""
        self.mistakes.append(Mistake(place, sentence))

    def locate(self, path: Key) -> Located:
        """Follow a path; steps into a list that was given as one value are left out."""
        node, place, key_place, steps = self.data, self.place, self.place, list[str | int]()
        readable = node is not UNREADABLE
        for step in path:
            if isinstance(node, dict | list) and (step in node if isinstance(node, dict) else step in range(len(node))):
                place = getattr(node, "values_at", {}).get(step, place)
                key_place = getattr(node, "keys_at", {}).get(step, place)
                node = node[step]  # type: ignore[index]
                steps.append(step)
                readable = readable and node is not UNREADABLE
            elif isinstance(node, dict) and isinstance(step, str):
                return Located((*steps, step), node, place, place, readable)
        return Located(tuple(steps), node, place, key_place, readable and not _holds_unreadable(node))


def _holds_unreadable(node: Any) -> bool:
    items = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return node is UNREADABLE or any(map(_holds_unreadable, items))
