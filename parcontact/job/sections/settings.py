"""The `grid`, `numerics`, `output` and `checkpoint` sections."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from ..text.fault import Fault
from .part import Context, Part, Rule
from .values import FROM_SURFACE, Count, Flag, Fraction, Number, Positive, Whole, both, from_home, listed


class Grid(Part):
    """The box and its cells; x comes first in `points` and `size`."""

    points: Annotated[tuple[Count, Count], BeforeValidator(both), FROM_SURFACE] = Field(
        description="a positive whole number of points"
    )
    size: Annotated[tuple[Positive, Positive], BeforeValidator(both), FROM_SURFACE] = Field(
        description="a positive length [m]"
    )
    boundary: Literal["periodic", "free"] = "periodic"

    @property
    def nx(self) -> int:
        """Points along x."""
        return self.points[0]

    @property
    def ny(self) -> int:
        """Points along y."""
        return self.points[1]

    @property
    def lx(self) -> float:
        """Length of the box along x [m]."""
        return self.size[0]

    @property
    def ly(self) -> float:
        """Length of the box along y [m]."""
        return self.size[1]

    @property
    def dx(self) -> float:
        """Length of a cell along x [m]."""
        return self.lx / self.nx

    @property
    def dy(self) -> float:
        """Length of a cell along y [m]."""
        return self.ly / self.ny


TOLERANCE_SHARE, BRANCH_SHARE = 0.5, 0.1  # of numerics.accuracy


class Numerics(Part):
    """How the equations are solved; `accuracy` chooses the tolerance and what branches may be folded, where these are
    not given, and says how fine the mesh should be."""

    accuracy: Fraction = Field(default=1e-2, description="an error of friction and area [-] above 0 and below 1")
    integrator: Literal["exponential", "backward-euler"] = "exponential"
    tolerance: Fraction = Field(default=5e-3, description="a tolerance [-] above 0 and below 1")
    max_iterations: Count = Field(default=500, description="a positive whole number of iterations")
    branch_error: Number = Field(
        default=1e-3, ge=0, lt=1, description="an error of friction [-] of zero or more and below 1"
    )
    kernel: Literal["spectral", "love"] = "spectral"  # in a free scene: love
    precision: Literal["double", "mixed"] = "double"
    slope: Literal["spectral", "finite-difference"] = "spectral"
    accept_unconverged: Flag = Field(default=False, description="true or false")
    strict: Flag = Field(default=False, description="true or false")

    @classmethod
    def filled(cls, data: dict[str, Any], context: Context | None) -> dict[str, Any]:
        """The tolerance and the error of folded branches are shares of the accuracy."""
        accuracy = data.get("accuracy")
        if isinstance(accuracy, bool) or not isinstance(accuracy, int | float) or not 0 < accuracy < 1:
            return data
        return {"tolerance": TOLERANCE_SHARE * accuracy, "branch_error": BRANCH_SHARE * accuracy, **data}


FieldName = Literal["pressure", "displacement", "gap", "height"]


def _needs_energy(branch_dissipation: bool, energy: bool) -> Iterator[Fault]:
    if branch_dissipation and not energy:
        yield Fault("needs energy: true", ("branch_dissipation",))


def _no_repeats(fields: tuple[str | None, ...]) -> Iterator[Fault]:
    for index, name in enumerate(fields):
        if name is not None and name in fields[:index]:
            yield Fault(f"names {name} a second time", ("fields", index))


class Output(Part):
    """What is written, where, and how often. A relative directory starts at the working directory."""

    directory: Annotated[Path, AfterValidator(from_home)] = Field(
        default=Path("out"), description="the path of a directory (text)"
    )  # default: out/<job file stem>
    fields: Annotated[tuple[FieldName, ...], BeforeValidator(listed)] = Field(
        default=(), description="a list of fields"
    )
    every: Count = Field(default=1, description="a positive whole number of steps")
    energy: Flag = Field(default=False, description="true or false")
    branch_dissipation: Flag = Field(default=False, description="true or false")
    mesh_check: Flag = Field(default=False, description="true or false")

    rules = (Rule(("branch_dissipation", "energy"), _needs_energy), Rule(("fields",), _no_repeats))


class Checkpoint(Part):
    """When the state is saved, by steps or by wall time, and how many of the last ones are kept."""

    every: Count | None = Field(default=None, description="a positive whole number of steps")
    minutes: Positive | None = Field(default=None, description="a positive wall time in minutes [min]")
    keep: Whole = Field(default=2, ge=0, description="a whole number of checkpoints, zero or more")

    at_most_one = (("every", "minutes"),)

    @classmethod
    def filled(cls, data: dict[str, Any], context: Context | None) -> dict[str, Any]:
        """Saves every 10 minutes unless told otherwise."""
        return data if data.keys() & {"every", "minutes"} else {"minutes": 10.0, **data}
