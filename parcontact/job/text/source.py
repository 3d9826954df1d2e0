"""Plain data that remembers where each value and key was written, and the mistakes met on the way.

A `Source` holds the data of one job and the place (file, line, column) of every value and key in it, so that a mistake
found much later can still point at the text.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

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


@dataclass
class Source:
    """Plain data with the places of its values and keys, the mistakes met so far, and where data cannot be trusted."""

    data: Any = None
    values: dict[Key, Place] = field(default_factory=dict)
    keys: dict[Key, Place] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    broken: set[Key] = field(default_factory=set)

    def place(self, path: Key) -> Place:
        """Where the value at `path` was written, or else the nearest thing that holds it."""
        while path not in self.values and path:
            path = path[:-1]
        return self.values.get(path, Place(""))

    def key_place(self, path: Key) -> Place:
        """Where the key at the end of `path` was written."""
        return self.keys.get(path) or self.place(path)

    def written(self, path: Key) -> Key:
        """`path` as the user wrote it: without the steps into lists that were given as one value."""
        steps: list[str | int] = []
        node = self.data
        for step in path:
            if (isinstance(node, dict) and step in node) or (isinstance(node, list) and step in range(len(node))):
                node = node[cast(Any, step)]
                steps.append(step)
            elif isinstance(node, dict) and isinstance(step, str):
                return (*steps, step)
        return tuple(steps)

    def forget(self, path: Key) -> None:
        """Drops every place at and under `path`."""
        for table in (self.values, self.keys):
            for known in [known for known in table if known[: len(path)] == path]:
                del table[known]

    def untrusted(self) -> set[Key]:
        """The ways to all that could not be read, and to what holds it."""
        return {path[:length] for path in self.broken for length in range(len(path) + 1)}

    def within_broken(self, path: Key) -> bool:
        """Whether a path leads to or through something that could not be read."""
        return any(path[:length] in self.broken for length in range(len(path) + 1))

    def graft(self, path: Key, other: Source) -> None:
        """Takes over the places and mistakes of `other`, whose data was put at `path`."""
        self.values.update({path + known: place for known, place in other.values.items()})
        self.keys.update({path + known: place for known, place in other.keys.items()})
        self.broken.update(path + known for known in other.broken)
        self.mistakes.extend(other.mistakes)


def shorten(text: str, most: int = 200) -> str:
    """A text without its middle where it is too long to be read."""
    return text if len(text) <= most else f"{text[: most // 2]}...{text[-most // 4 :]}"
