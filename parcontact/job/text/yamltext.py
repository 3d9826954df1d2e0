"""YAML text as a `Source`: plain data with the places of all values and keys.

Unlike in PyYAML, `1e-3` is a number, repeated keys are a mistake, and numbers are decimal: `12:30` and `010` are text.
The size of a text and the number of its values after expansion of aliases are limited.
"""

from __future__ import annotations

import re
import stat
from pathlib import Path
from typing import Any

import yaml

from .fault import is_storable, shorten
from .places import UNREADABLE, Key, Place, Source

YAML_TAG = "tag:yaml.org,2002:"
RESOLVERS = (  # tag, pattern of its scalars, their first characters; tried in this order
    ("bool", r"^(?:yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF)$", "yYnNtTfFoO"),
    ("int", r"^[-+]?(?:0|[1-9][0-9_]*)$", "-+0123456789"),
    ("float", r"^[-+]?(?:[0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)[eE][-+]?[0-9]+$", "-+.0123456789"),
    ("float", r"^[-+]?(?:[0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*)$", "-+.0123456789"),
    ("float", r"^[-+]?\.(?:inf|Inf|INF)$|^\.(?:nan|NaN|NAN)$", "-+."),
    ("merge", r"^<<$", "<"),
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
)
SCALAR_TAGS = tuple(YAML_TAG + name for name in ("bool", "int", "float", "null", "str"))
# Limits far above the size of any job, against broken files.
MAX_BYTES = 2_000_000  # tuning: largest size of a file [bytes]
MAX_VALUES = 100_000  # tuning: most values in a text after its YAML aliases are expanded


def _implicit_resolvers() -> dict[str, list[tuple[str, re.Pattern[str]]]]:
    resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}
    for tag, pattern, first_characters in RESOLVERS:
        for character in first_characters:
            resolvers.setdefault(character, []).append((YAML_TAG + tag, re.compile(pattern)))
    return resolvers


class JobLoader(yaml.SafeLoader):
    """PyYAML's safe loader with RESOLVERS."""

    yaml_implicit_resolvers = _implicit_resolvers()


class JobDumper(yaml.SafeDumper):
    """PyYAML's safe dumper with RESOLVERS: it quotes texts that `JobLoader` would not read as text."""

    yaml_implicit_resolvers = _implicit_resolvers()


def dump(data: Any) -> str:
    """Return plain data as YAML text that `parse` reads back as equal data."""
    return yaml.dump(data, Dumper=JobDumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=120)


def read_source(path: Path, shown: str) -> Source:
    """Return the `Source` of a YAML file, called `shown` in messages; an unreadable file is noted as a mistake."""
    return read_with_content(path, shown)[1]


def read_with_content(path: Path, shown: str) -> tuple[bytes, Source]:
    """Return the bytes of a YAML file, and its `Source`."""
    try:
        if not stat.S_ISREG(path.stat().st_mode) and not path.is_dir():  # a pipe might never end
            raise OSError(0, "it is not a regular file")
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return content, parse(content, shown)
        reason = f"it is larger than {MAX_BYTES / 1e6:g} MB, the limit for a job"
    except FileNotFoundError:
        reason = "there is no such file"
    except (OSError, ValueError) as error:  # ValueError: a null character in its name
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, IsADirectoryError) and (path / "job.resolved.yaml").is_file():
            reason += f"; the job of the run in it is {Path(shown) / 'job.resolved.yaml'}"
    found = Source(UNREADABLE, Place(shorten(shown)))
    found.note(found.place, f"cannot be read: {reason}")
    return b"", found


def _remedy(problem: str) -> str:
    """Return the remedy for a frequent message of PyYAML, or ''."""
    if "\\t" in problem:
        return "; indent by blanks, not by tabs"
    if problem.startswith("mapping values"):
        return "; keys of one mapping must begin in the same column, and a text with a colon needs quotes"
    return ""


