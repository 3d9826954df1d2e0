"""Numbers formatted for readers: prefixes of units, shares in per cent, and as many digits as the error allows.

Texts contain ± and µ; `streams` replaces them on terminals that cannot show them.
"""

import math
from collections.abc import Sequence

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


def stated_error(error: float, digits: int = 2) -> str:
    """Return an estimated relative error in per cent, or "unknown" above 100 %."""
    return per_cent(error, digits) if error <= 1.0 else "unknown"


def with_error(value: float, error: float) -> str:
    """Return a number and its error with two digits of the error: 0.01483 ± 0.00036.

    The number has at most MOST_DIGITS digits, and four if no error is known.
    """
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
