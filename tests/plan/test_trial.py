"""What a plan tries: steps and steady states that stand for others, also on coarser grids; counts, never times."""

import itertools
import math
import time
from functools import partial

import pytest
from marched_jobs import begun, marched
from mpi4py import MPI

from parcontact.door import memory
from parcontact.door.memory import FEWEST, StageCost, Trial, try_job
from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import scene, steady
from parcontact.march.choices import choices
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab

from .planned import CELLS, JOBS, TWO, Json, alike, job


def test_stages_not_tried_are_like_the_others() -> None:
    stages = (alike(4, {"fft": 10.0}), StageCost(6))
    seen = Trial(job(), 1, (48, 40), 0.0, stages)
    assert seen.total("fft") == 100.0
    assert seen.total("never counted") == 0.0


@pytest.mark.mpi(2, 3)
@pytest.mark.parametrize("name", ["elastic, static", "viscoelastic", "free, energies"])
def test_a_short_job_is_tried_whole(comm: MPI.Intracomm, name: str) -> None:
    """Its counts, put together from shares, are those of a run to rounding."""
    planned = job(**JOBS[name])
    before = begun(planned, comm=comm).scene.slab.tally
    march, rows = marched(planned, comm=comm)
    spent = march.scene.slab.tally.since(before)
    seen = try_job(planned, Slab(comm, *planned.grid.points), 1e6)
    assert seen is not None
    assert seen.steps == seen.tried == len(rows) - 1
    assert seen.total("operator") == pytest.approx(sum(row.operator_calls for row in rows), rel=1e-14)
    for count in ("fft", "allreduce", "bytes sent"):
        assert seen.total(count) == pytest.approx(spent.get(count, 0), rel=1e-14)


def test_rest_that_is_cut_short_is_known() -> None:
    """Where all steps can be tried."""
    material = {"model": "elastic", "shear_modulus": 1e6}
    dwell = {"pressure": 1e4, "duration": 1.0, "time_step": {"first": 1e-5, "growth": 1.2}}
    planned = job(material=material, history=[dwell, CELLS])
    _, rows = marched(planned)
    assert len(rows) < len(Timeline.from_job(planned))
    seen = try_job(planned, Slab.alone(*planned.grid.points), 1e6)
    assert seen is not None
    assert seen.steps == len(rows) - 1


def test_steps_that_stages_choose_are_known() -> None:
    """Where all of them are tried: as many as a run makes; else those that were made, and a guess of the rest."""
    dwell, slide = {"pressure": 1e4, "duration": 1e-3}, {"pressure": 1e4, "velocity": 0.1, "distance": 1.25e-4}
    planned = job(material=TWO, history=[dwell, slide])
    _, rows = marched(planned)
    slab = Slab.alone(*planned.grid.points)
    seen = try_job(planned, slab, 1e6)
    assert seen is not None
    assert seen.steps == seen.tried == len(rows) - 1
    assert seen.total("operator") == sum(row.operator_calls for row in rows)


def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the clock by one that goes on by 2 ms whenever it is read."""
    monkeypatch.setattr(time, "process_time", partial(next, itertools.count(0.0, 2e-3)))


def test_a_disturbed_step_does_not_lengthen_the_others() -> None:
    """Steps of 2 calls and 1 s, and as many of 4 calls and 2 s; other programs made one of them take 100 s."""
    stage = StageCost(100)
    for number in range(22):
        calls = 2 + 2 * (number % 2)
        stage.add({"operator": calls, "seconds": 100.0 if number == 10 else calls / 2.0})
    assert stage.total("operator") == pytest.approx(300.0)
    assert stage.total("seconds") == pytest.approx(150.0)


def test_every_stage_is_tried_in_the_time_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three long ones get some steps each; what is not tried costs as much as what was, and first steps count once."""
    ticking(monkeypatch)
    long = [{**CELLS, "distance": 5e-3, "pressure": pressure} for pressure in (1e4, 2e4, 3e4)]
    seen = try_job(job(history=long), Slab.alone(48, 40), 2.0)
    assert seen is not None
    assert all(stage.tried >= FEWEST for stage in seen.stages[:2])
    assert seen.tried < seen.steps == 3 * (1 + 240)
    stage = StageCost(100)
    for calls in (30.0, 20.0, 5.0, 6.0, 7.0):
        stage.add({"operator": calls})
    assert stage.total("operator") == 30 + 20 + 98 * 6


