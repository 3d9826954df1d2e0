"""Units with the prefix that suits the numbers: 1.04 kPa, not 0.00104167 MPa."""

import numpy as np

from ..parallel.slab import Array

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
DIGITS = 3
WHOLE = 1e6  # numbers below have no exponent


def scaled(unit: str, *series: Array) -> tuple[str, list[Array]]:
    """The unit with the prefix that suits the largest value, and the series in it.

    Squares as m² go up by a million; they keep the larger unit down to a thousandth of it. No unit has no prefix, and
    there are no kiloseconds.
    """
    largest = max((float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) for values in series), default=0.0)
    if not unit or not largest:
        return unit, list(series)
    order = np.log10(largest) + 1e-9
    power = 3 * int(np.floor((order + 3.0) / 6.0 if unit.endswith("²") else order / 3.0))
    power = min(max(power, min(PREFIXES)), 0 if unit == "s" else max(PREFIXES))
    label = PREFIXES[power] + unit
    return label, [values / size_of(label, unit) for values in series]


def size_of(label: str, unit: str) -> float:
    """What a unit with its prefix stands for."""
    power = next(power for power, prefix in PREFIXES.items() if prefix + unit == label)
    return 10.0 ** (2 * power if unit.endswith("²") else power)


def text(value: float, unit: str, digits: int = DIGITS) -> str:
    """A number with its unit."""
    label, (shown,) = scaled(unit, np.array([float(f"{value:.{digits}g}")]))
    number = f"{shown[0]:.{digits}g}"
    whole = f"{float(number):.0f}" if "e+" in number and shown[0] < WHOLE else number
    return f"{whole} {label}".rstrip()


def labelled(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
