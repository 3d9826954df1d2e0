"""Conversion of the text of an option to its value; raises argparse.ArgumentTypeError with what was expected."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
INFINITE = float("inf")


def checked(convert: Callable[[str], T], accepts: Callable[[T], bool], expected: str) -> Callable[[str], T]:
    """Return a function that converts a text, and raises ArgumentTypeError unless `accepts` the value."""

    def value_of(text: str) -> T:
        try:
            value = convert(text)
        except ValueError:
            value = None
        if value is None or not accepts(value):
            raise argparse.ArgumentTypeError(f"must be {expected}, got {text!r}")
        return value

    return value_of


def _floats(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split(",")))


def wall_seconds(text: str) -> float:
    """Return the seconds in a text [[HH:]MM:]SS or D-HH:MM:SS; 0 for other texts."""
    days, dash, rest = text.rpartition("-")
    fields = rest.split(":")
    try:
        if len(fields) > 3:
            return 0.0
        seconds = sum(float(field) * 60.0**power for power, field in enumerate(reversed(fields)))
        return seconds + (86400.0 * int(days) if dash else 0.0)
    except ValueError:
        return 0.0


seconds = checked(float, lambda value: 0.0 <= value < INFINITE, "a time [s] of zero or more")
wall = checked(wall_seconds, lambda value: 0.0 < value < INFINITE, "a wall time HH:MM:SS")
natural = checked(int, lambda value: value >= 0, "a whole number of zero or more")
counts = checked(
    lambda text: tuple(map(int, text.split(","))), lambda values: min(values) > 0, "positive whole numbers"
)
pressure = checked(float, lambda value: 0.0 <= value < INFINITE, "a pressure [Pa] of zero or more")
positive = checked(float, lambda value: 0.0 < value < INFINITE, "a positive number")
share = checked(float, lambda value: 0.0 <= value <= 1.0, "a number from 0 to 1")
poisson = checked(float, lambda value: -1.0 < value <= 0.5, "a Poisson ratio above -1 and up to 0.5")
degrees = checked(_floats, bool, "a list of temperatures [deg C]")


def instant(text: str) -> str:
    """Return the text of a step (digits) or of a time [s]."""
    checked(float, lambda value: 0.0 <= value < INFINITE, "a step, as a whole number, or a time [s]")(text)
    return text.strip()


def output_directory(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("must name a directory, got ''")
    return str(Path.cwd() / text) if text.startswith("~") else text  # the shell has expanded home directories


def results_path(text: str) -> Path:
    """Return the path of an output directory or of a file of results. Raises InputError for pipes and devices."""
    from ..storage import files

    files.refuse_pipes(Path(text))
    return Path(text)


def comma_names(text: str) -> tuple[str, ...]:
    return tuple(filter(None, (part.strip() for part in text.split(","))))


def spaced_numbers(text: str) -> tuple[float, ...]:
    """Return numbers equally spaced in the logarithm, from `first:last:count`, or from a list `a,b,c`."""
    try:
        return _spaced(text) if ":" in text else _floats(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be first:last:count or a list of numbers, got {text!r}") from None


def _spaced(text: str) -> tuple[float, ...]:
    from ..job import log_range

    first, last, number = text.split(":")
    if min(float(first), float(last)) <= 0.0:
        reason = "is equally spaced in the logarithm; first and last must be above 0"
        raise argparse.ArgumentTypeError(f"a range first:last:count {reason}, got {text!r}")
    if int(number) < 2 and first != last:
        raise argparse.ArgumentTypeError(f"a range first:last:count must have a count of 2 or more, got {text!r}")
    return log_range(text)


def fluid(text: str) -> Any:
    """Return the fluid with a name, or with a viscosity [Pa s]."""
    from ..effects.leakage.fluids import FLUIDS, Fluid

    if text in FLUIDS:
        return FLUIDS[text]
    known = f"a fluid ({', '.join(FLUIDS)}) or a positive viscosity [Pa s]"
    return Fluid("the fluid", checked(float, lambda value: 0.0 < value < INFINITE, known)(text))


def pressure_drop(text: str) -> tuple[float, float]:
    """Return two pressures [Pa] from HIGH:LOW."""
    try:
        high, low = map(float, text.split(":"))
    except ValueError:
        high, low = 0.0, 0.0
    if not 0.0 <= low < high < INFINITE:
        raise argparse.ArgumentTypeError(f"must be HIGH:LOW [Pa], such as 2e5:1e5, got {text!r}")
    return high, low
