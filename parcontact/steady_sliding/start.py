"""The start of a march from steady sliding: contact, displacement and branches as if it had slid for ever."""

from dataclasses import replace

from ..errors import InputError
from ..march.step import March
from ..physics.body import Zener
from .sliding import SteadySliding


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
    material = scene.material
    if isinstance(material, Zener):
        material.u[...] = contact.u
        for k, steady in enumerate(sliding.branch_maps(initial.velocity)):
            if k in material.kept:
                material.branches[material.kept.index(k)] = steady
    march.p[...] = contact.p
    if march.p_old is not None:
        march.p_old[...] = contact.p
    march.alpha = march.alpha_old = 1.0
    march.d = contact.d
    scene.solver.u[...] = contact.u
    march.row = replace(
        march.row,
        measures=point.measures,
        iterations=contact.steps,
        certificate=point.certificate,
        operator_calls=round(point.operator_calls),
        seconds=point.seconds,
    )
