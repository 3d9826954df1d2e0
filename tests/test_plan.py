"""The plan of a job: memory to the byte, steps that stand for others, scaling; counts are checked, never times."""

import re
import shutil
import subprocess
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import yaml
from marching import begun, marched
from mpi4py import MPI

from parcontact import __main__, private, scene
from parcontact.command import words
from parcontact.effects import decisions
from parcontact.job import Job, load_cases
from parcontact.job.table import plain
from parcontact.parallel.slab import Slab
from parcontact.plan import machine, memory, other_ranks, report, trial, whole_sweep
from parcontact.plan.planning import only_steady_states, try_job
from parcontact.plan.report import Costs
from parcontact.plan.sample import Sample, StageCost, chosen, sample
from parcontact.plan.scaling import Machine, Scaling
from parcontact.steady_sliding.sliding import SteadySliding

Json = dict[str, Any]
ROUGH: Json = {
    "shape": "rough",
    "hurst": 0.8,
    "long_wavelength": 2.5e-4,
    "short_wavelength": 1.25e-4,
    "rms_slope": 0.02,
    "seed": 1,
}
TWO = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}, {"modulus": 2e6, "relaxation_time": 1e-4}],
}
PRESS = {"pressure": 1e4}
SLIDE = {"pressure": 1e4, "velocity": 0.1, "duration": 1e-3, "time_step": 1e-4}
CELLS = {"pressure": 1e4, "velocity": 0.1, "distance": 1.25e-4, "cells_per_step": 1}


def job(**changes: Any) -> Job:
    return Job.model_validate(
        {
            "grid": {"points": [48, 40], "size": [1e-3, 1e-3], **changes.pop("grid", {})},
            "surface": ROUGH,
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [PRESS],
            **changes,
        }
    )


