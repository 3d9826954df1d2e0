"""Values of options: text -> value, or an argparse.ArgumentTypeError that says what is expected."""

import argparse
from contextlib import suppress
from pathlib import Path


def directory(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("must name a directory, got ''")
    return str(Path.cwd() / text) if text.startswith("~") else text  # a shell has said all there is to say of homes


def seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a time [s] of zero or more, got {text!r}")
    return value


def count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be positive whole numbers, got {text!r}")
    return int(text)


def natural(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number of zero or more, got {text!r}")
    return int(text)


def counts(text: str) -> tuple[int, ...]:
    return tuple(count(part) for part in text.split(","))


def instant(text: str) -> str:
    """A step, as digits, or a time as the text of a number."""
    with suppress(ValueError):
        if 0.0 <= float(text) < float("inf"):
            return text.strip()
    raise argparse.ArgumentTypeError(f"must be a step, as a whole number, or a time [s], got {text!r}")


def names(text: str) -> tuple[str, ...]:
    return tuple(filter(None, (part.strip() for part in text.split(","))))


def network(text: str) -> tuple[float, float]:
    found = numbers(text)
    if len(found) != 2 or min(found) <= 0.0:
        raise argparse.ArgumentTypeError(f"must be seconds of a message and bytes per second, got {text!r}")
    return found[0], found[1]


def positive(text: str) -> float:
    with suppress(ValueError):
        if 0.0 < float(text) < float("inf"):
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a positive number, got {text!r}")


def poisson(text: str) -> float:
    with suppress(ValueError):
        if -1.0 < float(text) <= 0.5:
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a Poisson ratio above -1 and up to 0.5, got {text!r}")


def share(text: str) -> float:
    with suppress(ValueError):
        if 0.0 <= float(text) <= 1.0:
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a number from 0 to 1, got {text!r}")


def wall_seconds(text: str) -> float:
    """Seconds of [[HH:]MM:]SS, or with days in front as in Slurm, D-HH:MM:SS; 0 for other text."""
    days, dash, rest = text.rpartition("-")
    fields = rest.split(":")
    try:
        if len(fields) > 3:
            return 0.0
        seconds = sum(float(field) * 60.0**power for power, field in enumerate(reversed(fields)))
        return seconds + (86400.0 * int(days) if dash else 0.0)
    except ValueError:
        return 0.0


def wall(text: str) -> float:
    limit = wall_seconds(text)
    if not 0.0 < limit < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a wall time HH:MM:SS, got {text!r}")
    return limit


def numbers(text: str) -> tuple[float, ...]:
    """Numbers equally spaced in their logarithm, `first:last:count`, or a list `a,b,c`."""
    try:
        return _spaced(text) if ":" in text else tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be first:last:count or a list of numbers, got {text!r}") from None


def degrees(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a list of temperatures [deg C], got {text!r}") from None


def _spaced(text: str) -> tuple[float, ...]:
    from ..job import log_range

    first, last, number = text.split(":")
    if min(float(first), float(last)) <= 0.0:
        reason = "is spaced equally in the logarithm, so it must begin and end above 0"
        raise argparse.ArgumentTypeError(f"a range first:last:count {reason}, got {text!r}")
    if int(number) < 2 and first != last:
        raise argparse.ArgumentTypeError(f"a range first:last:count must have a count of 2 or more, got {text!r}")
    return log_range(text)
