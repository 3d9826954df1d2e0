"""The kinds of values in a job, and the short forms in which they may be written."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field


def _whole(value: Any) -> Any:
    """1e3 is a whole number."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def both(value: Any) -> Any:
    """One value for both directions."""
    return value if isinstance(value, list | tuple) else (value, value)


def along_x(value: Any) -> Any:
    """A number is the x component of a vector."""
    return value if isinstance(value, list | tuple) else (value, 0.0)


def listed(value: Any) -> Any:
    """A single value is a list of one."""
    return value if isinstance(value, list | tuple) else (value,)


Real = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True), BeforeValidator(_whole)]
Count = Annotated[int, Field(strict=True, ge=1), BeforeValidator(_whole)]
Natural = Annotated[int, Field(strict=True, ge=0), BeforeValidator(_whole)]
Flag = Annotated[bool, Field(strict=True)]
Vector = Annotated[tuple[Real, Real], BeforeValidator(along_x)]
