"""A march: a scene, its state, and the loop over the steps of a timeline. After each step the tasks of the caller are
done.

`make_step` returns the next state of a scene and leaves the state before it unchanged. A step begins the body, solves
the contact, measures, commits the body, estimates errors, and updates effects. A step that is rejected or fails is
dropped; nothing has to be undone. No map of the old state is copied or changed by a step: the new pressure is in the
spare map of the state. The new displacement is in a map of the solver's workspace, and the workspace gets the map of
the old displacement in exchange. Operations in place come last, when nothing can fail.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..contact.problem import Approach, Control, MeanPressure
from ..effects.effect import (
    Changes,
    Detached,
    EdgeMotion,
    Instant,
    PreviousContacts,
    PreviousPressure,
    Sheared,
    effect_values,
    nothing_holds,
)
from ..errors import InputError
from ..files.checkpoint import Contents, Facts
from ..files.recorder import StepRow
from ..job.calculation import FIELDS_NEED, components_of
from ..job.history import MadeStep, Step, Timeline
from ..parallel.slab import Array
from ..physics.body import Trial, remembers, states_errors, surface_of
from ..physics.energy import EnergyMemory, Pressed
from ..physics.records import Entry
from . import laws
from .budget import ErrorBudget, ErrorSums, add_shear
from .laws import DetachedError, StepError, cells_moved, choose_contact_law
from .scene import Scene
from .state import (
    ErrorMemory,
    SolvedStep,
    State,
    StepErrors,
    add_energy_error,
    energies_of,
    entries,
    error_of_energies,
    estimate_errors,
    first_state,
    restored,
    save_state,
)


@dataclass(frozen=True)
class _Made:
    """An accepted step: its solution, errors and motion, and its record if it was chosen."""

    solved: SolvedStep
    errors: StepErrors
    motion: EdgeMotion
    verdict: MadeStep | None


def make_step(scene: Scene, state: State, step: Step) -> State:
    """Return the state after a step, or after a shorter step if the errors are too large; collective. Raises
    StepError."""
    began, calls = time.perf_counter(), scene.slab.tally["operator"]
    made = _accepted(scene, state, step)
    solved, errors, contact = made.solved, made.errors, made.solved.contact
    energy = _advance_energy(scene, state, solved)
    changes, sheared = _follow(scene, state, made, energy)
    if state.chosen is not None and made.verdict is not None:
        turned = max((each.turned for each in changes.values()), default=0.0)
        state.chosen.add(scene.controller.limit(made.verdict, made.solved.step.dt, turned))
    if solved.body.displacement is scene.solver.workspace.pressure:
        scene.solver.workspace.pressure = surface_of(state.body)
    step, last = solved.step, state.contact.last
    followed = {name: each.memory for name, each in changes.items()}
    measures = solved.measures if sheared is None else sheared.measures
    stated = all(each.states_errors for each in changes.values()) and not measures.at_edge and errors.resolved
    errors = replace(errors, budget=_budget_of(made, sheared))
    work, stored, lost, split = energies_of(scene, energy, followed)
    known = errors if stated and states_errors(scene.material) else None
    of_energy = add_energy_error(state.memories["errors"].energy, known, sheared, lost - state.row.dissipated)
    error_energy = error_of_energies(scene, of_energy, errors.of_area * stored, followed)
    passed = f"replaces {step.passed} further steps: at rest, under a constant load, nothing changes"
    remarks = (solved.of_law.remark, *(each.remark for each in changes.values()), passed if step.passed else "")
    row = StepRow(
        step.number,
        step.time,
        state.row.distance + math.dist(step.position, last.position),
        measures,
        contact.iterations,
        contact.certificate,
        scene.slab.tally["operator"] - calls,
        work,
        stored,
        lost,
        error_energy,
        split,
        seconds=time.perf_counter() - began,
        remark="; ".join(f"{laws.describe_place(scene, step)}: {remark}" for remark in remarks if remark),
        errors=errors.budget if stated else None,
        added=effect_values(scene.effects, followed),
    )
    pressure = PreviousPressure(contact.p, solved.trial.alpha, step.position)
    pasts = state.contact.pressures
    return state.after(
        row=row,
        contact=PreviousContacts((pressure, *pasts[:-1]), pasts[-1].pressure, contact.d),
        law=solved.of_law.memory,
        material=solved.body,
        errors=ErrorMemory(errors.friction, state.errors, of_energy),
        energy=energy,
        tolerance=scene.controller.learn(state.tolerance, contact.certificate.worst, errors.lasting),
        **followed,
    )


def _accepted(scene: Scene, state: State, step: Step) -> _Made:
    """Solve a step, or a shorter one if its errors are too large; collective. Raises StepError, and DetachedError if
    the surfaces detach even in the shortest step."""
    law = choose_contact_law(scene)
    while True:
        try:
            solved = _solve(scene, state, step)
        except (DetachedError, StepError):
            shorter = step.decide(0.0, math.inf) if step.decide is not None and law.may_shorten else None
            if not isinstance(shorter, Step):
                raise
            step = shorter
            continue
        errors = estimate_errors(scene, state.friction, solved)
        motion = law.motion(solved.of_law, state.row.measures, solved.measures)
        if step.decide is None:
            return _Made(solved, errors, motion, None)
        error = 0.0 if motion.untouched else scene.slab.agree(errors.step)
        verdict = step.decide(error, motion.front, motion.begins)
        if not isinstance(verdict, Step):
            return _Made(solved, errors, motion, verdict)
        step = verdict


def _solve(scene: Scene, state: State, step: Step) -> SolvedStep:
    """Solve a step, measure it and commit the body; collective. Raises StepError and DetachedError."""
    body, law, before = scene.material, choose_contact_law(scene), state.row.measures
    trial = body.begin(state.body, step.dt, scene.motion.at(step.position), step.growth)
    control, tolerance = _control(scene, step, trial), scene.controller.tolerance(state.tolerance, step)
    of_law = law.solve(trial, step, control, state.law, state.contact, before, tolerance)
    contact = of_law.contact
    if of_law.end == "detached":
        raise DetachedError(step.time, step.load)
    if contact.failure and not laws.accepts(scene, contact):
        moved = math.hypot(*cells_moved(scene, step, state.contact.last.position))
        raise laws.of_solve(scene, step, contact, contact, [], trial.effective, moved)
    maps = contact.p, trial.alpha, contact.u, trial.effective, contact.d, of_law.touching
    measures = scene.probe.measure(*maps, step.position, step.velocity, of_law.least_load)
    if not measures.finite:
        raise laws.not_finite(scene, step, measures)
    memory = body.commit(state.body, trial, contact.u, scene.solver.workspace.pressure)
    return SolvedStep(step, trial, of_law, measures, memory)


def _control(scene: Scene, step: Step, trial: Trial) -> Control:
    """Return the prescribed load of a step in the run's units; collective. Raises StepError."""
    grid = scene.choices.grid
    if step.control == "approach":
        laws.refuse_beyond_full_contact(scene, step, trial.effective)
        return Approach((step.load + scene.setup.surface.datum) / scene.units.height)
    mean = step.load / (grid.lx * grid.ly) if step.control == "force" else step.load
    return MeanPressure(mean / (trial.alpha * scene.units.pressure))


