"""Types of the values in a job, and their short forms."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from .yaml_text import Fault, quote, refuse, shorten

FROM_SURFACE = "from surface"  # grid.points or grid.size: as the measured map
AUTO_POINTS = "auto"  # grid.points: chosen by the accuracy
MOST = 2**31 - 1  # largest whole number: transforms and messages count in 32 bits
SMALLEST, LARGEST = 1e-60, 1e60  # rounding: range of numbers in a job, whose squares and quotients do not overflow
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
    """Return a list; a single value is a list of one."""
    return value if isinstance(value, list | tuple) else (value,)


def countable(value: int) -> int:
    if abs(value) > MOST:
        refuse(Fault(f"must be at most {MOST}, got {quote(value)}"))
    return value


def from_home(path: Path) -> Path:
    """Replace a leading ~ or ~user of a path; refuse unknown users, and paths that are too long."""
    if len(str(path)) > LONGEST_NAME or any(len(part.encode()) > 255 for part in path.parts):
        refuse(Fault(f"must be the name of a file, got {len(str(path))} characters, {shorten(str(path), 40)!r}"))
    try:
        return path.expanduser()
    except RuntimeError:
        refuse(Fault(f"must be the name of a file, got {str(path)!r}: there is no such user"))


def log_range(text: str) -> tuple[float, ...]:
    """Return n positive numbers from a to b, equally spaced in the logarithm, from a text `a:b:n`.

    Raises ValueError with the end of a sentence "KEY must be ...".
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
    """Return a number; refuse one that would overflow in a run, in squares of slopes or quotients of lengths."""
    if value and not SMALLEST <= abs(value) <= LARGEST:
        refuse(Fault(f"must be zero, or from {SMALLEST:g} to {LARGEST:g} in size, got {value!r}"))
    return value


NUMBER, BOUNDED = BeforeValidator(_number), AfterValidator(bounded)
Number = Annotated[float, Field(strict=True), NUMBER]
Real = Annotated[float, Field(strict=True, allow_inf_nan=False), NUMBER, BOUNDED]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False), NUMBER, BOUNDED]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False), NUMBER, BOUNDED]
Fraction = Annotated[float, Field(strict=True, gt=0, lt=1), NUMBER]
Whole = Annotated[int, Field(strict=True), BeforeValidator(_whole), AfterValidator(countable)]
Count = Annotated[int, Field(strict=True, ge=1), BeforeValidator(_whole), AfterValidator(countable)]
Seed = Annotated[
    int, Field(strict=True, ge=0, lt=2**128, description="a whole number of zero or more"), BeforeValidator(_whole)
]
Flag = Annotated[bool, Field(strict=True, description="true or false")]
Vector = Annotated[tuple[Real, Real], BeforeValidator(along_x)]
