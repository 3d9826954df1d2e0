"""The state of a run: all that one step hands to the next, and the one list of what a checkpoint has of it."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..effects.effect import values_of
from ..errors import InputError
from ..history.chosen import SYMBOLS, ChosenSteps
from ..parallel.slab import Array
from ..physics.body import BodyMemory
from ..physics.budget import ErrorSums
from ..physics.energy import EnergyMemory
from ..physics.entries import Entry, MapCount, Saved, part_of, prefixed
from ..physics.measures import Measures
from ..physics.units import Units
from ..scene import Scene
from ..storage import checkpoint, wisdom
from ..storage.checkpoint import Contents, Facts
from ..storage.row import Row
from . import sticking
from .starts import Past
from .sticking import StickingMemory
from .tolerance import StepTolerance, follows

FURTHER = 2  # tuning: pressures before the earlier one that are kept for starts, of three and of four steps ago
FRICTION = "budget/friction"  # in a checkpoint
MODULI, POSITIONS = "contact/further moduli", "clock/further positions"  # in a checkpoint, of these


@dataclass(frozen=True)
class State:
    """A run after a step. `make_step` returns another one and leaves this one as it was.

    `row` is what the step is recorded as. `pasts` are the last pressures, the newest first: a history of single solves
    keeps one, others two or more. `approach` is the d of the body, `body` and `energy` are their memories; `friction`
    is that of the body in the last step, infinite where that was a jump, `errors` the sums of the error budget,
    `chosen` the record of the steps that stages have chosen, which grows; `sticking` is the memory of a contact with
    adhesion, `tolerance` that of the tolerance of solves. The next pressure will be in the map `spare`. Effects that
    follow the steps keep what they remember themselves, as they are told only of steps that were made.

    Two states share most maps, and the oldest ones of a state are spare in the next: a state can be used until a step
    begins from the one after it. Maps are in the run's units.
    """

    row: Row
    pasts: tuple[Past, ...]
    spare: Array
    body: BodyMemory
    energy: EnergyMemory | None
    approach: float = 0.0
    friction: float = math.inf
    errors: ErrorSums = field(default_factory=ErrorSums)
    chosen: ChosenSteps | None = None
    sticking: StickingMemory | None = None
    tolerance: StepTolerance = field(default_factory=StepTolerance)

    @staticmethod
    def count_maps(lasts: bool, keeps_further: bool) -> MapCount:
        """Count the maps of pressures and the spare one; there is an earlier pressure if stages last."""
        earlier = lasts + FURTHER * keeps_further
        return MapCount(held=2 + earlier, saved=1 + earlier)

    @property
    def pressure(self) -> Array:
        """The map of p, whose pressure is `alpha p`."""
        return self.pasts[0].pressure

    @property
    def alpha(self) -> float:
        """The modulus of the last step, 0 before the first one."""
        return self.pasts[0].alpha

    @property
    def position(self) -> tuple[float, float]:
        """The way of the surface so far [m]."""
        return self.pasts[0].position


def first_state(scene: Scene, body: BodyMemory | None = None) -> State:
    """Return the state before the first step, in new maps: at no load the surface just touches the body."""
    setup, slab = scene.setup, scene.slab
    highest = setup.heights.highest
    touching = Measures(approach=0.0 - highest - setup.surface.datum, mean_gap=highest - setup.heights.mean)
    further = FURTHER * scene.choices.further_starts.on
    pasts = tuple(Past(slab.zeros()) for _ in range(1 + scene.choices.extrapolated_starts.on + further))
    chosen = ChosenSteps.of(scene.job) if scene.choices.timeline.chooses else None
    state = State(
        Row(measures=touching),
        pasts,
        slab.zeros(),
        scene.material.at_rest() if body is None else body,
        scene.energy.at_rest() if scene.energy is not None else None,
        -highest / setup.units.height,
        chosen=chosen,
        sticking=sticking.at_rest(scene) if scene.sticking is not None else None,
    )
    return completed(scene, state)


def pressed_state(scene: Scene, state: State, row: Row, pressure: Array, approach: float) -> State:
    """Return a first state under a pressure, which is copied into its maps, and that had been there before, with the
    friction of a row."""
    for past in state.pasts[:2]:
        past.pressure[...] = pressure
    pasts = (*(past._replace(alpha=1.0) for past in state.pasts[:2]), *state.pasts[2:])
    friction = row.measures.friction - row.measures.friction_interface
    return completed(scene, replace(state, row=row, pasts=pasts, approach=approach, friction=friction))


def completed(scene: Scene, state: State) -> State:
    """Return the state with the energies [J] and the columns of effects in its row."""
    work, stored, lost, split = energies_of(scene, state.energy, state.sticking)
    added = values_of(scene.followers)
    row = replace(state.row, work=work, stored=stored, dissipated=lost, branch_dissipation=split, added=added)
    return replace(state, row=row)


def energies_of(
    scene: Scene, memory: EnergyMemory | None, stuck: StickingMemory | None
) -> tuple[float, float, float, tuple[float, ...]]:
    """Return work, stored and dissipated energy [J], and the dissipation of each branch; NaN if not asked for.

    The work is that on the body, with adhesion that of the load.
    """
    if scene.energy is None or memory is None:
        return math.nan, math.nan, math.nan, ()
    unit = scene.energy.unit
    lost = tuple(float(value) * unit for value in memory.dissipated)
    work = memory.work * unit if stuck is None else stuck.energies.work
    return work, memory.stored * unit, math.fsum(lost), lost


# -- checkpoints ------------------------------------------------------------------------------------------------------


def entries(scene: Scene, state: State) -> dict[str, Entry]:
    """Return everything that a run remembers, by the names `part/name` that checkpoints have; maps are no copies."""
    found = _contact_entries(state, scene.units) | prefixed("material", scene.material.entries(state.body, scene.units))
    if scene.energy is not None and state.energy is not None:
        found |= scene.energy.entries(state.energy, scene.units)
    for name, effect in scene.followers.items():
        found |= prefixed(name, effect.entries(scene.units))
    if state.chosen is not None:
        numbers = state.chosen.numbers()
        found |= {name: Entry(np.array(value), 1.0, SYMBOLS[name], optional=True) for name, value in numbers.items()}
    if scene.material.branched is not None:
        found[FRICTION] = Entry(state.friction, optional=True)
    if follows(scene):
        found |= state.tolerance.entries()
    if state.sticking is not None:
        units = scene.units.height, scene.units.modulus
        found |= prefixed("sticking", sticking.entries(state.sticking, state.row.measures, *units))
    return found | state.errors.entries()


def save(path: Path, scene: Scene, state: State, facts: Facts) -> None:
    """Write a checkpoint of a state, with the plans of its transforms; collective. Raises RunError."""
    everything = {**entries(scene, state), "plans/all": Entry(wisdom.gather(scene.slab))}
    checkpoint.write(path, scene.slab, replace(facts, step=state.row.step, time=state.row.time), everything)


def restored(scene: Scene, state: State, contents: Contents) -> State:
    """Return the state of a checkpoint, in the maps of another one; collective.

    Raises InputError for a checkpoint that lacks something, or is of another body.
    """
    _refuse_lost_branches(scene, contents)
    declared = entries(scene, state)
    wanted = {name: entry for name, entry in declared.items() if not entry.optional or name in contents.units}
    _compare(contents, wanted)
    checkpoint.read(contents, scene.slab, wanted)
    saved = {name: _value(name, entry, contents) for name, entry in wanted.items()}
    energy = state.energy
    if scene.energy is not None and energy is not None:
        energy = scene.energy.restored(energy, saved)
    for name, effect in scene.followers.items():
        effect.restore(part_of(name, saved))
    row = Row(contents.step, contents.time, float(saved["clock/distance"]))
    stuck = state.sticking
    if stuck is not None:
        of_stuck = part_of("sticking", saved)
        row = replace(row, measures=sticking.restored_measures(of_stuck))
        stuck = sticking.restored(stuck, of_stuck, sticking.came_off(contents, scene.job))
    found = replace(
        state,
        row=row,
        pasts=_restored_pasts(state.pasts, saved),
        body=scene.material.restored(state.body, part_of("material", saved)),
        energy=energy,
        approach=float(saved["contact/approach"]),
        friction=float(saved.get(FRICTION, math.inf)),
        errors=ErrorSums.restored(saved),
        chosen=None if state.chosen is None else ChosenSteps.of(scene.job, saved),
        sticking=stuck,
        tolerance=StepTolerance.restored(saved),
    )
    return completed(scene, found)


def _contact_entries(state: State, units: Units) -> dict[str, Entry]:
    """Return the pressures and where the surface was; step and time a checkpoint says itself."""
    strain = units.height / units.length
    last, *older = state.pasts
    found = {
        "clock/distance": Entry(state.row.distance, 1.0, "m"),
        "clock/position": Entry(np.array(last.position), 1.0, "m"),
        "contact/pressure": Entry(last.pressure, strain),
        "contact/modulus": Entry(last.alpha, units.modulus, "Pa"),
        "contact/earlier modulus": Entry(older[0].alpha if older else 0.0, units.modulus, "Pa"),
        "contact/approach": Entry(state.approach, units.height, "m"),
    }
    if older:
        found["contact/earlier pressure"] = Entry(older[0].pressure, strain, optional=True)
        found["clock/earlier position"] = Entry(np.array(older[0].position), 1.0, "m", optional=True)
    if further := older[1:]:
        found |= {_name(k): Entry(past.pressure, strain, optional=True) for k, past in enumerate(further)}
        found[MODULI] = Entry(np.array([past.alpha for past in further]), units.modulus, "Pa", optional=True)
        found[POSITIONS] = Entry(np.array([past.position for past in further]).ravel(), 1.0, "m", optional=True)
    return found


def _name(index: int) -> str:
    """Return the name of a further pressure in a checkpoint."""
    return f"contact/pressure {index + 3} steps ago"


def _restored_pasts(pasts: tuple[Past, ...], saved: Saved) -> tuple[Past, ...]:
    """Return the pressures of a checkpoint, whose maps have been read; those that it lacks are not known."""
    numbers = [(float(saved["contact/modulus"]), saved["clock/position"])]
    if "contact/earlier pressure" in saved:
        place = saved.get("clock/earlier position", saved["clock/position"])
        numbers.append((float(saved["contact/earlier modulus"]), place))
        if MODULI in saved:
            numbers += zip(saved[MODULI].tolist(), np.reshape(saved[POSITIONS], (-1, 2)), strict=True)
    known = zip(pasts, numbers, strict=False)
    found = [Past(past.pressure, alpha, (float(x), float(y))) for past, (alpha, (x, y)) in known]
    return (*found, *(Past(past.pressure) for past in pasts[len(found) :]))


def _value(name: str, entry: Entry, contents: Contents) -> NDArray[Any]:
    """Return a map, which has been read in place, or numbers in the run's units."""
    if entry.is_map:
        return np.asarray(entry.value)
    return np.asarray(contents.numbers[name] * (contents.units[name] / entry.unit))


