"""Precision of search directions, and the smallest certificate that rounding allows.

Directions, residuals and preconditioned residuals may be rounded to single precision: the step along a direction and
the image of the new iterate are computed in double precision. In full contact, which one step solves, the result is
then correct to little more than single precision.
"""

from collections.abc import Sequence

import numpy as np

from ..parallel.slab import Array, Slab

VERY_LOOSE = 1e-3  # accuracy: least tolerance on a certificate with displacements in single precision
ROUNDINGS = 4.0  # accuracy: least certificate that is surely reached, over the relative rounding of the largest length
LOOSE = 1e-5  # accuracy: least tolerance on a certificate with directions in single precision


def precision_of_directions(tolerance: float, loose: float = LOOSE) -> type[np.floating]:
    """Return the type of maps of directions for a solver with this tolerance."""
    return np.float32 if tolerance >= loose else np.float64


def reachable_certificate(slab: Slab, lengths: Sequence[Array], p: Array, compliance: float, length: float) -> float:
    """Return the smallest certificate, over `length`, that the rounding of maps of lengths and of p allows; collective.
    An error in the last digit of p moves the body by this digit times the largest `compliance`."""
    sizes = slab.reduce((), [float(np.abs(each).max(initial=0.0)) for each in (*lengths, p)])
    sizes[-1] *= compliance
    return ROUNDINGS * float(np.finfo(lengths[0].dtype).eps) * max(sizes) / length