@pytest.mark.mpi(2)
def test_a_job_without_time_for_its_steps_is_tried_on_fewer_points(
    comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock ends its first solve on all ranks. Its steps are those of its own grid, and so is the price of its
    transforms; ranks share what is not the overhead of a call."""
    ticking(monkeypatch)
    large = job(grid={"points": 256}, material=TWO, history=[CELLS], numerics={"tolerance": 1e-8})
    ends, attempt = list[float](), memory._attempt

    def shorter(tried: Job, slab: memory.TimedSlab, seconds: float) -> Trial | None:
        found = attempt(tried, slab, 0.06 if tried.grid.nx == 256 else 1e6)
        ends.append(slab.price)
        return found

    monkeypatch.setattr(memory, "_attempt", shorter)
    seen = try_job(large, Slab(comm, 256, 256), 1.0)
    assert seen is not None
    assert seen.points == (64, 64)
    assert seen.steps == len(Timeline.from_job(large)) > seen.tried
    assert min(ends) > 0.0
    each = seen.total("seconds") / seen.steps
    assert seen.step(comm.size, 0.0) == pytest.approx(each * seen.share(comm.size))
    assert seen.step(4 * comm.size, 0.0) == pytest.approx(seen.step(comm.size, 0.0) / 4)
    assert seen.step(10**12, 1e-9) == pytest.approx(1e-9 * seen.total("operator") / seen.steps, rel=1e-3)


@pytest.mark.parametrize("name", JOBS)
def test_a_tiny_scene_has_all_that_runs(name: str) -> None:
    """The same effects as the job, on 16 points along each side: what is compiled for it is compiled for the job."""
    planned = job(**JOBS[name])
    small = memory._tiny(planned)
    assert small is not None
    assert max(small.grid.points) == 16
    assert choices(small).isolated.on == choices(planned).isolated.on
    assert (small.material, small.history) == (planned.material, planned.history)


CURVE: Json = {"velocities": [1e-3, 1e-2, 0.1, 1.0], "pressures": [1e4, 3e4]}


@pytest.mark.mpi(2, 3)
def test_steady_states_are_tried_as_they_are_solved(comm: MPI.Intracomm) -> None:
    """All of them, in another order: the states and transforms are those of the verb, as each starts from nothing."""
    planned = job(material=TWO, history=[], steady=CURVE)
    slab = Slab(comm, *planned.grid.points)
    sliding = SteadySliding(scene.set_up(planned, slab))
    before = slab.tally.copy()
    for pressure in CURVE["pressures"]:
        for speed in CURVE["velocities"]:
            sliding.solve((speed, 0.0), pressure)
    spent = slab.tally.since(before)
    seen = try_job(planned, Slab(comm, *planned.grid.points), 1e6)
    assert seen is not None
    assert seen.steps == seen.tried == 8
    for count in ("fft", "allreduce", "operator"):
        assert seen.total(count) == spent[count]


def test_a_stage_that_chooses_its_steps_ends_with_a_long_one(comm: MPI.Intracomm) -> None:
    """Each stage but the last ends after a few steps, and those of the next begin there."""
    slab, slide = memory.TimedSlab(comm, 48, 40), {"pressure": 1e4, "velocity": 0.1, "distance": 2.5e-4}
    slab.end = math.inf
    march = steady.first(job(material=TWO, history=[{"pressure": 1e4, "duration": 1e-2}, slide]), slab)
    press, _ = memory._try(march, 0.0)
    ends = march.timeline().chosen
    assert ends is not None
    first, second = ends.ends.values()
    assert press.tried == FEWEST == len(first) < press.steps  # a jump, and the long step in place of it
    assert (first[-1], len(second)) == (pytest.approx(1e-2), FEWEST)
