"""The plan of a job as a user reads it: of runs, steady states and sweeps, also on a busy machine."""

import re
import shutil
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from mpi4py import MPI

import parcontact as pc
from parcontact import __main__, private
from parcontact.job.sections.listing import plain
from parcontact.parallel.slab import Slab
from parcontact.plan import machine, other_ranks, report
from parcontact.plan.planning import only_steady_states
from parcontact.plan.report import Costs
from parcontact.plan.sample import Sample, StageCost, sample
from parcontact.plan.scaling import Scaling

from .planned import CELLS, MACHINE, SWEEP, TWO, job


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
    planned = job(grid={"points": 20}, material=TWO, steady={"velocities": [1e-2, 0.1]}, numerics={"accuracy": 0.5})
    (tmp_path / "job.yaml").write_text(planned.resolved())
    assert __main__.main(["plan", "job.yaml", "--ranks", "1,2", "--seconds", "1"]) == 0
    said = capsys.readouterr().out
    assert "1 steps: stage 1 1" in said
    assert "parcontact steady: 2 steady states, 2 velocities" in said
    assert re.search(r"tried: [12] states on 1 rank in", said)
    assert bool(re.search(r"tried: [12] states on 2 ranks in", said)) == (machine.cores() > 1)
    assert "state [s]" in said
    steady = said[said.index("parcontact steady:") :]
    told = re.search(r"operator calls a state, errors of ([\d.]+) % by the mesh", steady)
    assert told
    found = pc.steady(planned)
    assert 0.01 * float(told[1]) == pytest.approx(found.error_friction.mean(), rel=0.2)  # the rest is the solver's


def test_plan_of_a_whole_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**plain(job()), **SWEEP}))
    assert __main__.main(["plan", str(tmp_path / "job.yaml"), "--seconds", "0.1", "--ranks", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "first of 3 cases: history.0.duration = 0.001" in lines
    assert lines[-3] == "sweep of 3 cases: 0, 1, 2 were tried"
    assert re.fullmatch(r" +1 rank: \S+( s)?\*? in all, one case after the other", lines[-1])
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]
