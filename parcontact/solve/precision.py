"""The precision of search directions, which are as good when they are rounded; and how far rounding lets a solve go.

Whatever a direction is, the step along it is right, and so is the image of what comes out, which is made anew. The same
holds of the residuals and of the preconditioner that directions are made of. In partial contact rounding costs contact
solves no iteration, even to 1e-11; full contact, which one step solves, is then good to hardly more digits than single
precision has.
"""

from collections.abc import Sequence

import numpy as np

from ..parallel.slab import Array, Slab

VERY_LOOSE = 1e-3  # accuracy: tolerance with which displacements may have the digits of single precision; certificates
# of such solves end at 1e-6 to 1e-4, more where displacements are far larger than they vary within the contact
ROUNDINGS = 4.0  # accuracy: times the rounding of the largest length, below which no certificate is sure to be
LOOSE = 1e-5  # accuracy: tolerance on a certificate with which they are in single precision


def precision_of_directions(tolerance: float, loose: float = LOOSE) -> type[np.floating]:
    """The type of their maps in a solver with such a tolerance."""
    return np.float32 if tolerance >= loose else np.float64


def reachable_certificate(slab: Slab, lengths: Sequence[Array], p: Array, compliance: float, length: float) -> float:
    """Return the certificate, over `length`, that the rounding of maps of lengths and of p allows; collective.

    A pressure that is wrong in its last digit moves the body by that digit of p times the largest `compliance`: a load
    far beyond full contact has no digits left for what differs from its mean.
    """
    sizes = slab.reduce((), [float(np.abs(each).max(initial=0.0)) for each in (*lengths, p)])
    sizes[-1] *= compliance
    return ROUNDINGS * float(np.finfo(lengths[0].dtype).eps) * max(sizes) / length
