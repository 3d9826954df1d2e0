"""The start of a march from steady sliding: contact, displacement and branches as if it had slid for ever."""

from dataclasses import replace

from ..effects import decisions
from ..errors import InputError
from ..job import Job
from ..march.state import State
from ..march.step import March
from ..parallel.slab import Slab
from ..physics.body import ZenerBody
from ..record.checkpoint import Contents
from ..scene import build
from .sliding import SteadySliding


def first(job: Job, slab: Slab, until: float = 0.0, saved: Contents | None = None) -> March:
    """A march before the first step of a job, or after that of a checkpoint; collective.

    It can go on to the end of the history or, if later, to `until` [s]. Raises InputError for files that do not fit.
    """
    march = March(build(job, slab, until))
    if saved is not None:
        march.restore(saved)
    elif decisions.steady_start(job).on:
        begin(march)
    return march


def begin(march: March) -> None:
    """Put a run that has not begun into the steady state of its job's `initial` section; collective.

    Raises InputError where energies are asked for: they count from a body at rest.
    """
    scene, initial = march.scene, march.scene.job.initial
    if scene.energy is not None:
        raise InputError("output.energy: energies count from a body at rest, so they need initial: {state: virgin}")
    sliding = SteadySliding(scene.frame)
    point = sliding.solve(initial.velocity, initial.pressure or 0.0)
    contact = sliding.contact
    assert contact is not None
    if isinstance(scene.material, ZenerBody):
        scene.material.begin_with(contact.u, sliding.branch_maps(initial.velocity))
    row = replace(
        march.row,
        measures=point.measures,
        iterations=contact.steps,
        certificate=point.certificate,
        operator_calls=round(point.operator_calls),
        seconds=point.seconds,
    )
    march.begin_with(State(row, contact.p, None, 1.0, 1.0, contact.d))
