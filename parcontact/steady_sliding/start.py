"""Start of a march from steady sliding: contact, displacement and branches of a surface that has always slid."""

from dataclasses import replace
from typing import Any

from ..accuracy.controller import tolerance_before
from ..job import Job
from ..march.loop import March
from ..march.state import first_state, pressed_state
from ..parallel.slab import Slab
from ..scene import Scene, Setup, build_on, sanity, set_up
from ..solve.nonsymmetric.judge import SteadyContact
from ..storage.checkpoint import Contents
from .losses import branch_maps
from .point import Point
from .sliding import SteadySliding


def first(job: Job, slab: Slab, until: float = 0.0, saved: Contents | None = None) -> March:
    """Return a march before the first step of a job, or after the step of a checkpoint; collective.

    It can continue to the end of the history or, if later, to `until` [s]. Raises InputError for files that do not
    fit, and for approaches beyond full contact.
    """
    setup = set_up(job, slab, until)
    sanity.refuse_approaches(setup)
    if saved is None and setup.choices.steady_start.on:
        return _from_steady_sliding(setup)
    march = March(build_on(setup))
    if saved is not None:
        march.restore(saved)
    return march


def start_march(scene: Scene, contact: SteadyContact | None = None, **of_row: Any) -> March:
    """Return a march on a scene from rest, or from a `contact` in steady sliding at the velocity of its job's `initial`
    section, with the values `of_row` in the row of time 0; collective."""
    if contact is None:
        return March(scene)
    body, workspace = scene.material.at_rest(), scene.solver.workspace
    maps = branch_maps(scene.setup, contact, scene.job.initial.velocity, workspace.other_displacement)
    scene.material.start_from(body, contact.u, maps)
    state = first_state(scene, body)
    return March(scene, pressed_state(scene, state, replace(state.row, **of_row), contact.p, contact.d))


def _from_steady_sliding(setup: Setup) -> March:
    """Return a march in the steady state of its job's `initial` section; collective. Maps of the scene are made after
    those of the steady solver are freed; meanwhile the pressure is in a map of the workspace."""
    point, contact = _solve(setup)
    scene = build_on(setup)
    workspace, body = scene.solver.workspace, scene.material.at_rest()
    branches = branch_maps(setup, contact, setup.job.initial.velocity, workspace.other_displacement)
    scene.material.start_from(body, contact.u, branches)
    workspace.pressure[...] = contact.p
    iterations, approach = contact.steps, contact.d
    del contact
    state = first_state(scene, body)
    row = replace(
        state.row,
        measures=point.measures,
        iterations=iterations,
        certificate=point.certificate,
        errors=point.errors if point.errors.resolved else None,
        operator_calls=round(point.operator_calls),
        seconds=point.seconds,
    )
    return March(scene, pressed_state(scene, state, row, workspace.pressure, approach))


def _solve(setup: Setup) -> tuple[Point, SteadyContact]:
    """Return the state and its contact, without the maps of the solver; collective."""
    sliding, initial = (
        SteadySliding(setup, tolerance_before(setup.job, 0, setup.choices.viscoelasticity.on)),
        setup.job.initial,
    )
    point = sliding.solve(initial.velocity, initial.pressure or 0.0)
    assert sliding.contact is not None
    return point, sliding.contact
