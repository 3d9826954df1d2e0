"""The program as a user starts it: exit codes, messages, nothing written for bad input."""

import os
import re
import subprocess
import time
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from conftest import Main, RunParcontact
from csv_rows import measures
from short_job import JOB, STEPS

from parcontact import __main__
from parcontact.door.arguments import NAMES, wall_seconds
from parcontact.files import stopping


def job(path: Path, **changes: Any) -> Path:
    path.write_text(yaml.safe_dump(JOB | changes))
    return path


def line_of(lines: Sequence[str], step: int) -> str:
    return next(line for line in lines if line.split()[0] == str(step))


def test_from_job_to_result(run_parcontact: RunParcontact, tmp_path: Path) -> None:
    """On two ranks; the same command again finds that it is done."""
    job(tmp_path / "job.yaml")
    done = run_parcontact(["job.yaml"], ranks=2)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[0] == "job: 16 x 12 points on 2 ranks"
    table = [line.split()[0] for line in lines[1:-1] if line.startswith("    ")]
    assert table == ["step", *map(str, range(STEPS + 1))]
    farewell = [line.split()[0] for line in lines[lines.index(line_of(lines, STEPS)) + 1 : -1]]
    assert farewell == ["mu_max,", "mu_dyn,", "the", "largest", "estimated", "estimated"], done.stdout
    assert lines[-1] == "done: results in out/job"
    out = tmp_path / "out" / "job"
    assert [int(row["step"]) for row in measures(out)] == list(range(STEPS + 1))
    assert {path.name for path in out.iterdir()} == {
        *("measures.csv", "run.log", "job.yaml", "job.resolved.yaml", "checkpoint", ".parcontact")
    }
    again = run_parcontact(["job.yaml"], ranks=2)
    assert again.returncode == 0
    assert "finished before, at t = 0.0035 s" in again.stdout
    assert len(measures(out)) == STEPS + 1


BAD: list[tuple[Sequence[str], str]] = [
    (["absent.yaml"], "absent.yaml"),
    (["broken.yaml"], "broken.yaml:1:"),
    (["job.yaml", "--set", "grid.points=0"], "grid.points must be a positive whole number"),
    (["job.yaml", "--set", "grid.pionts=8"], "did you mean"),
    (["job.yaml", "--out", "file/out"], "the output directory file/out cannot be written: Not a directory"),
    (["job.yaml", "--out", "/proc/out"], "the output directory /proc/out cannot be written: No such file"),
    (["job.yaml", "--restart", "absent.h5"], "absent.h5 cannot be read: No such file or directory"),
    (["job.yaml", "--restart", "file"], "file is incomplete or damaged: it has no seal"),
    (["job.yaml", "--until", "-1"], "must be a time [s] of zero or more, got '-1'"),
    (["job.yaml", "--wall", "soon"], "must be a wall time HH:MM:SS, got 'soon'"),
    (["job.yaml", "--sett", "grid.points=8"], "unrecognized arguments"),
    (["info", "absent.h5"], "absent.h5 does not exist"),
    (["info", "job.yaml"], "job.yaml is neither a checkpoint nor a field file: it is not an HDF5 file"),
    (
        ["plot", "job.yaml"],
        "it has neither measures.csv nor steady.csv; give the output directory of a run, such as out/job",
    ),
    ([], "parcontact: a job is needed"),
    (["plt", "out/job"], "'plt' is neither a verb nor a job file; did you mean plot?"),
    (["hlep"], "did you mean help?"),
    (["steady", "job.yaml", "--velocities", "0:10:5"], "first and last must be above 0, got '0:10:5'"),
    (["steady", "job.yaml", "--velocities", "1:10:1"], "must have a count of 2 or more, got '1:10:1'"),
    (["steady", "job.yaml", "--velocities", "1:10"], "must be first:last:count or a list of numbers, got '1:10'"),
    (["--out", "", "job.yaml"], "must name a directory, got ''"),
    (["heights.yaml"], "heights.npy has shape (3, 4), but the grid has (ny, nx) = (12, 16)"),
    (["curve.yaml", "--until", "1"], "--until: a friction curve has no time; leave it out"),
    (["one_solve.yaml", "--until", "1"], "--until 1 is beyond the end of the history, t = 0 s"),
]


