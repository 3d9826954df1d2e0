"""Measured numbers of scripts/bench.py, and times of ways that take turns."""

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    """One measured number; a ratio has the quartiles of its rounds."""

    part: str
    what: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None


def interleave(
    ways: Mapping[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
    before: int = 1,
) -> dict[str, list[float]]:
    """Seconds of each way in every round, in turns; all are done once, or so many times, `before`."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for count in range(before + rounds):
        for name, way in ways.items():
            began = clock()
            way()
            if count >= before:
                times[name].append(clock() - began)
    return times


def compare(part: str, times: dict[str, list[float]], base: str) -> Iterator[Line]:
    """The median of each way, and the ratio of the others to the base."""
    for name, seconds in times.items():
        yield Line(part, name, 1e3 * statistics.median(seconds), "ms")
        if name != base:
            ratios = [a / b for a, b in zip(seconds, times[base], strict=True)]
            low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist()
            yield Line(part, f"{name} over {base}", middle, "", low, high)
