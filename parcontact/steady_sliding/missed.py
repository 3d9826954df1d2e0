"""Sentences about the points of a friction curve that miss the accuracy asked for."""

import math
from collections.abc import Iterator, Sequence

from ..physics.budget import Parts, advice, describe
from .sliding import Point


def describe_missed(points: Sequence[Point], accuracy: float) -> Iterator[str]:
    """Yield a sentence for friction and one for the corrected area, as far as points are more wrong than asked for."""
    friction = [(point, point.errors.friction) for point in points if point.errors.friction is not None]
    area = [(point, point.errors.area) for point in points]
    for name, each in (("friction", friction), ("corrected contact area", area)):
        missed = [(parts.total, point, parts) for point, parts in each if parts.total > accuracy]
        if missed:
            _, point, parts = max(missed, key=lambda one: one[0])
            yield (
                f"estimated error of the {name} of {len(missed)} of {len(points)} points: up to {_worst(point, parts)}"
                f"{advice(parts, accuracy)}"
            )


def _worst(point: Point, parts: Parts) -> str:
    place = f"{math.hypot(*point.velocity):g} m/s under {point.pressure:g} Pa"
    heated = "" if math.isnan(point.temperature) else f" at {point.temperature:g} C"
    return f"{describe(parts)}, at {place}{heated}"
