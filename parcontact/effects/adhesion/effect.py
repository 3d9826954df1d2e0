"""The effect of adhesion: columns, rules and warnings of the section `adhesion`, and energies of adhesive contacts.

The energies of a run are the work of the load, the energy of the attraction, and the energy lost in snaps.

In a step the rigid surface does the work `F dd - F_t ds` along the path of its load, with the normal force F, the
change dd of the approach, the tangential force F_t and the distance ds that it slides; the integral is taken by the
trapezoidal rule. The gain is the increase of the energy of the body, including what it dissipates, and of the energy of
the attraction. If the work exceeds the gain by more than the error of the rule can explain, the difference is lost in a
snap. Otherwise the difference counts as an error, and the work is set to the gain.

Surfaces that detach under a load, or that a load closes again, pass through states without equilibrium. The work of the
load in these states depends on inertia, which the model does not have. So the work in such a step is that up to the
last equilibrium, or the gain if this is larger. The excess of the work over the gain is lost. While the surfaces are
detached, neither work nor losses change.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from ...columns import added_by
from ...contact.problem import Mask
from ...errors import Doubt, Kind
from ...job import limits
from ...job.parts import Part, Rule, rules_of
from ...job.surfaces import Sphere, Wave
from ...job.yaml_text import Fault
from ...march.budget import ENERGY
from ...parallel.slab import Array
from ...physics.body import remembers
from ...physics.records import Entry, Measures, Saved, Units
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
from .section import AUTO, SAME, Adhesion, adhesion_law, chosen_range, doubt_range, doubts_of_adhesion, law_of

MOST_CELLS = 2.0  # physics: largest cell over the process zone of a viscoelastic body
JKR_LIKE, DMT_LIKE = 3.0, 0.3  # physics: Tabor's parameter above and below which these theories hold
FULL_CONTACT = 0.56988  # physics: least Johnson's parameter for full contact of a wave without load
LEAST_SNAP = 1e-4  # accuracy: least loss in a snap over the energies of the step
FORCE_DOUBT = 0.3  # accuracy: relative error of the tangential force
SNAP_FRONT = 2.0  # accuracy: motion of an edge [half process zones] above which the shortest step is a snap


def _excluded(adhesion: Adhesion | None, grid: Any, material: Any, bands: Any) -> Iterator[Fault]:
    if adhesion is None:
        return
    if material.hardness is not None:
        yield Fault("cannot be used with adhesion: leave one of them out", ("material", "hardness"))
    if adhesion.range == AUTO and material.fitted.long_modulus == 0.0:
        yield Fault("must be a length [m] for a body without long-term modulus, got auto", ("adhesion", "range"))
    if bands is not None:
        yield Fault("cannot be used with bands: they are coupled by pressures alone", ("adhesion",))
    yield from limits.no_strip("adhesion", grid)


def _zone_is_resolved(adhesion: Adhesion | None, grid: Any, material: Any, bands: Any) -> Iterator[Fault]:
    """Refuse viscoelastic bodies whose process zone the mesh does not resolve."""
    if adhesion is None or grid is None or bands is not None or not material.fitted.branches:
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
    negative at small ones. `lost` is the energy lost in snaps. `error` is the error of these energies: the differences
    between work and energies in all steps without a snap, and the error of the dissipated energy by the mesh.
    """

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0
    error: float = 0.0


NO_ENERGIES = AdhesiveEnergies()


def advance_energies(past: AdhesiveEnergies, instant: Instant, area: float) -> AdhesiveEnergies:
    """Return the energies after the step that `instant` describes. `past` are the energies before it, and `area` [m^2]
    is the area of the box."""
    numbers, before, measures = instant.solved.numbers, instant.before, instant.measures
    surfaces = numbers["surface_energy"]
    gained = instant.gained + surfaces - past.surfaces
    dragged, doubt = _drag(before, measures, instant.moved)
    work = numbers["work_of_load"] + dragged
    if numbers["leaves_equilibrium"]:
        work = max(work, gained)
    else:
        way = measures.approach - before.approach
        doubt += 0.5 * area * abs((measures.pressure - before.pressure) * way)
    lost = work - gained
    snaps = lost > doubt + LEAST_SNAP * (abs(gained) + abs(surfaces))
    error = past.error + ENERGY.value * instant.error_area * abs(instant.dissipated)
    if snaps:
        return AdhesiveEnergies(past.work + work, surfaces, past.lost + lost, error)
    return AdhesiveEnergies(past.work + gained, surfaces, past.lost, error + abs(lost))


def _drag(before: Measures, now: Measures, moved: tuple[float, float]) -> tuple[float, float]:
    """Return the work of sliding by `moved` without friction of the interface, and its error [J]."""
    (x, y), slid = moved, math.hypot(*moved)
    if not slid:
        return 0.0, 0.0
    works = [-(one.force_x * x + one.force_y * y) - one.force_interface * slid for one in (before, now)]
    return 0.5 * sum(works), 0.5 * abs(works[1] - works[0]) + FORCE_DOUBT * abs(works[1])


@dataclass(frozen=True)
class AdhesionMemory:
    """Memory of the effect: the energies, the number `snaps` of steps in which the contact has snapped, and the values
    of the `columns` in the last row. `front_warning_given` is True after the warning about edges of contact that move
    too far in a step."""

    energies: AdhesiveEnergies = NO_ENERGIES
    snaps: int = 0
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
        return doubt_range(job, span)

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
    def doubts(job: Any) -> Iterator[Doubt]:
        return doubts_of_adhesion(job)

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

        return AdhesiveLaw(self._scene)

    def at_rest(self) -> AdhesionMemory:
        return AdhesionMemory()

    def follow(self, instant: Instant, memory: AdhesionMemory) -> Changes[AdhesionMemory]:
        """Return the changes after a step: the energies and the columns. No errors are stated across a snap. A remark
        warns once, if edges of contact of a viscoelastic body move so far in a step that rates are not resolved."""
        solved, energies = instant.solved, memory.energies
        columns = solved.numbers["tensile_area"], solved.numbers["adhesive_force"], math.nan, math.nan
        if self._scene.energy is not None:
            if solved.end != "open":
                energies = advance_energies(energies, instant, self._area)
            columns = (*columns[:2], energies.surfaces, energies.lost)
        far = instant.front > SNAP_FRONT and not instant.untouched
        chosen = instant.step.decide is not None
        snapped = solved.snapped or (chosen and far)
        snapped |= energies.lost > memory.energies.lost and not instant.untouched
        warns = far and not (chosen or memory.front_warning_given or instant.step.jump)
        warns = warns and remembers(self._scene.material)
        memory = AdhesionMemory(energies, memory.snaps + snapped, memory.front_warning_given or warns, columns)
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
        """Return the checkpoint entries: the energies, and the number of steps in which the contact snapped."""
        energies = {name: Entry(value, 1.0, "J") for name, value in memory.energies._asdict().items()}
        return energies | {"snaps": Entry(float(memory.snaps))}

    def restored(self, memory: AdhesionMemory, saved: Saved) -> AdhesionMemory:
        energies = AdhesiveEnergies(*(float(saved[name]) for name in AdhesiveEnergies._fields))
        return AdhesionMemory(energies, int(saved["snaps"]))
