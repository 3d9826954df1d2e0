"""A step of a contact that sticks: from which gap it starts, what it remembers, what it tells.

The gap is a part of the state: under the same load there are several equilibria, and history decides which one. A solve
starts from the last two gaps, extrapolated in time and moved with the surface by whole cells.
"""

import math
from dataclasses import astuple, dataclass, replace
from typing import NamedTuple

import numpy as np
from pydantic import TypeAdapter

from ..effects.adhesion import cell_of, modulus_of
from ..history.timeline import Step
from ..job import Job, Stage
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.body import Trial
from ..physics.entries import Entry, MapCount, Saved
from ..physics.measures import SIDE, Measures
from ..scene import Scene
from ..solve.adhesive import kernels
from ..solve.certificate import Certificate
from ..solve.constraint import Mask
from ..solve.contact import Contact
from ..solve.problem import Approach, Control
from ..storage.checkpoint import Contents
from .starts import cells_moved
from .sticking_energies import NO_ENERGIES, PathWork, Pushed, StickingEnergies

JUMP_STRIDE = 1.0 / 8.0  # accuracy: of a jump: the longest part in which it is made
LEAST_STRIDE = 1.0 / 16.0  # accuracy: of these, and of a step: the shortest part in which a hard one is made
PART_TOLERANCE = 0.05  # tuning: of the parts of a step but for the last
OPEN = 10.0  # physics: ranges of attraction between surfaces that have come off
SNAP_FRONT = 2.0  # accuracy: half process zones by which an edge moves in the shortest step of a snap
LEAST_TENSION = 1e-2  # physics: of the largest attraction: less is not counted as an area under tension


NEVER = (-1.0, 0.0)


class PastGap(NamedTuple):
    """The gap after a step, and where the surface was [m]; one that is not `known` has not been."""

    gap: Array
    position: tuple[float, float] = (0.0, 0.0)
    known: bool = False


@dataclass(frozen=True)
class StickingMemory:
    """Memory of a contact that sticks: the last gaps, the newest first, and two spare maps.

    `lag` is what a free body lacks (`solve.adhesive.sticking`) per pressure, for the modulus `modulus`, None of a
    periodic one. `energies` are counted where they are asked for. `detached` is when nothing held the surfaces any more
    [s], under which load; NEVER before. `snaps` is the number of steps in which the contact snapped; `told`
    says that the run has been told of steps that are too long.
    """

    pasts: tuple[PastGap, PastGap]
    spare: Array
    held: Array
    lag: Array | None
    modulus: float = 0.0
    energies: StickingEnergies = NO_ENERGIES
    detached: tuple[float, float] = NEVER
    snaps: int = 0
    told: bool = False


class StuckContact(NamedTuple):
    """The contact of a step, the memory after it, where the surfaces touch, and its numbers for columns; `pushed`
    is the work of the load along its path; `flips` is the number of points that came into contact or left it; `snapped`
    and `detached` say that the contact did, or that nothing holds the load any more."""

    contact: Contact
    memory: StickingMemory
    touching: Mask
    columns: tuple[float, ...]
    pushed: Pushed
    flips: float
    snapped: bool
    detached: bool

    def noted(self) -> "StuckContact":
        """Return it as one that has snapped."""
        return self._replace(memory=replace(self.memory, snaps=self.memory.snaps + 1), snapped=True)


def count_maps(free: bool) -> MapCount:
    """Count the maps of a memory, in a `free` box or a periodic one."""
    return MapCount(held=4 + free, saved=2 + free)


def at_rest(scene: Scene) -> StickingMemory:
    """Return the memory before the first step, in new maps."""
    slab = scene.slab
    lag = slab.zeros() if scene.choices.isolated.on else None
    pasts = PastGap(slab.zeros()), PastGap(slab.zeros())
    return StickingMemory(pasts, slab.zeros(), slab.zeros(), lag)


@dataclass(frozen=True)
class Path:
    """The way of the prescribed load from the last step to this one; approach and mean pressure of the last one; in the
    units of the solver. A load that presses surfaces which are apart first brings them `together`."""

    before: float
    control: Control
    approach: float
    pressure: float
    together: bool = False

    def at(self, share: float) -> Control:
        """Return what is prescribed at a share of the way; exact at its end."""
        if share == 1.0:
            return self.control
        return replace(self.control, value=self.before + share * (self.control.value - self.before))


