"""The `adhesion` section of a job, and the law of attraction that it asks for."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ...job.sections.calculation import Grid
from ...job.sections.part import Part
from ...job.sections.quantities import Positive
from .attraction import AdhesionLaw, cell_of, modulus_of, ramp_of, smallest_range

CELLS = 2.0  # accuracy: process zone over the cell with the range `auto`; the error of pull-off is 0.6 %
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


def adhesion_law(section: Adhesion | None, grid: Grid, material: Any) -> AdhesionLaw | None:
    """Return the law of a section; the range `auto` is the smallest that the cells of the grid resolve."""
    if section is None:
        return None
    reach = section.range
    if not isinstance(reach, float):
        reach = smallest_range(section.work, modulus_of(material), cell_of(grid), CELLS)
    law = AdhesionLaw(section.work, reach, section.law)
    return replace(law, ramp=ramp_of(law, modulus_of(material), cell_of(grid))) if law.kind == "dugdale" else law


def chosen_range(job: Any) -> float | None:
    """Return the range [m] that `auto` has on the mesh of a job; None if it is given, or without adhesion."""
    section = job.section("adhesion")
    law = None if section is None or section.range != AUTO else adhesion_law(section, job.grid, job.material)
    return None if law is None else law.range