def _compare(contents: Contents, wanted: dict[str, Entry]) -> None:
    if lacking := [name for name in wanted if name not in contents.units]:
        hint = ": output.energy was off, and energies count from the start" if lacking[0].startswith("energy/") else ""
        raise InputError(f"{contents.path} does not have {', '.join(lacking)}, which the job needs{hint}")
    for name in (name for name, entry in wanted.items() if entry.given):
        old = np.asarray(contents.numbers[name]) * contents.units[name]
        new = np.asarray(wanted[name].value) * wanted[name].unit
        if old.shape != new.shape or not np.allclose(old, new, rtol=1e-12, atol=0.0):
            raise InputError(f"{contents.path} is of another job: {name} was {old.tolist()}, is {new.tolist()}")


def _refuse_lost_branches(scene: Scene, contents: Contents) -> None:
    """Raise InputError where a branch had no map in the run that wrote the checkpoint, as it relaxed too fast, and
    needs one now that steps are shorter: what it remembered is lost."""
    if "material/frozen" not in contents.numbers:
        return
    for k in scene.folded.kept:
        if f"material/branch {k}" in contents.maps or contents.numbers["material/frozen"][k]:
            continue
        error, allowed = scene.folded.memoryless_errors[k], contents.job["numerics"].get("branch_error", 0.0)
        if error > allowed:
            time = scene.setup.prony.relaxation_times[k]
            raise InputError(
                f"{contents.path} does not have the branch of relaxation time {time:g} s, which relaxed within every "
                f"step of its run. The steps to come are shorter: without it friction would be wrong by {error:.2g}; "
                f"numerics.branch_error is {allowed:g}. Take longer steps, or start afresh (--restart never)"
            )
