"""A contact problem, as solvers are given it."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..parallel.slab import Array
from .constraint import Constraint


class Operator(Protocol):
    """A linear map from maps to maps, which may be the same one; applying it is collective."""

    def apply(self, field: Array, out: Array) -> Array: ...


class Operators(NamedTuple):
    """The operator A of a body on one grid, pressure to displacement, and a preconditioner K close to its inverse."""

    operator: Operator
    preconditioner: Operator


@dataclass(frozen=True)
class MeanPressure:
    """Load control: the mean of p is given, the rigid approach d follows."""

    value: float


@dataclass(frozen=True)
class Approach:
    """Displacement control: the rigid approach d is given, the load follows."""

    value: float


Control = MeanPressure | Approach


@dataclass(frozen=True)
class Problem:
    """Find a pressure p that the `constraint` admits, and whose gap `g = A p - h - d` meets its conditions.

    `operator` is A, `preconditioner` a K close to its inverse, `heights` is the map h; `control` gives either the mean
    of p, so that d is unknown, or d.
    """

    operator: Operator
    preconditioner: Operator
    heights: Array
    constraint: Constraint
    control: Control

    @property
    def mean(self) -> float | None:
        """The mean pressure asked for, None with a given approach."""
        return self.control.value if isinstance(self.control, MeanPressure) else None