@pytest.mark.parametrize(("words", "message"), BAD)
def test_bad_input(main: Main, tmp_path: Path, words: Sequence[str], message: str) -> None:
    """One message, exit code 2, and nothing written."""
    job(tmp_path / "job.yaml")
    job(tmp_path / "one_solve.yaml", history=[{"pressure": 1e4}])
    job(tmp_path / "curve.yaml", history=[], steady={"velocities": [0.1], "pressures": [1e4]})
    np.save(tmp_path / "heights.npy", np.zeros((3, 4)))
    job(tmp_path / "heights.yaml", surface={"shape": "file", "path": "heights.npy"})
    (tmp_path / "broken.yaml").write_text("{")
    (tmp_path / "file").write_text("")
    before = sorted(tmp_path.rglob("*"))
    code, out, err = main(*words)
    assert code == 2
    assert message in err
    assert out == ""
    assert err.count(message) == 1
    assert "Traceback" not in err
    assert sorted(tmp_path.rglob("*")) == before


def test_ranks_that_are_alone(run_parcontact: RunParcontact, outside_mpi: dict[str, str], tmp_path: Path) -> None:
    """A launcher of another MPI starts ranks that do not see each other: each of them refuses."""
    job(tmp_path / "job.yaml")
    outside_mpi["PMI_SIZE"] = "2"
    alone = run_parcontact(["job.yaml"], ranks=0)
    assert alone.returncode == 2
    assert "2 ranks were started but each is alone" in alone.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]


def test_until(main: Main, tmp_path: Path) -> None:
    """Stops after the first step that reaches it; goes on; extends a finished run by its last stage."""
    path = job(tmp_path / "job.yaml")
    out = tmp_path / "out" / "job"
    code, said, _ = main(path, "--until", "6e-4")
    assert code == 0
    assert "stopped at t = 0.00075 s as requested" in said
    assert measures(out)[-1]["time"] == "0.00075"
    assert "has already reached t = 0.00075 s, and --until 0.0006 is not later" in main(path, "--until", "6e-4")[1]
    assert main(path, "--quiet") == (0, "", "")
    assert len(measures(out)) == STEPS + 1
    assert main(path, "--quiet", "--until", "0.005")[0] == 0
    extended = measures(out)
    assert [int(row["step"]) for row in extended] == list(range(len(extended)))
    assert float(extended[-2]["time"]) < 0.005 <= float(extended[-1]["time"])
    steps = [float(b["time"]) - float(a["time"]) for a, b in pairwise(extended[5:])]
    assert all(step == pytest.approx(6.25e-4, rel=1e-9) for step in steps)
    assert main(path, "--quiet", "--out", "at-once", "--until", "0.005")[0] == 0
    assert extended == measures(tmp_path / "at-once")


def test_wall_limit_of_a_chain(main: Main, tmp_path: Path) -> None:
    """Each run stops by itself, with a checkpoint, and says so; together they complete the history."""
    path = job(tmp_path / "job.yaml")
    codes: list[int] = []
    while not codes or codes[-1] == 3:
        code, said, _ = main(path, "--wall", "0:01")  # this process is older: one step each
        codes.append(code)
        assert ("the wall time is nearly used up; run again to go on" in said) == (code == 3)
    assert codes == [3] * (STEPS - 1) + [0]
    assert [int(row["step"]) for row in measures(tmp_path / "out" / "job")] == list(range(STEPS + 1))
    assert main(path, "--quiet", "--out", "at-once")[0] == 0
    assert measures(tmp_path / "out" / "job") == measures(tmp_path / "at-once")


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("90", 90.0), ("2:30", 150.0), ("01:00:00", 3600.0), ("1-12:00:00", 129600.0), ("100:00:00", 360000.0)],
)
def test_wall_times(text: str, seconds: float) -> None:
    assert wall_seconds(text) == seconds


def test_end_of_a_batch_job() -> None:
    """The earliest limit holds; times are those of the batch system or of this process's start, kept by a clock that
    nobody sets."""
    assert stopping.limit_time(None, {}) is None
    born = stopping.limit_time(0.0, {})
    assert born is not None
    assert 0.0 < time.monotonic() - born < 3600.0
    epoch = born + time.time() - time.monotonic()
    soon, late = repr(epoch + 100.0), repr(epoch + 200.0)
    near = partial(pytest.approx, abs=0.1)
    assert stopping.limit_time(300.0, {"SLURM_JOB_END_TIME": late}) == near(born + 200.0)
    assert stopping.limit_time(None, {"PARCONTACT_END_TIME": soon, "SLURM_JOB_END_TIME": late}) == near(born + 100.0)
    assert stopping.limit_time(None, {"SLURM_JOB_END_TIME": repr(epoch - 1.0)}) is None  # of an earlier job
    assert stopping.limit_time(None, {"PBS_WALLTIME": "60"}) == near(born + 60.0)
    assert stopping.limit_time(50.0, {"PBS_WALLTIME": "60"}) == near(born + 50.0)


