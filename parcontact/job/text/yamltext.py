"""YAML text as a `Source`: plain data that remembers where each value and key was written.

Two things differ from PyYAML's own reading: `1e-3` is a number, and equal keys in one mapping are a mistake instead of
the last one winning. Numbers are decimal: `12:30` and `010` are text. What a text may grow to is bounded: its own size,
its values once all aliases are followed, and the depth of its nesting.
"""

from __future__ import annotations

import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from .fault import shorten
from .places import UNREADABLE, Key, Place, PlacedDict, PlacedList, Source, put

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
# Bounds against texts that a broken program has written; no job comes near them.
MAX_BYTES = 2_000_000  # of a file
MAX_VALUES = 100_000  # of a text, an alias counting as all that it stands for
MAX_DEPTH = 60  # of values within values
MAX_DIGITS = 50  # of a whole number


def _implicit_resolvers() -> dict[str, list[tuple[str, re.Pattern[str]]]]:
    resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}
    for tag, pattern, first_characters in RESOLVERS:
        for character in first_characters:
            resolvers.setdefault(character, []).append((YAML_TAG + tag, re.compile(pattern)))
    return resolvers


class JobLoader(yaml.SafeLoader):
    """PyYAML's safe loader with the numbers of this module's docstring."""

    yaml_implicit_resolvers = _implicit_resolvers()


class JobDumper(yaml.SafeDumper):
    """PyYAML's safe dumper that quotes exactly the texts which `JobLoader` would take for something else."""

    yaml_implicit_resolvers = _implicit_resolvers()


JobDumper.add_representer(PlacedDict, yaml.SafeDumper.represent_dict)
JobDumper.add_representer(PlacedList, yaml.SafeDumper.represent_list)


def dump(data: Any) -> str:
    """Return plain data as YAML text that `parse` reads back as equal data."""
    return yaml.dump(data, Dumper=JobDumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=120)


def read(path: Path, shown: str) -> Source:
    """Return the `Source` of a YAML file, called `shown` in messages; one that cannot be read is a mistake in it."""
    return read_with_content(path, shown)[1]


def read_with_content(path: Path, shown: str) -> tuple[bytes, Source]:
    """Return the bytes of a YAML file too."""
    try:
        if not stat.S_ISREG(path.stat().st_mode) and not path.is_dir():  # a pipe might never end
            raise OSError(0, "it is no regular file")
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return content, parse(content, shown)
        reason = f"it is larger than {MAX_BYTES / 1e6:g} MB, which no job is"
    except FileNotFoundError:
        reason = "there is no such file"
    except (OSError, ValueError) as error:  # ValueError: a null character in its name
        reason = getattr(error, "strerror", None) or str(error)
    found = Source(UNREADABLE, Place(shorten(shown)))
    found.note(found.place, f"cannot be read: {reason}")
    return b"", found


def parse(text: str | bytes, origin: str, whole: Place | None = None) -> Source:
    """Return YAML text as a `Source`; `origin` names it in places, unless `whole` is the one place of all of it."""
    start = whole or Place(origin, 1, 1)
    source = Source(UNREADABLE, start)
    reader = _Reader(source, origin, whole)
    try:
        source.data = reader.read(text)
    except yaml.MarkedYAMLError as error:
        began = f" ({error.context} in line {error.context_mark.line + 1})" if error.context_mark else ""
        mark = error.problem_mark or error.context_mark
        source.note(reader.place(mark), f"cannot be read as YAML: {error.problem}{began}")
    except yaml.reader.ReaderError as error:
        source.note(start, f"is not a text file in UTF-8: {error.reason} at position {error.position}")
    except yaml.YAMLError as error:
        source.note(start, str(error))
    except RecursionError:
        source.note(start, "cannot be read as YAML: it is nested too deeply")
    return source