def solve(scene: Scene, memory: StickingMemory, step: Step, trial: Trial, path: Path, pressure: Array) -> StuckContact:
    """Solve a step from the memory of the one before, with its pressure in a map; collective.

    A jump goes along its path in parts, so that it does not pass over an equilibrium on its way, and so does a step
    that is not solved at once, or comes off. Where shorter parts are of no help that stands.
    """
    law, gap, lag = scene.law(trial.alpha), memory.spare, memory.lag
    assert scene.sticking is not None
    assert law is not None
    if lag is not None and memory.modulus:
        lag *= memory.modulus / trial.alpha
    whole = JUMP_STRIDE if step.jump else 1.0
    now_known = memory.pasts[0].known
    _start(scene, memory, step, trial, path, gap, still=step.jump)
    reached, stride, iterations, began, snapped = 0.0, whole, 0, memory.held, False
    work = PathWork(scene, path.approach, path.pressure)
    while True:
        share = min(reached + stride, 1.0)
        loose = 1.0 if share == 1.0 else max(1.0, PART_TOLERANCE / scene.choices.numerics.tolerance)
        contact, detached = scene.sticking.solve(law, trial.effective, path.at(share), gap, lag, pressure, loose)
        iterations += contact.iterations
        hard = detached or (bool(contact.failure) and share == 1.0)
        if hard and stride > LEAST_STRIDE * whole:
            if reached == 0.0:
                _start(scene, memory, step, trial, path, gap, still=True)
            else:
                gap[...] = began
            stride *= 0.5
            continue
        if not detached and not path.together:
            work.go_on(contact)
        snapped |= hard and now_known
        if detached or share == 1.0:
            break
        reached = share
        began[...] = gap
    contact = replace(contact, iterations=iterations)
    pasts = PastGap(gap, step.position, True), memory.pasts[0]
    now = StickingMemory(pasts, memory.pasts[1].gap, began, lag, trial.alpha, memory.energies)
    now = replace(now, snaps=memory.snaps, told=memory.told)
    touching, flips = law.touches(gap), 0.0
    if now_known:
        (flips,) = scene.slab.sum(float(np.count_nonzero(law.touches(memory.pasts[0].gap) != touching)))
    columns = _columns(scene, trial, contact.p)
    pushed = Pushed(work.total * trial.alpha, detached or path.together)
    return StuckContact(contact, now, touching, columns, pushed, flips, snapped, detached)


def is_apart(stuck: StuckContact, before: Measures, now: Measures) -> bool:
    """Return whether nothing touches before and after a step, and no point is under tension after it: what is left of
    the load is no more than the solver's error."""
    return not (before.contact_area or now.contact_area or stuck.columns[0])


def front_of(scene: Scene, flips: float, before: Measures, now: Measures) -> float:
    """Return by how many half process zones the edge of the contact has moved in a step, in the mean.

    In cells that is the number of points over the length of the edge, which is pi/4 of the sides of cells along it.
    """
    law, grid = scene.choices.adhesion, scene.choices.grid
    assert law is not None
    excess = max(each.contact_area - each.contact_area_corrected for each in (before, now))
    sides = excess * scene.slab.points / SIDE
    if sides <= 0.0:
        return 0.0
    moved = flips / (0.25 * math.pi * sides) * cell_of(grid)
    zone = law.process_zone(modulus_of(scene.job.material))
    return 2.0 * moved / zone if zone > 0.0 else 0.0


def open_up(scene: Scene, stuck: StuckContact, trial: Trial) -> StuckContact:
    """Return the contact with the surfaces apart: where nothing holds a load, and the run goes on; collective."""
    contact, law, memory = stuck.contact, scene.law(trial.alpha), stuck.memory
    (now, before), lag = memory.pasts, memory.lag
    assert law is not None
    contact.p.fill(0.0)
    contact.u.fill(0.0)
    highest = scene.slab.reduce((), [float(trial.effective.max(initial=-np.inf))])[0]
    d = -highest - OPEN * law.range
    np.subtract(-d, trial.effective, out=now.gap)
    if lag is not None:
        lag.fill(0.0)
    memory = replace(memory, pasts=(now, before._replace(known=False)))
    contact = replace(contact, d=d, failure="", certificate=Certificate(0.0, 0.0, 0.0))
    touching, columns = law.touches(now.gap), _columns(scene, trial, contact.p)
    return stuck._replace(contact=contact, memory=memory, touching=touching, columns=columns)


