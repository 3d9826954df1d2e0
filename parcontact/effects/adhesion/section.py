"""The `adhesion` section of a job, the law of attraction that it defines, and warnings about implausible magnitudes.

With the work of adhesion w [J/m^2], the range rho [m] and the gap g,

    exponential  sigma(g) = (w/rho) exp(-g/rho),          gamma(g) = w exp(-g/rho),
    dugdale      sigma(g) = w/rho for g < rho, else 0,    gamma(g) = w max(1 - g/rho, 0).

A node that crosses the end of Dugdale's law would snap, with an error proportional to the side h of the cells. So
the computed law ends over a ramp in the gap, centred at rho: it is the mean of the law over a cell at the end of the
process zone, where the gap rises by about 2 rho h/l in a cell.

The process zone is the strip at the edge of a contact in which the traction rises. It has the length `l = E* rho^2/w`,
with E* = 2 G/(1 - nu). Tabor's and Johnson's parameters classify adhesive contacts,

    mu = (R w^2/(E*^2 rho^3))^(1/3),        alpha^2 = 2 w lambda/(pi^2 E* h^2),

of a sphere of radius R (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2), and of a wave of length lambda whose
crests are 2 h above its troughs (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).

A sphere of radius R attracts a flat body at the gap d with the force `2 pi R gamma(d)`. The share `gamma(d + r^2/(2
R))/gamma(d)` of this force comes from points further than r from the axis of the sphere. If the force of the
exponential law is a sum over the points of a mesh with cells of side h, it has a relative error of up to `4 exp(-2 pi^2
R rho/h^2)`, by Poisson's sum of a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ...errors import Doubt, Kind
from ...job import meaning
from ...job.advice import more_points
from ...job.calculation import Grid
from ...job.parts import Part, Positive
from ...job.surfaces import Sphere

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


@dataclass(frozen=True)
class AdhesionLaw:
    """Law of adhesion of a job: work [J/m^2], range [m] and kind, with E* of the relaxed body (`modulus` [Pa]) and the
    longer side of a `cell` [m] among the directions with several points."""

    work: float
    range: float
    kind: Literal["exponential", "dugdale"]
    modulus: float
    cell: float

    @property
    def strength(self) -> float:
        """Largest attraction [Pa]."""
        return self.work / self.range

    @property
    def zone(self) -> float:
        """Length l of the process zone [m]; 0 for a body without long-term modulus."""
        return self.modulus * self.range**2 / self.work

    @property
    def ramp(self) -> float:
        """Range of gaps [m] over which the attraction of Dugdale's law falls to 0: 2 rho h/l for cells of side h, at
        most 2 rho. It is 0 for the exponential law."""
        return 2.0 * self.range * self.cell / max(self.zone, self.cell) if self.kind == "dugdale" else 0.0

    def tabor(self, modulus: float, radius: float) -> float:
        """Return Tabor's parameter for the `modulus` E* [Pa] and the radius of a sphere [m]."""
        return (radius * self.work**2 / (modulus**2 * self.range**3)) ** (1.0 / 3.0)

    def johnson(self, modulus: float, length: float, amplitude: float) -> float:
        """Return Johnson's parameter for the `modulus` E* [Pa] and a wave of this length [m] and amplitude [m]."""
        return math.sqrt(2.0 * self.work * length / (math.pi**2 * modulus)) / abs(amplitude)

    def range_for(self, cells: float) -> float:
        """Return the range [m] whose process zone is as long as a number of cells."""
        return math.sqrt(cells * self.cell * self.work / self.modulus)


def adhesion_law(section: Adhesion, grid: Grid, material: Any) -> AdhesionLaw:
    """Return the law of a section, for a grid and a material; a range `auto` is the smallest that the cells resolve."""
    modulus = float(2.0 * material.fitted.long_modulus / (1.0 - material.poisson))
    cell = max((step for step, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1), default=grid.dx)
    law = AdhesionLaw(section.work, math.nan, section.law, modulus, cell)
    return replace(law, range=section.range if isinstance(section.range, float) else law.range_for(CELLS))


def law_of(job: Any) -> AdhesionLaw:
    """Return the law of a job that has the section `adhesion`."""
    return adhesion_law(job.section("adhesion"), job.grid, job.material)


def chosen_range(job: Any) -> float | None:
    """Return the range [m] that `auto` means on the mesh of a job; None without adhesion, or if the range is given."""
    section = job.section("adhesion")
    return None if section is None or section.range != AUTO else law_of(job).range


MOST_WORK = 1.0  # physics: largest work of dry solids [J/m^2]; rubber has 0.03 to 0.1
MOST_STRAIN = 0.5  # physics: largest strain of the linear theory
MOST_RANGE = 0.2  # physics: largest range over the box; the law is that of flat surfaces
MOST_RING = 2.0  # accuracy: largest cell over sqrt(R rho); the error of the force of a sphere is then 3 %
SMALL = 0.01  # accuracy: least share of a force that is warned of
SAME = 1e-9  # rounding: relative tolerance on a range
PULL_OFF = 1.5 * math.pi  # physics: least pull-off force over w R, of elastic bodies with a short range


