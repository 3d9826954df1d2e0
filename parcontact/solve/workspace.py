"""The maps of one grid that contact solves work in; between solves they serve other parts of a run."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parallel.slab import Slab
from .precision import precision_of_directions


class Workspace:
    """A pressure, two displacements, a search direction and a byte per point.

    The scene makes one and hands it to whoever needs a map for a moment. A solve overwrites all of them and ends with
    `A p` in `displacement`, which stays valid until the next one. Maps may change places and be replaced by others of
    the same type: read them as attributes at each use.

    Parameters: `kept`, the type of displacements, single precision where the operator has no more digits; the
    `tolerance` of solves, with which a loose one keeps directions in single precision.
    """

    def __init__(self, slab: Slab, tolerance: float, kept: type[np.floating] = np.float64) -> None:
        self.slab = slab
        self.pressure = slab.zeros()
        self.displacement, self.other_displacement = slab.zeros(kept), slab.zeros(kept)
        self.direction = slab.zeros(precision_of_directions(tolerance))
        self.working: NDArray[Any] = slab.zeros(np.bool_)

    def swap_displacements(self) -> None:
        self.displacement, self.other_displacement = self.other_displacement, self.displacement
