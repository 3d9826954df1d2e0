"""The `adhesion` section of a job, and the law of attraction that it asks for.

Warnings about magnitudes of adhesion: work and range compared with those of solids, body, surface, mesh and box.

A sphere attracts a flat body at the gap d with `2 pi R gamma(d)`, of which the share `gamma(d + r^2/(2 R))/gamma(d)`
comes from points further than r from its axis. Summed over the points of a mesh with cells h, the force of the
exponential law has an error of up to `4 exp(-2 pi^2 R rho/h^2)`, by Poisson's sum of a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ...doubts import Doubt
from ...job import meaning
from ...job.advice import more_points
from ...job.calculation import Grid
from ...job.parts import Part
from ...job.quantities import Positive
from ...job.surfaces import Sphere
from .law import AdhesionLaw, cell_of, modulus_of, ramp_of, smallest_range

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


MOST_WORK = 1.0  # physics: largest work of dry solids [J/m^2]; rubber has 0.03 to 0.1
MOST_STRAIN = 0.5  # physics: largest strain of the linear theory
MOST_RANGE = 0.2  # physics: largest range over the box; the law is that of flat surfaces
MOST_RING = 2.0  # accuracy: largest cell over sqrt(R rho); the error of the force of a sphere is then 3 %
SMALL = 0.01  # accuracy: least share of a force that is warned of
PULL_OFF = 1.5 * math.pi  # physics: least pull-off force over w R, of elastic bodies with a short range


def doubts_of_adhesion(job: Any, law: AdhesionLaw, modulus: float, cell: float) -> Iterator[Doubt]:
    """Yield warnings about an implausible work or range, or one outside the model, with E* of the relaxed body [Pa] and
    the side of a cell [m]."""
    given = {"work": law.work, "range": law.range}
    if law.work > MOST_WORK:
        yield Doubt("work", "adhesion", {**given, "most": MOST_WORK})
    elif modulus and (strain := law.strength / modulus) > MOST_STRAIN:
        yield Doubt("strained edges", "adhesion", {**given, "strain": strain, "most": MOST_STRAIN})
    sides = [size for size, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1] or list(job.grid.size)
    if law.range > MOST_RANGE * min(sides):
        yield Doubt("long range", "adhesion", {**given, "most": MOST_RANGE, "remedy": _shorten(job)})
    for index, shape in enumerate(job.surface):
        if isinstance(shape, Sphere):
            yield from _sphere(f"surface.{index}", shape, job.grid, law, cell)
    if modulus > 0.0 and not list(meaning.neighbours(job, job.material.fitted)):
        contact = (0.75 * PULL_OFF * law.work / modulus) ** (1.0 / 3.0)  # of Hertz under the pull-off, over R^(2/3)
        yield from meaning.acting_neighbours(job, lambda radius: contact * radius ** (2.0 / 3.0))


def _sphere(name: str, sphere: Sphere, grid: Grid, law: AdhesionLaw, cell: float) -> Iterator[Doubt]:
    """Yield warnings about a sphere that is too small, or of whose attraction the cells or the box resolve little."""
    radius, ring = sphere.radius, math.sqrt(sphere.radius * law.range)
    if cell > MOST_RING * ring:
        remedies = {"most": MOST_RING, "fine": MOST_RING * ring, "enough": cell**2 / MOST_RING**2 / radius}
        yield Doubt("coarse tip", "adhesion", {"cell": cell, "ratio": cell / ring, "sphere": name, **remedies})
    if law.range > radius / 2.0:
        yield Doubt("small sphere", name, {"radius": radius, "most": radius / 2.0})
    if min(grid.points) == 1:
        return
    x, y = sphere.center or (grid.lx / 2.0, grid.ly / 2.0)
    alone = grid.boundary == "free"
    room = max(min(x, grid.lx - x, y, grid.ly - y), 0.0) if alone else min(grid.size) / 2.0
    edge, exponential = room**2 / (2.0 * radius) / law.range, law.kind == "exponential"
    share = math.exp(-edge) if exponential else max(1.0 - edge, 0.0)
    if share > SMALL:
        enough = -math.log(SMALL) if exponential else 1.0
        remedies = {"shorter": law.range * edge / enough, "more": math.sqrt(2.0 * enough) * ring}
        numbers = {"share": share, "range": law.range, "room": room, "most": SMALL, **remedies}
        yield Doubt("cut attraction" if edge else "attraction at an edge", name, numbers)


def doubt_range(job: Any, law: AdhesionLaw, span: float) -> Iterator[Doubt]:
    """Yield a warning about a range above the height of a rough surface, from its lowest to its highest point [m]."""
    if law.range > span > 0.0:
        yield Doubt("range beyond heights", "adhesion", {"range": law.range, "span": span, "remedy": _shorten(job)})


def _shorten(job: Any) -> str:
    """Return the advice to use a shorter range, which `auto` has on finer cells."""
    if job.adhesion.range == AUTO:
        return f"{more_points(job.grid)}, which range: auto follows"
    return "a shorter range (range: auto follows the cells)"