def _start(
    scene: Scene,
    memory: StickingMemory,
    step: Step,
    trial: Trial,
    path: Path,
    out: Array,
    still: bool = False,
) -> None:
    """Put the gap from which a step starts into a map: extrapolated, or `still` that of the last step; collective."""
    now, before = memory.pasts
    if not now.known:
        _of_undeformed(scene, trial.effective, path.at(0.0 if still else 1.0), out)
        return
    growth = step.growth if before.known and not still else 0.0
    slab, points = scene.slab, scene.choices.grid.points
    along_x, along_y = (
        round(moved) % count for moved, count in zip(cells_moved(scene, step, now.position), points, strict=True)
    )
    older = before.gap
    if along_y and growth > 0.0:
        older = rows.roll(slab, before.gap, along_y, out)
    loops.travel(now.gap, older, 1.0 + growth, growth, along_x, 0.0, np.inf, out)
    if along_y:
        out[...] = rows.roll(slab, out, along_y, scene.solver.workspace.pressure)
    if path.together:
        out += slab.reduce((), [-float(out.min(initial=np.inf))])[0]


def _of_undeformed(scene: Scene, effective: Array, control: Control, out: Array) -> None:
    """Put the gap under a body that nothing has deformed into a map: at the approach, or where the surface touches;
    collective."""
    slab = scene.slab
    d = -slab.reduce((), [float(effective.max(initial=-np.inf))])[0]
    if isinstance(control, Approach):
        d = control.value
    np.maximum(-effective - d, 0.0, out=out)


def _columns(scene: Scene, trial: Trial, p: Array) -> tuple[float, ...]:
    """Return the share of points under tension and the force of all tension [N]; collective."""
    law, slab, grid = scene.law(trial.alpha), scene.slab, scene.choices.grid
    assert law is not None
    count, pull = slab.sum(*kernels.tension(p, LEAST_TENSION * law.strength))
    unit = trial.alpha * scene.units.pressure * grid.lx * grid.ly / slab.points
    return count / slab.points, pull * unit, np.nan, np.nan


# -- checkpoints ------------------------------------------------------------------------------------------------------


def entries(memory: StickingMemory, measures: Measures, height: float, modulus: float) -> dict[str, Entry]:
    """Return what a checkpoint has of it and of the last measures, in units of heights [m] and moduli [Pa]."""
    now, before = memory.pasts
    found = {
        "gap": Entry(now.gap, height, "m"),
        "earlier gap": Entry(before.gap, height, "m"),
        "positions": Entry(np.array([*now.position, *before.position]), 1.0, "m"),
        "known": Entry(np.array([float(now.known), float(before.known)])),
        "modulus": Entry(memory.modulus, modulus, "Pa"),
        "energies": Entry(np.array(memory.energies), 1.0, "J"),
        "detached": Entry(np.array(memory.detached)),
        "snaps": Entry(float(memory.snaps)),
        "measures": Entry(np.array(astuple(measures), dtype=np.float64)),
    }
    return found if memory.lag is None else {**found, "lag": Entry(memory.lag, height, "m")}


def restored_measures(saved: Saved) -> Measures:
    """Return the measures of the last step, with which the next one is compared; what was not saved is 0."""
    numbers = dict(zip(Measures.__dataclass_fields__, saved["measures"].tolist(), strict=False))
    return Measures(**{**numbers, "at_edge": bool(numbers["at_edge"])})


def came_off(contents: Contents, job: Job) -> tuple[float, float]:
    """Return when the surfaces of a checkpoint came off [s], and under which load; NEVER where they did not, or where
    the job goes on then or has another history ahead."""
    section, saved = job.section("adhesion"), contents.numbers.get("sticking/detached")
    if section is None or section.detached == "open" or saved is None:
        return NEVER
    history = TypeAdapter(tuple[Stage, ...]).validate_python(contents.job["history"])
    return (float(saved[0]), float(saved[1])) if history == job.history else NEVER


def restored(memory: StickingMemory, saved: Saved, detached: tuple[float, float]) -> StickingMemory:
    """Return the memory of a checkpoint, whose maps have been read into those of this one."""
    x, y, x_before, y_before = saved["positions"].tolist()
    known = [bool(each) for each in saved["known"]]
    now, before = memory.pasts
    pasts = PastGap(now.gap, (x, y), known[0]), PastGap(before.gap, (x_before, y_before), known[1])
    modulus, maps = float(saved["modulus"]), (memory.spare, memory.held, memory.lag)
    energies, snaps = StickingEnergies(*saved["energies"].tolist()), int(saved["snaps"])
    return StickingMemory(pasts, *maps, modulus, energies, detached, snaps)
