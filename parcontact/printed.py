"""Printed output: numbers formatted for readers, streams that never fail, and bars of progress on terminals.

Numbers have units with prefixes and as many digits as the error allows; shares are in per cent. Texts contain ± and µ;
streams replace both on terminals that cannot show them. Printing must not end the program.
"""

import io
import math
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, TextIO, TypeVar

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
TIMES = {"years": 365.25 * 86400.0, "days": 86400.0, "h": 3600.0, "min": 60.0}  # [s]
LONG_TIME = 2.0  # smallest number of minutes, hours, days or years that is printed in this unit
ROUNDING = 1e-9  # rounding: relative difference of equal numbers
MOST_DIGITS = 6  # limit on the digits of a number with an error


def prefixed(unit: str, largest: float) -> tuple[str, float]:
    """Return the unit with the prefix that suits the largest value, and the size of this prefixed unit in `unit`.

    Prefixes of m² change by factors of a million; values down to a thousandth of a unit are in this unit. °C, m³ and
    dimensionless values have no prefix. Times of two minutes or more are in minutes, hours, days or years.
    """
    if unit == "s" and abs(largest) >= LONG_TIME * TIMES["min"]:
        return next((name, size) for name, size in TIMES.items() if abs(largest) >= LONG_TIME * size)
    if unit in ("", "°C", "m³") or not largest or not math.isfinite(largest):
        return unit, 1.0
    square = unit == "m²"
    order = math.log10(abs(largest)) + 1e-9
    power = 3 * math.floor((order + 3.0) / 6.0 if square else order / 3.0)
    power = min(max(power, min(PREFIXES)), 0 if unit == "s" else max(PREFIXES))
    return PREFIXES[power] + unit, 10.0 ** (2 * power if square else power)


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit and a suitable prefix: 11.7 µm."""
    rounded = float(f"{value:.{digits}g}") + 0.0  # no -0
    shown, size = prefixed(unit, rounded)
    number = value if shown in TIMES else rounded  # a time is rounded in its own unit
    return f"{float(f'{number / size:.{digits}g}'):g} {shown}".rstrip()


def rounded_up(value: float, digits: int = 3) -> str:
    """Return a number rounded up to `digits` digits, for advice on a least value."""
    return _round_towards(value, digits, 1)


def rounded_down(value: float, digits: int = 3) -> str:
    """Return a number rounded down to `digits` digits, for advice on a largest value."""
    return _round_towards(value, digits, -1)


def _round_towards(value: float, digits: int, side: int) -> str:
    """Return a rounded number that is at least the value (`side` 1), or at most (-1), but for the last digits."""
    text = f"{value:.{digits}g}"
    if not value or not math.isfinite(value) or side * (float(text) - value) >= -ROUNDING * abs(value):
        return text
    power = math.floor(math.log10(abs(value)))  # of the first digit
    return f"{float(text) + side * 10.0 ** (power - digits + 1):.{digits}g}"


def span(low: float, high: float, unit: str, digits: int = 3) -> str:
    """Return two numbers in one unit, with enough digits to distinguish them: 1.05 and 1.10 MPa."""
    largest = max(abs(low), abs(high))
    shown, size = prefixed(unit, largest)
    if low == high or abs(low) < 0.01 * largest:
        return f"{quantity(low, unit, digits)} and {quantity(high, unit, digits)}"
    step = min(largest / 10 ** (digits - 1), abs(high - low)) / size
    places = max(0, -math.floor(math.log10(step) + 1e-9))
    ends = [f"{end / size:.{places}f}" for end in (low, high)]
    while all("." in end and end[-1] in "0." for end in ends):
        ends = [end[:-1] for end in ends]
    return f"{ends[0]} and {ends[1]} {shown}".rstrip()


def per_cent(share: float, digits: int = 2) -> str:
    """Return a share in per cent: 0.033 %, 2.2 %, 130 %."""
    percent = 100.0 * share
    return f"{percent:.{digits}g} %" if percent < 10.0**digits - 0.5 else f"{percent:.0f} %"


def stated_error(error: float) -> str:
    """Return an estimated relative error in per cent, or "unknown" above 100 %."""
    return per_cent(error) if error <= 1.0 else "unknown"


def with_error(value: float, error: float, unit: str = "") -> str:
    """Return a number and its error with two digits of the error, both in one prefixed unit: 19.20 ± 0.14 mm².

    The number has at most MOST_DIGITS digits, and four if no error is known.
    """
    shown, size = prefixed(unit, max(abs(value), error if error < math.inf else 0.0))
    return f"{_with_error(value / size, error / size)} {shown}".rstrip()


def _with_error(value: float, error: float) -> str:
    if not 0.0 < error < math.inf:
        return f"{value:.4g}"
    last = _exponent(error) - 1  # the power of ten of the last digit that is shown
    first = max(_exponent(value), last + 1) if value else last + 1
    shown = max(last, first + 1 - MOST_DIGITS)
    if -4 <= first < MOST_DIGITS:
        within = f"{error:.{max(-last, 0)}f}" if shown == last else f"{error:.1e}"
        return f"{value:.{max(-shown, 0)}f} ± {within}"
    return f"{value:.{first - shown}e} ± {error:.1e}"


def _exponent(value: float) -> int:
    """Return the power of ten of the first digit, after rounding to two digits."""
    return int(f"{value:.1e}".partition("e")[2])


def name_cases(numbers: Sequence[int]) -> str:
    """Return ascending numbers as text: `cases 0, 2-5`."""
    starts = [number for number in numbers if number - 1 not in numbers]
    ends = [number for number in numbers if number + 1 not in numbers]
    pairs = zip(starts, ends, strict=True)
    listed = ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in pairs)
    return f"case{'s' * (len(numbers) > 1)} {listed}"


# output streams

PLAIN = str.maketrans({"±": "+-", "µ": "u", "²": "^2", "³": "^3", "°": "deg ", "−": "-", "–": "-", "×": "x"})
CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def printable(text: str) -> str:
    """Return the text with control characters, and characters that reverse the direction of text, replaced by their
    codes."""
    return CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}" if ord(found[0]) > 255 else repr(found[0])[1:-1], text)


class TolerantStream(io.TextIOBase):
    """A stream that writes to another stream. It drops text if the other stream is closed or full, and replaces
    characters that the other stream cannot encode.

    If `plain` is True, control characters except tabs and ends of lines are replaced, too; a progress bar needs them.
    """

    def __init__(self, stream: TextIO | None, plain: bool) -> None:
        self._stream, self._plain, self.gone = stream, plain, False
        self.lost = "" if stream else "it is closed"  # why text was lost, except to a closed pipe

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        shown = printable(text) if self._plain else text
        if self._stream is not None and not self.gone:
            try:
                self._stream.write(shown)
            except UnicodeEncodeError:
                self._stream.write(shown.translate(PLAIN).encode("ascii", "backslashreplace").decode())
            except (OSError, ValueError) as error:
                self._give_up(error)
        return len(text)

    def flush(self) -> None:
        if self._stream is not None and not self.gone:
            try:
                self._stream.flush()
            except (OSError, ValueError) as error:
                self._give_up(error)

    def _give_up(self, error: OSError | ValueError) -> None:
        self.gone = True
        if not isinstance(error, BrokenPipeError):
            self.lost = getattr(error, "strerror", None) or "it is closed"

    def isatty(self) -> bool:
        with suppress(OSError, ValueError):
            return self._stream is not None and not self.gone and self._stream.isatty()
        return False

    def drop_the_rest(self) -> None:
        """Drop unwritten text of a failed stream, so that Python does not fail when it ends."""
        self.flush()
        if self.gone and self._stream is not None:
            with suppress(OSError, ValueError):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)


@contextmanager
def tolerant_streams() -> Iterator[None]:
    """Make standard output and standard error tolerant within the context."""
    before = sys.stdout, sys.stderr
    out, err = TolerantStream(before[0], True), TolerantStream(before[1], False)
    sys.stdout, sys.stderr = out, err
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        out.drop_the_rest()
        err.drop_the_rest()


def describe_loss() -> str:
    """Return why printed text could not be written; '' if it was written, or if the reader closed the pipe."""
    sys.stdout.flush()
    return sys.stdout.lost if isinstance(sys.stdout, TolerantStream) else ""


T = TypeVar("T")


class Bar:
    """A progress bar below the printed lines, if standard error is a terminal."""

    def __init__(self, total: int, what: str, unit: str = "step", wanted: bool = True) -> None:
        self._bar = None
        if wanted and total and sys.stderr.isatty():
            from tqdm import tqdm  # slow to import

            self._bar = tqdm(total=total, desc=what, unit=unit, leave=False)

    def step(self) -> None:
        """Advance the bar by one."""
        if self._bar is not None:
            self._bar.update()

    def print(self, text: str) -> None:
        """Print a line above the bar."""
        if self._bar is not None:
            self._bar.write(text, file=sys.stdout)
        else:
            print(text, flush=True)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


def with_bar(items: Sequence[T], what: str, unit: str = "step") -> Iterator[T]:
    """Yield the items, with a progress bar that counts the finished ones."""
    bar = Bar(len(items), what, unit)
    try:
        for item in items:
            yield item
            bar.step()
    finally:
        bar.close()
