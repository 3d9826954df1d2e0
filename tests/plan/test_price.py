"""What other accuracies cost, scaled from a trial: meshes, steps and calls, also against runs at what is offered."""

import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marching import marched

from parcontact.accuracy.budget import ErrorSums
from parcontact.accuracy.constants import LINEAR_PAIR, PASSING, VIEWS
from parcontact.accuracy.shares import FRICTION, TIME_MEDIAN
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.job.checks import advice
from parcontact.job.checks.cells import cells_per_wave
from parcontact.job.sections.listing import plain_data
from parcontact.mesh import load_cases
from parcontact.parallel.slab import Slab
from parcontact.plan import price
from parcontact.plan.costs import Costs, costs_of
from parcontact.plan.planning import only_steady_states
from parcontact.plan.sample import Sample, sample

from .planned import alike

Json = dict[str, Any]
WAVE = 1.25e-4
ROUGH: Json = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": WAVE, "rms_slope": 0.02}
SOLID = {"model": "zener", "modulus_inf": 0.3e6, "branches": [{"modulus": 2.5e6, "relaxation_time": 1e-3}]}
SLIDE = {"pressure": 1e4, "velocity": 0.1, "distance": 1e-3, "cells_per_step": 1}
FINE: Json = {"points": 80, "size": 1e-3}  # 10 cells per shortest wave, as 1 % asks for


def job(**changes: Any) -> Job:
    grid = {"points": 64, "size": 1e-3}
    return Job.model_validate({"grid": grid, "surface": ROUGH, "material": SOLID, "history": [SLIDE], **changes})


def costs(planned: Job, time: float = 0.0, mesh: float = 0.0, of: str = "friction", calls: float = 10.0) -> Costs:
    """As if a trial of all steps had seen such errors; a step takes 1 s and some calls."""
    stages = []
    for span in Timeline.from_job(planned).spans:
        n = span.jumps + span.count
        sums = {"seconds": 1.0, "operator": calls, f"{of} weight": 1.0, f"{of} time error": time}
        stages.append(alike(n, {**sums, f"{of} mesh error": mesh}))
    seen = Sample(planned, 1, 0.0, 0.0, 0.0, 0, tuple(stages))
    return costs_of(planned, seen, 1e30)


def test_meshes_have_the_cells_that_waves_need() -> None:
    """8 of them in the box: 1 % takes 10 cells each, for 0.6 % by the mesh; the least length that transforms like.
    Where the trial has seen a larger error, as of small friction, it takes more: it falls with the power 1.5 of the
    cell."""
    seen = costs(job(), mesh=0.005)
    found = [price.offer(seen, accuracy).job.grid.nx for accuracy in price.ACCURACIES]
    assert found == [48, 80, 144, 384]  # 17 cells along and 46 across are what area asks for
    for points, accuracy in zip(found, price.ACCURACIES, strict=True):
        assert points >= 8 * cells_per_wave(FRICTION.mesh * accuracy)
    assert price.offer(costs(job(), mesh=0.06), 0.01).job.grid.nx == 320  # 64 * 10^(1/1.5) is 297


def test_meshes_of_spots_go_by_their_error() -> None:
    """A sphere whose mesh makes eight times the error that it may; half of it with as many cells less."""
    ball = job(surface={"shape": "sphere", "radius": 1e-2})
    for error in (0.08, 0.005):
        points = price.offer(costs(ball, mesh=FRICTION.mesh * error), 0.01).job.grid.nx
        least = 64 * (error / 0.01) ** (1 / VIEWS.order)
        assert least <= points < least + 32
    assert (
        price.offer(costs(ball, mesh=FRICTION.mesh * 0.02, of="area"), 0.01).job.grid.nx == 128
    )  # at rest, in the first order


