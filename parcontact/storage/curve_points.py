"""The points of a friction curve: which are asked for, and which its table lacks."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

from ..printed import quantity

LOG = "steady.log"  # beside its table: what was said of it
CLOSE = 1e-6  # accuracy: relative: speeds and pressures that are the same but for rounding

Place = tuple[float, float, float]  # of a point: speed, mean pressure, temperature


class Wanted(NamedTuple):
    """One steady state: speed [m/s], mean pressure [Pa], temperature [deg C], NaN for that of the material."""

    speed: float
    pressure: float
    temperature: float = math.nan

    def __str__(self) -> str:
        heated = "" if math.isnan(self.temperature) else f" at {self.temperature:g} C"
        return f"{self.speed:.4g} m/s under {quantity(self.pressure, 'Pa', 4)}{heated}"


def asked(speeds: Sequence[float], pressures: Sequence[float], temperatures: Sequence[float] = ()) -> list[Wanted]:
    """Return every speed under every pressure at every temperature, each point once, in the order in which they are
    solved."""
    order = product(temperatures or (math.nan,), pressures, speeds)
    return list(dict.fromkeys(Wanted(speed, pressure, temperature) for temperature, pressure, speed in order))


def of_table(columns: Mapping[str, Sequence[float]]) -> list[Wanted]:
    """Return the points that are in a table, given by its columns."""
    speeds = columns["velocity"]
    degrees = columns.get("temperature", [math.nan] * len(speeds))
    return list(map(Wanted, speeds, columns["pressure"], degrees))


def lacking(points: Sequence[Place], there: Sequence[Place]) -> list[int]:
    """Return the numbers of the points that are not there."""
    return [number for number, point in enumerate(points) if not any(_same(point, other) for other in there)]


def _same(one: Place, other: Place) -> bool:
    """Return whether two points are the same; temperatures that were not asked for are."""
    pairs = zip(one, other, strict=True)
    return all(math.isclose(a, b, rel_tol=CLOSE) or (math.isnan(a) and math.isnan(b)) for a, b in pairs)
