"""Base of all sections of a job, and the types of their values.

Sections are frozen pydantic models that report all mistakes at once, as sentences.

A `Part` declares its keys as fields. The description of a field completes the sentence "grid.size must be ..." and
contains its unit, `[m]`. Pydantic checks each field, and the base class checks several keys together. `one_of` and
`at_most_one` name keys that exclude each other. Each of the `rules` is checked if the fields that it needs are correct,
even if other fields are not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from inspect import signature
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails

from .yaml_text import (
    AT_KEY,
    AT_VALUE,
    Fault,
    closest,
    did_you_mean,
    in_si,
    is_storable,
    list_words,
    quote,
    refuse,
    shorten,
)


class Included(NamedTuple):
    """An included file: its absolute path, and the SHA-256 of its content."""

    path: Path
    sha256: str
    section: str = "material"

    def __str__(self) -> str:
        return f"{self.section}: included from {self.path} (SHA-256 {self.sha256})"


class Origin(NamedTuple):
    """Where a job comes from: the absolute path of its file, and the files of its `included` materials.

    `from_file` is False for a job from Python. If `numbers_as_texts` is True, texts such as 1e-3 count as numbers,
    since PyYAML's `safe_load` returns them as texts. `names_directory` is True if the job gives its output directory.
    `mesh` is a sentence on points that the program chose, '' if the job gives its points.

    Messages name two further places: `approaches` are the places of the approaches of all stages, and `strict` is the
    place of `numerics.strict`. For jobs from Python these are () and ''.
    """

    path: Path = Path("job.yaml")
    included: tuple[Included, ...] = ()
    from_file: bool = True
    numbers_as_texts: bool = False
    names_directory: bool = False
    mesh: str = ""
    approaches: tuple[str, ...] = ()
    strict: str = ""


class Rule(NamedTuple):
    """A rule on several fields: the function `check` gets the values of the fields named in `needs`, and yields faults.

    A rule is checked if all these fields are correct. A list with wrong items counts as correct, with None for each
    such item.
    """

    needs: tuple[str, ...]
    check: Callable[..., Iterator[Fault]]


def rules_of(*checks: Callable[..., Iterator[Fault]]) -> tuple[Rule, ...]:
    """Return a rule for each check; the parameters of a check have the names of the fields that it needs."""
    return tuple(Rule(tuple(signature(check).parameters), check) for check in checks)


class Instead(NamedTuple):
    """Advice on an unknown key, with the keys that the user probably meant."""

    advice: str
    keys: tuple[str, ...] = ()


class Part(BaseModel):
    """Base of all sections."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    label: ClassVar[str] = ""  # name of the part in messages, by default its kind, such as "shape sphere"
    foreign: ClassVar[Mapping[str, Instead]] = {}  # advice for removed keys and for keys of other programs
    one_of: ClassVar[tuple[tuple[str, ...], ...]] = ()
    at_most_one: ClassVar[tuple[tuple[str, ...], ...]] = ()
    rules: ClassVar[tuple[Rule, ...]] = ()

    @classmethod
    def filled(cls, data: dict[str, Any], context: Origin | None) -> dict[str, Any]:
        """Return `data` with the defaults that depend on other keys or on the job file."""
        return data

    @property
    def given(self) -> Part:
        """Return this part as it was in the job. An effect may have replaced it: a material that stands for two bodies
        may replace the material of one body."""
        return self

    def left_out(self) -> tuple[str, ...]:
        """Return the keys that stored jobs leave out although they have a value, such as the grid of a job in bands."""
        return ()

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """Return the keys of the part as they are written in a job."""
        return tuple(cls.model_fields)

    @model_validator(mode="wrap")
    @classmethod
    def _every_mistake(cls, data: Any, handler: Callable[[Any], Any], info: ValidationInfo) -> Any:
        """Run pydantic's own validation, then the checks of keys, then the rules; refuse with all faults together."""
        if isinstance(data, cls):
            return data
        if not isinstance(data, dict):
            refuse(Fault(f"must be a mapping of keys, got {quote(data)}"))
        if odd := [key for key in data if isinstance(key, str) and not is_storable(key)]:
            refuse(*(Fault("is not a known key", (key,), at_key=True) for key in odd))
        known = cls.words()  # a key without a value is absent if it is known, and a mistake otherwise
        given = {key: value for key, value in data.items() if value is not None or key not in known}
        filled = cls.filled(dict(given), info.context)
        part, errors = None, list[ErrorDetails]()
        try:
            part = handler(filled)
        except ValidationError as failure:
            # a list with a wrong value is not too short
            errors = [error for error in failure.errors() if error["type"] != "too_short" or not error["input"]]
        # a default that depends on a wrong value is not a second mistake
        of_user = [error for error in errors if _absent(error) or error["loc"][:1] in {(), *((key,) for key in given)}]
        meant = {word for key in given if key not in known for word in cls._instead(str(key)).keys}
        reported = [error for error in of_user or errors if not (_absent(error) and error["loc"][0] in meant)]
        faults = [cls._fault(error, filled) for error in reported]
        faults += cls._exclusive_faults(given, meant)
        for rule in cls.rules:
            values = [_value(cls, name, part, filled, errors, info.context) for name in rule.needs]
            if not any(value is WRONG for value in values):
                faults += rule.check(*values)
        if faults:
            refuse(*faults)
        return part

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return pydantic's schema with the exclusions between keys."""
        found = handler.resolve_ref_schema(handler(core))
        rules: list[Any] = [{"oneOf": [{"required": [word]} for word in group]} for group in cls.one_of]
        rules += [{"not": {"required": list(pair)}} for group in cls.at_most_one for pair in combinations(group, 2)]
        if rules:
            found["allOf"] = rules
        if kind := kind_key(cls):
            found["required"] = [kind, *found.get("required", ())]
        found["description"] = re.split(r"(?<=\.) (?=[A-Z])", " ".join((cls.__doc__ or "").split()))[0]
        return found

    @classmethod
    def _fault(cls, error: ErrorDetails, filled: dict[str, Any]) -> Fault:
        """Return pydantic's error as a fault."""
        kind, path, value = error["type"], error["loc"], error["input"]
        if kind in (AT_VALUE, AT_KEY):
            return Fault(error["msg"], path, kind == AT_KEY)
        name = str(path[0])
        if kind == "extra_forbidden":
            word = kind_key(cls)
            label = cls.label or (word and f"{word} {cls.model_fields[word].default}")
            what = f"is not a key of {label}" if label else "is not a known key"
            advice = cls._instead(name).advice or f"known keys: {', '.join(cls.words())}"
            return Fault(f"{what}; {advice}", path, at_key=True)
        field = cls.model_fields[name]
        words = literal_words(field.annotation) if _absent(error) or kind == "literal_error" else ()
        expected = f"must be {list_words(words) if words else field.description}"
        if _absent(error):
            return Fault(f"is missing; it {expected}", path)
        got = quote(filled[name] if kind == "missing" else value)
        advice = did_you_mean(value, words) or in_si(value, unit_in(field.description))
        return Fault(f"{expected}, got {got}{advice}", path)

    @classmethod
    def _instead(cls, word: str) -> Instead:
        """Return advice for an unknown word, empty if no key resembles it."""
        close = closest(word, cls.words())
        misspelt = Instead(f"did you mean {close}?", (close,)) if close else Instead("")
        return cls.foreign.get(word.lower(), misspelt)

    @classmethod
    def _exclusive_faults(cls, given: Mapping[str, Any], meant: Collection[str]) -> Iterator[Fault]:
        """Check the keys that exclude each other; keys that unknown words are `meant` to be do not count as missing."""
        for group in (*cls.one_of, *cls.at_most_one):
            present = [word for word in group if word in given]
            lacks = group in cls.one_of and not any(word in meant for word in group)
            if len(present) > 1 or (not present and lacks):
                number = "needs exactly one of" if group in cls.one_of else "takes at most one of"
                yield Fault(f"{number} {list_words(group)}, got {' and '.join(present) or 'none'}")


