"""What the solvers ask of an operator."""

from typing import Protocol

from ..parallel.slab import Array


class Operator(Protocol):
    """A linear map from maps to maps, which may be the same one; applying it is collective."""

    def apply(self, field: Array, out: Array) -> Array: ...
