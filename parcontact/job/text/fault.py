"""Mistakes as predicates of sentences about a key, and their transport through pydantic."""

from __future__ import annotations

import difflib
import re
import reprlib
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, NoReturn

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from .places import Key

MAX_WORD = 40  # tuning: longest word that is checked for misspelling [characters]
BOUNDED = reprlib.Repr()  # a `repr` of limited length
BOUNDED.maxlist = BOUNDED.maxtuple = BOUNDED.maxset = 60
BOUNDED.maxstring = BOUNDED.maxlong = BOUNDED.maxother = 500
PREFIXES = {"": 1.0, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
UNITS = {f"{prefix}{unit}": size for prefix, size in PREFIXES.items() for unit in ("m", "s", "Pa", "N", "m/s")}
AT_VALUE, AT_KEY = "at value", "at key"  # types of this module's errors in pydantic


class Fault(NamedTuple):
    """A mistake: the predicate of a sentence whose subject is a key, and the path to the key."""

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
    """Yield the faults inside an error that `refuse` raised."""
    for line in error.errors():
        yield Fault(line["msg"], line["loc"], line["type"] == AT_KEY)


def shorten(text: str, most: int = 200) -> str:
    """Return a text without its middle if it has more than `most` characters."""
    return text if len(text) <= most else f"{text[: most // 2]}...{text[-most // 4 :]}"


def is_storable(text: str) -> bool:
    """Return False for a text with half of a surrogate pair, which UTF-8 does not have."""
    return text.isascii() or not re.search("[\ud800-\udfff]", text)


def quote(value: Any) -> str:
    """Return a value as shown after "got"."""
    if value is None or isinstance(value, dict):
        return "nothing" if value is None else "a mapping"
    text = str(value).lower() if isinstance(value, bool) else BOUNDED.repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def list_words(words: Iterable[str]) -> str:
    """Return the words to choose from."""
    return " | ".join(words)


def closest(word: Any, words: Iterable[str]) -> str:
    """Return the one of `words` that is closest to a misspelt `word`, '' if none is close."""
    if len(str(word)) > MAX_WORD:
        return ""
    known = {candidate.lower(): candidate for candidate in words}
    close = difflib.get_close_matches(str(word).lower(), known, n=1, cutoff=0.65)
    return known[close[0]] if close else ""


def in_si(value: Any) -> str:
    """Return the ending '; write 1.0e-3' if a value is a number with a unit, such as '1 mm', else ''."""
    found = (
        re.fullmatch(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S+)", value.strip()) if isinstance(value, str) else None
    )
    if not found or (unit := UNITS.get(found[2])) is None:
        return ""
    try:
        digits, exponent = f"{float(found[1]) * unit:.9e}".split("e")
    except ValueError:
        return ""
    return f"; write {float(digits)}e{int(exponent)}"


def did_you_mean(word: Any, words: Iterable[str]) -> str:
    """Return the ending '; did you mean X?' if one of `words` is close to `word`, else ''."""
    found = closest(word, words)
    return f"; did you mean {found}?" if found else ""