WRONG = object()  # in place of the value of a field with mistakes


def _value(
    kind: type[Part], name: str, part: Part | None, filled: Mapping[str, Any], errors: list[ErrorDetails], context: Any
) -> Any:
    """Return the value of one field, also if other fields have mistakes.

    A value with mistakes is WRONG; in a list, wrong items are None.
    """
    if part is not None:
        return getattr(part, name)
    field, wrong = kind.model_fields[name], [error["loc"] for error in errors if error["loc"][:1] == (name,)]
    if not wrong and name not in filled:
        return field.get_default(call_default_factory=True, validated_data=dict(filled))
    if not wrong:
        annotation: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
        return TypeAdapter(annotation).validate_python(filled[name], context=context)
    item, *more = get_args(field.annotation) or (Any,)
    bad = {loc[1] if len(loc) > 1 else "" for loc in wrong}
    if more != [...] or not isinstance(filled.get(name), list) or not all(isinstance(index, int) for index in bad):
        return WRONG
    adapter: TypeAdapter[Any] = TypeAdapter(item)
    items = enumerate(filled[name])
    return tuple(None if index in bad else adapter.validate_python(one, context=context) for index, one in items)


def kind_key(part: type[Part]) -> str:
    """Return the key that selects the kind of a part (shape, model, law), or '' for a part without kinds."""
    kinds = (word for word in ("shape", "model", "law") if word in part.model_fields)
    return next((word for word in kinds if len(get_args(part.model_fields[word].annotation)) == 1), "")