def test_limit_of_a_clock_that_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """The wall time goes on as it did when somebody sets the clock of the day a year ahead."""
    before = stopping.limit_time(60.0, {})
    monkeypatch.setattr(time, "time", lambda: 1e10)
    assert stopping.limit_time(60.0, {}) == pytest.approx(before, abs=0.1)


def test_info_and_check(main: Main, tmp_path: Path) -> None:
    path = job(tmp_path / "job.yaml", output={"fields": ["pressure"], "every": 3})
    assert main(path, "--quiet")[0] == 0
    code, said, _ = main("info", f"out/job/checkpoint/step-{STEPS}.h5")
    assert code == 0
    assert said.splitlines()[-1] == "sound: every row matches its checksum"
    assert "3 of 3 instants saved" in main("info", "out/job/fields.h5")[1]
    with (tmp_path / "out/job/checkpoint" / f"step-{STEPS}.h5").open("r+b") as file:
        file.seek(-9, os.SEEK_END)
        file.write(b"damage")
    code, said, _ = main("info", f"out/job/checkpoint/step-{STEPS}.h5")
    assert code == 2
    assert "is damaged" in said
    assert main("check", path)[0] == 0


@pytest.mark.parametrize("verb", [["check"], ["plan", "--seconds", "0.1"]])
def test_doubts_of_a_sweep_are_stated_once(main: Main, tmp_path: Path, verb: list[str]) -> None:
    """Each kind of them, of the heights too, which the job alone does not tell; numbers differ from case to case."""
    rough = {"hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 2.5e-4, "rms_height": 6e-5}
    changes = {"surface": {"shape": "rough", **rough}, "sweep": {"surface.0.seed": [1, 2]}}
    code, out, _ = main(*verb[:1], job(tmp_path / "job.yaml", **changes), *verb[1:])
    stated = [line for line in out.splitlines() if "its rms slope is" in line]
    assert code == 0
    assert len(stated) == 1
    assert stated[0].endswith("(cases 0-1)")


def test_check_reads_a_measured_road(main: Main, tmp_path: Path) -> None:
    np.save(tmp_path / "road.npy", np.zeros((8, 8)))
    path = job(tmp_path / "job.yaml", surface={"shape": "topography", "path": "road.npy", "size": [1e-3, 1e-3]})
    code, _, said = main("check", path)
    assert code == 2
    assert said.endswith("does not say the unit of its heights: give unit: m | mm | um | nm\n")


def test_help_is_a_verb(main: Main) -> None:
    assert main("help") == main("--help")
    assert main("help", "plan") == main("plan", "--help")
    assert f"{stopping.RESERVE_SECONDS:g} s and twice the longest step" in " ".join(main("help", "run")[1].split())


def test_options_may_come_first(main: Main, tmp_path: Path) -> None:
    path = job(tmp_path / "job.yaml")
    assert main("--quiet", "--until", "0", path)[0] == 0
    assert (tmp_path / "out" / "job").is_dir()


@pytest.mark.parametrize(
    "name", ["5", "{a}", "~", "u #x", "1e3", "null", "- a", "\xfc: \U0001f6de", '"q"', "a\\b", "\x7f"]
)
def test_out_is_taken_literally(main: Main, tmp_path: Path, name: str) -> None:
    """Whatever YAML would read in it."""
    path = job(tmp_path / "job.yaml")
    assert main("check", path, "--out", name)[0] == 0
    assert main(path, "--quiet", "--until", "0", "--out", name)[0] == 0
    assert sorted(found.name for found in tmp_path.iterdir()) == sorted(["job.yaml", name])


def test_completion_knows_every_verb_and_is_bash(capsys: pytest.CaptureFixture[str]) -> None:
    """Bash reads it without a mistake, and the verbs and an option of one are in it."""
    with pytest.raises(SystemExit) as end:
        __main__.main(["--print-completion", "bash"])
    script = capsys.readouterr().out
    assert end.value.code == 0
    assert subprocess.run(["bash", "-n"], input=script, text=True, check=False).returncode == 0
    assert all(re.search(rf"subparsers=.*\b{verb}\b", script) for verb in NAMES)
    assert "--velocities" in script
