"""One step: `make_step` returns the next state of a scene and leaves the state from which it begins as it was.

A step that its judge rejects, or that fails, is dropped; nothing has to be taken back. No map is copied for that: the
new pressure is in the spare map of the state, the new displacement in one of the solver's workspace, which has the map
of the old one in its place when the step has been made. What works in place comes last, when nothing can fail.
"""

import math
import time
from dataclasses import replace
from functools import partial

import numpy as np

from ..effects.effect import Instant, values_of
from ..history.chosen import MadeStep
from ..history.timeline import Step
from ..physics.body import Trial, surface_of
from ..physics.energy import EnergyMemory, Pressed
from ..scene import Scene, solver_on, solver_on_tiles
from ..solve.contact import Contact
from ..solve.fallback import cold_start, retry
from ..solve.problem import Approach, MeanPressure, Problem
from ..storage.row import Row
from . import failure, sticking, sticking_energies
from .errors import Estimate, Solved, estimate_errors
from .failure import DetachedError, StepError
from .starts import Past, cells_moved, make_start
from .state import State, energies_of


def make_step(scene: Scene, state: State, step: Step) -> State:
    """Return the state after a step, or after a shorter one if its judge asks for that; collective.

    Raises StepError when that cannot be.
    """
    began, calls = time.perf_counter(), scene.slab.tally["operator"]
    solved, errors, verdict = _accepted(scene, state, step)
    step, contact, slid = solved.step, solved.contact, math.dist(solved.step.position, state.position)
    energy = _advance_energy(scene, state, solved)
    if solved.stuck is not None and energy is not None:
        solved = replace(solved, stuck=_count_energies(scene, state, solved, energy))
    if solved.stuck is not None and (solved.stuck.snapped or _loses(state, solved)):
        solved, errors = replace(solved, stuck=solved.stuck.noted()), replace(errors, budget=None)
    if solved.measures.at_edge:  # of what the box cuts off no estimate knows
        errors = replace(errors, budget=None)
    _tell_effects(scene, solved, slid)
    if state.chosen is not None and verdict is not None:
        state.chosen.add(verdict)
    if solved.body.displacement is scene.solver.workspace.pressure:
        scene.solver.workspace.pressure = surface_of(state.body)
    row = Row(
        step.number,
        step.time,
        state.row.distance + slid,
        solved.measures,
        contact.iterations,
        contact.certificate,
        scene.slab.tally["operator"] - calls,
        *energies_of(scene, energy, None if solved.stuck is None else solved.stuck.memory),
        seconds=time.perf_counter() - began,
        remark=solved.remark,
        errors=errors.budget,
        added=values_of(scene.followers),
    )
    return replace(
        state,
        row=row,
        pasts=(Past(contact.p, solved.trial.alpha, step.position), *state.pasts[:-1]),
        spare=state.pasts[-1].pressure,
        body=solved.body,
        energy=energy,
        approach=contact.d,
        friction=errors.friction,
        sticking=None if solved.stuck is None else solved.stuck.memory,
        tolerance=state.tolerance.after(scene, contact, errors.lasting),
    )


def _advance_energy(scene: Scene, state: State, solved: Solved) -> EnergyMemory | None:
    """Return the energies after a step; collective."""
    if scene.energy is None or state.energy is None:
        return None
    now, before = Pressed(solved.contact.p, solved.trial.alpha), Pressed(state.pressure, state.alpha)
    energy = scene.energy.advance(state.energy, solved.step.dt, now, before, solved.contact.u, solved.body)
    apart = solved.stuck is not None and _stay_apart(state, solved.stuck)
    return energy.without_work(state.energy) if apart else energy


def _accepted(scene: Scene, state: State, step: Step) -> tuple[Solved, Estimate, MadeStep | None]:
    """Solve a step, or the shorter one that its judge asks for; returns also its errors, and how it is noted;
    collective. Raises StepError, and DetachedError where nothing holds the load of the shortest step."""
    while True:
        try:
            solved = _solve(scene, state, step)
        except (DetachedError, StepError):
            shorter = None if step.judge is None or state.sticking is None else step.judge(0.0, math.inf)
            if not isinstance(shorter, Step):
                raise
            step = shorter
            continue
        errors = estimate_errors(scene, state.friction, solved)
        if step.judge is None:
            return _remarked(scene, state, solved), errors, None
        error = scene.slab.agree(errors.step)
        if solved.stuck is None:
            verdict = step.judge(error)
        elif sticking.is_apart(solved.stuck, state.row.measures, solved.measures):
            verdict = step.judge(0.0)
        else:
            front = _front(scene, state, solved)
            verdict = step.judge(error, front)
            snapped = solved.stuck.snapped or front > sticking.SNAP_FRONT
            solved = replace(solved, stuck=solved.stuck._replace(snapped=snapped))
        if not isinstance(verdict, Step):
            return solved, errors, verdict
        step = verdict


