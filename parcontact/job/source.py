"""YAML text as plain data that remembers where each value and key was written.

A `Source` holds the data of one job and the place (file, line, column) of every value and key in it, so that a mistake
found much later can still point at the text. Two things differ from PyYAML's own reading: `1e-3` is a number, and equal
keys in one mapping are a mistake instead of the last one winning. Numbers are decimal: `12:30` and `010` are text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, cast

import yaml

Key = tuple[str | int, ...]  # the way to a value: ("history", 0, "pressure")

YAML_TAG = "tag:yaml.org,2002:"
RESOLVERS = (  # tag, what such a scalar looks like, first characters; tried in this order
    ("bool", r"^(?:yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF)$", "yYnNtTfFoO"),
    ("int", r"^[-+]?(?:0|[1-9][0-9_]*)$", "-+0123456789"),
    ("float", r"^[-+]?(?:[0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)[eE][-+]?[0-9]+$", "-+.0123456789"),
    ("float", r"^[-+]?(?:[0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*)$", "-+.0123456789"),
    ("float", r"^[-+]?\.(?:inf|Inf|INF)$|^\.(?:nan|NaN|NAN)$", "-+."),
    ("merge", r"^<<$", "<"),
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
)
SCALAR_TAGS = tuple(YAML_TAG + name for name in ("bool", "int", "float", "null", "str"))


def _implicit_resolvers() -> dict[str, list[tuple[str, re.Pattern[str]]]]:
    table: dict[str, list[tuple[str, re.Pattern[str]]]] = {}
    for tag, pattern, first_characters in RESOLVERS:
        for character in first_characters:
            table.setdefault(character, []).append((YAML_TAG + tag, re.compile(pattern)))
    return table


class JobLoader(yaml.SafeLoader):
    """PyYAML's safe loader with the numbers of this module's docstring."""

    yaml_implicit_resolvers = _implicit_resolvers()


class JobDumper(yaml.SafeDumper):
    """PyYAML's safe dumper that quotes exactly the texts which `JobLoader` would take for something else."""

    yaml_implicit_resolvers = _implicit_resolvers()


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
        return f"{self.place}: {self.sentence}"


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

    def graft(self, path: Key, other: Source) -> None:
        """Takes over the places and mistakes of `other`, whose data was put at `path`."""
        self.values.update({path + known: place for known, place in other.values.items()})
        self.keys.update({path + known: place for known, place in other.keys.items()})
        self.broken.update(path + known for known in other.broken)
        self.mistakes.extend(other.mistakes)


def parse(text: str | bytes, origin: str, whole: Place | None = None) -> Source:
    """YAML text as a `Source`; `origin` names it in places, unless `whole` is the one place of all of it."""
    source = Source()
    reader = _Reader(source, origin, whole)
    try:
        reader.read(text)
    except yaml.YAMLError as error:
        source.mistakes.append(_syntax_mistake(error, reader.place))
        source.broken.add(())
    except RecursionError:
        source.mistakes.append(Mistake(reader.place(None), "cannot be read as YAML: it is nested too deeply"))
        source.broken.add(())
    return source


def read(path: Path, shown: str) -> Source:
    """The `Source` of a YAML file, called `shown` in messages; a file that cannot be read is a mistake in it."""
    try:
        content = path.read_bytes()
    except OSError as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else error.strerror
        return Source(mistakes=[Mistake(Place(shown), f"cannot be read: {reason}")], broken={()})
    return parse(content, shown)


def dump(data: Any) -> str:
    """Plain data as YAML text that `parse` reads back as equal data."""
    return yaml.dump(data, Dumper=JobDumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=120)


def _syntax_mistake(error: yaml.YAMLError, place: Callable[[yaml.Mark | None], Place]) -> Mistake:
    if isinstance(error, yaml.MarkedYAMLError):
        began = error.context_mark and f" ({error.context} in line {error.context_mark.line + 1})"
        mark = error.problem_mark or error.context_mark
        return Mistake(place(mark), f"cannot be read as YAML: {error.problem}{began or ''}")
    if isinstance(error, yaml.reader.ReaderError):
        return Mistake(place(None), f"is not a text file in UTF-8: {error.reason} at position {error.position}")
    return Mistake(place(None), f"cannot be read as YAML: {error}")


