"""The text of a job as plain data with the place of each value and key, for messages about mistakes.

Unlike in PyYAML, `1e-3` is a number, repeated keys are a mistake, and numbers are decimal: `12:30` and `010` are text.
The size of a text and the number of its values after expansion of aliases are limited.

A `Fault` states a mistake as the predicate of a sentence about a key. Pydantic collects the faults of a job.

For jobs given as Python data instead of a file, messages about mistakes name the key.
"""

from __future__ import annotations

import difflib
import os
import re
import reprlib
import stat
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn

import yaml
from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

Key = tuple[str | int, ...]  # the way to a value: ("history", 0, "pressure")


class Place(NamedTuple):
    """A place in a file. Other origins of a value, such as an override on the command line, have the `line` 0."""

    origin: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.origin}:{self.line}:{self.column}" if self.line else self.origin


class Mistake(NamedTuple):
    """A mistake as users see it: a place, and a sentence (see `Fault` for a mistake before its place is known)."""

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
    """The place of a key of a job: `path` is the list of keys that leads to it, as the user wrote them, `place` is the
    place of its value, and `key_place` the place of the key itself. If the key is missing, both are the place of the
    mapping that lacks it."""

    path: Key
    place: Place
    key_place: Place
    readable: bool = True


@dataclass
class Source:
    """The data of a file, of a mapping or of an override. `place` is the place of all data, `mistakes` are the mistakes
    found so far, and `content` are the bytes of a file.

    `places` maps the path of a key to the places of the key and of its value. If a path is missing there, the place of
    the list or mapping around it is used.
    """

    data: Any = None
    place: Place = NOWHERE
    mistakes: list[Mistake] = field(default_factory=list)
    places: dict[Key, tuple[Place, Place]] = field(default_factory=dict)
    content: bytes = b""

    def note(self, place: Place, sentence: str) -> None:
        self.mistakes.append(Mistake(place, sentence))

    def put(self, path: Key, value: Any, key_place: Place, place: Place) -> None:
        """Set the value at a path, whose last key may be new, with the places of this key and of the value."""
        node = self.data
        for step in path[:-1]:
            node = node[step]
        node[path[-1]] = value
        self.places = {key: known for key, known in self.places.items() if key[: len(path)] != path}
        self.places[path] = key_place, place

    def locate(self, path: Key) -> Located:
        """Return the place of a key. An index is ignored where the job gives a single value in place of a list."""
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


