"""Contact law with adhesion, whose unknown is the gap, and energies of contacts with adhesion.

Under one load there are several equilibria, and the history decides which one is reached. A solve starts from the
last two gaps, extrapolated in time and moved with the surface by whole cells.

Energies are the work of the load, the energy of the surfaces, and losses in snaps.

In a step in which body and surfaces gain energy, the load does work along its path, by the trapezoidal rule, `F dd -
F_t ds`. The difference between the gain and this work is lost in a snap if the load could not have supplied it on any
path between the two states. Otherwise the difference is an error of the rule, and the work is set to the gain.

Surfaces that detach under a load, or that a load closes again, pass through states without equilibrium. The work of the
load on this path depends on inertia, which the model does not have. From the last equilibrium on, the work is taken as
the least that the change needs, and as 0 if energy is released; this energy is lost. While surfaces are detached,
neither work nor losses change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...contact.problem import Approach, Contact, Control, MeanPressure
from ...job.history import Step
from ...march.constants import ENERGY
from ...parallel import regrid
from ...parallel.slab import Array
from ...physics import loops
from ...physics.body import Trial
from ...physics.entries import Entry, Saved, Units
from ...physics.measures import SIDE, Certificate, Measures
from ...physics.motion import cells_between
from ..effect import (
    Detached,
    EdgeMotion,
    End,
    Instant,
    PreviousContacts,
    SolvedContact,
    end_in,
    entries_of_end,
    nothing_holds,
)
from . import law as gap_kernels
from .gap_solver import AdhesiveSolver, GapOperators, GapSolver
from .law import DUGDALE, EXPONENTIAL, Law, cell_of, modulus_of
from .section import adhesion_law

LEAST_SNAP = 1e-4  # accuracy: least loss in a snap over the energies of the step
FORCE_DOUBT = 0.3  # accuracy: relative error of the tangential force
SURFACES, PUSHED, JUMPS = "surface_energy", "work_of_load", "leaves_equilibrium"  # names of numbers of the law


class AdhesiveEnergies(NamedTuple):
    """Energies [J] since the start of a run with adhesion.

    `work` of the rigid surface; energy of the `surfaces`, 0 at large gaps; energy `lost` in snaps; `error`, the sum
    over all steps without a snap of the difference between work and energies.
    """

    work: float = 0.0
    surfaces: float = 0.0
    lost: float = 0.0
    error: float = 0.0


NO_ENERGIES = AdhesiveEnergies()


class PathWork:
    """Work of the load along its path by the trapezoidal rule, for a body of modulus 1, in the scene's unit of energy;
    0 if the job asks for no energies."""

    def __init__(self, scene: Any, approach: float, pressure: float) -> None:
        self.scene, self.approach, self.pressure, self.total = scene, approach, pressure, 0.0

    def add(self, contact: Contact) -> None:
        """Add the work between the last contact and this one; collective."""
        if (energy := self.scene.energy) is None:
            return
        pressure = self.scene.slab.sum(float(contact.p.sum()))[0] / self.scene.slab.points
        mean, way = 0.5 * (self.pressure + pressure), contact.d - self.approach
        self.total += energy.unit * self.scene.slab.points * mean * way
        self.approach, self.pressure = contact.d, pressure


def advance_energies(past: AdhesiveEnergies, instant: Instant, area: float) -> AdhesiveEnergies:
    """Return the energies after a step, in a box with an `area` [m^2]."""
    numbers, before, measures = instant.solved.numbers, instant.before, instant.measures
    surfaces = numbers[SURFACES]
    gained = instant.gained + surfaces - past.surfaces
    dragged, doubt = _drag(before, measures, instant.moved)
    work = numbers[PUSHED] + dragged
    if numbers[JUMPS]:
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


JUMP_STRIDE = 1.0 / 8.0  # accuracy: longest part of a jump that is solved at once
LEAST_STRIDE = 1.0 / 16.0  # accuracy: shortest part of these, and of a step
PART_TOLERANCE = 0.05  # tuning: tolerance of all parts of a step except the last
OPEN = 10.0  # physics: gap of detached surfaces over the range
LEAST_LOAD = 1e-9  # accuracy: least load over all tension, and over the strength of a point
LEAST_TENSION = 1e-2  # physics: least tension over the strength in the area under tension


class PastGap(NamedTuple):
    """The gap after a step and the position of the surface [m]; `known` is False before the first step."""

    gap: Array
    position: tuple[float, float] = (0.0, 0.0)
    known: bool = False


@dataclass(frozen=True)
class AdhesiveMemory:
    """Memory of a contact with adhesion: the last gaps, the newest first, a spare map and a backup of the gap.

    `free_correction` is the correction for a free body (`gap_solver`) over the pressure, for the modulus `modulus`;
    None for a periodic body. `end` has time and load of the detachment, None before it.
    """

    pasts: tuple[PastGap, PastGap]
    spare: Array
    gap_backup: Array
    free_correction: Array | None
    modulus: float = 0.0
    end: Detached | None = None


@dataclass(frozen=True)
class LoadPath:
    """Path of the prescribed load from the last step to the present one, in the units of the solver.

    `before` is its value at the last step, `approach` and `pressure` are the last approach and mean pressure.
    `closes_gap_first` is True for a compressive load on detached surfaces.
    """

    before: float
    control: Control
    approach: float
    pressure: float
    closes_gap_first: bool = False

    def at(self, share: float) -> Control:
        """Return the prescribed load at a `share` of the path, 0 to 1; exact at its end."""
        if share == 1.0:
            return self.control
        return replace(self.control, value=self.before + share * (self.control.value - self.before))


class _Walk(NamedTuple):
    """Result of solving along the path of a load: contact, whether it is detached, work and whether it has snapped."""

    contact: Contact
    detached: bool
    work: float
    snapped: bool


class AdhesiveLaw:
    """Contact law of the `adhesion` section, for the steps of a scene."""

    may_shorten = True

    def __init__(self, scene: Any) -> None:
        setup, numerics = scene.setup, scene.choices.numerics
        by_gap = GapOperators(*setup.half_space.gap_operators(setup.fft))
        gaps = GapSolver(setup.slab, by_gap, numerics.max_iterations)
        free = scene.operators.operator if scene.choices.isolated.on else None
        self.solver = AdhesiveSolver(gaps, scene.solver.workspace, numerics.tolerance, free)
        self.scene, self.slab, self.grid = scene, setup.slab, scene.choices.grid
        self._goes_on_open = scene.job.section("adhesion").detached == "open"
        law = adhesion_law(scene.job.section("adhesion"), scene.job.grid, scene.job.material)
        assert law is not None
        self._attraction = law

    def law(self, alpha: float) -> Law:
        """Return the attraction in a step with the modulus alpha, in the units of the solver."""
        law = self._attraction
        kind, unit = DUGDALE if law.kind == "dugdale" else EXPONENTIAL, self.scene.units.height
        return Law(kind, law.strength / (alpha * self.scene.units.pressure), law.range / unit, law.ramp / unit)

    # -- a step --------------------------------------------------------------------------------------------------------

    def solve(
        self,
        trial: Trial,
        step: Step,
        control: Control,
        memory: AdhesiveMemory,
        past: PreviousContacts,
        before: Measures,
        tolerance: float | None,
    ) -> SolvedContact[AdhesiveMemory]:
        """Solve the contact of a step from the last gap; see `effects.effect.ContactLaw.solve`. Solves use the job's
        tolerance. If the surfaces detach and the job continues, they are moved far from each other."""
        law, path = self.law(trial.alpha), self._path(trial, control, past, before)
        walk = self._walk(law, memory, step, trial, path, past.spare)
        contact, gap = walk.contact, memory.spare
        pasts = PastGap(gap, step.position, True), memory.pasts[0]
        now = AdhesiveMemory(pasts, memory.pasts[1].gap, memory.gap_backup, memory.free_correction, trial.alpha)
        changed = self._count_changes(law, *now.pasts)
        end: End = "detached" if walk.detached else "equilibrium"
        snapped, remark = walk.snapped, ""
        if walk.detached and self._goes_on_open:
            contact, now = self._open_up(contact, now, law, trial)
            separate = before.contact_area == before.pressure == 0.0
            end, snapped = ("open", False) if separate else ("opened", snapped)
            remark = "" if separate else nothing_holds(step.control, step.load)
        numbers = self._tension(law, contact.p, trial.alpha) | {"points_changed": changed}
        if self.scene.energy is not None:
            sum_gamma = 0.0 if walk.detached else self.slab.sum(gap_kernels.surface_energy(law, gap))[0]
            numbers[SURFACES] = sum_gamma * trial.alpha * self.scene.energy.unit
            numbers[PUSHED] = walk.work * trial.alpha
            numbers[JUMPS] = float(walk.detached or path.closes_gap_first)
        touching = law.touches(now.pasts[0].gap)
        pull = numbers["adhesive_force"]
        least_load = self._least_load(law, trial.alpha, control, contact.p, pull)
        return SolvedContact(contact, now, touching, numbers, pull, least_load, end, snapped, remark)

    def _walk(
        self, law: Law, memory: AdhesiveMemory, step: Step, trial: Trial, path: LoadPath, pressure: Array
    ) -> _Walk:
        """Solve along the path of the load up to its end, with gap and pressure in maps; collective.

        A jump is solved in parts, so that it does not pass over an equilibrium. A step that fails or detaches is
        solved in parts, too, and accepted as it is if the shortest parts do not help.
        """
        gap, correction = memory.spare, memory.free_correction
        if correction is not None and memory.modulus:
            correction *= memory.modulus / trial.alpha
        whole = JUMP_STRIDE if step.jump else 1.0
        self._start(memory, step, trial, path, gap, still=step.jump)
        reached, stride, iterations, backup, snapped = 0.0, whole, 0, memory.gap_backup, False
        work = PathWork(self.scene, path.approach, path.pressure)
        while True:
            share = min(reached + stride, 1.0)
            loose = 1.0 if share == 1.0 else max(1.0, PART_TOLERANCE / self.scene.choices.numerics.tolerance)
            contact, detached = self.solver.solve(
                law, trial.effective, path.at(share), gap, correction, pressure, loose
            )
            iterations += contact.iterations
            hard = detached or (bool(contact.failure) and share == 1.0)
            if hard and stride > LEAST_STRIDE * whole:
                if reached == 0.0:
                    self._start(memory, step, trial, path, gap, still=True)
                else:
                    gap[...] = backup
                stride *= 0.5
                continue
            if not detached and not path.closes_gap_first:
                work.add(contact)
            snapped |= hard and memory.pasts[0].known
            if detached or share == 1.0:
                return _Walk(replace(contact, iterations=iterations), detached, work.total, snapped)
            reached = share
            backup[...] = gap

    def motion(self, solved: SolvedContact[AdhesiveMemory], before: Measures, now: Measures) -> EdgeMotion:
        """Return the mean motion of the edges of contact in a step [half process zones].

        The motion in cells is the number of points that entered or left contact, divided by the length of the edge,
        pi/4 of the cell sides along it. A contact is `untouched` if its load is at most an error of the solver.
        """
        least = LEAST_LOAD * self._attraction.strength
        separate = not (before.contact_area or now.contact_area or solved.numbers["tensile_area"])
        if separate or (not solved.loaded and max(before.max_pressure, -before.pressure) <= least):
            return EdgeMotion(0.0, True)
        begins = (before.contact_area == 0.0) != (now.contact_area == 0.0)
        excess = max(each.contact_area - each.contact_area_corrected for each in (before, now))
        sides = excess * self.slab.points / SIDE
        if sides <= 0.0:
            return EdgeMotion(begins=begins)
        moved = solved.numbers["points_changed"] / (0.25 * math.pi * sides) * cell_of(self.grid)
        zone = self._attraction.process_zone(modulus_of(self.scene.job.material))
        return EdgeMotion(2.0 * moved / zone if zone > 0.0 else 0.0, begins=begins)

    def _path(self, trial: Trial, control: Control, past: PreviousContacts, before: Measures) -> LoadPath:
        """Return the path of the prescribed load since the last step, in the run's units."""
        pressure = before.pressure / (trial.alpha * self.scene.units.pressure)
        if isinstance(control, MeanPressure):
            closes = control.value >= 0.0 and before.contact_area == 0.0
            return LoadPath(0.0 if closes else pressure, control, past.approach, pressure, closes)
        approach = (
            past.approach if past.last.alpha else min(past.approach, control.value)
        )  # the surfaces were not closer before
        return LoadPath(approach, control, approach, pressure)

    def _start(
        self, memory: AdhesiveMemory, step: Step, trial: Trial, path: LoadPath, out: Array, still: bool = False
    ) -> None:
        """Put the start of a step into a map: the extrapolated gap, or the last one if `still`; collective. Before the
        first step it is the gap of an undeformed body, at the approach, or where the surface touches."""
        now, before = memory.pasts
        if not now.known:
            control = path.at(0.0 if still else 1.0)
            highest = self._highest(trial)
            np.maximum(-trial.effective - (control.value if isinstance(control, Approach) else -highest), 0.0, out=out)
            return
        growth = step.growth if before.known and not still else 0.0
        cells = cells_between(now.position, step.position, (self.grid.dx, self.grid.dy))
        along_x, along_y = (round(moved) % count for moved, count in zip(cells, self.grid.points, strict=True))
        older = before.gap
        if along_y and growth > 0.0:
            older = regrid.roll_rows(self.slab, before.gap, along_y, out)
        loops.travel(now.gap, older, 1.0 + growth, growth, along_x, 0.0, np.inf, out)
        if along_y:
            out[...] = regrid.roll_rows(self.slab, out, along_y, self.scene.solver.workspace.pressure)
        if path.closes_gap_first:
            out += self.slab.reduce((), [-float(out.min(initial=np.inf))])[0]

    def _open_up(
        self, contact: Contact, memory: AdhesiveMemory, law: Law, trial: Trial
    ) -> tuple[Contact, AdhesiveMemory]:
        """Return the contact with the surfaces far from each other, and its memory; collective."""
        now, before = memory.pasts
        contact.p.fill(0.0)
        contact.u.fill(0.0)
        d = -self._highest(trial) - OPEN * law.range
        np.subtract(-d, trial.effective, out=now.gap)
        if memory.free_correction is not None:
            memory.free_correction.fill(0.0)
        memory = replace(memory, pasts=(now, before._replace(known=False)))
        return replace(contact, d=d, failure="", certificate=Certificate(0.0, 0.0, 0.0)), memory

    def _highest(self, trial: Trial) -> float:
        return self.slab.reduce((), [float(trial.effective.max(initial=-np.inf))])[0]

    def _count_changes(self, law: Law, now: PastGap, before: PastGap) -> float:
        """Return the number of points that came into contact or left it; collective."""
        if not before.known:
            return 0.0
        return self.slab.sum(float(np.count_nonzero(law.touches(before.gap) != law.touches(now.gap))))[0]

    def _tension(self, law: Law, p: Array, alpha: float) -> dict[str, float]:
        """Return the share of points under tension and the force of all tension [N]; collective."""
        count, pull = self.slab.sum(*gap_kernels.tension(p, LEAST_TENSION * law.strength))
        unit = alpha * self.scene.units.pressure * self.grid.lx * self.grid.ly / self.slab.points
        return {"tensile_area": count / self.slab.points, "adhesive_force": pull * unit}

    def _least_load(self, law: Law, alpha: float, control: Control, p: Array, pull: float) -> float:
        """Return the largest load [N] that may be an error of the solver; collective. It is a share of all tension and
        of the strength of one point, and infinite if no point has more pressure or tension than this."""
        largest = self.slab.reduce((), [float(np.abs(p).max(initial=0.0))])[0]
        least = LEAST_LOAD * law.strength
        unloaded = isinstance(control, MeanPressure) and abs(control.value) * self.slab.points <= least
        if largest <= (LEAST_TENSION * law.strength if unloaded else least):
            return math.inf
        point = self.grid.lx * self.grid.ly / self.slab.points
        return LEAST_LOAD * max(pull, law.strength * alpha * self.scene.units.pressure * point)

    # -- as a part of the run ------------------------------------------------------------------------------------------

    def gap(self, memory: AdhesiveMemory) -> Array | None:
        """Return the map of the last gap, None before the first step."""
        return memory.pasts[0].gap if memory.pasts[0].known else None

    def detached(self, memory: AdhesiveMemory) -> Detached | None:
        """Return time and load of the detachment; None before it."""
        return memory.end

    def with_end(self, memory: AdhesiveMemory, end: Detached) -> AdhesiveMemory:
        """Return the memory with the detachment `end` added."""
        return replace(memory, end=end)

    def at_rest(self) -> AdhesiveMemory:
        """Return the memory before the first step, in new maps."""
        correction = self.slab.zeros() if self.scene.choices.isolated.on else None
        pasts = PastGap(self.slab.zeros()), PastGap(self.slab.zeros())
        return AdhesiveMemory(pasts, self.slab.zeros(), self.slab.zeros(), correction)

    def entries(self, memory: AdhesiveMemory, units: Units) -> dict[str, Entry]:
        """Return the checkpoint entries: the gaps, the positions of the surface, and the detachment."""
        now, before = memory.pasts
        found = {
            "gap": Entry(now.gap, units.height, "m"),
            "earlier gap": Entry(before.gap, units.height, "m"),
            "position": Entry(np.array(now.position), 1.0, "m"),
            "earlier position": Entry(np.array(before.position), 1.0, "m"),
            "gap is known": Entry(float(now.known)),
            "earlier gap is known": Entry(float(before.known)),
            "modulus": Entry(memory.modulus, units.modulus, "Pa"),
            **entries_of_end(memory.end, self.scene.job),
        }
        if memory.free_correction is None:
            return found
        return {**found, "free correction": Entry(memory.free_correction, units.height, "m")}

    def restored(self, memory: AdhesiveMemory, saved: Saved) -> AdhesiveMemory:
        """Return the memory of a checkpoint, whose maps have been read into `memory`."""
        now, before = (
            PastGap(past.gap, _place(saved[f"{age}position"]), bool(saved[f"{age}gap is known"]))
            for age, past in zip(("", "earlier "), memory.pasts, strict=True)
        )
        end = end_of(self.scene.job, saved)
        return replace(memory, pasts=(now, before), modulus=float(saved["modulus"]), end=end)


def end_of(job: Any, saved: Saved) -> Detached | None:
    """Return time and load of the detachment that a checkpoint holds; None if there is none, if the job continues after
    a detachment, or if it has another history."""
    section = job.section("adhesion")
    return None if section is None or section.detached == "open" else end_in(job, saved)


def _place(saved: Array) -> tuple[float, float]:
    x, y = saved.tolist()
    return x, y