def test_with_points_auto_meshes_are_those_of_auto() -> None:
    """Meshes are those of the whole job, also where its steady states alone are priced, and its own at its accuracy."""
    steady = {"velocities": [1e-2], "pressures": [1e4]}
    given = {**plain_data(job(steady=steady)), "grid": {"points": "auto", "size": 1e-3}}

    def at(accuracy: float) -> Job:
        return load_cases({**given, "numerics": {"accuracy": accuracy}})[0].job

    planned = at(price.ACCURACIES[0])
    for seen in (costs(planned), costs_of(only_steady_states(planned), costs(planned).sample, 1e30)):
        lines = list(price.table(seen, planned))
        meshes = [re.findall(r"\d+ x \d+", line)[0] for line in lines[2:-2]]
        expected = ["{} x {}".format(*at(accuracy).grid.points) for accuracy in price.ACCURACIES]
        assert meshes == [expected[0], *expected]
        assert lines[0] == "cost of an accuracy of friction and the contact area"


def test_heights_from_a_file_stay(tmp_path: Any) -> None:
    np.save(tmp_path / "road.npy", np.zeros((64, 64)))
    given = job(surface={"shape": "file", "path": str(tmp_path / "road.npy")})
    seen = costs(given, mesh=0.1)
    assert all(price.offer(seen, accuracy).job.grid == given.grid for accuracy in price.ACCURACIES)


@pytest.mark.parametrize(
    ("integrator", "order"),
    [("exponential", PASSING.order), ("exponential-linear", LINEAR_PAIR.order), ("backward-euler", 1.0)],
)
def test_steps_go_by_the_order_of_the_integrator(integrator: str, order: float) -> None:
    """On the own mesh: the error of steps three times as long."""
    stage = {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-5}
    planned = job(grid=FINE, history=[stage, SLIDE], numerics={"integrator": integrator})
    found = price.offer(costs(planned, time=3.0**order * FRICTION.time * 0.01), 0.01)
    steps = [stage.steps for stage in found.sample.stages]
    assert steps == [1 + 300, 3 * 80]


def test_chosen_steps_make_what_they_are_chosen_for() -> None:
    """The same error at the same accuracy takes as many; a tenth of it 10^(1/3) times as many."""
    chosen = {key: value for key, value in SLIDE.items() if key != "cells_per_step"}
    planned = job(grid={"points": 240, "size": 1e-3}, history=[chosen])
    seen = costs(planned, time=FRICTION.time * price.CHOSEN * TIME_MEDIAN * 0.01)
    lasting = Timeline.from_job(planned).spans[0].count
    for accuracy, times in ((0.01, 1.0), (1e-3, 10 ** (1 / PASSING.order))):
        assert price.offer(seen, accuracy).sample.steps == pytest.approx(1 + lasting * times, abs=1.0)


def test_steps_are_never_longer_than_a_cell() -> None:
    """However accurate they are; a grid with half the points needs half as many."""
    found = price.offer(costs(job(), time=1e-9), 0.05)
    assert (found.job.grid.nx, found.sample.steps) == (48, 1 + 48)


def test_calls_grow_with_the_decades_of_the_tolerance() -> None:
    """1.5 times for a tenth; time with N log N."""
    planned = job(grid=FINE)
    one, ten = (price.offer(costs(planned), accuracy) for accuracy in (1e-2, 1e-3))
    seconds = [each.marching / each.sample.steps for each in (one, ten)]
    points = [math.prod(each.grid.points) for each in (planned, one.job, ten.job)]
    work = [count * math.log(count + 1) for count in points]
    assert seconds[0] == pytest.approx(work[1] / work[0])
    assert seconds[1] == pytest.approx(1.5 * work[2] / work[0])


def test_from_a_coarser_grid() -> None:
    """What was tried on twice the cell, and so twice the step, has 2^3 times the error of the own steps."""
    own = job(grid={"points": 160, "size": 1e-3})
    tried = costs(job(grid=FINE), time=2.0**PASSING.order * FRICTION.time * 0.01).sample
    seen = costs_of(own, tried, 1e30)
    assert seen.sample.steps == 1 + 160
    assert price.offer(seen, 0.01).sample.steps == 1 + 160


