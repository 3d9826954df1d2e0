"""Temperatures of a contact: where its heat is released, and the distribution of the temperature rise over the contact.

The heat of the interface is its shear stress times the sliding speed, on all points in contact. The heat of the
body, dissipated by its branches, is distributed in proportion to the pressure.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...parallel.slab import Array, Slab

BINS = 512  # accuracy: bins of the histogram for quartiles, whose error is 1/512 of the range


@dataclass(frozen=True)
class Flash:
    """Temperature rises [K] of a contact, weighted by the heat where it is released, on the surface and in the body:
    their mean (the flash temperature), the highest on the surface, and the lower and upper quartile."""

    mean: float = 0.0
    highest: float = 0.0
    lower: float = 0.0
    upper: float = 0.0


def spread_over(slab: Slab, weights: Array, total: float) -> Array:
    """Return `total` [W/m^2, mean over the box] distributed in proportion to a map of weights; 0 if all weights are 0.
    Collective."""
    whole = slab.sum(float(weights.sum(dtype=np.float64)))[0]
    return weights * (total * slab.points / whole if whole > 0.0 else 0.0)


def share_of(slab: Slab, rubbed: Array, own: Array, other: Array, counterbody: Array) -> float:
    """Return the share of the heat of the interface that goes into the rubber, so that both surfaces have the same mean
    temperature over the contact (H. Blok, Proc. Inst. Mech. Engrs. 2 (1937) 222); collective.

    `own` and `counterbody` are the rises [K] that all of this heat would cause on either side, `other` is the rise
    of the rubber by other heat. The mean is weighted by `rubbed`.
    """
    sums = slab.sum(*(float((rise * rubbed).sum()) for rise in (own, other, counterbody)))
    whole = sums[0] + sums[2]
    return min(max((sums[2] - sums[1]) / whole, 0.0), 1.0) if whole > 0.0 else 1.0


def flash_of(slab: Slab, surface: Array, pairs: Sequence[tuple[Array, Array]]) -> Flash:
    """Return the temperatures of a contact; collective. `surface` has the rises [K] of the surface; `pairs` are maps of
    a rise [K] and of the heat released there."""
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
