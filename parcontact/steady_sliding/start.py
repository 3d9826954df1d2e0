"""The start of a march from steady sliding: contact, displacement and branches as if it had slid for ever."""

from dataclasses import replace

from ..effects import decisions
from ..errors import InputError
from ..job import Job
from ..march.state import State
from ..march.step import March
from ..parallel.slab import Slab
from ..physics.body import ZenerBody
from ..scene import Setup, build, set_up
from ..solve.nonsymmetric.steady import SteadyContact
from ..storage.checkpoint import Contents
from .sliding import Point, SteadySliding, branch_maps


def first(job: Job, slab: Slab, until: float = 0.0, saved: Contents | None = None) -> March:
    """A march before the first step of a job, or after that of a checkpoint; collective.

    It can go on to the end of the history or, if later, to `until` [s]. Raises InputError for files that do not fit,
    and where a steady start is asked for with energies: they count from a body at rest.
    """
    if saved is None and decisions.steady_start(job).on:
        return _from_steady_sliding(job, slab, until)
    march = March(build(job, slab, until))
    if saved is not None:
        march.restore(saved)
    return march


def _from_steady_sliding(job: Job, slab: Slab, until: float) -> March:
    """A march in the steady state of its job's `initial` section; collective.

    Maps of the scene are made when those of the steady solver are gone, and the pressures of the march last: until then
    the pressure waits in a map of the workspace.
    """
    if decisions.energies(job).on:
        raise InputError("output.energy: energies count from a body at rest, so they need initial: {state: virgin}")
    base = set_up(job, slab)
    point, contact = _solve(base)
    scene = build(job, slab, until, base)
    workspace = scene.solver.workspace
    if isinstance(scene.material, ZenerBody):
        scene.material.begin_with(
            contact.u, branch_maps(base, contact, job.initial.velocity, workspace.other_displacement)
        )
    workspace.pressure[...] = contact.p
    iterations, approach = contact.steps, contact.d
    del contact
    march = March(scene)
    row = replace(
        march.row,
        measures=point.measures,
        iterations=iterations,
        certificate=point.certificate,
        errors=point.errors,
        operator_calls=round(point.operator_calls),
        seconds=point.seconds,
    )
    march.begin_with(State(row, workspace.pressure, None, 1.0, 1.0, approach))
    return march


def _solve(base: Setup) -> tuple[Point, SteadyContact]:
    """The state, and its contact, without the maps that it took to find it; collective."""
    sliding, initial = SteadySliding(base), base.job.initial
    point = sliding.solve(initial.velocity, initial.pressure or 0.0)
    assert sliding.contact is not None
    return point, sliding.contact
