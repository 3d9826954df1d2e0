"""The state of a run, which holds all that one step passes to the next, and the error budget of a step.

A run consists of parts with a memory (`physics.records.RunPart`). Checkpoints are written and read part by part.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.problem import Contact
from ..effects.effect import Memories, PreviousContacts, PreviousPressure, Sheared, SolvedContact, effect_values
from ..errors import InputError
from ..files import checkpoint, wisdom
from ..files.checkpoint import Contents, Facts
from ..files.recorder import StepRow
from ..job.history import ChosenSteps, Step
from ..parallel.slab import Array
from ..physics.body import BodyMemory, Trial, remembers, states_errors
from ..physics.energy import EnergyMemory
from ..physics.records import Entry, Measures, RunPart, Saved, Units, part_of, with_part
from ..physics.surface import friction_by_energy
from .budget import ENERGY, ErrorBudget, ErrorSums, estimate
from .controller import IntegratorDifference, StepTolerance, TolerancePart
from .laws import choose_contact_law
from .scene import Scene
from .time_error import RunProperties, StepObservation, error_of_rise, time_error

NO_DIFFERENCE = IntegratorDifference(0.0, 0.0)


@dataclass(frozen=True)
class StepErrors:
    """Relative errors of a step.

    `budget` states the errors of friction and area by their sources; it is None without contact. `step` is the error
    that the length of the step alone causes. If the stage chooses its steps, the length of the next step follows from
    `step`. `friction` is the friction coefficient of the body, from which the next step computes the change of
    friction; it is infinite after a jump, when it is unknown. `lasting` is the budget without the error of a rise of
    friction. The tolerance of the next solves follows from `lasting`.
    """

    budget: ErrorBudget | None
    step: float
    friction: float
    lasting: ErrorBudget | None

    @property
    def of_friction(self) -> float:
        """Relative error of friction; infinite without friction."""
        return math.inf if self.budget is None or self.budget.friction is None else self.budget.friction.of_friction

    @property
    def resolved(self) -> bool:
        """True unless spots of contact may be smaller than a cell."""
        return self.budget is None or self.budget.resolved

    @property
    def of_area(self) -> float:
        """Relative error of the contact area; 0 without contact."""
        return 0.0 if self.budget is None else self.budget.area.total


@dataclass(frozen=True)
class SolvedStep:
    """A solved step: the contact found by the contact law, its measures, and the memory of the body after the step."""

    step: Step
    trial: Trial
    of_law: SolvedContact[Any]
    measures: Measures
    body: BodyMemory

    @property
    def contact(self) -> Contact:
        return self.of_law.contact

    @property
    def touches(self) -> bool:
        """True if the surfaces touch under pressure or tension."""
        return self.of_law.loaded and self.measures.contact_area > 0.0


@dataclass(frozen=True)
class ErrorMemory:
    """Memory of the errors of a run. `friction` is the friction coefficient of the body in the last step; after a jump
    it is unknown and stored as infinity. `sums` are the sums of the error budgets of all steps. `energy` [J] is the
    summed error of dissipated energy and slip loss; it is infinite if unknown."""

    friction: float = math.inf
    sums: ErrorSums = field(default_factory=ErrorSums)
    energy: float = 0.0


@dataclass(frozen=True)
class BudgetPart:
    """The part of a run that remembers the errors of all steps. `relaxes` is True for a viscoelastic body, and
    `energies` is True if the job asks for energies. All entries of this part in checkpoints are optional."""

    relaxes: bool
    energies: bool = False

    def at_rest(self) -> ErrorMemory:
        return ErrorMemory()

    def entries(self, memory: ErrorMemory, units: Units) -> dict[str, Entry]:
        friction = {"friction": Entry(memory.friction, optional=True)} if self.relaxes else {}
        energy = {"energy": Entry(memory.energy, 1.0, "J", optional=True)} if self.energies else {}
        return friction | energy | memory.sums.entries()

    def restored(self, memory: ErrorMemory, saved: Saved) -> ErrorMemory:
        friction, energy = float(saved.get("friction", math.inf)), float(saved.get("energy", math.inf))
        return ErrorMemory(friction, ErrorSums.restored(saved), energy)


def add_energy_error(summed: float, errors: StepErrors | None, sheared: Sheared | None, dissipated: float) -> float:
    """Return the summed error of energies [J] after a further step: `summed` is the sum before the step. Return
    infinity if `errors` is None.

    `dissipated` is the energy [J] that the body dissipates in the step. Its relative error is the error by the step
    length plus ENERGY times the error of the area. The energy lost in slip, in `sheared`, has the relative error of
    friction.
    """
    if errors is None:
        return math.inf
    slip = 0.0 if sheared is None or not sheared.lost else sheared.lost * min(errors.of_friction, 1.0)
    return summed + abs(dissipated) * (errors.step + ENERGY.value * errors.of_area) + slip


def estimate_errors(scene: Scene, friction: float, solved: SolvedStep) -> StepErrors:
    """Return the estimated errors of a step; collective. `friction` is the friction coefficient of the body in the step
    before, infinite if unknown or after a jump."""
    if not states_errors(scene.material):
        return StepErrors(None, 0.0, math.inf, None)
    run, measures = scene.properties, solved.measures
    body = measures.friction - measures.friction_interface
    observed = _observe(scene, run, solved, body - friction)
    time, last = time_error(run, observed), math.inf if solved.step.jump else body
    if not solved.touches:
        return StepErrors(None, time, last, None)
    budget, rise = estimate(run, observed), error_of_rise(run, observed)
    more = max(0.0, rise - time) * observed.body / measures.friction if budget.friction else 0.0
    return StepErrors(budget, time, last, budget.take_from_time(more))


def _observe(scene: Scene, run: RunProperties, solved: SolvedStep, change: float) -> StepObservation:
    """Return the observation of a step with this change of the friction of the body; collective."""
    step, measures, certificate = solved.step, solved.measures, solved.contact.certificate
    pair, mismatch, grid = _compare_integrators(scene, solved), _compare_views(scene, solved), scene.choices.grid
    curved = scene.choices.numerics.integrator == "exponential" and step.growth > 0.0
    of_steps: dict[str, Any] = {"difference": pair.difference, "order": pair.order}
    of_steps |= {"seconds": step.dt, "change": change}
    if remembers(scene.material) and scene.material.branched is None:
        of_steps["own_error"] = scene.material.time_error(solved.body, solved.trial, step.dt)  # type: ignore[attr-defined]
    if not solved.touches:
        return StepObservation(0.0, 0.0, 0.0, 0.0, curved=curved, **of_steps)
    return StepObservation(
        complementarity=certificate.complementarity,
        friction=measures.friction,
        area=measures.contact_area,
        corrected=measures.contact_area_corrected,
        slope=pair.slope * (scene.units.height / scene.units.length),
        interface=measures.friction_interface,
        penetrating=max(certificate.members / measures.contact_area - 1.0, 0.0),
        spared=measures.spared,
        straight=measures.straight,
        friction_mismatch=mismatch,
        way=step.velocity,
        position=(step.position[0] / grid.dx, step.position[1] / grid.dy),
        slid=_cells_slid(run, step, (grid.dx, grid.dy)),
        angle=pair.angle,
        curved=curved,
        uneven=min(1.0, measures.max_pressure / measures.pressure - 1.0) if measures.pressure > 0.0 else 1.0,
        **of_steps,
    )


def _cells_slid(run: RunProperties, step: Step, cell: tuple[float, float]) -> float:
    """Return by how many cells the surface slides in a step: of mean sides, or across straight edges of contact."""
    dx, dy = cell if run.edges_follow_grid else (run.mean_cell, run.mean_cell)
    return math.hypot(step.velocity[0] / dx, step.velocity[1] / dy) * step.dt


def _compare_integrators(scene: Scene, solved: SolvedStep) -> IntegratorDifference:
    """Return the differences that the embedded pair of integrators gives for a step; collective."""
    step, trial, contact, measures = solved.step, solved.trial, solved.contact, solved.measures
    pair = scene.integrators
    if pair is None:
        return NO_DIFFERENCE
    if not solved.touches:
        return pair.compare_without_load(step.dt, trial, solved.body, step.growth) if step.decide else NO_DIFFERENCE
    load = measures.pressure * scene.slab.points / (trial.alpha * scene.units.pressure)
    pressure = contact.p
    if (touching := solved.of_law.touching) is not pressure:  # tension counts as pressure does
        pressure = np.abs(contact.p) if solved.of_law.pull else np.where(touching, contact.p, 0.0)
        load = scene.slab.sum(float(pressure.sum()))[0]
    share = measures.contact_area
    return pair.compare(step.dt, trial, solved.body, pressure, contact.u, load, share, step.growth)


def _compare_views(scene: Scene, solved: SolvedStep) -> float:
    """Return the difference of friction by the slopes of the rigid surface and of the body; collective. For an elastic
    body the latter is 0."""
    step, measures, grid = solved.step, solved.measures, scene.choices.grid
    if not remembers(scene.material) or measures.friction == 0.0:
        return max(measures.friction - measures.friction_interface, 0.0)
    direction, own = _viscous(step.velocity, measures)
    displacement = scene.material.displacement(solved.body, solved.contact.u.copy, solved.trial.alpha)
    maps, cyclic = (solved.contact.p, displacement), grid.cyclic
    other = friction_by_energy(scene.slab, *maps, (grid.dx, grid.dy), direction, cyclic)
    return abs(other * scene.units.height - own)


def _viscous(velocity: tuple[float, float], measures: Measures) -> tuple[tuple[float, float], float]:
    """Return a unit direction, and friction along it without the interface. The direction is the direction of sliding,
    or opposite to the force at rest and if the force is mainly across, as for ridges that slide along themselves."""
    (x, y), (force_x, force_y) = velocity, (measures.force_x, measures.force_y)
    if abs(force_x * y - force_y * x) >= abs(force_x * x + force_y * y):
        x, y = -force_x, -force_y
    size = math.hypot(x, y)
    along = -(force_x * x + force_y * y) / (size * measures.normal_force)
    return (x / size, y / size), along - measures.friction_interface


# names of parts of every run; effects need other names
RESERVED = {"row", "contact", "law", "material", "errors", "energy", "steps", "tolerance", "plans"}
FURTHER = 2  # tuning: number of pressures kept for starts, from three and four steps ago


@dataclass(frozen=True)
class State:
    """The state of a run after a step: the memories of its parts, by the names of the parts (`parts_of`). `make_step`
    returns a new state.

    Maps are in the run's units. A state shares most maps with its successor. The step after the successor overwrites
    the oldest maps of this state; from then on this state is invalid.
    """

    memories: Memories

    def after(self, **changes: Any) -> "State":
        """Return a copy of the state with new memories for some parts. The keywords are the names of these parts."""
        return State({**self.memories, **changes})

    @property
    def row(self) -> StepRow:
        """Record of the last step."""
        row: StepRow = self.memories["row"]
        return row

    @property
    def contact(self) -> PreviousContacts:
        """The last pressures and the last approach, from which the next solve starts."""
        contact: PreviousContacts = self.memories["contact"]
        return contact

    @property
    def law(self) -> Any:
        """The memory of the contact law."""
        return self.memories["law"]

    @property
    def body(self) -> BodyMemory:
        memory: BodyMemory = self.memories["material"]
        return memory

    @property
    def energy(self) -> EnergyMemory | None:
        """Energies of the body; None if the job does not ask for them."""
        return self.memories.get("energy")

    @property
    def friction(self) -> float:
        """Friction coefficient of the body in the last step; infinite after a jump, when it is unknown."""
        memory: ErrorMemory = self.memories["errors"]
        return memory.friction

    @property
    def errors(self) -> ErrorSums:
        """Sums of the error budgets of all steps."""
        memory: ErrorMemory = self.memories["errors"]
        return memory.sums

    @property
    def chosen(self) -> ChosenSteps | None:
        """Record of the steps that stages have chosen so far; None if no stage chooses."""
        return self.memories.get("steps")

    @property
    def tolerance(self) -> StepTolerance:
        """Memory of the tolerance of solves."""
        return self.memories.get("tolerance") or StepTolerance()


# -- parts ------------------------------------------------------------------------------------------------------------


def parts_of(scene: Scene) -> dict[str, RunPart[Any]]:
    """Return all parts of a run that have a memory, by their names in checkpoints. Raises InputError if the name of an
    effect is already the name of another part."""
    choices = scene.choices
    if taken := sorted(RESERVED & choices.effects.keys()):
        raise InputError(
            f"the effect {taken[0]} cannot be used: a run keeps a part of its own under this name in checkpoints; its "
            f"decide must give another name, none of {', '.join(sorted(RESERVED))}"
        )
    found: dict[str, RunPart[Any]] = {
        "row": _RowPart(scene),
        "contact": _ContactPart(scene),
        "law": choose_contact_law(scene),
        "material": scene.material,
        "errors": BudgetPart(remembers(scene.material), scene.energy is not None),
    }
    if scene.energy is not None:
        found["energy"] = scene.energy
    if choices.timeline.chooses:
        found["steps"] = _ChosenStepsPart(scene)
    if scene.controller.follows:
        found["tolerance"] = TolerancePart()
    return found | dict(scene.effects)


@dataclass(frozen=True)
class _RowPart:
    """Record of the last step: distance and measures. Checkpoints have step and time on their own."""

    scene: Scene

    def at_rest(self) -> StepRow:
        """Return the record of the initial state, in which the surface just touches the body without load."""
        setup = self.scene.setup
        highest = setup.heights.highest
        return StepRow(
            measures=Measures(approach=0.0 - highest - setup.surface.datum, mean_gap=highest - setup.heights.mean)
        )

    def entries(self, memory: StepRow, units: Units) -> dict[str, Entry]:
        measures = {name: Entry(float(value)) for name, value in asdict(memory.measures).items()}
        return {"distance": Entry(memory.distance, 1.0, "m"), **measures}

    def restored(self, memory: StepRow, saved: Saved) -> StepRow:
        kinds: dict[str, type] = {each.name: type(each.default) for each in fields(Measures)}
        measures = Measures(**{name: kind(saved[name]) for name, kind in kinds.items()})
        return StepRow(distance=float(saved["distance"]), measures=measures)


@dataclass(frozen=True)
class _ContactPart:
    """The last pressures, the positions of the surface, and the last approach."""

    scene: Scene

    def at_rest(self) -> PreviousContacts:
        choices, setup, slab = self.scene.choices, self.scene.setup, self.scene.slab
        count = 1 + choices.extrapolated_starts.on + FURTHER * choices.further_starts.on
        pressures = tuple(PreviousPressure(slab.zeros()) for _ in range(count))
        return PreviousContacts(pressures, slab.zeros(), -setup.heights.highest / setup.units.height)

    def entries(self, memory: PreviousContacts, units: Units) -> dict[str, Entry]:
        """Return checkpoint entries for the last pressures with their moduli and positions, numbered backwards in
        steps. All but the last are optional."""
        found = {"approach": Entry(memory.approach, units.height, "m")}
        for ago, past in enumerate(memory.pressures):
            of_past = {
                "pressure": Entry(past.pressure, units.height / units.length, optional=ago > 0),
                "modulus": Entry(past.alpha, units.modulus, "Pa", optional=ago > 0),
                "position": Entry(np.array(past.position), 1.0, "m", optional=ago > 0),
            }
            found |= {_name(name, ago): entry for name, entry in of_past.items()}
        return found

    def restored(self, memory: PreviousContacts, saved: Saved) -> PreviousContacts:
        """Return the pressures of a checkpoint, whose maps have been read; missing pressures are marked as unknown."""
        pasts = []
        for ago, past in enumerate(memory.pressures):
            known = all(_name(name, ago) in saved for name in ("pressure", "modulus", "position"))
            x, y = saved[_name("position", ago)].tolist() if known else (0.0, 0.0)
            alpha = float(saved[_name("modulus", ago)]) if known else 0.0
            pasts.append(PreviousPressure(past.pressure, alpha, (x, y)))
        return replace(memory, pressures=tuple(pasts), approach=float(saved["approach"]))


def _name(what: str, ago: int) -> str:
    """Return the name in a checkpoint of a quantity some steps before the last one."""
    return f"earlier {what} {ago}" if ago else what


@dataclass(frozen=True)
class _ChosenStepsPart:
    """The steps that stages have chosen."""

    scene: Scene

    def at_rest(self) -> ChosenSteps:
        return ChosenSteps.from_job(self.scene.job)

    def entries(self, memory: ChosenSteps, units: Units) -> dict[str, Entry]:
        numbers = memory.numbers().items()
        return {name: Entry(np.array(value), 1.0, symbol, optional=True) for name, (value, symbol) in numbers}

    def restored(self, memory: ChosenSteps, saved: Saved) -> ChosenSteps:
        return ChosenSteps.from_job(self.scene.job, saved)


# -- first states -----------------------------------------------------------------------------------------------------


def first_state(scene: Scene, body: BodyMemory | None = None) -> State:
    """Return the state of a run before the first step. `body` is the memory of the body, if it exists already. All
    other maps of the state are new."""
    parts = parts_of(scene)
    given = {} if body is None else {"material": body}
    return completed(scene, State({name: part.at_rest() for name, part in parts.items() if name not in given} | given))


def pressed_state(scene: Scene, state: State, row: StepRow, pressure: Array, approach: float) -> State:
    """Return the first state of a run that begins under a constant `pressure`. The pressure is copied. The friction
    coefficient of the body before the first step is taken from `row`."""
    newest, others = state.contact.pressures[:2], state.contact.pressures[2:]
    for past in newest:
        past.pressure[...] = pressure
    pasts = (*(past._replace(alpha=1.0) for past in newest), *others)
    contact = PreviousContacts(pasts, state.contact.spare, approach)
    friction = row.measures.friction - row.measures.friction_interface
    return completed(scene, state.after(row=row, contact=contact, errors=ErrorMemory(friction, state.errors)))


def completed(scene: Scene, state: State) -> State:
    """Return the state with a complete record of the last step: the energies [J] and the columns of effects are added
    to `row`."""
    work, stored, lost, split = energies_of(scene, state.energy, state.memories)
    added = effect_values(scene.effects, state.memories)
    error = math.nan if state.row.step else error_of_energies(scene, 0.0, 0.0, state.memories)
    row = replace(state.row, work=work, stored=stored, dissipated=lost, error_energy=error)
    row = replace(row, branch_dissipation=split, added=added)
    return state.after(row=row)


def energies_of(
    scene: Scene, memory: EnergyMemory | None, of_effects: Memories
) -> tuple[float, float, float, tuple[float, ...]]:
    """Return work, stored and dissipated energy [J], and the energy dissipated in each branch; NaN without energies.
    The work is done on the body, unless an effect computes the work of the load. `of_effects` maps the names of effects
    to their memories."""
    if scene.energy is None or memory is None:
        return math.nan, math.nan, math.nan, ()
    unit, dissipated = scene.energy.unit, memory.dissipated
    counted = (effect.work(of_effects[name]) for name, effect in scene.effects.items())
    work, stored = next((work for work in counted if work is not None), memory.work * unit), memory.stored * unit
    for name, effect in scene.effects.items():
        if (further := effect.further_energies(of_effects[name])) is not None:
            energy, outside = further
            work, stored = work + energy.work * unit + outside, stored + energy.stored * unit
            dissipated = dissipated + energy.dissipated
    lost = tuple(float(value) * unit for value in dissipated)
    return work, stored, math.fsum(lost), lost


def error_of_energies(scene: Scene, summed: float, of_stored: float, of_effects: Memories) -> float:
    """Return the error of the energies [J] since the start; NaN without energies or if unknown.

    An effect may compute this error. Otherwise it is the sum of two parts: the error `summed` over all steps, and
    ENERGY times `of_stored`. `of_stored` [J] is the stored energy times the relative error of the area.
    """
    if scene.energy is None:
        return math.nan
    found = (effect.error_energy(of_effects[name]) for name, effect in scene.effects.items())
    error = next((error for error in found if error is not None), summed + ENERGY.value * of_stored)
    return error if math.isfinite(error) else math.nan


# -- checkpoints ------------------------------------------------------------------------------------------------------


def entries(scene: Scene, state: State) -> dict[str, Entry]:
    """Return all entries of a run by their names `part/name` in checkpoints; maps are not copied."""
    found: dict[str, Entry] = {}
    for name, part in parts_of(scene).items():
        found |= with_part(name, part.entries(state.memories[name], scene.units))
    return found


def save_state(path: Path, scene: Scene, state: State, facts: Facts) -> None:
    """Write a checkpoint of a state, with the algorithms that FFTW has chosen for transforms; collective. Raises
    RunError."""
    everything = {**entries(scene, state), "plans/all": Entry(wisdom.gather(scene.slab))}
    checkpoint.write_checkpoint(path, scene.slab, replace(facts, step=state.row.step, time=state.row.time), everything)


def restored(scene: Scene, state: State, contents: Contents) -> State:
    """Return the state that a checkpoint holds, in the maps of `state`; collective. Raises InputError if the checkpoint
    lacks an entry or belongs to another body."""
    _refuse_lost_branches(scene, contents)
    declared = entries(scene, state)
    wanted = {name: entry for name, entry in declared.items() if not entry.optional or name in contents.units}
    _compare(contents, wanted)
    checkpoint.read_maps(contents, scene.slab, wanted)
    saved = {name: _value(name, entry, contents) for name, entry in wanted.items()}
    memories: Mapping[str, Any] = {
        name: part.restored(state.memories[name], part_of(name, saved)) for name, part in parts_of(scene).items()
    }
    row = replace(memories["row"], step=contents.step, time=contents.time)
    scene.relax(memories)
    return completed(scene, State({**memories, "row": row}))


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
    """Raise InputError if a branch had no map when the checkpoint was written, because it relaxed too fast, and needs
    one for shorter steps: its memory is lost."""
    if "material/frozen" not in contents.numbers:
        return
    for k in scene.folded.kept:
        if f"material/branch {k}" in contents.maps or contents.numbers["material/frozen"][k]:
            continue
        error, allowed = scene.folded.memoryless_errors[k], contents.job["numerics"]["branch_error"]
        if error > allowed:
            time = scene.setup.prony.relaxation_times[k]
            raise InputError(
                f"{contents.path} does not have the branch of relaxation time {time:g} s, which relaxed within every "
                f"step of its run. The next steps are shorter: without it the error of friction would be {error:.2g}; "
                f"numerics.branch_error is {allowed:g}. Take longer steps, or start afresh (--restart never)"
            )