def _absent(error: ErrorDetails) -> bool:
    return error["type"] == "missing" and len(error["loc"]) == 1


def literal_words(annotation: Any) -> tuple[str, ...]:
    """Return the words of a Literal, also inside a tuple or a union."""
    words = [word for word in get_args(annotation) if isinstance(word, str)]
    for inner in get_args(annotation):
        words += literal_words(inner) if get_origin(inner) else ()
    return tuple(words)


def chosen(
    key: str, kinds: Mapping[str, type[Part]], called: Mapping[str, str] | None = None
) -> Callable[[Any, ValidationInfo], Any]:
    """Return a validator that reads a mapping as one of the parts `kinds`. The value of the mapping at `key` is a word,
    which chooses the part. `called` maps words of other programs to words of `kinds`; messages then advise the right
    word."""

    def choose(data: Any, info: ValidationInfo) -> Any:
        if isinstance(data, tuple(kinds.values())):
            return data
        if not isinstance(data, dict):
            refuse(Fault(f"must be a mapping with {key}: {list_words(kinds)}, got {quote(data)}"))
        word = data.get(key)
        if word is None:
            refuse(Fault(f"is missing; it must be {list_words(kinds)}", (key,)))
        if not isinstance(word, str) or word not in kinds:
            other = (called or {}).get(str(word).lower())
            advice = f"; did you mean {other}?" if other else did_you_mean(word, kinds)
            refuse(Fault(f"must be {list_words(kinds)}, got {quote(word)}{advice}", (key,)))
        return kinds[word].model_validate(data, context=info.context)

    return choose


# -- types of values -------------------------------------------------------------------------------------------------

FROM_SURFACE = "from surface"  # grid.points or grid.size: as the measured map
Auto = Literal["auto"]
AUTO: Auto = "auto"  # chosen by numerics.accuracy
MOST = 2**31 - 1  # largest whole number: transforms and messages count in 32 bits
SMALLEST, LARGEST = 1e-60, 1e60  # rounding: range of numbers in a job, whose squares and quotients do not overflow
LOWEST, HIGHEST = -273.15, 5000.0  # physics: range of temperatures [deg C]
LONGEST_NUMBER = 400  # tuning: longest text of a number [characters]
LONGEST_NAME = 4096  # longest path, PATH_MAX of Linux [characters]

MOST_OF_A_RANGE = 100_000  # tuning: most numbers in a range first:last:count


def _number(value: Any, info: ValidationInfo) -> Any:
    """Return a text as a number, if texts may be numbers."""
    if isinstance(value, str) and len(value) <= LONGEST_NUMBER and getattr(info.context, "numbers_as_texts", False):
        with suppress(ValueError):
            return float(value)
    return value


def _whole(value: Any, info: ValidationInfo) -> Any:
    """Return a float such as 1e3 as a whole number."""
    value = _number(value, info)
    return int(value) if isinstance(value, float) and value.is_integer() else value