def _advance_energy(scene: Scene, state: State, solved: SolvedStep) -> EnergyMemory | None:
    """Return the energies of the body after a step; None without energies; collective."""
    if scene.energy is None or state.energy is None:
        return None
    last = state.contact.last
    now, before = Pressed(solved.contact.p, solved.trial.alpha), Pressed(last.pressure, last.alpha)
    step, body = solved.step, solved.body
    energy = scene.energy.advance(state.energy, step.dt, now, before, solved.contact.u, body, step.growth)
    return energy.without_work(state.energy) if solved.of_law.end == "open" else energy


def _follow(
    scene: Scene, state: State, made: _Made, energy: EnergyMemory | None
) -> tuple[dict[str, Changes[Any]], Sheared | None]:
    """Return the changes by effects in a step, and update the relaxation of the body; collective."""
    solved, u, gained, dissipated = made.solved, made.solved.body.displacement, math.nan, math.nan
    assert u is not None
    if energy is not None and state.energy is not None and scene.energy is not None:
        now, old = ((each.stored, float(each.dissipated.sum())) for each in (energy, state.energy))
        dissipated = scene.energy.unit * (now[1] - old[1])
        gained = scene.energy.unit * (now[0] - old[0]) + dissipated
    (x, y), (x_before, y_before) = solved.step.position, state.contact.last.position
    instant = Instant(
        solved.step,
        solved.of_law,
        solved.trial.alpha,
        u,
        state.row.measures,
        solved.measures,
        (x - x_before, y - y_before),
        gained,
        dissipated,
        made.motion.front,
        made.motion.untouched,
        made.errors.of_friction,
        made.errors.of_area,
    )
    changes = dict[str, Changes[Any]]()
    for name, effect in scene.effects.items():
        changes[name] = effect.follow(instant, state.memories[name])
        if (sheared := changes[name].sheared) is not None:
            errors = replace(made.errors, budget=_budget_of(made, sheared))
            instant = replace(instant, sheared=sheared, error_friction=errors.of_friction)
    scene.relax({name: each.memory for name, each in changes.items()})
    return changes, instant.sheared


