"""What a plan tries: steps and steady states that stand for others, also on coarser grids; counts, never times."""

from itertools import pairwise

import pytest
from marching import begun, marched
from mpi4py import MPI

from parcontact import scene
from parcontact.history.timeline import Timeline
from parcontact.parallel.slab import Slab
from parcontact.plan.sample import Sample, StageCost, chosen, sample
from parcontact.plan.trial import make_tiny
from parcontact.scene import choices
from parcontact.steady_sliding.sliding import SteadySliding

from .planned import CELLS, JOBS, SLIDE, TWO, Json, job


def test_stages_not_tried_are_like_the_others() -> None:
    stages = (StageCost(4, 4, 4.0, {"fft": 40.0}), StageCost(6))
    seen = Sample(job(), 1, 0.0, 0.0, 0.0, 0, stages)
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
    seen = sample(planned, Slab(comm, *planned.grid.points), 1e6)
    assert seen.steps == seen.tried == len(rows) - 1
    assert seen.total("operator") == pytest.approx(sum(row.operator_calls for row in rows), rel=1e-14)
    for count in ("fft", "allreduce", "bytes sent"):
        assert seen.total(count) == pytest.approx(spent.get(count, 0), rel=1e-14)


@pytest.mark.parametrize("material", [{"model": "elastic", "shear_modulus": 1e6}, TWO])
def test_rest_that_is_cut_short_is_known(material: Json) -> None:
    """Where all steps can be tried."""
    dwell = {"pressure": 1e4, "duration": 1.0, "time_step": {"first": 1e-5, "growth": 1.2}}
    planned = job(material=material, history=[dwell, CELLS])
    _, rows = marched(planned)
    assert len(rows) < len(Timeline.of(planned))
    assert sample(planned, Slab(MPI.COMM_SELF, *planned.grid.points), 1e6).steps == len(rows) - 1


def test_steps_that_stages_choose_are_known() -> None:
    """Where all of them are tried: as many as a run makes; else those that were made, and a guess of the rest."""
    dwell, slide = {"pressure": 1e4, "duration": 1e-3}, {"pressure": 1e4, "velocity": 0.1, "distance": 1.25e-4}
    planned = job(material=TWO, history=[dwell, slide])
    _, rows = marched(planned)
    slab = Slab(MPI.COMM_SELF, *planned.grid.points)
    seen = sample(planned, slab, 1e6)
    assert seen.steps == seen.tried == len(rows) - 1
    assert seen.total("operator") == sum(row.operator_calls for row in rows)
    few = sample(planned, slab, 0.0)
    assert few.tried < len(rows) - 1
    assert few.steps > 0


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("stage", [SLIDE, {**SLIDE, "time_step": {"first": 1e-6, "growth": 1.02}}, CELLS])
def test_chosen_steps_stand_for_all(stage: Json, share: float) -> None:
    """They follow each other without a gap, weigh as much as all, and end where all do."""
    stage = {**stage, **({"duration": 1e-2} if "duration" in stage else {"distance": 1e-2})}
    planned = job(history=[stage])
    timeline = Timeline.of(planned)
    whole = list(timeline)
    picked = list(chosen(timeline, range(1, len(timeline) + 1), share))
    assert sum(weight for _, weight in picked) == pytest.approx(len(whole), rel=1e-12)
    assert picked[0] == (whole[0], 1.0)
    assert picked[-1][0].time == whole[-1].time
    assert picked[-1][0].position == whole[-1].position
    for (before, _), (step, _) in pairwise(picked):
        assert step.time - step.dt == pytest.approx(before.time, abs=1e-12 * whole[-1].time)
    if share < 1.0:
        assert len(picked) <= max(share * len(whole), 10) + 3
    weighed = [step for step, weight in picked if weight]
    assert set(weighed) <= set(whole)


@pytest.mark.parametrize("name", JOBS)
def test_a_tiny_scene_has_all_that_runs(name: str) -> None:
    """The same effects as the job, on 16 points along each side: what is compiled for it is compiled for the job."""
    planned = job(**JOBS[name])
    small = make_tiny(planned)
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
    seen = sample(planned, Slab(comm, *planned.grid.points), 1e6)
    assert seen.steps == seen.tried == 8
    for count in ("fft", "allreduce", "operator"):
        assert seen.total(count) == spent[count]
    assert seen.held == slab.agree(slab.tally["map bytes at most"])
