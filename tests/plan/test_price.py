"""Costs of other accuracies, scaled from a trial: meshes, steps and times, also against runs at what is offered."""

import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import marched

from parcontact.accuracy.budget import ErrorSums
from parcontact.accuracy.constants import AREA, LINEAR_PAIR, PASSING, VIEWS
from parcontact.accuracy.shares import FRICTION
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.job.sections.listing import plain_data
from parcontact.mesh import load_cases
from parcontact.parallel.slab import Slab
from parcontact.plan import price
from parcontact.plan.costs import Costs, costs_of
from parcontact.plan.planning import only_steady_states
from parcontact.plan.sample import Sample, sample

from .planned import alike

Json = dict[str, Any]
ROUGH: Json = {
    "shape": "rough",
    "hurst": 0.8,
    "long_wavelength": 2.5e-4,
    "short_wavelength": 1.25e-4,
    "rms_slope": 0.02,
}
SOLID = {"model": "zener", "modulus_inf": 0.3e6, "branches": [{"modulus": 2.5e6, "relaxation_time": 1e-3}]}
SLIDE = {"pressure": 1e4, "velocity": 0.1, "distance": 1e-3, "cells_per_step": 1}
BALL: Json = {"shape": "sphere", "radius": 1e-2}


def job(**changes: Any) -> Job:
    grid = {"points": 64, "size": 1e-3}
    return Job.model_validate({"grid": grid, "surface": ROUGH, "material": SOLID, "history": [SLIDE], **changes})


def costs(planned: Job, time: float = 0.0, mesh: float = 0.0, of: str = "friction") -> Costs:
    """Return the costs that follow from a trial of all steps with these errors; a step takes 1 s."""
    sums = {"seconds": 1.0, f"{of} weight": 1.0, f"{of} time error": time, f"{of} mesh error": mesh}
    stages = tuple(alike(span.jumps + span.count, sums) for span in Timeline.from_job(planned).spans)
    return costs_of(planned, Sample(planned, 1, 0.0, 0.0, 0.0, 0, stages), 1e30)


def test_the_mesh_of_a_sphere_makes_its_share_of_the_error() -> None:
    """The error falls with the order of its fit; lengths that transform fast are at most 32 points longer."""
    ball = job(surface=BALL)
    for times in (8.0, 0.5):
        points, _ = price.points_at(costs(ball, mesh=FRICTION.mesh * 0.01 * times), ball, 0.01)
        least = 64 * times ** (1 / VIEWS.order)
        assert least <= points < least + 32
    at_rest = costs(ball, mesh=FRICTION.mesh * 0.02, of="area")
    assert price.points_at(at_rest, ball, 0.01) == (64 * round(2 ** (1 / AREA.order)),) * 2


@pytest.mark.parametrize("points", [64, "auto"])
def test_meshes_of_rough_surfaces_are_those_of_points_auto(points: int | str) -> None:
    """The table has them also where a job gives its points, and for its steady states alone."""
    steady = {"velocities": [1e-2], "pressures": [1e4]}
    given = {**plain_data(job(steady=steady)), "grid": {"points": "auto", "size": 1e-3}}

    def at(accuracy: float) -> Job:
        return load_cases({**given, "numerics": {"accuracy": accuracy}})[0].job

    planned = at(0.05) if points == "auto" else job(steady=steady)
    expected = ["{} x {}".format(*one.grid.points) for one in (planned, *map(at, price.ACCURACIES))]
    for seen in (costs(planned), costs_of(only_steady_states(planned), costs(planned).sample, 1e30)):
        assert [re.findall(r"\d+ x \d+", line)[0] for line in list(price.table(seen, planned))[1:-1]] == expected


def test_heights_from_a_file_stay_on_their_mesh(tmp_path: Path) -> None:
    np.save(tmp_path / "road.npy", np.zeros((64, 64)))
    given = job(surface={"shape": "file", "path": str(tmp_path / "road.npy")})
    assert price.points_at(costs(given, mesh=0.1), given, 1e-3) == (64, 64)