def _budget_of(made: _Made, sheared: Sheared | None) -> ErrorBudget | None:
    """Return the error budget of a step, with that of tractions along the surface; None where nothing touches."""
    budget = made.errors.budget
    if budget is None or sheared is None:
        return budget
    body, now = made.solved.measures.friction, sheared.measures
    errors = sheared.error, sheared.share, sheared.time, sheared.mesh
    return add_shear(budget, body, now.friction_interface, now.friction, *errors)


FIELDS_OF_EFFECTS = {part: need for name, need in FIELDS_NEED.items() for part in components_of(name)}


class March:
    """A calculation in time: a scene and its state at an instant. A march advances step by step."""

    def __init__(self, scene: Scene, state: State | None = None) -> None:
        self.scene = scene
        self.state = self._weighed(first_state(scene) if state is None else state)

    @property
    def row(self) -> StepRow:
        return self.state.row

    @property
    def detached(self) -> str:
        """A sentence if the surfaces have detached and no step follows; '' otherwise."""
        row, end = self.row, choose_contact_law(self.scene).detached(self.state.law)
        if end is None:
            return ""
        time, load = end
        lost = nothing_holds(self.timeline(time).span(row.step + 1).stage.control, load)
        last = f"the last equilibrium was at {row.measures.pressure:g} Pa, t = {row.time:g} s"
        return f"detached at t = {time:g} s: {lost}; {last}"

    def timeline(self, until: float = 0.0) -> Timeline:
        """Return all steps of the history (`Timeline.from_job`), including the steps chosen so far."""
        return Timeline.from_job(self.scene.job, until, self.state.chosen)

    def steps(self, timeline: Timeline | None = None, until: float | None = None) -> Iterator[Step]:
        """Yield the steps that follow the last step made; collective. Each step is chosen only when the iterator
        reaches it. A step that replaces several steps of the timeline ends no later than the first step of the timeline
        that reaches `until` [s]."""
        timeline = self.timeline() if timeline is None else timeline
        stop = len(timeline) if until is None else timeline.first_reaching(until)
        while self.row.step < len(timeline) and not self.detached:
            yield next_step(self.scene, self.state, timeline, stop)

    def advance(self, step: Step) -> StepRow:
        """Make a step and return its record; collective. Raises StepError and keeps the state if the step fails."""
        try:
            self.state = self._weighed(make_step(self.scene, self.state, step), self.row)
        except DetachedError as end:
            memory = choose_contact_law(self.scene).with_end(self.state.law, Detached(end.time, end.load))
            self.state = self.state.after(law=memory)
        return self.row

    def _weighed(self, state: State, since: StepRow | None = None) -> State:
        """Return the state with its errors added to the sums; the sums begin with a first state."""
        row = state.row
        if row.errors is None:
            return state
        friction = row.measures.friction if row.distance > 0.0 else 0.0
        if since is None:
            return self._with_sums(state, ErrorSums().plus(row.errors, friction, 0.0))
        seconds, slid = row.time - since.time, row.distance - since.distance
        return self._with_sums(state, state.errors.plus(row.errors, friction, seconds, slid))

    @staticmethod
    def _with_sums(state: State, sums: ErrorSums) -> State:
        return state.after(errors=replace(state.memories["errors"], sums=sums))

    def restore(self, contents: Contents) -> None:
        """Restore the state of a checkpoint; collective. Raises InputError if the checkpoint lacks an entry or belongs
        to another body."""
        self.state = restored(self.scene, self.state, contents)

    def entries(self) -> dict[str, Entry]:
        """Return all entries of a checkpoint by their names; maps are not copied."""
        return entries(self.scene, self.state)

    def save(self, path: Path, facts: Facts) -> None:
        """Write a checkpoint; collective. Raises RunError."""
        save_state(path, self.scene, self.state, facts)

    def field(self, name: str) -> Array:
        """Return this rank's rows of a field as a new array, shape (rows of this rank, nx); collective.

        The fields are `pressure` [Pa], `displacement`, `gap` and `height` [m], and fields of effects, such as the rise
        of `temperature` [K]. `height` belongs to the rigid surface at its present position, so that `gap = displacement
        - height - approach`. Raises InputError for a field of an effect that the job does not use.
        """
        scene, state, units = self.scene, self.state, self.scene.units
        last, gap = state.contact.last, choose_contact_law(scene).gap(state.law)
        for part, effect in scene.effects.items():
            if name in effect.fields:
                return effect.field(state.memories[part], name)
        if name in FIELDS_OF_EFFECTS:
            raise InputError(f"there is no field {name!r} without {FIELDS_OF_EFFECTS[name]} in the job")
        if name == "gap" and gap is not None:
            return gap * units.height
        if name == "pressure":
            return last.pressure * (last.alpha * units.pressure)
        if name == "displacement":
            return self._displacement() * units.height
        if name == "height":
            return scene.heights(last.position) * units.height + scene.setup.surface.datum
        return scene.gap(self._displacement(), last.position, state.contact.approach)

    def _displacement(self) -> Array:
        """Return the displacement of the body, computed from the pressure if needed; collective."""
        scene, last = self.scene, self.state.contact.last
        image, apply = scene.solver.workspace.displacement, scene.operators.operator.apply
        return scene.material.displacement(self.state.body, lambda: apply(last.pressure, image), last.alpha)


