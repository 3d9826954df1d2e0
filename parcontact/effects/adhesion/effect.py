"""The effect of adhesion: the section `adhesion`, its law of attraction, rules, warnings and columns, and energies.

With the work of adhesion w [J/m^2], the range rho [m] and the gap g,

    exponential  sigma(g) = (w/rho) exp(-g/rho),          gamma(g) = w exp(-g/rho),
    dugdale      sigma(g) = w/rho for g < rho, else 0,    gamma(g) = w max(1 - g/rho, 0).

A node that crosses the end of Dugdale's law would snap, with an error proportional to the side h of the cells. So the
computed law falls to 0 over a ramp in the gap, which is centred at rho. On the ramp, the computed law is the mean of
the law over a cell at the end of the process zone, where the gap rises by about 2 rho h/l in a cell.

The process zone is the strip at the edge of a contact in which the traction rises. It has the length `l = E* rho^2/w`,
with E* = 2 G/(1 - nu). Tabor's and Johnson's parameters classify adhesive contacts,

    mu = (R w^2/(E*^2 rho^3))^(1/3),        alpha^2 = 2 w lambda/(pi^2 E* h^2),

of a sphere of radius R (D. Tabor, J. Colloid Interface Sci. 58 (1977) 2), and of a wave of length lambda whose
crests are 2 h above its troughs (K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423).

A sphere of radius R attracts a flat body at the gap d with the force `2 pi R gamma(d)`. The share `gamma(d + r^2/(2
R))/gamma(d)` of this force comes from points further than r from the axis of the sphere. If the force of the
exponential law is a sum over the points of a mesh with cells of side h, it has a relative error of up to `4 exp(-2 pi^2
R rho/h^2)`, by Poisson's sum of a Gaussian.

The energies of a run are the work of the load, the energy of the attraction, and the energy lost in snaps.

In a step the rigid surface does the work `F dd - F_t ds` along the path of its load, with the normal force F, the
change dd of the approach, the tangential force F_t of the pressures and the distance ds that it slides; the integral is
taken by the trapezoidal rule. The gain is the increase of the energies of the body and of the attraction, plus the
energy that the body dissipates. If the work exceeds the gain by more than the error of the rule, the difference is lost
in a snap. Otherwise the difference counts as an error, and the work is set to the gain.

Surfaces that detach under a load, or that a load closes again, pass through states without equilibrium. The work of the
load in these states depends on inertia, which the model does not have. So the work in such a step is the work up to the
last equilibrium, or the gain if the gain is larger. The excess of the work over the gain is lost. While the surfaces
are detached, neither work nor losses change.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo

from ...columns import added_by
from ...contact.problem import Mask
from ...errors import Doubt, Kind
from ...job import limits, meaning
from ...job.advice import more_points
from ...job.calculation import Grid
from ...job.parts import Part, Positive, Rule, rules_of
from ...job.surfaces import Sphere, Wave
from ...job.yaml_text import Fault
from ...march.budget import ENERGY
from ...parallel.slab import Array
from ...physics.body import remembers
from ...physics.records import Entry, Measures, Saved, Units
from ...physics.surface import Vector
from ..effect import (
    BY_THEORY,
    EXTRAPOLATION,
    SINGLE,
    TOLERANCES,
    Changes,
    ContactLaw,
    Decision,
    Detached,
    Effect,
    Instant,
)

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
    """Law of adhesion of a job: the work of adhesion [J/m^2], the range [m], and the kind. `modulus` is E* of the
    relaxed body [Pa]. `cell` is the longer side of a cell [m], where directions with a single point do not count."""

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
        """Return the range [m] for which the process zone is as long as this number of cells."""
        return math.sqrt(cells * self.cell * self.work / self.modulus)


def adhesion_law(section: Adhesion, grid: Grid, material: Any) -> AdhesionLaw:
    """Return the law of a section for a grid and a material. For a range `auto`, the law has the smallest range that
    the cells resolve."""
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


def _shorten(job: Any) -> str:
    """Return the advice to use a shorter range, which `auto` has on finer cells."""
    if job.adhesion.range == AUTO:
        return f"{more_points(job.grid)}, which range: auto follows"
    return "a shorter range (range: auto follows the cells)"


MOST_CELLS = 2.0  # physics: largest cell over the process zone of a viscoelastic body
JKR_LIKE, DMT_LIKE = 3.0, 0.3  # physics: Tabor's parameter above and below which these theories hold
FULL_CONTACT = 0.56988  # physics: least Johnson's parameter for full contact of a wave without load
LEAST_SNAP = 1e-4  # accuracy: least loss in a snap over the energies of the step
FORCE_DOUBT = 0.3  # accuracy: relative error of the tangential force
SNAP_FRONT = 2.0  # accuracy: motion of an edge [half process zones] above which the shortest step is a snap

Forces = tuple[Vector, Vector]  # before and after a step


def _excluded(adhesion: Adhesion, grid: Any, material: Any, bands: Any) -> Iterator[Fault]:
    if material.hardness is not None:
        sentence = "cannot be used with adhesion: contacts that attract and yield are not solved; leave one of them out"
        yield Fault(sentence, ("material", "hardness"))
    if adhesion.range == AUTO and material.fitted.long_modulus == 0.0:
        yield Fault("must be a length [m] for a body without long-term modulus, got auto", ("adhesion", "range"))
    if bands is not None:
        sentence = "cannot be used with bands: they are coupled by pressures alone; give the job a grid"
        yield Fault(sentence, ("adhesion",))
    yield from limits.no_strip("adhesion", grid)


def _zone_is_resolved(adhesion: Adhesion, grid: Any, material: Any, bands: Any) -> Iterator[Fault]:
    """Refuse viscoelastic bodies whose process zone the mesh does not resolve."""
    if grid is None or bands is not None or not material.fitted.branches:
        return
    if adhesion.range == AUTO or material.fitted.long_modulus == 0.0:
        return
    law = adhesion_law(adhesion, grid, material)
    least = law.range_for(1.0 / MOST_CELLS)
    if law.range < least * (1.0 - SAME):
        sentence = (
            f"must be at least {least:.3g} m for a viscoelastic body on cells of {law.cell:.3g} m, got {law.range:g}: "
            f"with less the mesh pins the edges of contact, and the rate of pulling has no meaning"
        )
        yield Fault(sentence, ("adhesion", "range"))


def _also(slow: float, fast: float) -> str:
    return "" if math.isclose(slow, fast) else f" relaxed, {fast:.3g} at once"


def _kind(tabor: float) -> str:
    if tabor > JKR_LIKE:
        return "as in the theory of Johnson, Kendall and Roberts, pull-off near 1.5 pi w R"
    if tabor < DMT_LIKE:
        return "as in that of Derjaguin, Muller and Toporov, pull-off near 2 pi w R"
    return "between the theories of Johnson, Kendall and Roberts (1.5 pi w R) and of Derjaguin, Muller and Toporov (2)"


class AdhesiveEnergies(NamedTuple):
    """Energies [J] since the start of a run with adhesion.

    `work` is the work that the rigid surface has done. `surfaces` is the energy of the attraction, 0 at large gaps and
    negative at small gaps. `lost` is the energy lost in snaps. `error` is the error of these energies: the differences
    between work and energies in all steps without a snap, the error of the dissipated energy by the mesh, and the error
    of the energy lost in slip.
    """

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0
    error: float = 0.0


NO_ENERGIES = AdhesiveEnergies()


def advance_energies(past: AdhesiveEnergies, instant: Instant, area: float, forces: Forces) -> AdhesiveEnergies:
    """Return the energies after the step that `instant` describes. `past` are the energies before it, `area` [m^2] is
    the area of the box, and `forces` [N] are the tangential forces of the pressures on the surface before and after the
    step."""
    numbers, before, measures = instant.solved.numbers, instant.before, instant.measures
    surfaces = numbers["surface_energy"]
    gained = instant.gained + surfaces - past.surfaces
    dragged, doubt = _drag(forces, instant.moved)
    work = numbers["work_of_load"] + dragged
    if numbers["leaves_equilibrium"]:
        work = max(work, gained)
    else:
        way = measures.approach - before.approach
        doubt += 0.5 * area * abs((measures.pressure - before.pressure) * way)
    lost = work - gained
    snaps = lost > doubt + LEAST_SNAP * (abs(gained) + abs(surfaces))
    error = past.error + ENERGY.value * instant.error_area * abs(instant.dissipated)
    if instant.sheared is not None:
        error += instant.sheared.lost * min(instant.sheared.error_of_tractions(instant.error_area), 1.0)
    if snaps:
        return AdhesiveEnergies(past.work + work, surfaces, past.lost + lost, error)
    return AdhesiveEnergies(past.work + gained, surfaces, past.lost, error + abs(lost))


def _drag(forces: Forces, moved: Vector) -> tuple[float, float]:
    """Return the work of sliding by `moved` against the tangential forces before and after a step, and its error
    [J]."""
    if not any(moved):
        return 0.0, 0.0
    old, new = (-(x * moved[0] + y * moved[1]) for x, y in forces)
    return 0.5 * (old + new), 0.5 * abs(new - old) + FORCE_DOUBT * abs(new)


def force_of_pressures(measures: Measures, velocity: Vector) -> Vector:
    """Return the tangential force of the pressures on the surface [N], which is that of a step without the force of an
    interface that slips everywhere, against the velocity."""
    size = measures.force_interface / (math.hypot(*velocity) or 1.0)
    return measures.force_x + size * velocity[0], measures.force_y + size * velocity[1]


@dataclass(frozen=True)
class AdhesionMemory:
    """Memory of the effect: the energies, the number `snaps` of steps in which the contact has snapped, the
    tangential `force` of the pressures [N], and the values of the `columns` in the last row. `front_warning_given`
    is True after the warning about edges of contact that move too far in a step."""

    energies: AdhesiveEnergies = NO_ENERGIES
    snaps: int = 0
    force: Vector = (0.0, 0.0)
    front_warning_given: bool = False
    columns: tuple[float, ...] = (0.0, 0.0, math.nan, math.nan)


WARN_RANGE_FOLLOWS_CELLS = Kind(
    "range follows cells",
    "auto depends on cells, work and modulus, and gives {least:.4g} to {most:.4g} m in these cases, which are "
    "different physics; to compare them give all one range: {most:.4g} m is resolved by the cells of each",
)


class AdhesionColumns(Effect[AdhesionMemory]):
    """Effect of adhesion: its contact law, its energies, and its columns. These are the share of the area under
    tension, the force of all tension [N], the energy of the surfaces [J], and the energy lost in snaps [J]."""

    section: ClassVar[type[Part]] = Adhesion
    columns: ClassVar[tuple[str, ...]] = added_by("adhesion")
    in_bands_over_time: ClassVar[bool] = True  # `_excluded` refuses them
    rules: ClassVar[tuple[Rule, ...]] = rules_of(_excluded, _zone_is_resolved)
    lifts: ClassVar[tuple[Any, ...]] = (limits.loads_press, limits.some_load)
    forbids: ClassVar[Mapping[str, str]] = {
        EXTRAPOLATION: "contacts with adhesion start from the last gaps",
        TOLERANCES: "contacts with adhesion are solved to the tolerance of the job",
        SINGLE: "contacts with adhesion are solved in double precision",
        BY_THEORY: "the theory excludes adhesion: leave out the section adhesion",
    }
    doubts = staticmethod(doubts_of_adhesion)

    @staticmethod
    def remembers(job: Any) -> bool:
        return True

    @staticmethod
    def compares_heights(job: Any) -> bool:
        return True

    @staticmethod
    def chosen_values(job: Any) -> Mapping[str, float]:
        """Return the range [m] that `auto` means on the mesh of the job, under the key `adhesion.range`; nothing if the
        job gives a range."""
        reach = chosen_range(job)
        return {} if reach is None else {"adhesion.range": reach}

    @staticmethod
    def doubt_heights(job: Any, span: float) -> Iterator[Doubt]:
        if (reach := law_of(job).range) > span > 0.0:
            yield WARN_RANGE_BEYOND_HEIGHTS("adhesion", {"range": reach, "span": span, "remedy": _shorten(job)})

    @staticmethod
    def doubt_cases(jobs: Sequence[Any]) -> Iterator[Doubt]:
        ranges = {reach for job in jobs if (reach := chosen_range(job)) is not None}
        if len(ranges) > 1:
            yield WARN_RANGE_FOLLOWS_CELLS("adhesion.range", {"least": min(ranges), "most": max(ranges)})

    @staticmethod
    def ended(job: Any, saved: Saved) -> Detached | None:
        from .adhesive_law import end_of

        return end_of(job, saved)

    @staticmethod
    def touches(job: Any, pressure: Array, gap: Array) -> Mask:
        return gap == 0.0

    @staticmethod
    def decide(job: Any) -> Decision:
        if job.section("adhesion") is None:
            return Decision("adhesion", False, "there is no adhesion section")
        law = law_of(job)
        return Decision("adhesion", True, f"{law.work:g} J/m^2 over a range of {law.range:.4g} m ({law.kind})")

    @staticmethod
    def facts(job: Any) -> Iterator[str]:
        """Yield sentences on the process zone and on Tabor's and Johnson's parameters."""
        law = law_of(job)
        if law.modulus == 0.0:
            yield "adhesion: a body without long-term modulus has no process zone of its own"
            return
        yield (
            f"adhesion: range {law.range:.4g} m, strength {law.strength:.4g} Pa, process zone l = {law.zone:.4g} m, "
            f"cell h = {law.cell / law.zone:.3g} l; rates are velocity times relaxation time over l"
        )
        at_once = float(2.0 * job.material.fitted.instant_modulus / (1.0 - job.material.poisson))
        for index, shape in enumerate(job.surface):
            if isinstance(shape, Sphere):
                slow, fast = law.tabor(law.modulus, shape.radius), law.tabor(at_once, shape.radius)
                yield f"surface.{index}: Tabor's parameter {slow:.3g}{_also(slow, fast)}: {_kind(slow)}"
            elif isinstance(shape, Wave) and any(shape.waves) and shape.amplitude:
                sides = zip(shape.waves, job.grid.size, strict=True)
                length = 1.0 / math.hypot(*(count / size for count, size in sides))
                slow, fast = (law.johnson(each, length, shape.amplitude) for each in (law.modulus, at_once))
                full = "full contact without load" if slow > FULL_CONTACT else "no full contact without load"
                yield f"surface.{index}: Johnson's parameter {slow:.3g}{_also(slow, fast)}: {full}"

    def __init__(self, scene: Any) -> None:
        self._scene, self._area = scene, scene.choices.grid.lx * scene.choices.grid.ly

    def law(self) -> ContactLaw[Any]:
        from .adhesive_law import AdhesiveLaw

        return AdhesiveLaw(self._scene, law_of(self._scene.job))

    def at_rest(self) -> AdhesionMemory:
        return AdhesionMemory()

    def follow(self, instant: Instant, memory: AdhesionMemory) -> Changes[AdhesionMemory]:
        """Return what a step changes: the energies and the columns. No errors are stated across a snap. A remark warns
        once if edges of contact of a viscoelastic body move so far in a step that the rates of strain are not resolved.
        """
        solved, energies = instant.solved, memory.energies
        force = force_of_pressures(instant.measures, instant.step.velocity)
        columns = solved.numbers["tensile_area"], solved.numbers["adhesive_force"], math.nan, math.nan
        if self._scene.energy is not None:
            if solved.end != "open":
                energies = advance_energies(energies, instant, self._area, (memory.force, force))
            columns = (*columns[:2], energies.surfaces, energies.lost)
        far = instant.front > SNAP_FRONT and not instant.untouched
        chosen = instant.step.decide is not None
        snapped = solved.snapped or (chosen and far)
        snapped |= energies.lost > memory.energies.lost and not instant.untouched
        warns = far and not (chosen or memory.front_warning_given or instant.step.jump)
        warns = warns and remembers(self._scene.material)
        memory = AdhesionMemory(energies, memory.snaps + snapped, force, memory.front_warning_given or warns, columns)
        remark = (
            f"the edge of contact moves by {0.5 * instant.front:.2g} times a process zone, and rates are resolved up "
            "to half of one: use shorter steps, or time_step: auto; further steps are not checked"
        )
        return Changes(memory, remark if warns else "", not snapped)

    def last_lines(self, memory: AdhesionMemory) -> Iterator[str]:
        if memory.snaps:
            yield f"the contact snapped in {memory.snaps} of the steps; no error is stated for them"

    def values(self, memory: AdhesionMemory) -> Sequence[float]:
        return memory.columns

    def work(self, memory: AdhesionMemory) -> float:
        return memory.energies.work

    def error_energy(self, memory: AdhesionMemory) -> float:
        return memory.energies.error

    def entries(self, memory: AdhesionMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: the energies, the number of steps in which the contact snapped, and the
        force."""
        energies = {name: Entry(value, 1.0, "J") for name, value in memory.energies._asdict().items()}
        return energies | {"snaps": Entry(float(memory.snaps)), "force": Entry(np.array(memory.force), 1.0, "N")}

    def restored(self, memory: AdhesionMemory, saved: Saved) -> AdhesionMemory:
        energies = AdhesiveEnergies(*(float(saved[name]) for name in AdhesiveEnergies._fields))
        x, y = saved["force"].tolist()
        return AdhesionMemory(energies, int(saved["snaps"]), (x, y))