WARN_WORK = Kind(
    "work",
    "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m: dry surfaces have a work of adhesion of at most "
    "{most:g} J/m^2, rubber about 0.05; the material adds what the body dissipates",
)
WARN_STRAINED_EDGES = Kind(
    "strained edges",
    "strains at the edges of contact are about work/(E* range) = {strain:.2g}; the theory assumes small strains, "
    "up to {most:g}. adhesion.work is {work:g} J/m^2 and the range {range:.3g} m; use a longer range or a smaller "
    "work",
)
WARN_LONG_RANGE = Kind(
    "long range",
    "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m, more than {most:g} of the box: points then also "
    "attract points that are not opposite, which the law neglects; use {remedy}",
)
WARN_COARSE_PROCESS_ZONE = Kind(
    "coarse process zone",
    "a cell, {cell:.3g} m, is {ratio:.2g} times as long as the process zone, so the forces at edges of contact are "
    "not resolved: pull-off is wrong by 4 % at 1.2 times and by 23 % at 1.8 times; use a range of {enough!u} m "
    "or more, or cells of {zone!d} m",
)


def doubts_of_adhesion(job: Any) -> Iterator[Doubt]:
    """Yield warnings about a work of adhesion or a range that is implausible, outside the model, or not resolved by the
    cells."""
    law = law_of(job)
    given, modulus = {"work": law.work, "range": law.range}, law.modulus
    if law.work > MOST_WORK:
        yield WARN_WORK("adhesion", {**given, "most": MOST_WORK})
    elif modulus and (strain := law.strength / modulus) > MOST_STRAIN:
        yield WARN_STRAINED_EDGES("adhesion", {**given, "strain": strain, "most": MOST_STRAIN})
    sides = [size for size, n in zip(job.grid.size, job.grid.points, strict=True) if n > 1] or list(job.grid.size)
    if law.range > MOST_RANGE * min(sides):
        yield WARN_LONG_RANGE("adhesion", {**given, "most": MOST_RANGE, "remedy": _shorten(job)})
    for index, shape in enumerate(job.surface):
        if isinstance(shape, Sphere):
            yield from _sphere(f"surface.{index}", shape, job.grid, law)
    if modulus > 0.0 and not list(meaning.neighbours(job)):
        contact = (0.75 * PULL_OFF * law.work / modulus) ** (1.0 / 3.0)  # of Hertz under the pull-off, over R^(2/3)
        yield from meaning.acting_neighbours(job, lambda radius: contact * radius ** (2.0 / 3.0))
    if 0.0 < law.zone < law.cell * (1.0 - SAME):
        numbers = {"cell": law.cell, "ratio": law.cell / law.zone, "enough": law.range_for(1.0), "zone": law.zone}
        yield WARN_COARSE_PROCESS_ZONE("adhesion", numbers)


WARN_COARSE_TIP = Kind(
    "coarse tip",
    "a cell, {cell:.3g} m, is {ratio:.2g} times sqrt(radius range), the radius within which {sphere} is attracted; "
    "at {most:g} times the sum over points is wrong by 3 %; use cells of {fine!d} m, or a range of {enough!u} m",
)
WARN_SMALL_SPHERE = Kind(
    "small sphere",
    "it attracts out to sqrt(2 radius range), more than its radius, {radius:g} m; the theory assumes small slopes: "
    "use an adhesion.range of at most {most!d} m",
)
WARN_CUT_ATTRACTION = Kind(
    "cut attraction",
    "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
    "the box ends (limit: {most!p}); use a range of at most {shorter!d} m, or {more!u} m of room around the "
    "sphere",
)
WARN_ATTRACTION_AT_AN_EDGE = Kind(
    "attraction at an edge",
    "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
    "the box ends (limit: {most!p}); use {more!u} m of room around the sphere",
)


def _sphere(name: str, sphere: Sphere, grid: Grid, law: AdhesionLaw) -> Iterator[Doubt]:
    """Yield warnings about a sphere that is too small, or of whose attraction the cells or the box resolve little."""
    radius, cell, ring = sphere.radius, law.cell, math.sqrt(sphere.radius * law.range)
    if cell > MOST_RING * ring:
        remedies = {"most": MOST_RING, "fine": MOST_RING * ring, "enough": cell**2 / MOST_RING**2 / radius}
        yield WARN_COARSE_TIP("adhesion", {"cell": cell, "ratio": cell / ring, "sphere": name, **remedies})
    if law.range > radius / 2.0:
        yield WARN_SMALL_SPHERE(name, {"radius": radius, "most": radius / 2.0})
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
        yield (WARN_CUT_ATTRACTION if edge else WARN_ATTRACTION_AT_AN_EDGE)(name, numbers)


WARN_RANGE_BEYOND_HEIGHTS = Kind(
    "range beyond heights",
    "the range, {range:.3g} m, is more than the {span:.3g} m from the lowest to the highest point of the surface, "
    "so the attraction is nearly uniform and adhesion acts as a pressure of work/range; use {remedy}",
)


def doubt_range(job: Any, span: float) -> Iterator[Doubt]:
    """Yield a warning if the range of attraction exceeds the height `span` of a rough surface, from its lowest to its
    highest point [m]."""
    if (reach := law_of(job).range) > span > 0.0:
        yield WARN_RANGE_BEYOND_HEIGHTS("adhesion", {"range": reach, "span": span, "remedy": _shorten(job)})


def _shorten(job: Any) -> str:
    """Return the advice to use a shorter range, which `auto` has on finer cells."""
    if job.adhesion.range == AUTO:
        return f"{more_points(job.grid)}, which range: auto follows"
    return "a shorter range (range: auto follows the cells)"