@pytest.mark.parametrize("accuracy", [0.05, 0.01])
def test_what_is_offered_keeps_its_promise(accuracy: float) -> None:
    """The run at the mesh, steps and tolerance of the offer: its own error budget is within the accuracy; it takes as
    many steps, and as many calls to a factor of 1.5 (small jobs differ by that from mesh to mesh), or
    of 2.3 in steps that do not end at whole cells."""
    planned = job()
    seen = sample(planned, Slab.alone(*planned.grid.points), 1e6)
    found = price.offer(costs_of(planned, seen, 1e30), accuracy)
    stage = {**{k: v for k, v in SLIDE.items() if k != "cells_per_step"}, "time_step": 0.01 / (found.sample.steps - 1)}
    _, rows = marched(Job.model_validate({**plain_data(found.job), "history": [stage]}))
    budget, calls = ErrorSums(), sum(row.operator_calls for row in rows)
    for before, row in pairwise(rows):
        assert row.errors is not None
        budget = budget.plus(row.errors, row.measures.friction, row.time - before.time)
    assert budget.friction is not None
    assert len(rows) == 1 + found.sample.steps  # the initial state, and the jump of the load among the steps
    assert budget.friction.total <= 1.25 * accuracy  # views differ by chance from mesh to mesh
    assert 1 / 1.5 < calls / found.sample.total("operator") < 2.3


def test_errors_of_a_trial_of_all_steps_are_those_of_the_run() -> None:
    """Weighed by the way slid: a slow stage that lasts fifty times as long does not hide what a fast one makes."""
    short = {**SLIDE, "distance": 2.5e-4}
    planned = job(history=[{**short, "velocity": 0.01}, {**short, "velocity": 0.5}])
    seen = sample(planned, Slab.alone(*planned.grid.points), 1e6)
    budget, (_, rows) = ErrorSums(), marched(planned)
    for before, row in pairwise(rows):
        assert row.errors is not None
        budget = budget.plus(row.errors, row.measures.friction, row.time - before.time, row.distance - before.distance)
    for name, parts in (("friction", budget.friction), ("area", budget.area)):
        assert parts is not None
        assert price.error_of(seen, name, "mesh") == pytest.approx(parts.mesh, rel=1e-6)


def test_friction_has_no_price_where_nothing_slides() -> None:
    """Waves that are pressed have tangential forces by rounding and by the mesh, which are noise."""
    planned = job(history=[{"pressure": 1e4, "duration": 1e-3, "time_step": 2.5e-4}])
    seen = sample(planned, Slab.alone(*planned.grid.points), 1e6)
    assert seen.total("area weight") > 0.0
    assert seen.total("friction weight") == 0.0
    assert next(price.table(costs_of(planned, seen, 1e30))) == "cost of an accuracy of the contact area"


def test_the_table() -> None:
    """As a user reads it: one line for the job, one for each accuracy."""
    seen = costs(job(), time=1e-3, mesh=8.8e-3)
    head, names, own, *rows = list(price.table(seen))[:7]
    assert "friction" in head
    assert " ".join(names.split()) == "accuracy mesh steps precision maps [MB] 1 rank"
    assert " ".join(own.split()).startswith("this job 64 x 64 65 double")
    assert [row.split()[0] for row in rows] == ["5", "1", "0.3", "0.1"]


@pytest.mark.parametrize("stage", [{"pressure": 1e4}, SLIDE])
def test_no_mesh_is_advised_of_which_a_run_warns(tmp_path: Path, stage: Json) -> None:
    """Of a measured map whose trial has seen no error, as in the mean over a long hold: at each accuracy the run on the
    mesh has no doubt about its shortest wave. One cell of it was advised."""
    x = np.arange(128) / 128
    heights = sum(np.cos(2 * np.pi * k * x) * k**-1.5 for k in range(1, 17)) * np.ones((128, 1)) * 1e-6
    np.save(tmp_path / "map.npy", heights)
    map_ = {"shape": "topography", "path": str(tmp_path / "map.npy"), "unit": "m", "size": [1e-3, 1e-3]}
    measured = {**map_, "detrend": "mean", "periodic": "none"}
    planned = job(grid={"points": 128, "size": 1e-3}, surface=measured, history=[stage])
    for accuracy in price.ACCURACIES:
        found = price.offer(costs(planned, mesh=1e-5), accuracy).job
        assert found.grid.nx >= 2.0 * 16
        asked, ways = found.numerics.asked, found.directions
        assert not list(advice.doubt_measured_waves(found.grid, 1e-3 / 16, asked, ways)), (accuracy, found.grid.points)
