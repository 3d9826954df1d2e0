"""Maps of one grid that contact solves work in. Between solves other parts of a run use them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parallel.slab import Slab
from .precision import precision_of_directions


class Workspace:
    """A pressure, two displacements, a search direction, and one byte per point.

    The scene makes one and passes it to all that need a map temporarily. A solve overwrites all maps and leaves `A p`
    in `displacement`, valid until the next one. Read maps as attributes at each use: they may be swapped or replaced.

    Parameters: `kept`, the type of displacements, single precision if the operator has no more digits; `tolerance` of
    solves, which decides the precision of directions.
    """

    def __init__(self, slab: Slab, tolerance: float, kept: type[np.floating] = np.float64) -> None:
        self.slab = slab
        self.pressure = slab.zeros()
        self.displacement, self.other_displacement = slab.zeros(kept), slab.zeros(kept)
        self.direction = slab.zeros(precision_of_directions(tolerance))
        self.working: NDArray[Any] = slab.zeros(np.bool_)

    def swap_displacements(self) -> None:
        self.displacement, self.other_displacement = self.other_displacement, self.displacement