def parse(text: str | bytes, origin: str, whole: Place | None = None) -> Source:
    """Return YAML text as a `Source`; `origin` is its name in places, unless `whole` is the place of all values."""
    start = whole or Place(origin, 1, 1)
    source = Source(UNREADABLE, start)
    reader = _Reader(source, origin, whole)
    try:
        source.data = reader.read(text)
    except yaml.MarkedYAMLError as error:
        began = f" ({error.context} in line {error.context_mark.line + 1})" if error.context_mark else ""
        mark = error.problem_mark or error.context_mark
        source.note(reader.place(mark), f"cannot be read as YAML: {error.problem}{began}{_remedy(str(error.problem))}")
    except yaml.reader.ReaderError as error:
        source.note(start, f"is not a text file in UTF-8: {error.reason} at position {error.position}")
    except yaml.YAMLError as error:
        source.note(start, str(error))
    except RecursionError:
        source.note(start, "cannot be read as YAML: it is nested too deeply, or an alias contains itself")
    return source


class _Reader:
    """Converts YAML nodes to plain data, and notes places and mistakes in a `Source`."""

    def __init__(self, source: Source, origin: str, whole: Place | None):
        self.source, self.origin, self.whole = source, origin, whole
        self.count = 0  # number of values so far

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
            raise yaml.YAMLError(
                f"has more than {MAX_VALUES} values after expansion of its aliases, the limit for a job"
            )
        if isinstance(node, yaml.MappingNode) and node.tag == YAML_TAG + "map":
            return self.mapping(node, path)
        if isinstance(node, yaml.SequenceNode) and node.tag == YAML_TAG + "seq":
            return [self.item(child, child, (*path, index)) for index, child in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode) and node.tag in SCALAR_TAGS:
            try:
                return self.loader.construct_object(node)
            except (ValueError, LookupError):  # !!int '', and more digits than Python reads
                pass
        return self.refuse(node, f"{shorten(node.tag.replace(YAML_TAG, '!!'))} does not belong in a job")

    def item(self, key: yaml.Node, child: yaml.Node, path: Key) -> Any:
        """Return the value of a mapping or a list, and record its place unless it is already known."""
        self.source.places.setdefault(path, (self.place(key.start_mark), self.place(child.start_mark)))
        return self.value(child, path)

    def mapping(self, node: yaml.MappingNode, path: Key) -> dict[str, Any]:
        """Return a mapping; its own keys override keys merged by `<<`."""
        found: dict[str, Any] = {}
        merged: list[yaml.Node] = []
        for key, child in node.value:
            if key.tag == YAML_TAG + "merge":
                merged += child.value if isinstance(child, yaml.SequenceNode) else [child]
            elif not isinstance(key, yaml.ScalarNode) or key.tag != YAML_TAG + "str" or _is_no_word(key, child):
                got = repr(shorten(key.value)) if isinstance(key, yaml.ScalarNode) else "a list or a mapping"
                comma = "; write decimals with a point" if _follows_a_comma(key, child) else ""
                self.refuse(key, f"a key must be a word, got {got}{comma}")
            elif key.value in found:
                name, line = ".".join(map(str, (*path, key.value))), self.source.places[*path, key.value][0].line
                self.refuse(key, f"{shorten(name)} is given twice" + f", first in line {line}" * bool(line))
            else:
                found[key.value] = self.item(key, child, (*path, key.value))
        for other in merged:
            if isinstance(inherited := self.value(other, path), dict):
                found = inherited | found
            else:
                self.refuse(other, "<< must be a mapping, or a list of mappings")
        return found


def _is_no_word(key: yaml.ScalarNode, child: yaml.Node) -> bool:
    return not is_storable(key.value) or _follows_a_comma(key, child)


def _follows_a_comma(key: yaml.Node, child: yaml.Node) -> bool:
    """Return True if a key is probably the digits after a decimal comma, as in {thickness: 0,02}: it has no value."""
    return isinstance(key, yaml.ScalarNode) and key.value[:1].isdigit() and not child.value
