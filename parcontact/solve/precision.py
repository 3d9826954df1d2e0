"""The precision of search directions, which are as good when they are rounded.

Whatever a direction is, the step along it is right, and so is the image of what comes out, which is made anew. The same
holds of the residuals and of the preconditioner that directions are made of. In partial contact rounding costs contact
solves no iteration, even to 1e-11; full contact, which one step solves, is then good to hardly more digits than single
precision has.
"""

import numpy as np

VERY_LOOSE = 1e-3  # accuracy: tolerance with which displacements may have the digits of single precision; certificates
# of such solves end at 1e-6 to 1e-4, more where displacements are far larger than they vary within the contact
LOOSE = 1e-5  # accuracy: tolerance on a certificate with which they are in single precision


def precision_of_directions(tolerance: float, loose: float = LOOSE) -> type[np.floating]:
    """The type of their maps in a solver with such a tolerance."""
    return np.float32 if tolerance >= loose else np.float64