JOBS: dict[str, Json] = {
    "elastic, static": {},
    "elastic, sliding": {"history": [CELLS]},
    "viscoelastic": {"material": TWO, "history": [CELLS]},
    "between cells": {"material": TWO, "history": [SLIDE]},
    "free": {"grid": {"boundary": "free"}, "surface": {"shape": "sphere", "radius": 1e-2}},
    "free, energies": {"grid": {"boundary": "free"}, "material": TWO, "history": [SLIDE], "output": {"energy": True}},
    "energies": {"material": TWO, "history": [CELLS], "output": {"energy": True}},
    "single": {"material": TWO, "history": [CELLS], "numerics": {"precision": "single"}},
    "long cells": {"grid": {"size": [1e-3, 1e-5]}, "history": [SLIDE]},
    "mixed": {"history": [SLIDE], "numerics": {"precision": "mixed"}},
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", JOBS)
def test_memory(comm: MPI.Intracomm, name: str) -> None:
    """What each rank holds after a run, and what a checkpoint has in maps, to the byte."""
    planned = job(**JOBS[name])
    march, _ = marched(planned, comm=comm)
    slab = march.scene.slab
    assert memory.total(planned, comm.size, comm.rank) == slab.tally["map bytes"]
    maps = [np.asarray(entry.value) for entry in march.entries().values() if entry.is_map]
    saved = sum(rows.nbytes + 4 * len(rows) for rows in maps)
    assert sum(slab.from_all(saved)) == memory.saved(planned)


def test_no_rank_has_more_than_is_planned() -> None:
    """The last has the most but for the few waves of the surface, which another one may have."""
    for name, ranks in [("free", 7), ("mixed", 3), ("viscoelastic", 100)]:
        planned = job(**JOBS[name])
        most = max(memory.total(planned, ranks, rank) for rank in range(ranks))
        waves = sum(held.bytes for held in memory.holdings(planned, ranks) if held.what == "surface spectrum")
        assert most <= memory.total(planned, ranks) <= most + waves


@pytest.mark.mpi
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
    assert len(rows) < len(planned.timeline())
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
    timeline = planned.timeline()
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


def test_stages_not_tried_are_like_the_others() -> None:
    stages = (StageCost(4, 4, 4.0, {"fft": 40.0}), StageCost(6))
    seen = Sample(job(), 1, 0.0, 0.0, 0.0, 0, stages)
    assert seen.total("fft") == 100.0
    assert seen.total("never counted") == 0.0


MACHINE = Machine(cores=8, crowding=1.5, per_call=1e-5, copy_rate=1e10)


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


def test_all_ranks_try_the_same_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four ranks could try a finer grid than one in the time given; they are told not to."""
    large = job(grid={"points": 512}, history=[CELLS])
    alone = trial.grid_for(large, 1, 0.5)
    assert alone is not None
    assert alone.grid.points != trial.grid_for(large, 4, 0.5).grid.points  # type: ignore[union-attr]
    asked: list[list[str]] = []
    monkeypatch.setattr(subprocess, "run", lambda command, **_: asked.append(command))
    assert list(other_ranks.samples(alone, ["job.yaml"], [2, 4], 0.5)) == []  # nothing was left
    options = [words.understand(command[command.index("plan") :]) for command in asked]
    assert [option.sample_points for option in options] == 2 * [alone.grid.points]
    seen = try_job(large, Slab(MPI.COMM_SELF, 512, 512), 1e-3, 0.0, options[0].sample_points)
    assert seen is not None
    assert seen.job == alone


def test_the_most_that_is_held() -> None:
    """The first solve of 256 x 256 points is found on nested grids, whose maps are gone afterwards."""
    planned = job(grid={"points": 256}, surface={**ROUGH, "short_wavelength": 6.25e-5})
    seen = sample(planned, Slab(MPI.COMM_SELF, 256, 256), 1e6)
    march, _ = marched(planned)
    tally = march.scene.slab.tally
    assert tally["map bytes at most"] > 1.1 * tally["map bytes"]
    assert Costs(Scaling.of(planned, [seen], MACHINE), 1e9).held(1) == tally["map bytes at most"]
    assert Costs(Scaling.of(planned, [replace(seen, held=0)], MACHINE), 1e9).held(1) == tally["map bytes"]


@pytest.mark.parametrize("name", JOBS)
def test_a_tiny_scene_has_all_that_runs(name: str) -> None:
    """The same effects as the job, on 16 points along each side: what is compiled for it is compiled for the job."""
    planned = job(**JOBS[name])
    small = trial.tiny(planned)
    assert small is not None
    assert max(small.grid.points) == 16
    assert decisions.isolated(small).on == decisions.isolated(planned).on
    assert small.numerics.map_type == planned.numerics.map_type
    assert (small.material, small.history) == (planned.material, planned.history)


def test_a_large_job_is_tried_on_a_coarser_grid() -> None:
    large = job(grid={"points": 2**14}, history=[CELLS])
    tried = trial.grid_for(large, 1, 1.0)
    assert tried is not None
    assert max(tried.grid.points) <= 1024
    assert tried.grid.size == large.grid.size
    assert len(tried.timeline()) < len(large.timeline())
    seen = Sample(tried, 1, 0.0, 1.0, 0.0, 0, (StageCost(9, 9, 9.0, {"seconds": 9.0}),))
    assert Scaling.of(large, [seen], MACHINE).steps == len(large.timeline())
    ratio = Scaling.of(large, [seen], MACHINE).step(1) / Scaling.of(tried, [seen], MACHINE).step(1)
    assert ratio > large.grid.nx**2 / tried.grid.nx**2
    assert trial.grid_for(job(), 1, 10.0) == job()


def test_plan(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a user reads it; nothing is written."""
    monkeypatch.chdir(tmp_path)
    text = "grid: {points: 32, size: 1.0e-3}\nsurface: {shape: sphere, radius: 1.0e-2}\n"
    text += "material: {model: elastic, shear_modulus: 1.0e6}\nhistory: [{pressure: 1.0e4}]\n"
    (tmp_path / "job.yaml").write_text(text)
    (tmp_path / "parcontact.py").write_text("open('executed', 'w')")  # where Python would look first
    assert __main__.main(["plan", "job.yaml", "--ranks", "1,2,1000", "--cores", "4", "--seconds", "1"]) == 0
    said = capsys.readouterr().out
    assert "on   checkpoints" in said
    assert "off  viscoelasticity" in said
    assert "1 steps: stage 1 1" in said
    assert "scaling ends at" in said
    assert "tried: 1 steps on 1 rank in" in said
    assert ("tried: 1 steps on 2 ranks in" in said) == (machine.cores() > 1)  # by two processes started for it
    assert sorted(path.name for path in tmp_path.iterdir()) == ["job.yaml", "parcontact.py"]


@pytest.mark.parametrize("words", [["--ranks", "0"], ["--ranks", "two"], ["--network", "1"], ["--cores", "-1"]])
def test_bad_options(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        __main__.main(["plan", "job.yaml", *words])
    assert ended.value.code == 2
    assert "must be" in capsys.readouterr().err


def test_what_cannot_be_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No mpirun, no sample; a place that cannot be written to, a guess."""
    monkeypatch.setattr(other_ranks, "MPIRUN", tmp_path / "absent")
    assert list(other_ranks.samples(job(), ["job.yaml"], [2], 1.0)) == []
    assert machine.write_rate(Path("/proc/out")) == machine.SLOW_WRITE
    assert machine.write_rate(tmp_path / "not" / "yet") > 0.0
    assert list(tmp_path.iterdir()) == []


def test_too_large_for_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no memory for any grid, nothing is tried."""
    monkeypatch.setattr(trial, "free_bytes", lambda: 1000)
    assert trial.grid_for(job(), 1, 10.0) is None


# -- a busy machine ----------------------------------------------------------------------------------------------------


def planned_times(shares: dict[int, float], points: int = 64) -> list[str]:
    """The table of a job that was tried on some ranks, which had such a share of their cores."""
    planned = job(grid={"points": points})
    counts = {"seconds": 1.0, "operator": 10.0}
    samples = [
        Sample(planned, ranks, 0.0, 1.0, 0.0, 0, (StageCost(1, 1, 1.0, counts),), share=share)
        for ranks, share in shares.items()
    ]
    return list(report.times(Costs(Scaling.of(planned, samples, MACHINE), 1e9), (1, 2, 4)))


def test_what_other_programs_have_disturbed_is_marked() -> None:
    """A trial that waited for its cores: a warning, and a mark on all that follows from it."""
    quiet, busy = planned_times({1: 1.0, 2: 0.95}), planned_times({1: 1.0, 2: 0.46})
    assert not [line for line in quiet if "busy" in line or report.MARK in line]
    assert "busy with other programs" in busy[0]
    assert "46% of a core each on 2 ranks" in busy[0]
    assert [report.MARK in line for line in busy[2:5]] == [False, True, True]  # 4 ranks follow from 2
    assert "rank*:" in busy[5] or "ranks*:" in busy[5]


def test_waiting_for_a_core_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The share is the time of the process over that of the clock, here one that runs at twice its speed."""
    clock = time.perf_counter
    monkeypatch.setattr(time, "perf_counter", lambda: 2.0 * clock())
    seen = sample(job(), Slab(MPI.COMM_SELF, 48, 40), 0.1)
    assert seen.share < 0.6
    assert seen.disturbed


@pytest.mark.parametrize(("points", "unit"), [(64, "MB"), (2**15, "GB")])
def test_units_of_memory(points: int, unit: str) -> None:
    """A number that a reader can take in: never one of seven digits."""
    head, *rows, _ = report.maps(job(grid={"points": points}), [1, 64])
    assert head.startswith(f"memory per rank [{unit}]")
    assert all(0.0 <= float(number) < 1e6 for row in rows for number in row.split()[-2:])
    assert all("e+" not in row for row in rows)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (12.34, "12.3 s"),
        (599.6, "600 s"),
        (3660.0, "01h01m"),
        (86400.0 * 2.5, "2.5 days"),
        (7.79e3 * 86400.0, "21.3 years"),
    ],
)
def test_times_as_people_tell_them(seconds: float, text: str) -> None:
    """No longer than a column of a table, so that one can be told from the next."""
    assert report.duration_text(seconds) == text
    assert len(text + report.MARK) <= 11


# -- steady states -----------------------------------------------------------------------------------------------------

CURVE: Json = {"velocities": [1e-3, 1e-2, 0.1, 1.0], "pressures": [1e4, 3e4]}


@pytest.mark.mpi
def test_steady_states_are_tried_as_they_are_solved(comm: MPI.Intracomm) -> None:
    """All of them, in another order: the states and transforms are those of the verb, as each starts from nothing."""
    planned = job(material=TWO, history=[], steady=CURVE)
    slab = Slab(comm, *planned.grid.points)
    sliding = SteadySliding(scene.frame(planned, slab))
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


def test_steady_states_beside_a_history() -> None:
    """They are planned on their own, under the pressures that the verb would take."""
    planned = job(material=TWO, history=[CELLS], steady={"velocities": [0.1]})
    steady, words = only_steady_states(planned)
    assert steady.history == ()
    assert steady.steady is not None
    assert steady.steady.pressures == (1e4,)
    assert words == ["--set", "steady.pressures=[10000.0]", "--set", "history=[]", "--set", "initial={state: virgin}"]


def test_plan_of_steady_states(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: Any) -> None:
    """As a user reads it, for the steady section of a job with a history; by two processes too."""
    monkeypatch.chdir(tmp_path)
    compiled = private.directory("compiled")
    assert compiled is not None
    unfinished = shutil.ignore_patterns("*.tmp.*")  # of others that compile now: gone when they are done
    kept = tmp_path / "cache" / "parcontact" / "compiled"  # processes need not compile anew
    shutil.copytree(compiled, kept, ignore=unfinished)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    planned = job(grid={"points": 20}, steady={"velocities": [1e-2, 0.1]})
    (tmp_path / "job.yaml").write_text(planned.resolved())
    assert __main__.main(["plan", "job.yaml", "--ranks", "1,2", "--seconds", "1"]) == 0
    said = capsys.readouterr().out
    assert "1 steps: stage 1 1" in said
    assert "parcontact steady: 2 steady states, 2 velocities" in said
    assert re.search(r"tried: [12] states on 1 rank in", said)
    assert bool(re.search(r"tried: [12] states on 2 ranks in", said)) == (machine.cores() > 1)
    assert "state [s]" in said


SWEEP = {"history": [SLIDE], "sweep": [{"history.0.duration": [1e-3, 2e-3, 4e-3]}]}


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


def test_plan_of_a_whole_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**plain(job()), **SWEEP}))
    assert __main__.main(["plan", str(tmp_path / "job.yaml"), "--seconds", "0.1", "--ranks", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "first of 3 cases: history.0.duration = 0.001" in lines
    assert lines[-3] == "sweep of 3 cases: 0, 1, 2 were tried"
    assert re.fullmatch(r" +1 rank: \S+( s)?\*? in all, one case after the other", lines[-1])
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]
