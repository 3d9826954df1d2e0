"""Plain data with the place of each value in its file, for messages about mistakes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

Key = tuple[str | int, ...]  # the way to a value: ("history", 0, "pressure")


class Place(NamedTuple):
    """A place in a file; `line` is 0 if `origin` is the whole place, such as a command-line override."""

    origin: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.origin}:{self.line}:{self.column}" if self.line else self.origin


class Mistake(NamedTuple):
    """A place and a sentence about the mistake there."""

    place: Place
    sentence: str

    def __str__(self) -> str:
        text = f"{self.place}: {self.sentence}" if self.place.origin else self.sentence
        return text.encode(errors="backslashreplace").decode()  # without halves of surrogate pairs


class _Unreadable:
    def __repr__(self) -> str:
        return "something unreadable"


UNREADABLE: Final = _Unreadable()  # in place of a value whose mistake is already noted
NOWHERE: Final = Place("")


class Located(NamedTuple):
    """The result of following a path: the path as the user wrote it, and the places of its value and of its key.

    The places of a missing value are the place of the mapping that lacks it.
    """

    path: Key
    place: Place
    key_place: Place
    readable: bool = True


@dataclass
class Source:
    """The data of a file, of a mapping or of an override, with its place and its mistakes.

    `places` has the places of key and value by path; other values have the place of the list or mapping around them.
    """

    data: Any = None
    place: Place = NOWHERE
    mistakes: list[Mistake] = field(default_factory=list)
    places: dict[Key, tuple[Place, Place]] = field(default_factory=dict)

    def note(self, place: Place, sentence: str) -> None:
        self.mistakes.append(Mistake(place, sentence))

    def put(self, path: Key, value: Any, key_place: Place, place: Place) -> None:
        """Set a value in an existing mapping or list, with the places of its key and of the value."""
        node = self.data
        for step in path[:-1]:
            node = node[step]
        node[path[-1]] = value
        self.places = {key: known for key, known in self.places.items() if key[: len(path)] != path}
        self.places[path] = key_place, place

    def locate(self, path: Key) -> Located:
        """Follow a path; indices into a list that was given as a single value are ignored."""
        node, place, key_place, steps = self.data, self.place, self.place, Key()
        for step in path:
            if isinstance(node, dict | list) and (step in node if isinstance(node, dict) else step in range(len(node))):
                node, steps = node[step], (*steps, step)  # type: ignore[index]
                key_place, place = self.places.get(steps, (place, place))
            elif isinstance(node, dict) and isinstance(step, str):
                return Located((*steps, step), place, place)
        return Located(steps, place, key_place, not _holds_unreadable(node))


def _holds_unreadable(node: Any) -> bool:
    items = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return node is UNREADABLE or any(map(_holds_unreadable, items))