MAX_WORD = 40  # tuning: longest word that is checked for misspelling [characters]
BOUNDED = reprlib.Repr()  # a `repr` of limited length
BOUNDED.maxlist = BOUNDED.maxtuple = BOUNDED.maxset = 60
BOUNDED.maxstring = BOUNDED.maxlong = BOUNDED.maxother = 500
PREFIXES = {"": 1.0, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
HAVE_PREFIXES = ("m", "s", "Pa", "N", "Hz", "m/s")
AT_VALUE, AT_KEY = "at value", "at key"  # types of this module's errors in pydantic


class Fault(NamedTuple):
    """A mistake that a check finds: the predicate of a sentence about a key, and the path to this key."""

    predicate: str
    path: Key = ()
    at_key: bool = False  # point at the key itself instead of its value


def refuse(*faults: Fault) -> NoReturn:
    """Raise the faults as a ValidationError, which pydantic collects."""
    raise ValidationError.from_exception_data("job", [_line(fault) for fault in faults])


def _line(fault: Fault) -> InitErrorDetails:
    kind = PydanticCustomError(AT_KEY if fault.at_key else AT_VALUE, "{text}", {"text": fault.predicate})
    return InitErrorDetails(type=kind, loc=fault.path, input=None)


def faults_of(error: ValidationError) -> Iterator[Fault]:
    """Yield the faults inside a pydantic error that `refuse` raised."""
    for line in error.errors():
        yield Fault(line["msg"], line["loc"], line["type"] == AT_KEY)


def shorten(text: str, most: int = 200) -> str:
    """Return a text of at most `most` characters; dots replace the middle of a longer text."""
    return text if len(text) <= most else f"{text[: most // 2]}...{text[-most // 4 :]}"


def is_storable(text: str) -> bool:
    """Return False for a text with an unpaired surrogate, which UTF-8 does not have."""
    return text.isascii() or not re.search("[\ud800-\udfff]", text)


def quote(value: Any) -> str:
    """Return a value as text, for the part of a message after "got"."""
    if value is None or isinstance(value, dict):
        return "nothing" if value is None else "a mapping"
    text = str(value).lower() if isinstance(value, bool) else BOUNDED.repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def list_words(words: Iterable[str]) -> str:
    """Return a text that lists the words to choose from."""
    return " | ".join(words)


def closest(word: Any, words: Iterable[str]) -> str:
    """Return the word of `words` that is closest to a misspelt `word`, or '' if no word is close."""
    if len(str(word)) > MAX_WORD:
        return ""
    known = {candidate.lower(): candidate for candidate in words}
    close = difflib.get_close_matches(str(word).lower(), known, n=1, cutoff=0.65)
    return known[close[0]] if close else ""


def in_si(value: Any, unit: str) -> str:
    """Return the end of a message, such as '; write 1.0e-3', if a value is a number with a multiple of the `unit` of
    its key, such as '1 mm'. Otherwise return ''."""
    text = value.strip() if isinstance(value, str) and unit in HAVE_PREFIXES else ""
    found = re.fullmatch(rf"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*({'|'.join(PREFIXES)}){unit}", text)
    if not found:
        return ""
    try:
        digits, exponent = f"{float(found[1]) * PREFIXES[found[2]]:.9e}".split("e")
    except ValueError:
        return ""
    return f"; write {float(digits)}e{int(exponent)}"


def did_you_mean(word: Any, words: Iterable[str]) -> str:
    """Return the end of a message, '; did you mean X?', if one of `words` is close to `word`, else ''."""
    found = closest(word, words)
    return f"; did you mean {found}?" if found else ""


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
    """PyYAML's safe loader. `RESOLVERS` are its rules for words without quotes: which are numbers, true or nothing."""

    yaml_implicit_resolvers = _implicit_resolvers()


class JobDumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which quotes texts that `JobLoader` would not read as text."""

    yaml_implicit_resolvers = _implicit_resolvers()


def dump(data: Any) -> str:
    """Return plain data as YAML text that `parse` reads back as equal data."""
    return yaml.dump(data, Dumper=JobDumper, default_flow_style=None, sort_keys=False, allow_unicode=True, width=120)


def read_source(path: Path, shown: str) -> Source:
    """Return the `Source` of a YAML file, called `shown` in messages; an unreadable file is noted as a mistake."""
    try:
        if not stat.S_ISREG(path.stat().st_mode) and not path.is_dir():  # a pipe might never end
            raise OSError(0, "it is not a regular file")
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) <= MAX_BYTES:
            return replace(parse(content, shown), content=content)
        reason = f"it is larger than {MAX_BYTES / 1e6:g} MB, the limit for a job"
    except FileNotFoundError:
        reason = "there is no such file"
    except (OSError, ValueError) as error:  # ValueError: a null character in its name
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, IsADirectoryError) and (path / "job.resolved.yaml").is_file():
            reason += f"; the job of the run in it is {Path(shown) / 'job.resolved.yaml'}"
    found = Source(UNREADABLE, Place(shorten(shown)))
    found.note(found.place, f"cannot be read: {reason}")
    return found


REMEDIES = {  # by a part of a frequent message of PyYAML
    "\\t": "; indent by blanks, not by tabs",
    "mapping values": "; keys of one mapping must begin in the same column, and a text with a colon needs quotes",
}


def parse(text: str | bytes, origin: str, whole: Place | None = None) -> Source:
    """Return YAML text as a `Source`. Messages name the place of a value by `origin`, such as a file, line and column.
    All values of an override have the place `whole`."""
    start = whole or Place(origin, 1, 1)
    source = Source(UNREADABLE, start)
    reader = _Reader(source, origin, whole)
    try:
        source.data = reader.read(text)
    except yaml.MarkedYAMLError as error:
        began = f" ({error.context} in line {error.context_mark.line + 1})" if error.context_mark else ""
        remedy = next((remedy for part, remedy in REMEDIES.items() if part in str(error.problem)), "")
        place = reader.place(error.problem_mark or error.context_mark)
        source.note(place, f"cannot be read as YAML: {error.problem}{began}{remedy}")
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
            elif not isinstance(key, yaml.ScalarNode):
                self.refuse(key, "a key must be a word, got a list or a mapping")
            elif key.value[:1].isdigit() and not child.value:  # digits after a decimal comma: {thickness: 0,02}
                self.refuse(key, f"a key must be a word, got {shorten(key.value)!r}; write decimals with a point")
            elif key.tag != YAML_TAG + "str" or not is_storable(key.value):
                self.refuse(key, f"a key must be a word, got {shorten(key.value)!r}")
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


def source_of(data: Any, place: Place = NOWHERE) -> Source:
    """Return Python data as a `Source`; all its values have the same place."""
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
