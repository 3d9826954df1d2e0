"""What all sections of a job have in common: frozen pydantic models whose mistakes are sentences, reported all at once.

A `Part` declares its keys as fields. The description of a field completes the sentence "grid.size must be ..." and
holds its unit, `[m]`. Pydantic checks each field; the base class adds what needs several keys together: `one_of` and
`at_most_one` for keys that exclude each other, and `rules`, each of which runs as soon as the fields it needs are
right, whatever else is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, ValidationInfo, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from ..text.fault import AT_KEY, AT_VALUE, Fault, choices, did_you_mean, quote, refuse
from ..text.overrides import Included
from ..text.source import shorten
from .values import from_home


@dataclass(frozen=True)
class Context:
    """What a section may need to know about the job file: its absolute path, and the file of its material if it
    includes one."""

    path: Path
    included: Included | None = None


def existing_file(path: Path, info: ValidationInfo) -> Path:
    """The absolute path of a file that a job names; relative ones start at the job file."""
    found = (info.context.path.parent if info.context else Path.cwd()) / from_home(path)
    if found.exists() and not (found.is_file() or found.is_dir()):
        refuse(Fault(f"must be a regular file, got {str(path)!r}, which is a pipe, a device or a socket"))
    if not found.is_file():
        refuse(Fault(f"must be an existing file, got {str(path)!r} (looked for {found})"))
    return found


class Rule(NamedTuple):
    """A check of several fields; runs when all of those in `needs` are right (bad items of lists come as None)."""

    needs: tuple[str, ...]
    check: Callable[..., Iterator[Fault]]


class Part(BaseModel):
    """Base of all sections."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    label: ClassVar[str] = ""  # what the part is called when a key does not belong to it: "shape sphere"
    one_of: ClassVar[tuple[tuple[str, ...], ...]] = ()
    at_most_one: ClassVar[tuple[tuple[str, ...], ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = ()

    @classmethod
    def filled(cls, data: dict[str, Any], context: Context | None) -> dict[str, Any]:
        """`data` with the defaults that depend on other keys or on the job file."""
        return data

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """The keys as they are written in a job."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())

    @classmethod
    def field(cls, word: str) -> FieldInfo:
        """The field that is written as `word`."""
        return next(field for name, field in cls.model_fields.items() if word in (field.alias, name))

    @model_validator(mode="wrap")
    @classmethod
    def _every_mistake(cls, data: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        if isinstance(data, cls):
            return data
        if not isinstance(data, dict):
            refuse(Fault(f"must be a mapping of keys, got {quote(data)}"))
        known = cls.words()  # an empty value is an absent key, but no excuse for one that there is not
        given = {key: value for key, value in data.items() if value is not None or key not in known}
        attempt = Attempt(cls, given, cls.filled(dict(given), info.context), info.context)
        faults = list(attempt.faults(handler))
        if faults:
            refuse(*faults)
        return attempt.part


WRONG = object()  # stands for the value of a field that has mistakes


class Attempt:
    """One attempt to make a part out of data: the part if all went well, and what is wrong otherwise."""

    def __init__(self, kind: type[Part], given: Mapping[str, Any], filled: Mapping[str, Any], context: Any):
        self.kind = kind
        self.given = given  # what the user wrote
        self.filled = filled  # with computed defaults
        self.context = context
        self.part: Any = None
        self.errors: list[ErrorDetails] = []

    def faults(self, handler: Callable[[Any], Any]) -> Iterator[Fault]:
        """Runs pydantic's own validation, then the checks of keys, then the rules."""
        try:
            self.part = handler(self.filled)
        except ValidationError as failure:
            self.errors = failure.errors()
        of_user = [error for error in self.errors if self.concerns_user(error)]
        for error in of_user or self.errors:
            yield self.fault(error)
        yield from self.exclusive_faults()
        for rule in self.kind.rules:
            values = [self.value(name) for name in rule.needs]
            if not any(value is WRONG for value in values):
                yield from rule.check(*values)

    def concerns_user(self, error: ErrorDetails) -> bool:
        """Whether the error is in what was written: a default copied from a wrong value is no second mistake."""
        return not error["loc"] or error["loc"][0] in self.given or _absent(error)

    def fault(self, error: ErrorDetails) -> Fault:
        """Pydantic's error as the rest of a sentence."""
        kind, path, value = error["type"], error["loc"], error["input"]
        if kind in (AT_VALUE, AT_KEY):
            return Fault(error["msg"], path, kind == AT_KEY)
        name = str(path[0])
        if kind == "extra_forbidden":
            return Fault(self.unknown(name), path, at_key=True)
        field = self.kind.field(name)
        if kind == "literal_error" or (_absent(error) and literal_words(field.annotation)):
            words = literal_words(field.annotation)
            expected, hint = f"must be {choices(words)}", did_you_mean(value, words)
        else:
            expected, hint = f"must be {field.description}", ""
        if _absent(error):
            return Fault(f"is missing; it {expected}", path)
        return Fault(f"{expected}, got {quote(self.filled[name] if kind == 'missing' else value)}{hint}", path)

    def unknown(self, word: str) -> str:
        """What to say about a key that the part does not have."""
        words, word = self.kind.words(), shorten(word)
        what = f"is not a key of {self.kind.label}" if self.kind.label else "is not a known key"
        return what + (did_you_mean(word, words) or f"; there are {', '.join(words)}")

    def exclusive_faults(self) -> Iterator[Fault]:
        """Checks which keys were given, whatever their values."""
        for group in self.kind.one_of:
            present = [word for word in group if word in self.given]
            if len(present) != 1:
                yield Fault(f"needs exactly one of {choices(group)}, got {' and '.join(present) or 'none'}")
        for group in self.kind.at_most_one:
            present = [word for word in group if word in self.given]
            if len(present) > 1:
                yield Fault(f"takes at most one of {choices(group)}, got {' and '.join(present)}")

    def value(self, name: str) -> Any:
        """The value of one field, also when other fields have mistakes; None for bad items of a list, or else WRONG."""
        if self.part is not None:
            return getattr(self.part, name)
        field = self.kind.model_fields[name]
        wrong = [error["loc"] for error in self.errors if error["loc"][:1] == (name,)]
        if not wrong and name not in self.filled:
            return field.get_default(call_default_factory=True)
        if not wrong:
            return self.validated(_annotated(field), self.filled[name])
        item, *more = get_args(field.annotation) or (None,)
        if more != [...] or not isinstance(self.filled.get(name), list):
            return WRONG
        if not all(len(loc) > 1 and isinstance(loc[1], int) for loc in wrong):
            return WRONG
        bad = {loc[1] for loc in wrong}
        return tuple(None if i in bad else self.validated(item, value) for i, value in enumerate(self.filled[name]))

    def validated(self, annotation: Any, value: Any) -> Any:
        """A value that is known to be right, as the model holds it."""
        return TypeAdapter(annotation).validate_python(value, context=self.context)


def _absent(error: ErrorDetails) -> bool:
    return error["type"] == "missing" and len(error["loc"]) == 1


def _annotated(field: FieldInfo) -> Any:
    return Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation


def literal_words(annotation: Any) -> tuple[str, ...]:
    """The words of a Literal, also inside a tuple or a union."""
    words = [word for word in get_args(annotation) if isinstance(word, str)]
    for inner in get_args(annotation):
        words += literal_words(inner) if get_origin(inner) else ()
    return tuple(words)


def chosen(
    key: str, kinds: Mapping[str, type[Part]], called: Mapping[str, str] | None = None
) -> Callable[[Any, ValidationInfo], Any]:
    """A validator that takes the kind of a part from its `key`; `called` are other names of kinds, to advise on."""

    def advice(word: Any) -> str:
        other = (called or {}).get(str(word).lower())
        return f"; did you mean {other}?" if other else did_you_mean(word, kinds)

    def choose(data: Any, info: ValidationInfo) -> Any:
        if isinstance(data, tuple(kinds.values())):
            return data
        if not isinstance(data, dict):
            refuse(Fault(f"must be a mapping with {key}: {choices(kinds)}, got {quote(data)}"))
        word = data.get(key)
        if word is None:
            refuse(Fault(f"is missing; it must be {choices(kinds)}", (key,)))
        if not isinstance(word, str) or word not in kinds:
            refuse(Fault(f"must be {choices(kinds)}, got {quote(word)}{advice(word)}", (key,)))
        return kinds[word].model_validate(data, context=info.context)

    return choose