def next_step(scene: Scene, state: State, timeline: Timeline, stop: int) -> Step:
    """Return the step after the last one made.

    At rest under a constant load a body without memory does not change. One step then replaces further steps of a stage
    whose time steps grow. It ends with the first of three steps: the next one after which fields are written, the step
    with the number `stop`, and the last one of the stage. The decision follows from the state, so that it is the same
    after a restart.
    """
    number = state.row.step + 1
    span = timeline.span(number)
    if state.chosen is not None and span.stage.chooses and span.place(number) > 0:
        return scene.controller.propose(state.chosen, span, number)
    if remembers(scene.material) or not span.rests or span.place(number) < 1:
        return span.step(number)
    output = scene.choices.output
    due = [-(-number // output.every) * output.every] if output.fields else []
    target = min([span.last, *due, *([stop] if stop >= number else [])])
    return span.leap(number, target) if target > number else span.step(number)


Task = Callable[[March], bool | None]


def run_steps(march: March, tasks: Sequence[Task], steps: Iterable[Step] | None = None) -> bool:
    """Advance the march step by step, and do the tasks in order after each step, until a task returns True.

    If `steps` is None, all steps of the job are made, and the tasks are also done before the first step. Return True if
    a task has ended the march.
    """
    if steps is None:
        if run_tasks(march, tasks):
            return True
        steps = march.steps()
    for step in steps:
        march.advance(step)
        if march.detached:
            return False
        if run_tasks(march, tasks):
            return True
    return False


def run_tasks(march: March, tasks: Sequence[Task]) -> bool:
    """Do all tasks. Return True if a task ends the march."""
    return any([task(march) for task in tasks])  # noqa: C419  # all tasks run, also when one ends the march
