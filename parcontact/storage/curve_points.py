"""The points of a friction curve: which are asked for, and which its table lacks."""

import math
from collections.abc import Mapping, Sequence
from itertools import product

LOG = "steady.log"  # beside its table: what was said of it
CLOSE = 1e-6  # relative: speeds and pressures that are the same but for rounding

Point = tuple[float, float, float]  # speed [m/s], mean pressure [Pa], temperature [deg C], NaN for the material's


def asked(speeds: Sequence[float], pressures: Sequence[float], temperatures: Sequence[float] = ()) -> list[Point]:
    """Return every speed under every pressure at every temperature, in the order in which they are solved."""
    order = product(temperatures or (math.nan,), pressures, speeds)
    return [(speed, pressure, temperature) for temperature, pressure, speed in order]


def of_table(columns: Mapping[str, Sequence[float]]) -> list[Point]:
    """Return the points that are in a table, given by its columns."""
    speeds = columns["velocity"]
    degrees = columns.get("temperature", [math.nan] * len(speeds))
    return list(zip(speeds, columns["pressure"], degrees, strict=True))


def lacking(points: Sequence[Point], there: Sequence[Point]) -> list[int]:
    """Return the numbers of the points that are not there."""
    return [number for number, point in enumerate(points) if not any(_same(point, other) for other in there)]


def _same(one: Point, other: Point) -> bool:
    """Return whether two points are the same; temperatures that were not asked for are."""
    pairs = zip(one, other, strict=True)
    return all(math.isclose(a, b, rel_tol=CLOSE) or (math.isnan(a) and math.isnan(b)) for a, b in pairs)