def _remarked(scene: Scene, state: State, solved: Solved) -> Solved:
    """Return a step of a viscoelastic contact with adhesion with what to say if it is too long, once in a run."""
    stuck, step = solved.stuck, solved.step
    if stuck is None or stuck.memory.told or step.jump or scene.material.branched is None:
        return solved
    front = _front(scene, state, solved)
    if front <= sticking.SNAP_FRONT:
        return solved
    remark = (
        f"{failure.where(scene, step)}: the edge of contact moves by {0.5 * front:.2g} times a process zone, and rates "
        "are resolved up to half of one: use shorter steps, or time_step: auto; further steps are not looked at"
    )
    memory = replace(stuck.memory, told=True)
    return replace(solved, stuck=stuck._replace(memory=memory), remark=solved.remark or remark)


def _loses(state: State, solved: Solved) -> bool:
    """Return whether a step has lost energy in a snap, where energies are counted."""
    stuck, past = solved.stuck, state.sticking
    if stuck is None or past is None or sticking.is_apart(stuck, state.row.measures, solved.measures):
        return False
    return stuck.memory.energies.lost > past.energies.lost


def _front(scene: Scene, state: State, solved: Solved) -> float:
    """Return how far the edge of a contact with adhesion has moved in a step, in half process zones."""
    if solved.stuck is None:
        return 0.0
    return sticking.front_of(scene, solved.stuck.flips, state.row.measures, solved.measures)


def _count_energies(scene: Scene, state: State, solved: Solved, energy: EnergyMemory) -> sticking.StuckContact:
    """Return a contact with adhesion with its energies, after those of the body; collective."""
    assert scene.energy is not None
    assert state.energy is not None
    assert solved.stuck is not None
    kept, old = ((each.stored, float(each.dissipated.sum())) for each in (energy, state.energy))
    body = scene.energy.unit * ((kept[0] - old[0]) + (kept[1] - old[1]))
    stuck, memory = solved.stuck, solved.stuck.memory
    (x, y), (x_before, y_before) = solved.step.position, state.position
    changes = body, state.row.measures, solved.measures, (x - x_before, y - y_before)
    energies, load = memory.energies, (memory.pasts[0].gap, solved.trial, stuck.pushed, stuck.detached)
    if not _stay_apart(state, stuck):
        energies = sticking_energies.after_step(scene, energies, *load, *changes)
    columns = (*stuck.columns[:2], energies.surfaces, energies.lost)
    return stuck._replace(memory=replace(memory, energies=energies), columns=columns)


def _tell_effects(scene: Scene, solved: Solved, slid: float) -> None:
    """Tell the effects that follow the steps of one that was made; collective."""
    u, stuck = solved.body.displacement, solved.stuck
    assert u is not None
    numbers = None if stuck is None else stuck.columns
    for follower in scene.followers.values():
        maps = solved.contact.p, solved.trial.alpha, u, solved.touching
        follower.follow(Instant(solved.step, *maps, slid, solved.measures, numbers))


# -- the contact of a step ---------------------------------------------------------------------------------------------


def _solve(scene: Scene, state: State, step: Step) -> Solved:
    """Solve a step, measure it and let the body go on; collective. Raises StepError."""
    body = scene.material
    trial = body.begin(state.body, step.dt, scene.motion.at(step.position))
    control = _control(scene, step, trial)
    if state.sticking is not None:
        return _solve_stuck(scene, state, step, trial, control)
    tolerance = state.tolerance.of(scene, step)
    solver, contact = scene.solver, None
    problem = Problem(*scene.operators, trial.effective, scene.constraint(trial.alpha), control)
    make_start(scene, state.pasts, step, trial.alpha, state.spare)
    if state.alpha == 0.0:  # nothing has been solved before
        on = partial(solver_on, scene.setup)
        contact = cold_start.prepare(solver, problem, state.spare, on, solver_on_tiles(scene.setup))
    contact, remark = contact or solver.solve(problem, state.spare, tolerance=tolerance), ""
    if contact.failure:
        contact, remark = _retry(scene, state, step, problem, contact)
    if step.passed:
        remark = "; ".join(filter(None, (remark, _passed(scene, step))))
    touching = problem.constraint.touches(contact.p)
    maps = contact.p, trial.alpha, contact.u, trial.effective, contact.d, touching
    measures = scene.probe.measure(*maps, step.position, step.velocity)
    if not measures.finite:
        raise failure.not_finite(scene, step, measures)
    memory = body.commit(state.body, trial, contact.u, scene.solver.workspace.pressure)
    return Solved(step, trial, contact, touching, measures, memory, remark)


