"""Adhesion: surfaces that attract each other (`physics.adhesion`, `solve.adhesive`), and what is told of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal

from numpy.typing import DTypeLike
from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ..job.checks import limits
from ..job.sections.calculation import Grid
from ..job.sections.part import Part, Rule
from ..job.sections.quantities import Positive
from ..job.text.fault import Fault
from ..physics.adhesion import AdhesionLaw, smallest_range
from ..physics.entries import Entry
from ..physics.units import Units
from .effect import Decision, Instant

CELLS = 2.0  # accuracy: of the process zone with the range `auto`; pull-off is then right to 0.6 %
AUTO: Literal["auto"] = "auto"
LENGTH: TypeAdapter[float] = TypeAdapter(Positive)


def _range(value: Any, info: ValidationInfo) -> float | str:
    return AUTO if value == AUTO else LENGTH.validate_python(value, context=info.context)


Range = Annotated[float | Literal["auto"], PlainValidator(_range, json_schema_input_type=Positive | Literal["auto"])]


class Adhesion(Part):
    """The `adhesion` section: the work of adhesion, the range and the law of the attraction."""

    work: Positive = Field(description="a positive work of adhesion [J/m^2]")
    range: Range = Field(default=AUTO, description="a positive range [m], or auto")
    law: Literal["exponential", "dugdale"] = "exponential"
    detached: Literal["end", "open"] = "end"


def modulus_of(material: Any) -> float:
    """Return E* = 2 G/(1 - nu) of the relaxed body [Pa]."""
    return float(2.0 * material.long_modulus / (1.0 - material.poisson))


def law_of(section: Adhesion | None, grid: Grid, material: Any) -> AdhesionLaw | None:
    """Return the law of a section; the range `auto` is the smallest that the cells of the grid resolve."""
    if section is None:
        return None
    reach = section.range
    if not isinstance(reach, float):
        reach = smallest_range(section.work, modulus_of(material), cell_of(grid), CELLS)
    return AdhesionLaw(section.work, reach, section.law)


def cell_of(grid: Grid) -> float:
    """Return the longer side of a cell [m], along directions that have several points."""
    return max((step for step, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1), default=grid.dx)


def _bodies(adhesion: Adhesion | None, material: Any) -> Iterator[Fault]:
    if adhesion is None:
        return
    if material.hardness is not None:
        yield Fault("does not go with adhesion: leave one of them out", ("material", "hardness"))
    if adhesion.range == AUTO and material.long_modulus == 0.0:
        yield Fault("must be a length [m] for a body without long-term modulus, got auto", ("adhesion", "range"))


def _no_steady(adhesion: Adhesion | None, initial: Any, steady: Any) -> Iterator[Fault]:
    sentence = "does not go with adhesion: slide into the steady state with a stage of the history"
    for key, given in (("initial", initial.state == "steady"), ("steady", steady is not None)):
        if adhesion is not None and given:
            yield Fault(sentence, (key,))


class AdhesionColumns:
    """The share of the area under tension, the force of all tension [N], the energy of the surfaces [J] and the energy
    lost in snaps [J]."""

    section: ClassVar[type[Part]] = Adhesion
    columns: ClassVar[tuple[str, ...]] = ("tensile_area", "adhesive_force", "surface_energy", "snap_loss")
    rules: ClassVar[tuple[Rule, ...]] = (
        Rule(("adhesion", "material"), _bodies),
        Rule(("adhesion", "initial", "steady"), _no_steady),
    )
    lifts: ClassVar[tuple[Any, ...]] = (limits.loads_press, limits.some_load)

    @staticmethod
    def decide(job: Any) -> Decision:
        section: Adhesion | None = job.section("adhesion")
        if section is None:
            return Decision("adhesion", False, "there is no adhesion section")
        law = law_of(section, job.grid, job.material)
        assert law is not None
        return Decision("adhesion", True, f"{law.work:g} J/m^2 over a range of {law.range:.4g} m ({law.kind})")

    @staticmethod
    def maps(job: Any) -> Sequence[DTypeLike]:
        """Return none: the march holds the gaps."""
        return ()

    def __init__(self, scene: Any) -> None:
        self._values: tuple[float, ...] = (0.0, 0.0, math.nan, math.nan)

    def follow(self, instant: Instant) -> None:
        if instant.sticking is not None:
            self._values = instant.sticking

    def values(self) -> Sequence[float]:
        return self._values

    def entries(self, units: Units) -> dict[str, Entry]:
        """Nothing is remembered here: the march has the gaps."""
        return {}

    def restore(self, saved: Any) -> None: ...