@pytest.mark.parametrize(
    ("integrator", "order"),
    [("exponential", PASSING.order), ("exponential-linear", LINEAR_PAIR.order), ("backward-euler", 1.0)],
)
@pytest.mark.parametrize("chosen", [False, True])
def test_steps_follow_the_order_of_the_integrator(integrator: str, order: float, chosen: bool) -> None:
    """An error of 3^p times the share takes steps a third as long, whether the job gives the steps or chooses them."""
    stage = {"pressure": 1e4, "duration": 1e-3} | ({} if chosen else {"time_step": 1e-5})
    planned = job(history=[stage], numerics={"integrator": integrator})
    allowed = FRICTION.time * 0.01 * (price.CHOSEN if chosen else 1.0)
    found = price.steps_at(costs(planned, time=3.0**order * allowed), 0.01, (64, 64))
    assert found == pytest.approx(3 * Timeline.from_job(planned).count, abs=1)


def test_given_steps_become_no_longer_in_cells() -> None:
    """However small their error is: 65 steps on 64 points are 33 on half as many. What was tried on cells twice as long
    with 2^3 times the error takes the steps of the job."""
    assert price.steps_at(costs(job(), time=1e-9), 0.05, (32, 32)) == 33
    tried = costs(job(), time=2.0**PASSING.order * FRICTION.time * 0.01).sample
    own = job(grid={"points": 128, "size": 1e-3})
    assert price.steps_at(costs_of(own, tried, 1e30), 0.01, (128, 128)) == pytest.approx(129, abs=2)


@pytest.mark.parametrize("accuracy", [0.05, 0.01])
def test_a_run_at_the_offered_settings_keeps_the_accuracy(accuracy: float) -> None:
    """Its own error budget is within the accuracy, to a quarter, as estimates differ by chance from mesh to mesh."""
    planned = job()
    seen = costs_of(planned, sample(planned, Slab.alone(*planned.grid.points), 1e6), 1e30)
    points = price.points_at(seen, planned, accuracy)
    steps = price.steps_at(seen, accuracy, points)
    stage = {**{k: v for k, v in SLIDE.items() if k != "cells_per_step"}, "time_step": 0.01 / (steps - 1)}
    changed = {"grid": {"points": points, "size": 1e-3}, "history": [stage], "numerics": {"accuracy": accuracy}}
    _, rows = marched(job(**changed))
    budget = ErrorSums()
    for before, row in pairwise(rows):
        assert row.errors is not None
        budget = budget.plus(row.errors, row.measures.friction, row.time - before.time)
    assert budget.friction is not None
    assert len(rows) == 1 + steps  # the initial state, and the jump of the load among the steps
    assert budget.friction.total <= 1.25 * accuracy


def test_times_follow_points_and_calls() -> None:
    """Time goes with N log N; a tenth of the accuracy takes 10^0.18, or 1.5, times the calls."""
    planned = job(history=[{"pressure": 1e4}])
    lines = list(price.table(costs(planned), planned))
    assert lines[0].split() == ["accuracy", "mesh", "steps", "maps", "[MB]", "time"]
    assert [line.split()[0] for line in lines[1:-1]] == ["this", "5", "1", "0.3", "0.1"]
    one, tenth = lines[3].split(), lines[5].split()
    work = [(n := int(words[2]) * int(words[4])) * math.log(n + 1) for words in (one, tenth)]
    assert float(tenth[-2]) / float(one[-2]) == pytest.approx(10**price.CALLS * work[1] / work[0], rel=0.01)


def test_friction_has_no_price_where_nothing_slides() -> None:
    """Waves that are pressed have tangential forces by rounding and by the mesh."""
    planned = job(history=[{"pressure": 1e4, "duration": 1e-3, "time_step": 2.5e-4}])
    seen = sample(planned, Slab.alone(*planned.grid.points), 1e6)
    assert seen.total("area weight") > 0.0
    assert seen.total("friction weight") == 0.0