def _solve_stuck(scene: Scene, state: State, step: Step, trial: Trial, control: MeanPressure | Approach) -> Solved:
    """Solve a step with adhesion, measure it and let the body go on; collective. Raises StepError."""
    assert state.sticking is not None
    path = _path(scene, state, trial, control)
    stuck, remark = sticking.solve(scene, state.sticking, step, trial, path, state.spare), ""
    if stuck.detached:
        if not scene.goes_on_open:
            raise DetachedError(step.time, step.load)
        stuck, sentence = sticking.open_up(scene, stuck, trial), failure.nothing_holds(step.control, step.load)
        if _stay_apart(state, stuck):
            stuck = stuck._replace(snapped=False)
        else:
            remark = f"{failure.where(scene, step)}: {sentence}"
    contact = stuck.contact
    if contact.failure and not _accepts(scene, contact):
        moved = math.hypot(*cells_moved(scene, step, state.position))
        raise failure.of_solve(scene, step, contact, contact, [], trial.effective, moved)
    _, pull, *_ = stuck.columns
    maps = contact.p, trial.alpha, contact.u, trial.effective, contact.d, stuck.touching
    measures = scene.probe.measure(*maps, step.position, step.velocity, pull)
    if not measures.finite:
        raise failure.not_finite(scene, step, measures)
    memory = scene.material.commit(state.body, trial, contact.u, scene.solver.workspace.pressure)
    return Solved(step, trial, contact, stuck.touching, measures, memory, remark, stuck=stuck)


def _stay_apart(state: State, stuck: sticking.StuckContact) -> bool:
    """Return whether nothing holds the load of a step, as nothing did before it."""
    return stuck.detached and state.row.measures.contact_area == state.row.measures.pressure == 0.0


def _path(scene: Scene, state: State, trial: Trial, control: MeanPressure | Approach) -> sticking.Path:
    """Return the way of what is prescribed since the last step, in the run's units."""
    pressure = state.row.measures.pressure / (trial.alpha * scene.units.pressure)
    if isinstance(control, MeanPressure):
        together = control.value >= 0.0 and state.row.measures.contact_area == 0.0
        return sticking.Path(0.0 if together else pressure, control, state.approach, pressure, together)
    approach = state.approach if state.alpha else min(state.approach, control.value)  # nothing came nearer than this
    return sticking.Path(approach, control, approach, pressure)


def _control(scene: Scene, step: Step, trial: Trial) -> MeanPressure | Approach:
    """Return what the load of a step prescribes, in the run's units; collective. Raises StepError."""
    grid = scene.choices.grid
    if step.control == "approach":
        failure.refuse_beyond_full_contact(scene, step, trial.effective)
        return Approach((step.load + scene.setup.surface.datum) / scene.units.height)
    mean = step.load / (grid.lx * grid.ly) if step.control == "force" else step.load
    return MeanPressure(mean / (trial.alpha * scene.units.pressure))


def _retry(scene: Scene, state: State, step: Step, problem: Problem, failed: Contact) -> tuple[Contact, str]:
    """Retry a solve that failed, unless the job takes it as it is: then only in double precision.

    Returns the contact, and what to say of it; collective. Raises StepError when nothing helps.
    """
    single, would_do = failed.u.dtype == np.float32, _accepts(scene, failed)
    in_double = (lambda: scene.in_double) if single else None
    if would_do and in_double is None:
        return failed, ""
    on, most = partial(solver_on, scene.setup), 1 if would_do else None
    contact, tried = retry.retry_solve(scene.solver, problem, failed, on, in_double, most)
    if contact.failure:
        if would_do and _accepts(scene, contact):
            return contact, ""
        moved = math.hypot(*cells_moved(scene, step, state.position))
        raise failure.of_solve(scene, step, failed, contact, tried, problem.heights, moved)
    what = f"{failure.where(scene, step)}: the contact solve {failed.failure}"
    return contact, f"{what}; solved when retried with {', with '.join(tried)}"


def _accepts(scene: Scene, contact: Contact) -> bool:
    """Return whether the job takes a solve that did not reach the tolerance."""
    return scene.choices.numerics.accept_unconverged and math.isfinite(contact.certificate.worst)


def _passed(scene: Scene, step: Step) -> str:
    """Return what to say of a step that stands for several."""
    what = f"{failure.where(scene, step)} takes the place of {step.passed} steps more"
    return f"{what}: at rest, under a constant load, nothing changes"
