"""Contact problem, the input of solvers."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

from ..parallel.slab import Array
from .constraint import Constraint


class Operator(Protocol):
    """Linear map of fields; `out` may be `field`. Applying it is collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


class Operators(NamedTuple):
    """Operator A of a body on one grid, from pressure to displacement, and a preconditioner K close to its inverse."""

    operator: Operator
    preconditioner: Operator


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d is unknown."""

    value: float


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load is unknown."""

    value: float


Control = MeanPressure | Approach


@dataclass(frozen=True)
class Problem:
    """Find a pressure p that the `constraint` admits and whose gap `g = A p - h - d` meets its conditions.

    `operator` is A, `preconditioner` is K, close to its inverse, and `heights` is the map h. `control` gives the
    mean of p or the approach d.
    """

    operator: Operator
    preconditioner: Operator
    heights: Array
    constraint: Constraint
    control: Control

    @cached_property
    def mean(self) -> float | None:
        """The prescribed mean pressure; None with a given approach."""
        return self.control.value if isinstance(self.control, MeanPressure) else None