def both(value: Any) -> Any:
    """Return a pair; a single value is used for both axes."""
    return value if isinstance(value, list | tuple) else (value, value)


def along_x(value: Any) -> Any:
    """Return a vector; a single number is its x component."""
    return value if isinstance(value, list | tuple) else (value, 0.0)


def listed(value: Any) -> Any:
    """Return a list. A single value becomes a list with one item."""
    return value if isinstance(value, list | tuple) else (value,)


def countable(value: int) -> int:
    if abs(value) > MOST:
        refuse(Fault(f"must be at most {MOST}, got {quote(value)}"))
    return value


def from_home(path: Path) -> Path:
    """Return a path with the home directory in place of a leading ~ or ~user. Raises ValidationError for an unknown
    user, and for a path that is too long."""
    if len(str(path)) > LONGEST_NAME or any(len(part.encode()) > 255 for part in path.parts):
        refuse(Fault(f"must be the name of a file, got {len(str(path))} characters, {shorten(str(path), 40)!r}"))
    try:
        return path.expanduser()
    except RuntimeError:
        refuse(Fault(f"must be the name of a file, got {str(path)!r}: there is no such user"))


def unit_in(description: str | None) -> str:
    """Return the unit in the brackets of a key's description: `-` for a quantity without dimension, and '' without
    brackets."""
    found = re.search(r"\[([^\],]+)\]", description or "")
    return found[1] if found else ""


def existing_file(path: Path, info: ValidationInfo) -> Path:
    """Return the absolute path of a file that a job names; relative paths start at the job file."""
    found = (info.context.path.parent if info.context else Path.cwd()) / from_home(path)
    if not found.is_file():
        refuse(Fault(f"must be an existing file, got {str(path)!r} (looked for {found})"))
    return found


def log_range(text: str) -> tuple[float, ...]:
    """Return n positive numbers from a to b, equally spaced in the logarithm, from a text `a:b:n`.

    Raises ValueError for another text. The message of the error is the end of a sentence "KEY must be ...".
    """
    try:
        first, last, count = text.split(":")
        a, b, n = float(first), float(last), int(count)
    except ValueError:
        raise ValueError("numbers or a range first:last:count like 1e-3:1e2:31") from None
    if not (0 < a < math.inf and 0 < b < math.inf):
        raise ValueError("a range first:last:count with first and last positive")
    if not 1 <= n <= MOST_OF_A_RANGE:
        raise ValueError(f"a range first:last:count with a count from 1 to {MOST_OF_A_RANGE}")
    if n == 1 and a != b:
        raise ValueError("a range first:last:count with a count of at least 2, or first and last the same")
    return (*(a * (b / a) ** (i / (n - 1)) for i in range(n - 1)), b)


def bounded(value: float) -> float:
    """Return a number. Raises ValidationError if its magnitude is not between `SMALLEST` and `LARGEST`, since squares
    of slopes or quotients of lengths would overflow in a run."""
    if value and not SMALLEST <= abs(value) <= LARGEST:
        refuse(Fault(f"must be from {SMALLEST:g} to {LARGEST:g} in size, got {value!r}"))
    return value


NUMBER, BOUNDED = BeforeValidator(_number), AfterValidator(bounded)
Number = Annotated[float, Field(strict=True), NUMBER]
Real = Annotated[float, Field(strict=True, allow_inf_nan=False), NUMBER, BOUNDED]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False), NUMBER, BOUNDED]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False), NUMBER, BOUNDED]
Fraction = Annotated[float, Field(strict=True, gt=0, lt=1), NUMBER, BOUNDED]
Celsius = Annotated[Real, Field(gt=LOWEST, le=HIGHEST, description="a temperature [deg C], up to 5000")]
Whole = Annotated[int, Field(strict=True), BeforeValidator(_whole), AfterValidator(countable)]
Count = Annotated[int, Field(strict=True, ge=1), BeforeValidator(_whole), AfterValidator(countable)]
Seed = Annotated[
    int, Field(strict=True, ge=0, lt=2**128, description="a whole number of zero or more"), BeforeValidator(_whole)
]
Flag = Annotated[bool, Field(strict=True, description="true or false")]
Vector = Annotated[tuple[Real, Real], BeforeValidator(along_x)]
