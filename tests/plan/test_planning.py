"""The plan of a job as a user reads it: of runs, steady states and sweeps, also on a busy machine."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from mpi4py import MPI

from parcontact import __main__
from parcontact.door import plan
from parcontact.door.plan import Planner, case_times, cases_to_try, only_steady_states
from parcontact.job import load_cases
from parcontact.job.listing import plain_data
from parcontact.parallel.slab import Groups

from .planned import CELLS, SWEEP, TWO, job


def test_plan(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a user reads it; nothing is written."""
    monkeypatch.chdir(tmp_path)
    text = "grid: {points: 32, size: 1.0e-3}\nsurface: {shape: sphere, radius: 1.0e-2}\n"
    text += "material: {model: elastic, shear_modulus: 1.0e6}\nhistory: [{pressure: 1.0e4}]\n"
    (tmp_path / "job.yaml").write_text(text)
    (tmp_path / "parcontact.py").write_text("open('executed', 'w')")  # where Python would look first
    assert __main__.main(["plan", "job.yaml", "--ranks", "1,2,1000", "--seconds", "5"]) == 0
    said = capsys.readouterr().out
    assert "on   checkpoints" in said
    assert "off  viscoelasticity" in said
    assert "1 steps: stage 1 1" in said
    assert re.search(r"memory per rank \[MB\] +1 rank +2 ranks +1000 ranks", said)
    assert re.search(r"time +1 rank +2 ranks +1000 ranks\n  a step \[s\]( +\S+){3}\n  in all ( +\S+ s){3}\n", said)
    assert "tried: 1 steps on 1 rank\n" in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["job.yaml", "parcontact.py"]


@pytest.mark.parametrize("words", [["--ranks", "0"], ["--ranks", "two"], ["--seconds", "-1"]])
def test_bad_options(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        __main__.main(["plan", "job.yaml", *words])
    assert ended.value.code == 2
    assert "must be" in capsys.readouterr().err


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
    """No longer than a column of a table, so that one can be stated from the next."""
    assert plan.duration_text(seconds) == text
    assert len(text) < 11


def test_steady_states_of_a_job_with_history() -> None:
    """They are planned on their own, under the pressures that the verb would take."""
    steady = only_steady_states(job(material=TWO, history=[CELLS], steady={"velocities": [0.1]}))
    assert steady.history == ()
    assert steady.steady is not None
    assert steady.steady.pressures == (1e4,)


def test_plan_of_steady_states(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: Any) -> None:
    """As a user reads it, for the steady section of a job with a history."""
    monkeypatch.chdir(tmp_path)
    planned = job(grid={"points": 20}, material=TWO, steady={"velocities": [1e-2, 0.1]})
    (tmp_path / "job.yaml").write_text(planned.resolved())
    assert __main__.main(["plan", "job.yaml", "--ranks", "1,2", "--seconds", "5"]) == 0
    said = capsys.readouterr().out
    assert "1 steps: stage 1 1" in said
    assert "parcontact steady: 2 steady states, 2 velocities" in said
    assert re.search(r"tried: [12] states on 1 rank", said)
    assert re.search(r"\n  a state \[s\] +\S+ +\S+\n", said)
    assert re.search(r"\n  steady states +\S+ +\S+\n", said)


def test_plan_of_a_whole_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**plain_data(job()), **SWEEP}))
    assert __main__.main(["plan", str(tmp_path / "job.yaml"), "--seconds", "5", "--ranks", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "first of 3 cases: history.0.duration = 0.001" in lines
    assert lines[-3] == "sweep of 3 cases: 0, 1, 2 were tried"
    assert lines[-2].startswith("the longest case takes ")  # of no other cases anything is assumed
    assert re.fullmatch(r"on 1 rank: \S+( s)?\*? in all, one case after the other", lines[-1])
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]


def test_times_of_a_sweep_add_up() -> None:
    """Work goes with the steps; a case that was not tried is like the nearest one that was."""
    cases = load_cases({**plain_data(job()), **SWEEP})
    steps = [11, 21, 41]  # with the jump of the load
    assert case_times(cases, {0: 1.0}) == pytest.approx([count / 11 for count in steps])
    assert case_times(cases, {0: 1.0, 2: 3.0}) == pytest.approx([1, 21 / 11, 3.0])
    assert [cases_to_try(count) for count in (1, 2, 3, 21)] == [[0], [0, 1], [0, 1, 2], [0, 10, 20]]


@pytest.mark.mpi(2)
def test_small_cases_are_planned_side_by_side(comm: MPI.Intracomm) -> None:
    """Each group tries the first case on its own ranks; all have the same lines."""
    cases = load_cases({**plain_data(job()), **SWEEP})
    lines = list(Planner([1], 5.0, 0.0).plan_sweep(cases, Groups(comm, 2)))
    assert any(line.startswith("tried: ") and "on 1 rank" in line for line in lines)
    assert re.fullmatch(
        rf"on {comm.size} ranks?: .* in all, {'2 cases at a time' if comm.size > 1 else '.*'}", lines[-1]
    )


PEAK = "import sys; from parcontact.__main__ import main; from parcontact.door.plan import peak_memory; "
PEAK += "code = main(sys.argv[1:]); print('peak', peak_memory()); sys.exit(code)"


def test_memory_to_ask_a_batch_system_for(tmp_path: Path, outside_mpi: dict[str, str]) -> None:
    """A run takes no more than the plan says, and no less than 0.7 of it: maps of a first solve on coarser grids and
    libraries are counted at their most. The maps are a quarter of it or more."""
    (tmp_path / "job.yaml").write_text(job(grid={"points": 1024}, material=TWO).resolved())

    def said(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, "-c", PEAK, *words], cwd=tmp_path, env=outside_mpi, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    said("job.yaml", "--quiet", "--set", "grid.points=256", "--out", "small")  # the compiler would take memory, too
    words = ("plan", "job.yaml", "--ranks", "1", "--seconds", "0.1")
    said(*words, "--set", "grid.points=256")
    text = said(*words)
    program, asked = (
        1e6 * float(re.findall(rf"{what} +(\S+)$", text, re.M)[0])
        for what in ("program without maps", "to ask a batch system for")
    )
    assert asked > 1.3 * program
    (peak,) = re.findall(r"peak (\d+)", said("job.yaml", "--quiet"))
    assert 0.7 * asked < float(peak) < asked
