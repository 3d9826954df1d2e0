"""A step of a contact that sticks: from which gap it starts, what it remembers, what it tells.

The gap is a part of the state: under the same load there are several equilibria, and history decides which one. A solve
starts from the last two gaps, extrapolated in time and moved with the surface by whole cells.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..history.timeline import Step
from ..parallel import rows
from ..parallel.slab import Array
from ..physics import loops
from ..physics.body import Trial
from ..physics.entries import Entry, MapCount, Saved
from ..scene import Scene
from ..solve.adhesive import kernels
from ..solve.contact import Contact
from ..solve.problem import Approach, MeanPressure
from .starts import cells_moved

LEAST_TENSION = 1e-2  # physics: of the largest attraction: less is not counted as an area under tension


class PastGap(NamedTuple):
    """The gap after a step, and where the surface was [m]; one that is not `known` has not been."""

    gap: Array
    position: tuple[float, float] = (0.0, 0.0)
    known: bool = False


@dataclass(frozen=True)
class StickingMemory:
    """Memory of a contact that sticks: the last gaps, the newest first, and a spare map.

    `lag` is what a free body lacks (`solve.adhesive.sticking`) per pressure, for the modulus `modulus`, None of a
    periodic one. `surface` is the energy of the surfaces and `snapped` that lost in snaps, in the unit of energies.
    """

    pasts: tuple[PastGap, PastGap]
    spare: Array
    lag: Array | None
    modulus: float = 0.0
    surface: float = 0.0
    snapped: float = 0.0


class StuckContact(NamedTuple):
    """The contact of a step, the memory after it, where the surfaces touch, and whether they have come apart."""

    contact: Contact
    memory: StickingMemory
    touching: Array
    detached: bool
    columns: tuple[float, ...]


def count_maps(free: bool) -> MapCount:
    """Count the maps of a memory, in a `free` box or a periodic one."""
    return MapCount(held=3 + free, saved=2 + free)


def at_rest(scene: Scene) -> StickingMemory:
    """Return the memory before the first step, in new maps."""
    slab = scene.slab
    lag = slab.zeros() if scene.choices.isolated.on else None
    return StickingMemory((PastGap(slab.zeros()), PastGap(slab.zeros())), slab.zeros(), lag)


def solve(
    scene: Scene, memory: StickingMemory, step: Step, trial: Trial, control: Approach | MeanPressure, pressure: Array
) -> StuckContact:
    """Solve a step from the memory of the one before, with its pressure in a map; collective."""
    assert scene.sticking is not None
    law = scene.law(trial.alpha)
    assert law is not None
    gap, lag = memory.spare, memory.lag
    _start(scene, memory, step, trial, control, gap)
    if lag is not None and memory.modulus:
        lag *= memory.modulus / trial.alpha
    contact, detached = scene.sticking.solve(law, trial.effective, control, gap, lag, pressure)
    pasts = PastGap(gap, step.position, True), memory.pasts[0]
    now = StickingMemory(pasts, memory.pasts[1].gap, lag, trial.alpha, memory.surface, memory.snapped)
    return StuckContact(contact, now, gap == 0.0, detached, _columns(scene, trial, contact.p))


def _start(
    scene: Scene, memory: StickingMemory, step: Step, trial: Trial, control: Approach | MeanPressure, out: Array
) -> None:
    """Put the gap from which a step starts into a map; collective."""
    now, before = memory.pasts
    if not now.known:
        _of_undeformed(scene, trial.effective, control, out)
        return
    growth = step.growth if before.known else 0.0
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


def _of_undeformed(scene: Scene, effective: Array, control: Approach | MeanPressure, out: Array) -> None:
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


def entries(memory: StickingMemory, height: float, modulus: float) -> dict[str, Entry]:
    """Return what a checkpoint has of it, in units of heights [m] and moduli [Pa]."""
    now, before = memory.pasts
    found = {
        "gap": Entry(now.gap, height, "m"),
        "earlier gap": Entry(before.gap, height, "m"),
        "positions": Entry(np.array([*now.position, *before.position]), 1.0, "m"),
        "known": Entry(np.array([float(now.known), float(before.known)])),
        "modulus": Entry(memory.modulus, modulus, "Pa"),
        "energies": Entry(np.array([memory.surface, memory.snapped])),
    }
    return found if memory.lag is None else {**found, "lag": Entry(memory.lag, height, "m")}


def restored(memory: StickingMemory, saved: Saved) -> StickingMemory:
    """Return the memory of a checkpoint, whose maps have been read into those of this one."""
    x, y, x_before, y_before = saved["positions"].tolist()
    known = [bool(each) for each in saved["known"]]
    now, before = memory.pasts
    pasts = PastGap(now.gap, (x, y), known[0]), PastGap(before.gap, (x_before, y_before), known[1])
    surface, snapped = saved["energies"].tolist()
    return StickingMemory(pasts, memory.spare, memory.lag, float(saved["modulus"]), surface, snapped)
