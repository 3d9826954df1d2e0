"""How a plan goes from what was tried on a few ranks to many, to other grids and to whole sweeps."""

from pathlib import Path
from unittest.mock import Mock

import pytest

from parcontact.job import load_cases
from parcontact.job.sections.listing import plain
from parcontact.plan import other_ranks, whole_sweep
from parcontact.plan.sample import Sample, StageCost
from parcontact.plan.scaling import Machine, Scaling

from .planned import MACHINE, SWEEP, job


def test_stages_not_tried_are_like_the_others() -> None:
    stages = (StageCost(4, 4, 4.0, {"fft": 40.0}), StageCost(6))
    seen = Sample(job(), 1, 0.0, 0.0, 0.0, 0, stages)
    assert seen.total("fft") == 100.0
    assert seen.total("never counted") == 0.0


def scaling(points: int, machine: Machine = MACHINE, **counts: float) -> Scaling:
    planned = job(grid={"points": points})
    sums = {"seconds": 1.0, "operator": 10.0, f"fft {points}x{points} float64": 20.0, "allreduce": 20.0, **counts}
    return Scaling.of(planned, [Sample(planned, 1, 0.0, 1.0, 0.0, 0, (StageCost(1, 1, 1.0, sums),))], machine)


def test_one_rank_is_what_was_seen() -> None:
    assert scaling(64).step(1) == pytest.approx(1.0, rel=1e-12)
    assert scaling(64).messages(1) == 0.0
    assert scaling(64).efficiency(1) == 1.0


def test_work_is_divided() -> None:
    """Without messages and calls: by the ranks, but for how they slow each other down on a node."""
    ideal = Machine(cores=4, crowding=2.0, per_call=0.0, copy_rate=1e30, latency=0.0, bandwidth=1e30, near_latency=0.0)
    assert [scaling(64, ideal).step(ranks) for ranks in (2, 4, 16)] == pytest.approx([(4 / 3) / 2, 2 / 4, 2 / 16])


def test_messages_grow_with_ranks_and_scaling_ends() -> None:
    """Each rank sends one message to every other one in a transpose: 20 of those, 2 us each between nodes."""
    few = scaling(1024)
    assert few.messages(1024) == pytest.approx(20 * (7 * 5e-7 + 1016 * 2e-6) + 21 * 10 * 2e-6, rel=0.1)
    assert few.efficiency(few.end) >= 0.5 > few.efficiency(2 * few.end)
    assert 8 < few.end < 1024
    slow = Machine(cores=8, crowding=1.5, per_call=1e-5, copy_rate=1e10, latency=1e-3)
    assert scaling(1024, slow).end < few.end


def test_a_sample_on_some_ranks_is_gone_by_there(tmp_path: Path) -> None:
    """It comes from another process; others start from it, or from the one on fewer ranks."""
    planned = job()
    stages = [(StageCost(1, 1, 1.0, {"seconds": seconds, "operator": 10.0}),) for seconds in (1.0, 0.7)]
    one, two = (Sample(planned, 1 + n, 0.5, 1.0, 2.0, 1000, each) for n, each in enumerate(stages))
    other_ranks.save(tmp_path / "sample", two)
    again = other_ranks.load(tmp_path / "sample", planned, 2.5)
    assert again == two
    both = Scaling.of(planned, [one, again], MACHINE)
    assert both.step(1) == pytest.approx(1.0)
    assert both.step(2) == pytest.approx(0.7)
    assert both.sample(64).ranks == 2
    ideal = both.messages(4) + 1e-4 + (0.7 - both.messages(2) - 1e-4) / 2 * MACHINE.slowed(4) / MACHINE.slowed(2)
    assert both.step(4) == pytest.approx(ideal)


def test_as_many_calls_on_any_number_of_ranks() -> None:
    """Where two had the time for four steps and one for one of them only: 15 calls of 0.1 s on one rank."""
    planned, free = job(), Machine(cores=8, crowding=1.5, per_call=0.0, copy_rate=1e10)
    stages = [StageCost(4, n, float(n), {"seconds": n * time, "operator": n * calls}) for n, time, calls in TRIED]
    one, two = (Sample(planned, 1 + k, 0.0, 1.0, 0.0, 0, (stage,)) for k, stage in enumerate(stages))
    both = Scaling.of(planned, [one, two], free)
    assert both.step(1) == pytest.approx(1.5)
    assert both.step(2) == pytest.approx(0.9, rel=1e-5)  # but for the messages of a sum


TRIED = ((1, 1.0, 10.0), (4, 0.9, 15.0))  # steps, seconds and calls of each


def test_times_of_a_sweep_add_up() -> None:
    """Work goes with the steps; a case that was not tried is like the nearest one that was. Side by side the time is
    that of all shared out, and no less than that of the longest; the program starts once."""
    cases = load_cases({**plain(job()), **SWEEP})
    steps = [11, 21, 41]  # with the jump of the load
    assert whole_sweep.times_of_first(cases, {0: 1.0}) == pytest.approx([count / 11 for count in steps])
    assert whole_sweep.times_of_first(cases, {0: 1.0, 2: 3.0}) == pytest.approx([1, 21 / 11, 3 * 41 / 11])
    times = [1.0, 2.0, 12.0]
    assert [whole_sweep.places_to_try(count) for count in (1, 2, 3, 21)] == [[0], [0, 1], [0, 1, 2], [0, 10, 20]]
    costs = Mock(whole=lambda ranks: 1.0 + 8.0 / ranks)  # seconds: one to start, the rest is shared
    costs.scaling.sample.return_value.starting = 1.0
    costs.scaling.machine.slowed.return_value = 1.0
    assert whole_sweep.whole(costs, times, 1, 1) == pytest.approx(1 + 15 * 8)
    assert whole_sweep.whole(costs, times, 2, 1) == pytest.approx(1 + 15 * 8 / 2)
    assert whole_sweep.whole(costs, [1, 2, 3], 2, 2) == pytest.approx(1 + 6 * 8 / 2)
    assert whole_sweep.whole(costs, times, 3, 3) == pytest.approx(1 + 12 * 8)
