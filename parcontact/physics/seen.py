"""What is known of a run, and what a step of it has shown, from which its errors are estimated: contact spots, how
large and how many they are."""

import math
from dataclasses import dataclass

from .measures import SIDE
from .prony import Prony

ROUND = 8.0 / math.pi  # cells of a round spot over its sides on the edge, times this: its radius in cells


@dataclass(frozen=True)
class Known:
    """What is known of a run before it begins.

    `cells_per_wave` of the shortest wave of a rough surface, None without one; `straight`: on a grid of one row or
    column every edge of contact follows the grid; `folded`: the bound; `exponential`: the integrator; `prony`: what
    relaxes, None of an elastic body.
    """

    cells_per_wave: float | None
    straight: bool
    folded: float
    exponential: bool
    prony: Prony | None = None


@dataclass(frozen=True)
class Seen:
    """What a step has shown: the certificate's complementarity; by how much the embedded pair differs, with its order
    in the step; the rms slope of the surface under the pressure; friction; contact area, counted and corrected, as
    shares; by how many cells the surface slid in it, in how many seconds; the points that penetrate without pressure,
    as a share of those in contact; by what angle a wave turned that is as high as the surface under the pressure
    and changes as much; by how much friction by the slopes of the rigid surface and of the body differ."""

    complementarity: float
    difference: float
    order: float
    slope: float
    friction: float
    area: float
    corrected: float
    slid: float = 0.0
    seconds: float = 0.0
    penetrating: float = 0.0
    angle: float = 0.0
    views_apart: float = 0.0

    @property
    def correction(self) -> float:
        """By how much the counted area is more than the corrected one, over that."""
        return (self.area - self.corrected) / self.corrected if self.corrected > 0.0 else 0.0


def spot_radius(seen: Seen, points: int) -> float:
    """Of round spots of contact, or of the gaps between them where these are the smaller, in cells; infinite where
    there are no edges."""
    sides = (seen.area - seen.corrected) * points / SIDE
    return ROUND * min(seen.area, 1.0 - seen.area) * points / sides if sides > 0.0 else math.inf


def radius_of(known: Known, seen: Seen, points: int) -> float:
    """Of spots, or half the width of a straight one."""
    return spot_radius(seen, points) / (ROUND if known.straight else 1.0)


def count_spots(known: Known, seen: Seen, points: int) -> float:
    """How many spots of contact there are; in full contact as many as half waves of the shortest length."""
    radius = radius_of(known, seen, points)
    if known.cells_per_wave is not None:
        radius = min(radius, 0.5 * known.cells_per_wave)
    one = 2.0 * radius if known.straight else math.pi * radius**2
    return max(1.0, seen.area * points / one) if one > 0.0 else 1.0
