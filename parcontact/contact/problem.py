"""Input, memory, precision and result of a contact solve.

Directions, residuals and preconditioned residuals may be rounded to single precision: the step along a direction and
the image of the new iterate are computed in double precision. In full contact, which one step solves, the result is
then correct to little more than single precision.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..parallel.slab import Array, Slab
from ..physics.measures import Certificate
from .constraint import Box


class Operator(Protocol):
    """Linear operator on maps. `out` may be the map `field` itself. Calls are collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


class Operators(NamedTuple):
    """Operator A of a body on one grid, from pressure to displacement, and a preconditioner K close to its inverse."""

    operator: Operator
    preconditioner: Operator


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d is unknown."""

    value: float

    @property
    def mean(self) -> float | None:
        """Return the prescribed mean pressure."""
        return self.value


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load is unknown."""

    value: float
    mean = None


Control = MeanPressure | Approach


@dataclass(frozen=True)
class Problem:
    """Find a pressure p between the bounds of the `constraint` whose gap `g = A p - h - d` meets its conditions.

    `operator` is A, `preconditioner` is K, close to its inverse, and `heights` is the map h. `control` gives the
    mean of p or the approach d.
    """

    operator: Operator
    preconditioner: Operator
    heights: Array
    constraint: Box
    control: Control


@dataclass(frozen=True)
class Contact:
    """A contact, solved or given up. Maps have the shape (rows of this rank, nx).

    `p` is the array that was passed as the start. `u = A p` is an array of the solver, overwritten by the next solve.
    `failure` is empty, or states why the tolerance was not reached.
    """

    p: Array
    u: Array
    d: float
    certificate: Certificate
    iterations: int
    failure: str

    @property
    def converged(self) -> bool:
        return not self.failure


VERY_LOOSE = 1e-3  # accuracy: least tolerance on a certificate with displacements in single precision
ROUNDINGS = 4.0  # accuracy: least certificate that is surely reached, over the relative rounding of the largest length
LOOSE = 1e-5  # accuracy: least tolerance on a certificate with directions in single precision


def precision_of_directions(tolerance: float, loose: float = LOOSE) -> type[np.floating]:
    """Return the floating-point type of search directions for a solver with this tolerance."""
    return np.float32 if tolerance >= loose else np.float64


def reachable_certificate(slab: Slab, lengths: Sequence[Array], p: Array, compliance: float, length: float) -> float:
    """Return the smallest certificate that rounding allows, with gaps divided by `length`; collective.

    `lengths` are the maps of heights and displacements. A rounding error of p moves the body by this error times the
    largest `compliance`.
    """
    sizes = slab.reduce((), [float(np.abs(each).max(initial=0.0)) for each in (*lengths, p)])
    sizes[-1] *= compliance
    return ROUNDINGS * float(np.finfo(lengths[0].dtype).eps) * max(sizes) / length


class Workspace:
    """A pressure, two displacements, a search direction, and one byte per point.

    All solvers of a run share one workspace. A solve overwrites all maps and leaves `A p` in `displacement`, valid
    until the next solve. Read maps as attributes at each use: they may be swapped or replaced.

    Parameters: `kept`, the type of displacements, single precision if the operator is; `tolerance` of solves, which
    decides the precision of directions.
    """

    def __init__(self, slab: Slab, tolerance: float, kept: type[np.floating] = np.float64) -> None:
        self.slab = slab
        self.pressure = slab.zeros()
        self.displacement, self.other_displacement = slab.zeros(kept), slab.zeros(kept)
        self.direction = slab.zeros(precision_of_directions(tolerance))
        self.working: NDArray[Any] = slab.zeros(np.bool_)

    def swap_displacements(self) -> None:
        self.displacement, self.other_displacement = self.other_displacement, self.displacement
