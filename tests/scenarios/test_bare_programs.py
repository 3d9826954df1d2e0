"""A job without effects counts what a program counts that never had them, and no more."""

from collections import Counter

import numpy as np
import pytest
from counting import ELASTIC, ITERATIONS, NX, NY, PRESS, RUBBER, SLIDE, STAND, Json, job, whole

from parcontact.contact.problem import Box, MeanPressure, Operators, Problem, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import choices, scene
from parcontact.march.controller import EmbeddedPair
from parcontact.parallel.slab import Slab
from parcontact.physics import loops
from parcontact.physics.body import ElasticBody, ZenerBody
from parcontact.physics.energy import Probe
from parcontact.physics.surface import AlongX, friction_by_energy


def bare(planned: Job) -> Counter[str]:
    """A surface that stands on an elastic body: a solver, and measures. Nothing lasts, moves or remembers."""
    slab = Slab.alone(NX, NY)
    base = scene.set_up(planned, slab)
    heights = base.surface.heights((0.0, 0.0), slab.empty())
    solver, operators = bare_solver(base)
    last, p = slab.zeros(), slab.zeros()
    probe = Probe(slab, base.surface, base.units)
    for stage in planned.history:
        load = MeanPressure(stage.load.end / (base.prony.modulus_inf * base.units.pressure))
        p[...] = last
        contact = solver.solve(Problem(*operators, heights, Box(), load), p)
        last, p = p, last
        probe.measure(contact.p, base.prony.modulus_inf, contact.u, heights, contact.d, contact.p, (0.0, 0.0))
    return slab.tally.copy()


def lasting(planned: Job) -> Counter[str]:
    """The same for a body with or without memory under stages that last; the surface stands or moves by whole cells."""
    slab = Slab.alone(NX, NY)
    base = scene.set_up(planned, slab)
    path = AlongX(base.surface)
    body: ZenerBody | ElasticBody
    if base.prony.moduli.size > 0:
        body = ZenerBody(slab, base.prony, "exponential")
    else:
        body = ElasticBody(slab, base.prony.modulus_inf, base.choices.slides_along_x)
    held, (solver, operators) = body.at_rest(), bare_solver(base)
    probe = Probe(slab, base.surface, base.units)
    earlier, last, p = (slab.zeros() for _ in range(3))
    moduli, cells = [0.0, 0.0], 0
    for step in Timeline.from_job(planned):
        heights = path.at(step.position)
        trial = body.begin(held, step.dt, heights, step.growth)
        alpha = trial.alpha
        now, before = (1.0 + step.growth) * moduli[1] / alpha, step.growth * moduli[0] / alpha
        loops.travel(last, earlier, now, before, heights.offset - cells, 0.0, np.inf, p)
        moduli, cells = [moduli[1], alpha], heights.offset
        load_of_step = MeanPressure(step.load / (alpha * base.units.pressure))
        contact = solver.solve(Problem(*operators, trial.effective, Box(), load_of_step), p)
        found = probe.measure(contact.p, alpha, contact.u, trial.effective, contact.d, contact.p, step.position)
        held = body.commit(held, trial, contact.u, p if held.displacement is None else held.displacement)
        if isinstance(body, ZenerBody):
            # The error budget looks at what another integrator would have done.
            load = found.pressure * slab.points / (alpha * base.units.pressure)
            pair = EmbeddedPair(slab, body, base.job.grid.dx / base.units.length)
            pair.compare(step.dt, trial, held, contact.p, contact.u, load, found.contact_area, step.growth)
            friction_by_energy(slab, contact.p, contact.u, (1.0, 1.0), (1.0, 0.0), (True, True))  # as often
        earlier, last, p = last, p, earlier
    return slab.tally.copy()


def bare_solver(base: scene.Setup) -> tuple[ContactSolver, Operators]:
    operators = Operators(base.half_space.operator(base.fft), base.half_space.inverse(base.fft))
    return ContactSolver(Workspace(base.slab, 1e-15), base.height / base.units.height, 1e-15, ITERATIONS), operators


def test_elastic_static() -> None:
    """No branch map, no shift, no earlier pressure, no padding, no energy: exactly the solver's operator calls."""
    planned = job(history=[STAND, {"pressure": 5e3}])
    counts = whole(planned)
    assert counts == bare(planned)
    assert counts["operator"] == 2 * (1 + 2 * ITERATIONS)
    assert counts["shift"] == 0
    assert not any(
        effect.on
        for effect in choices.choices(planned).decisions
        if effect.name not in ("surface spectrum", "checkpoints")
    )


@pytest.mark.parametrize("stage", [PRESS, SLIDE])
@pytest.mark.parametrize("material", [ELASTIC, RUBBER])
def test_lasting_stages(material: Json, stage: Json) -> None:
    """Only what is on: memory, whole cells, an earlier pressure."""
    planned = job(material=material, history=[stage])
    assert whole(planned) == lasting(planned)
