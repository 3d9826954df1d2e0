"""Plain data beside the places where they were written, so that a mistake found later points at the text."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

Key = tuple[str | int, ...]  # the way to a value: ("history", 0, "pressure")


class Place(NamedTuple):
    """A place where something was written. `line` 0 means that `origin` says it all (a command-line override)."""

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


class Located(NamedTuple):
    """The end of a path: the path as the user wrote it, and the places of its value and of its key.

    Where something is missing, both places are those of what should hold it.
    """

    path: Key
    place: Place
    key_place: Place
    readable: bool = True


@dataclass
class Source:
    """The data of a file, of a mapping or of an override, where all of it was written, and the mistakes in it.

    `places` has the places of key and value by the way to them; what it lacks was written where its holder was.
    """

    data: Any = None
    place: Place = NOWHERE
    mistakes: list[Mistake] = field(default_factory=list)
    places: dict[Key, tuple[Place, Place]] = field(default_factory=dict)

    def note(self, place: Place, sentence: str) -> None:
        self.mistakes.append(Mistake(place, sentence))

    def put(self, path: Key, value: Any, key_place: Place, place: Place) -> None:
        """Set a value of a mapping or a list that is there, and where its key and all of it were written."""
        node = self.data
        for step in path[:-1]:
            node = node[step]
        node[path[-1]] = value
        self.places = {key: known for key, known in self.places.items() if key[: len(path)] != path}
        self.places[path] = key_place, place

    def locate(self, path: Key) -> Located:
        """Follow a path; steps into a list that was given as one value are left out."""
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