def _unwritable(text: str) -> str:
    """Return what keeps a text from being written or being the name of a file, or ''."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        return f"this text is not UTF-8: {error.reason} at position {error.start}"
    return "a text must not hold a null character" if "\0" in text else ""


class _Reader:
    """Turns YAML nodes into plain data with places; mistakes go into a `Source`."""

    def __init__(self, source: Source, origin: str, whole: Place | None):
        self.source, self.origin, self.whole = source, origin, whole
        self.open: list[int] = []  # the nodes that hold the current one: an alias to one of them would never end
        self.count = 0  # of values so far

    def place(self, mark: yaml.Mark | None) -> Place:
        if self.whole is not None or mark is None:
            return self.source.place
        return Place(self.origin, mark.line + 1, mark.column + 1)

    def refuse(self, node: yaml.Node, sentence: str) -> Any:
        self.source.note(self.place(node.start_mark), sentence)
        return UNREADABLE

    def read(self, text: str | bytes) -> Any:
        self.loader = JobLoader(text)
        root = self.loader.get_single_node()
        return None if root is None else self.value(root, ())

    def value(self, node: yaml.Node, path: Key) -> Any:
        self.count += 1
        if self.count > MAX_VALUES:
            raise yaml.YAMLError(f"has more than {MAX_VALUES} values once its aliases are followed, which no job has")
        if len(path) > MAX_DEPTH:
            raise yaml.YAMLError(f"cannot be read as YAML: it is nested too deeply, by more than {MAX_DEPTH} levels")
        if id(node) in self.open:
            return self.refuse(node, "this alias holds itself")
        self.open.append(id(node))
        try:
            if isinstance(node, yaml.MappingNode) and node.tag == YAML_TAG + "map":
                return self.mapping(node, path)
            if isinstance(node, yaml.SequenceNode) and node.tag == YAML_TAG + "seq":
                places = [self.place(child.start_mark) for child in node.value]
                return PlacedList((self.value(child, (*path, i)) for i, child in enumerate(node.value)), places)
            return self.scalar(node)
        finally:
            self.open.pop()

    def scalar(self, node: yaml.Node) -> Any:
        if isinstance(node, yaml.ScalarNode) and node.tag in SCALAR_TAGS:
            if node.tag == YAML_TAG + "int" and len(node.value) > MAX_DIGITS:
                return self.refuse(node, f"a whole number of {len(node.value)} digits is too large")
            if wrong := _unwritable(node.value):
                return self.refuse(node, wrong)
            try:
                return self.loader.construct_object(node)
            except (ValueError, LookupError):  # !!int ''
                pass
        return self.refuse(node, f"{shorten(node.tag.replace(YAML_TAG, '!!'))} does not belong in a job")

    def mapping(self, node: yaml.MappingNode, path: Key) -> PlacedDict:
        """Return a mapping; what `<<` merges comes last, and only where the mapping has no such key."""
        found = PlacedDict()
        merged: list[yaml.Node] = []
        for key, child in node.value:
            if key.tag == YAML_TAG + "merge":
                merged += child.value if isinstance(child, yaml.SequenceNode) else [child]
            elif not isinstance(key, yaml.ScalarNode) or key.tag != YAML_TAG + "str":
                got = repr(shorten(key.value)) if isinstance(key, yaml.ScalarNode) else "a list or a mapping"
                self.refuse(key, f"a key must be a word, got {got}")
            elif key.value in found:
                name, line = ".".join(map(str, (*path, key.value))), found.keys_at[key.value].line
                self.refuse(key, f"{shorten(name)} is given twice" + f", first in line {line}" * bool(line))
            else:
                value = self.value(child, (*path, key.value))
                put(found, key.value, value, self.place(key.start_mark), self.place(child.start_mark))
        for inherited in self.merged(merged, path):
            for word in [word for word in inherited if word not in found]:
                put(found, word, inherited[word], inherited.keys_at[word], inherited.values_at[word])
        return found

    def merged(self, nodes: list[yaml.Node], path: Key) -> Iterator[PlacedDict]:
        for node in nodes:
            inherited = self.value(node, path) if isinstance(node, yaml.MappingNode) else None
            if isinstance(inherited, PlacedDict):
                yield inherited
            elif inherited is None:
                self.refuse(node, "<< takes a mapping, or a list of mappings")
