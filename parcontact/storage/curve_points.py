"""The points of a friction curve: requested ones, and those missing in its table."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

from ..printed import quantity

LOG = "steady.log"  # log of a friction curve, in the directory of its table
CLOSE = 1e-6  # rounding: relative difference below which speeds and pressures are the same

Place = tuple[float, float, float]  # speed [m/s], mean pressure [Pa], temperature [deg C]


class Wanted(NamedTuple):
    """A steady state: speed [m/s], mean pressure [Pa], temperature [deg C] (NaN: the temperature of the material)."""

    speed: float
    pressure: float
    temperature: float = math.nan

    def __str__(self) -> str:
        heated = "" if math.isnan(self.temperature) else f" at {self.temperature:g} C"
        return f"{self.speed:.4g} m/s under {quantity(self.pressure, 'Pa', 4)}{heated}"


def requested_points(
    speeds: Sequence[float], pressures: Sequence[float], temperatures: Sequence[float] = ()
) -> list[Wanted]:
    """Return all combinations of speeds, pressures and temperatures without repetition, in the order of solution."""
    order = product(temperatures or (math.nan,), pressures, speeds)
    return list(dict.fromkeys(Wanted(speed, pressure, temperature) for temperature, pressure, speed in order))


def of_table(columns: Mapping[str, Sequence[float]]) -> list[Wanted]:
    """Return the points in the columns of a table."""
    speeds = columns["velocity"]
    degrees = columns.get("temperature", [math.nan] * len(speeds))
    return list(map(Wanted, speeds, columns["pressure"], degrees))


def lacking(points: Sequence[Place], there: Sequence[Place]) -> list[int]:
    """Return the indices of `points` that are not in `there`."""
    return [number for number, point in enumerate(points) if not any(_same(point, other) for other in there)]


def _same(one: Place, other: Place) -> bool:
    """Return True if two points are the same; NaN temperatures are equal."""
    pairs = zip(one, other, strict=True)
    return all(math.isclose(a, b, rel_tol=CLOSE) or (math.isnan(a) and math.isnan(b)) for a, b in pairs)
