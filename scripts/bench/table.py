"""Measured numbers, and times of functions that take turns."""

import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """One measured number; a ratio has the quartiles of its rounds."""

    what: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None

    def __str__(self) -> str:
        spread = "" if self.low is None else f"   ({self.low:.3g} to {self.high:.3g})"
        return f"{self.what:<48}{self.value:>12.4g} {self.unit}{spread}"


def quartiles(what: str, values: Sequence[float]) -> Line:
    """Return the median of ratios with their quartiles."""
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
    return Line(what, middle, "", low, high)


def interleave(
    functions: Mapping[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
    before: int = 1,
) -> dict[str, list[float]]:
    """Return the times [s] of each function in every round, by turns, after `before` calls of each that are not
    timed."""
    times: dict[str, list[float]] = {name: [] for name in functions}
    for count in range(before + rounds):
        for name, function in functions.items():
            began = clock()
            function()
            if count >= before:
                times[name].append(clock() - began)
    return times


def compare(times: dict[str, list[float]], base: str) -> Iterator[Line]:
    """Yield the median time of each function, and the ratios of the others to `base`."""
    for name, seconds in times.items():
        yield Line(name, 1e3 * statistics.median(seconds), "ms")
        if name != base:
            yield quartiles(f"{name} over {base}", [a / b for a, b in zip(seconds, times[base], strict=True)])