class _Reader:
    """Fills a `Source` from text: composes the YAML nodes and walks them."""

    def __init__(self, source: Source, origin: str, whole: Place | None):
        self.source = source
        self.origin = origin
        self.whole = whole
        self.open: list[int] = []  # the nodes that hold the current one: an alias to one of them would never end

    def place(self, mark: yaml.Mark | None) -> Place:
        if self.whole is not None:
            return self.whole
        return Place(self.origin, mark.line + 1, mark.column + 1) if mark else Place(self.origin, 1, 1)

    def note(self, node: yaml.Node, sentence: str) -> None:
        mistake = Mistake(self.place(node.start_mark), sentence)
        if mistake not in self.source.mistakes:
            self.source.mistakes.append(mistake)

    def read(self, text: str | bytes) -> None:
        self.loader = JobLoader(text)
        try:
            root = self.loader.get_single_node()
            self.source.values[()] = self.place(None)
            if root is not None:
                self.source.data = self.value(root, ())
        finally:
            self.loader.dispose()

    def value(self, node: yaml.Node, path: Key) -> Any:
        self.source.values[path] = self.place(node.start_mark)
        if id(node) in self.open:
            self.note(node, "this alias holds itself")
            self.source.broken.add(path)
            return None
        self.open.append(id(node))
        try:
            return self.content(node, path)
        finally:
            self.open.pop()

    def content(self, node: yaml.Node, path: Key) -> Any:
        if isinstance(node, yaml.MappingNode) and node.tag == YAML_TAG + "map":
            return {key: self.value(child, (*path, key)) for key, child in self.entries(node, path)}
        if isinstance(node, yaml.SequenceNode) and node.tag == YAML_TAG + "seq":
            return [self.value(child, (*path, index)) for index, child in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode) and node.tag in SCALAR_TAGS:
            try:
                return self.loader.construct_object(node)
            except (ValueError, KeyError):
                pass
        self.note(node, f"{node.tag.replace(YAML_TAG, '!!')} does not belong in a job")
        self.source.broken.add(path)
        return None

    def entries(self, node: yaml.MappingNode, path: Key) -> Iterator[tuple[str, yaml.Node]]:
        """Keys and values of a mapping; what `<<` merges comes last and only where the mapping has no such key."""
        seen: dict[str, int] = {}
        merged: list[yaml.Node] = []
        for key_node, child in node.value:
            if key_node.tag == YAML_TAG + "merge":
                merged += child.value if isinstance(child, yaml.SequenceNode) else [child]
            elif not isinstance(key_node, yaml.ScalarNode) or key_node.tag != YAML_TAG + "str":
                got = repr(key_node.value) if isinstance(key_node, yaml.ScalarNode) else "a list or a mapping"
                self.note(key_node, f"a key must be a word, got {got}")
            elif key_node.value in seen:
                name = ".".join(map(str, (*path, key_node.value)))
                self.note(key_node, f"{name} is given twice, first in line {seen[key_node.value]}")
            else:
                seen[key_node.value] = key_node.start_mark.line + 1
                self.source.keys.setdefault((*path, key_node.value), self.place(key_node.start_mark))
                yield key_node.value, child
        yield from self.merged_entries(merged, seen, path)

    def merged_entries(
        self, nodes: list[yaml.Node], seen: dict[str, int], path: Key
    ) -> Iterator[tuple[str, yaml.Node]]:
        for node in nodes:
            if not isinstance(node, yaml.MappingNode):
                self.note(node, "<< takes a mapping, or a list of mappings")
            elif id(node) in self.open:
                self.note(node, "this alias holds itself")
            else:
                self.open.append(id(node))
                inherited = list(self.entries(node, path))
                self.open.pop()
                for key, child in inherited:
                    if key not in seen:
                        seen[key] = child.start_mark.line + 1
                        yield key, child
