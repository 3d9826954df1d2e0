"""Temperatures of a contact: where its heat is made, and what the map of the temperature rise is like over the contact.

The heat of the interface is its shear stress times the sliding speed, on all that is in contact. The heat of the body
is what its branches dissipate. It is deposited where the contact works: in proportion to the pressure.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..parallel.slab import Array, Slab

BINS = 512  # accuracy: of the histogram from which the quartiles are taken, within a 512th of the range


@dataclass(frozen=True)
class Flash:
    """Temperature rises [K] of a contact, weighted by heat where it is made, on the surface and in the body: their mean
    (the flash temperature), the highest one of the surface, and the lower and upper quartile."""

    mean: float = 0.0
    highest: float = 0.0
    lower: float = 0.0
    upper: float = 0.0


def spread_over(slab: Slab, weights: Array, total: float) -> Array:
    """Return `total` [W/m^2, mean over the box] in proportion to a map of weights, 0 where all are; collective."""
    whole = slab.sum(float(weights.sum(dtype=np.float64)))[0]
    return weights * (total * slab.points / whole if whole > 0.0 else 0.0)


def share_of(slab: Slab, rubbed: Array, own: Array, other: Array, counterbody: Array) -> float:
    """Return the share of the heat of the interface that goes into the rubber: both surfaces are then equally warm in
    the mean over the contact (H. Blok, Proc. Inst. Mech. Engrs. 2 (1937) 222); collective.

    `own` and `counterbody` are the rises [K] that all of this heat would make on either side, `other` is that of the
    rubber by other heat; the mean is weighted by what is `rubbed`.
    """
    sums = slab.sum(*(float((rise * rubbed).sum()) for rise in (own, other, counterbody)))
    whole = sums[0] + sums[2]
    return min(max((sums[2] - sums[1]) / whole, 0.0), 1.0) if whole > 0.0 else 1.0


def flash_of(slab: Slab, surface: Array, pairs: Sequence[tuple[Array, Array]]) -> Flash:
    """Return the temperatures of a contact, whose surface has these rises [K], from pairs of maps: a rise [K] and the
    heat that is made there; collective."""
    sums = [(float((rise * heat).sum()), float(heat.sum())) for rise, heat in pairs]
    warmed, whole = slab.sum(*(math.fsum(each) for each in zip(*sums, strict=True))) if sums else (0.0, 0.0)
    highest = float(surface.max(initial=-math.inf))
    if not whole > 0.0:
        return Flash()
    values = np.concatenate([rise[heat > 0.0] for rise, heat in pairs])
    weights = np.concatenate([heat[heat > 0.0] for _, heat in pairs])
    ends = float(values.max(initial=-math.inf)), -float(values.min(initial=math.inf))
    highest, top, bottom = slab.reduce((), [highest, *ends])
    low, span = -bottom, max(top + bottom, np.finfo(float).tiny)
    counts = np.histogram((values - low) / span, BINS, (0.0, 1.0), weights=weights)[0]
    shares = np.concatenate([[0.0], np.cumsum(slab.sum(*counts))]) / whole
    lower, upper = low + span * np.interp([0.25, 0.75], shares, np.linspace(0.0, 1.0, BINS + 1))
    return Flash(warmed / whole, highest, float(lower), float(upper))
