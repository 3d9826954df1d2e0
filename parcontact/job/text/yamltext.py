"""YAML text as a `Source`: plain data that remembers where each value and key was written.

Two things differ from PyYAML's own reading: `1e-3` is a number, and equal keys in one mapping are a mistake instead of
the last one winning. Numbers are decimal: `12:30` and `010` are text. What a text may grow to is bounded: its own size,
its values once all aliases are followed, and the depth of its nesting.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.cyaml import CParser  # type: ignore[attr-defined]
from yaml.resolver import Resolver

from .source import Key, Mistake, Place, Source, shorten

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
MAX_BYTES = 2_000_000  # of a file
MAX_VALUES = 100_000  # of a text, an alias counting as all that it stands for
MAX_DEPTH = 60  # of values within values
MAX_DIGITS = 50  # of a whole number
MANY = 6_000  # characters, beyond which speed counts more than messages

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


class FastLoader(Composer, CParser, SafeConstructor, Resolver):
    """The same with libyaml's parser, several times as fast; its messages say less.

    Nodes are composed in Python, as libyaml's own way ends the process where nesting is too deep for the stack.
    """

    yaml_implicit_resolvers = _implicit_resolvers()

    def __init__(self, text: str | bytes) -> None:
        CParser.__init__(self, text)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)


class TooMuchError(Exception):
    """More than a job may hold, said as the rest of a sentence."""


class JobDumper(yaml.SafeDumper):
    """PyYAML's safe dumper that quotes exactly the texts which `JobLoader` would take for something else."""

    yaml_implicit_resolvers = _implicit_resolvers()


def parse(text: str | bytes, origin: str, whole: Place | None = None) -> Source:
    """YAML text as a `Source`; `origin` names it in places, unless `whole` is the one place of all of it."""
    if isinstance(text, str) and (wrong := _unwritable(text)):
        return Source(mistakes=[Mistake(whole or Place(origin, 1, 1), wrong)], broken={()})
    loader = JobLoader if len(text) <= MANY else FastLoader
    source = Source()
    reader = _Reader(source, origin, whole)
    mistake: Mistake | None = None
    try:
        reader.read(loader, text)
    except yaml.YAMLError as error:
        mistake = _syntax_mistake(error, reader.place)
    except RecursionError:
        mistake = Mistake(reader.place(None), "cannot be read as YAML: it is nested too deeply")
    except TooMuchError as error:
        mistake = Mistake(reader.place(None), str(error))
    if mistake:
        source.mistakes.append(mistake)
        source.broken.add(())
    return source


def _unwritable(text: str) -> str:
    """What keeps a text from being written or being the name of a file, or ''."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        return f"this text is not UTF-8: {error.reason} at position {error.start}"
    return "a text must not hold a null character" if "\0" in text else ""


def read(path: Path, shown: str) -> Source:
    """The `Source` of a YAML file, called `shown` in messages; a file that cannot be read is a mistake in it."""
    return read_with_content(path, shown)[1]


def read_with_content(path: Path, shown: str) -> tuple[bytes, Source]:
    """The bytes of a YAML file too."""
    try:
        content = _content(path)
        return content, parse(content, shown)
    except FileNotFoundError:
        reason = "there is no such file"
    except OSError as error:
        reason = error.strerror or str(error)
    except ValueError as error:  # a null character in its name
        reason = str(error)
    return b"", Source(mistakes=[Mistake(Place(shorten(shown)), f"cannot be read: {reason}")], broken={()})


def _content(path: Path) -> bytes:
    """Bytes of a regular file of bounded size; a pipe or a device, which might never end, is not opened at all."""
    if stat.S_ISREG(path.stat().st_mode) or path.is_dir():
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return content
        raise OSError(0, f"it is larger than {MAX_BYTES / 1e6:g} MB, which no job is")
    raise OSError(0, "it is no regular file")


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
        self.noted: set[Mistake] = set()
        self.count = 0  # of values so far

    def place(self, mark: yaml.Mark | None) -> Place:
        if self.whole is not None:
            return self.whole
        return Place(self.origin, mark.line + 1, mark.column + 1) if mark else Place(self.origin, 1, 1)

    def note(self, node: yaml.Node, sentence: str) -> None:
        mistake = Mistake(self.place(node.start_mark), sentence)
        if mistake not in self.noted:
            self.noted.add(mistake)
            self.source.mistakes.append(mistake)

    def count_one(self) -> None:
        self.count += 1
        if self.count > MAX_VALUES:
            raise TooMuchError(f"has more than {MAX_VALUES} values once its aliases are followed, which no job has")

    def read(self, loader: type[Any], text: str | bytes) -> None:
        self.loader = loader(text)
        try:
            root = self.loader.get_single_node()
            self.source.values[()] = self.place(None)
            if root is not None:
                self.source.data = self.value(root, ())
        finally:
            self.loader.dispose()

    def value(self, node: yaml.Node, path: Key) -> Any:
        self.count_one()
        if len(path) > MAX_DEPTH:
            raise TooMuchError(f"cannot be read as YAML: it is nested too deeply, by more than {MAX_DEPTH} levels")
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
            if node.tag == YAML_TAG + "int" and len(node.value) > MAX_DIGITS:
                self.note(node, f"a whole number of {len(node.value)} digits is too large")
                self.source.broken.add(path)
                return None
            if wrong := _unwritable(node.value):
                self.note(node, wrong)
                self.source.broken.add(path)
                return None
            with suppress(ValueError, LookupError):
                return self.loader.construct_object(node)
        self.note(node, f"{shorten(node.tag.replace(YAML_TAG, '!!'))} does not belong in a job")
        self.source.broken.add(path)
        return None

    def entries(self, node: yaml.MappingNode, path: Key) -> Iterator[tuple[str, yaml.Node]]:
        """Keys and values of a mapping; what `<<` merges comes last and only where the mapping has no such key."""
        seen: dict[str, int] = {}
        merged: list[yaml.Node] = []
        for key_node, child in node.value:
            self.count_one()
            if key_node.tag == YAML_TAG + "merge":
                merged += child.value if isinstance(child, yaml.SequenceNode) else [child]
            elif not isinstance(key_node, yaml.ScalarNode) or key_node.tag != YAML_TAG + "str":
                got = repr(shorten(key_node.value)) if isinstance(key_node, yaml.ScalarNode) else "a list or a mapping"
                self.note(key_node, f"a key must be a word, got {got}")
            elif key_node.value in seen:
                name = shorten(".".join(map(str, (*path, key_node.value))))
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


def dump(data: Any) -> str:
    """Plain data as YAML text that `parse` reads back as equal data."""
    return yaml.dump(data, Dumper=JobDumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=120)
