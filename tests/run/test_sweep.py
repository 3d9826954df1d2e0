"""Sweeps as a user runs them: all cases or one, stopped and gone on with, and what they come to."""

import errno
import fcntl
import math
import os
import re
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from conftest import RunParcontact
from mpi4py import MPI
from sweeping import JOB, table

from parcontact.__main__ import main
from parcontact.door import memory
from parcontact.errors import InputError, RunError
from parcontact.files import files, outputs, stopping, sweep, tables
from parcontact.files.stopping import StopFile
from parcontact.job import Case, Job, load_cases
from parcontact.march.sanity import WARN_CELLS, WARN_EDGE
from parcontact.parallel.root import Signals
from parcontact.parallel.slab import Groups, Slab
from parcontact.results import info, slide

LEAVING = """
grid: {points: 32, size: 1.0e-3, boundary: free}
surface: {shape: sphere, radius: 1.0e-3}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0}]}
history: [{force: 2.0e-2}, {force: 2.0e-2, velocity: 1.0e-3, distance: 5.0e-4}]
sweep: [{history.1.velocity: [1.0e-3]}]
numerics: {accuracy: 0.1}
"""
OSCILLATING = """
grid: {points: 16, size: 1.2e-3, boundary: free}
surface: {shape: sphere, radius: 1.0e-2}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0e-2}]}
history: [{force: 4.0e-2, duration: 0.1}, {force: {mean: 4.0e-2, amplitude: 4.0e-3, frequency: 8.0}, cycles: 1}]
sweep: [{history.1.force.frequency: [2.0, 8.0]}]
numerics: {accuracy: 0.2}
"""
CELLS = {"excess": 0.2, "most": 0.15, "finer": "more points"}  # of a doubt about contacts of few cells


@pytest.fixture
def cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Case, ...]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(JOB)
    return load_cases("job.yaml")


def cases_in_groups(directory: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[tuple[Case, ...], Groups]:
    """The cases of the job in a directory that all ranks see, and two groups of ranks for them, or one; collective."""
    monkeypatch.chdir(directory)
    if MPI.COMM_WORLD.rank == 0:
        (directory / "job.yaml").write_text(JOB)
    MPI.COMM_WORLD.Barrier()
    return load_cases("job.yaml"), Groups(MPI.COMM_WORLD, 2)


def go(cases: tuple[Case, ...], act: Callable[[Job, Slab], int]) -> int:
    groups, stop = Groups(MPI.COMM_SELF), sweep.stop_file(cases)
    return sweep.SweepRun(cases, groups, lambda job, slab, _: act(job, slab), stop, quiet=True).run(cases)


def seeds_done(cases: tuple[Case, ...], codes: dict[int, int]) -> tuple[int, list[int]]:
    """The code of a sweep whose cases end with these codes (else 0), and the seeds of the cases that were begun."""
    begun = []

    def act(job: Job, slab: Slab) -> int:
        begun.append(job.surface[0].seed)  # type: ignore[union-attr]
        if (code := codes.get(len(begun) - 1, 0)) == 1:
            raise RunError("the third law does not hold; try another planet")
        return code

    return go(cases, act), begun


def test_a_full_disk_ends_no_case(
    cases: tuple[Case, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Tables of the sweep that cannot be written are said in a sentence, and the code is 1; all cases are done."""

    def full(path: Path, text: str) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files, "replace_file", full)
    assert seeds_done(cases, {}) == (1, [1, 2, 3, 1, 2, 3])
    assert "cannot write the tables of out/job: No space left on device; run again" in capsys.readouterr().err


def test_a_case_that_fails_does_not_stop_the_others(
    cases: tuple[Case, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert seeds_done(cases, {1: 1}) == (1, [1, 2, 3, 1, 2, 3])
    assert capsys.readouterr().err == "parcontact: case 1: the third law does not hold; try another planet\n"
    assert [row["state"] for row in table()] == ["-", "failed", "-", "-", "-", "-"]
    stated, _ = info.describe_path(cases[0].job.output.directory.parent.parent)
    assert stated.splitlines()[-1] == "  case 1 failed: the third law does not hold"
    assert seeds_done(cases, {})[0] == 0
    assert [row["state"] for row in table()] == ["-"] * 6


@pytest.mark.parametrize(("refused", "code"), [(range(6), 2), (range(5), 1), ((), 0)])
def test_a_sweep_is_bad_input_if_all_of_its_cases_are(
    cases: tuple[Case, ...], refused: Sequence[int], code: int
) -> None:
    """2 if no case can be run, as for a job without a sweep; 1 if some of them can."""
    begun = list[Job]()

    def act(job: Job, slab: Slab) -> int:
        begun.append(job)
        job.output.directory.mkdir(parents=True)
        job.output.directory.rmdir()  # as a case does that ends while another one runs
        if len(begun) - 1 in refused:
            raise InputError("the third law does not hold")
        return 0

    assert go(cases, act) == code
    assert len(begun) == 6
    written = cases[0].job.output.directory.parent.parent.exists()
    assert written == (code != 2)
    assert not written or [row["state"] for row in table()].count("failed") == len(refused)


def test_a_refused_theory_of_a_sweep_writes_nothing(
    cases: tuple[Case, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wave has no isotropic spectrum, in no case of the sweep."""
    words = ["theory", "job.yaml", "--set", "surface={shape: wave, amplitude: 1.0e-6, waves: [2, 1]}"]
    assert main([*words, "--set", "sweep=[{history.0.pressure: [1.0e5, 2.0e5]}]"]) == 2
    said = capsys.readouterr()
    assert said.err.count("the theory takes the power spectrum of one isotropic rough surface") == 2
    assert "results of all cases" not in said.out
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]


@pytest.mark.parametrize("damage", [lambda text: text[: len(text) // 2], lambda text: text + "x\n", None])
def test_a_finished_case_whose_table_lacks_rows_is_damaged(
    cases: tuple[Case, ...], capsys: pytest.CaptureFixture[str], damage: Callable[[str], str] | None
) -> None:
    """Its checkpoint is at the end, so that no run adds them: the message says what to do."""
    assert main(["job.yaml", "--case", "0", "--quiet"]) == 0
    directory = cases[0].job.output.directory
    csv = directory / "measures.csv"
    whole = csv.read_text()
    csv.unlink() if damage is None else csv.write_text(damage(whole))
    assert main(["job.yaml", "--case", "0", "--quiet"]) == 2  # as for a job without a sweep
    assert f"lacks rows; correct it, or move {directory} away to run the job again" in capsys.readouterr().err
    assert [row["state"] for row in table()] == ["damaged", *"-----"]
    directory.rename("aside")
    assert main(["job.yaml", "--case", "0", "--quiet"]) == 0
    assert [row["state"] for row in table()] == ["done", *"-----"]
    assert len(csv.read_text().splitlines()) == len(whole.splitlines())


def test_a_sweep_ends_with_its_largest_errors(cases: tuple[Case, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """And warns of the cases in which they are more than the accuracy, here one between those of two cases."""
    two = "sweep={surface.seed: [1, 2]}"

    def end(*words: str) -> tuple[list[str], list[str]]:
        assert main(["job.yaml", "--set", two, *words]) == 0
        said = capsys.readouterr()
        lines = [line for line in said.out.splitlines() if line.startswith("largest estimated error of ")]
        return lines[-2:], [line for line in said.err.splitlines() if "exceeds numerics.accuracy" in line]

    stated, warned = end("--set", "numerics.accuracy=0.5")
    for column, what, line in zip(slide.ERRORS, ("friction", "the corrected contact area"), stated, strict=True):
        errors = [float(row[column]) for row in table()]
        worst = errors.index(max(errors))
        assert line == f"largest estimated error of {what}: {100 * max(errors):.3g} %, in case {worst}"
        assert max(errors) < 0.5
        _, beyond = end("--set", f"numerics.accuracy={math.sqrt(errors[0] * errors[1])}")
        warning = f"warning: the estimated error of {what} exceeds numerics.accuracy in case {worst};"
        assert any(text.startswith(warning) for text in beyond)
    assert not warned


def test_a_sweep_of_cycles_ends_with_the_largest_errors_of_its_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The error of the area is the one of its last value; each case has stated its mean over time, which differs."""
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(OSCILLATING)
    assert main(["job.yaml"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("largest estimated error of ")]
    names = ("error_area", "the last value of the corrected contact area"), ("error_loss", "the loss")
    for (column, what), line in zip(names, lines, strict=True):
        errors = [float(row[column]) for row in table()]
        worst = errors.index(max(errors))
        assert line == f"largest estimated error of {what}: {100 * max(errors):.3g} %, in case {worst}"


def test_a_case_that_stops_early_stops_the_sweep(cases: tuple[Case, ...]) -> None:
    assert seeds_done(cases, {2: 3}) == (3, [1, 2, 3])


def test_no_case_begins_when_the_time_is_used_up(cases: tuple[Case, ...], capsys: pytest.CaptureFixture[str]) -> None:
    begun: list[int] = []

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begun.append(1)
        return 0

    for seconds, code in ((1.0, 3), (60.0, 0)):
        limit, alone = stopping.limit_time(stopping.age() + seconds, {}), Groups(MPI.COMM_SELF)
        assert sweep.SweepRun(cases[:2], alone, act, sweep.stop_file(cases), limit=limit).run(cases[:2]) == code
        assert len(begun) == (0 if code else 2)
        described, _ = info.describe_path(cases[0].job.output.directory.parents[1])
        assert "sweep of 2 cases: 2 not begun" in described
    said = capsys.readouterr().out.splitlines()[0]
    assert said == "stopped before case 0: the wall time is nearly used up; run again to go on"


@pytest.mark.mpi
def test_groups_of_ranks_take_cases_by_turns(
    shared_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each unfinished case is done by one group, as many by each; a failure is stated and does not stop the others, and
    a stop file that is made before a case stops all, and stays."""
    (cases, groups), world = cases_in_groups(shared_path, monkeypatch), MPI.COMM_WORLD
    begun: list[int] = []

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        number = int(job.output.directory.name)
        begun.append(number)
        assert slab.comm.size == sum(rank * groups.count // world.size == groups.number for rank in range(world.size))
        where = {**CELLS, "where": f"step {number}"}
        shown = [shows(kind("", where)) for kind in (WARN_EDGE, WARN_EDGE, *[WARN_CELLS] * (number == 5))]
        assert any(shown) == (groups.count == 1 and number in (0, 5))
        if number == 3:
            raise RunError("it fell over")
        return 0

    assert sweep.SweepRun(cases, groups, act, sweep.stop_file(cases)).run(cases) == 1
    assert groups.from_all(begun) == [list(range(6))[number :: groups.count] for number in range(groups.count)]
    said = capsys.readouterr()
    stated = "".join(world.allgather(said.err)).splitlines()
    assert "parcontact: case 3: it fell over" in stated
    assert sum("the edge of the box" in line and line.endswith(" (cases 0-5)") for line in stated) == 1
    rare = f"warning: {WARN_CELLS('', {**CELLS, 'where': 'step 5'})} (case 5)"
    assert (rare in stated) == (groups.count > 1)  # else it was shown at once
    assert ("case 4: done\n" in "".join(world.allgather(said.out))) == (groups.count > 1)
    if world.rank == 0:
        assert [row["state"] for row in table()] == ["-", "-", "-", "failed", "-", "-"]
    stop = sweep.stop_file(cases)
    world.Barrier()
    if world.rank == 0:
        stop.path.touch()
    world.Barrier()
    assert sweep.SweepRun(cases, groups, act, stop).run(cases) == 3
    assert begun == list(range(6))[groups.number :: groups.count]
    assert stop.path.exists()


def test_unfinished_cases_are_dealt_first(cases: tuple[Case, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep, "state_of", lambda case: "done" if case.number in (0, 3) else "begun")
    assert sweep.unfinished_first(cases) == [1, 2, 4, 5, 0, 3]
    assert sweep.to_do(cases, afresh=False) == [cases[number].job for number in (1, 2, 4, 5)]
    assert len(sweep.to_do(cases, afresh=True)) == 6


def test_how_many_cases_are_done_at_a_time(cases: tuple[Case, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """One on each rank as long as cases are small, there are that many, and they fit into the memory."""
    jobs = [case.job for case in cases]
    assert [memory.count_side_by_side(jobs, ranks) for ranks in (1, 2, 4, 40)] == [1, 2, 4, 6]
    assert memory.count_side_by_side(jobs[:1], 4) == 1
    large = jobs[0].model_copy(update={"grid": jobs[0].grid.model_copy(update={"points": (2048, 1024)})})
    assert memory.count_side_by_side([*jobs, large], 4) == 1
    monkeypatch.setattr(memory, "free_bytes", lambda: 8 * 34 * 34 * 10)
    assert memory.count_side_by_side(jobs, 4) == 1


def test_another_jobs_directory_is_refused(cases: tuple[Case, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """As for a single job: one of another scene, or with files of others; then nothing is written."""
    single = {"grid.points": 36, "output.directory": "there"}
    words = [word for key, value in single.items() for word in ("--set", f"{key}={value}")]
    text = JOB[: JOB.index("sweep:")]
    Path("one.yaml").write_text(text)
    assert main(["one.yaml", "--quiet", "--until", "1.0e-3", *words]) in (0, 3)
    Path("mine").mkdir()
    Path("mine/letter.txt").write_text("Dear")
    before = sorted(Path(".").rglob("*"))
    for out, stated in (("there", "there has a run of another job: grid.points"), ("mine", "it has letter.txt")):
        assert main(["job.yaml", "--quiet", "--out", out]) == 2
        assert stated in capsys.readouterr().err
    assert sorted(Path(".").rglob("*")) == before
    sweep.refuse_foreign_sweep(cases)  # the directory of its own job, which may be there already


@pytest.mark.parametrize("planted", ["cases", "cases/001"])
def test_nothing_is_written_through_a_link_in_place_of_a_case(
    cases: tuple[Case, ...], tmp_path: Path, planted: str
) -> None:
    """Where a directory of cases, or of a case, should be."""
    elsewhere, link = tmp_path / "elsewhere", cases[0].job.output.directory.parent.parent / planted
    elsewhere.mkdir()
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(elsewhere)
    with pytest.raises(InputError, match=rf"{planted} is a symbolic link, which is not followed"):
        sweep.refuse_foreign_sweep(cases)


def test_cases_run_on_ranks_and_only_once(run_parcontact: RunParcontact, tmp_path: Path) -> None:
    """Some cases one by one, as a job array has them, then the rest by running the whole; means are over seeds."""
    (tmp_path / "job.yaml").write_text(JOB)
    assert run_parcontact(["job.yaml", "--case", "4", "--quiet"], ranks=0).returncode == 0
    here = tmp_path / "out" / "job"
    assert [row["state"] for row in table(directory=here)] == ["-", "-", "-", "-", "done", "-"]
    before = (here / "cases" / "004" / "measures.csv").stat().st_mtime_ns
    done = run_parcontact(["job.yaml", "--set", "numerics.accuracy=0.5"], ranks=2)
    assert (done.returncode, done.stderr) == (0, "")
    assert "case 5: history.1.velocity = 0.1, surface.seed = 3 (of 6)\n" in done.stdout
    assert "case 5: done\n" in done.stdout
    assert "results of all cases: out/job/sweep.csv\n" in done.stdout  # what another rank says may come after it
    stated = run_parcontact(["info", "out/job"], ranks=0)
    assert stated.returncode == 0
    assert "  sweep of 6 cases: 6 done" in stated.stdout.splitlines()
    assert (here / "cases" / "004" / "measures.csv").stat().st_mtime_ns == before
    assert "34 x 34 points on 1 rank\n" in (here / "cases" / "005" / "run.log").read_text()
    rows, means = table(directory=here), table("sweep_mean.csv", here)
    assert [row["state"] for row in rows] == ["done"] * 6
    assert [row["history.1.velocity"] for row in rows] == ["0.01"] * 3 + ["0.1"] * 3
    assert [row["number"] for row in means] == ["3", "3"]
    for index, mean in enumerate(means):
        values = [float(row["mu_dyn"]) for row in rows[3 * index : 3 * index + 3]]
        assert float(mean["mu_dyn_mean"]) == pytest.approx(sum(values) / 3, rel=1e-12)
        spread = sum((value - sum(values) / 3) ** 2 for value in values) / 2
        assert float(mean["mu_dyn_std"]) == pytest.approx(spread**0.5, rel=1e-9)
        assert float(mean["mu_dyn_sem"]) == pytest.approx((spread / 3) ** 0.5, rel=1e-9)
        assert all(0.0 < float(row["mu_dyn"]) <= float(row["mu_max"]) for row in rows)
    case = here / "cases" / "001"
    for text in ((case / "run.log").read_text(), info.describe_path(case)[0]):
        found = re.search(r"last three quarters of this slide of 500 µm, is (\S+) ± (\S+)\n", text)
        assert found
        assert float(found[1]) == pytest.approx(float(rows[1]["mu_dyn"]), abs=0.1 * float(found[2]))


@pytest.mark.parametrize("words", [["check"], ["run"]])
def test_nothing_runs_with_a_mistake_in_any_case(
    run_parcontact: RunParcontact, tmp_path: Path, words: list[str]
) -> None:
    (tmp_path / "job.yaml").write_text(JOB.replace("[1, 2, 3]", "[1, 2, -3]"))
    done = run_parcontact([*words, "job.yaml", "--case", "0"], ranks=0)
    assert done.returncode == 2
    assert done.stderr == "job.yaml:9:27: surface.seed must be a whole number of zero or more, got -3\n"
    assert not (tmp_path / "out").exists()


def test_a_warning_of_many_cases_is_stated_once(run_parcontact: RunParcontact, tmp_path: Path) -> None:
    """With the cases that it holds for; run.log of each has its own. One case alone tells its own as any run does."""
    (tmp_path / "job.yaml").write_text(COARSE)
    done = run_parcontact(["job.yaml", "--quiet"])
    assert done.returncode == 0, done.stderr
    stated = [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
    coarse = [line for line in stated if "cells per shortest wave" in line]
    assert [line.rpartition(" (")[2] for line in coarse] == ["cases 0-1, 3)"], done.stderr
    text = coarse[0].removeprefix("warning: ").rpartition(" (")[0]
    logs = [(tmp_path / f"out/job/cases/{name}/run.log").read_text() for name in ("000", "001", "002", "003")]
    assert [f"warning: {text}" in log for log in logs] == [True, True, False, True]
    alone = run_parcontact(["job.yaml", "--quiet", "--case", "1", "--restart", "never"])
    assert f"warning: {text}\n" in alone.stderr


COARSE = """
grid: {points: 16, size: 1.0e-3}
surface: {shape: rough, hurst: 0.8, long_wavelength: 1.0e-3, short_wavelength: 2.5e-4, rms_slope: 0.01, seed: 1}
material: {model: elastic, shear_modulus: 1.0e6}
history: [{pressure: 1.0e4}]
sweep: [{surface.seed: [1, 2, 3, 4], surface.short_wavelength: [2.5e-4, 2.5e-4, 5.0e-4, 2.5e-4]}]
"""


def test_a_ball_that_leaves_its_box_has_no_stated_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its highest friction is the one of the rows in which the box does not cut the contact off."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(LEAVING)
    assert main(["job.yaml", "--quiet"]) == 0
    rows = tables.read_columns(Path("out/job/cases/000/measures.csv"))
    inside = [friction for friction, cut in zip(rows["friction"], rows["cut_off"], strict=True) if not cut]
    (row,) = table()
    assert float(row["mu_max"]) == max(inside) < max(rows["friction"])
    assert [row[name] for name in ("mu_max_error", "mu_dyn_error", "error_friction", "error_area")] == [""] * 4
    log = Path("out/job/cases/000/run.log").read_text()
    assert f"in {len(rows['friction']) - len(inside)} of " in log
    assert "the contact is cut off by the edge of the box: they do not count" in log


# -- several programs on the cases of one sweep: a job array, or the same command given twice -------------------------


def test_a_case_that_another_program_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is passed over, and has not failed; if it is the only one, the command is refused like a single run's."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    monkeypatch.setattr(outputs, "MAX_SECONDS_TO_RELEASE", 0.1)
    where = cases[1].job.output.directory
    where.mkdir(parents=True)
    with (where / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert main(["job.yaml", "--quiet", "--set", "numerics.accuracy=0.5"]) == 0
        in_use = f"the output directory {where} is in use by another run (just started)\n"
        assert capsys.readouterr().err == f"parcontact: case 1 is being run by another program: {in_use}"
        assert [row["state"] for row in table()] == ["done", "-", *["done"] * 4]
        assert main(["job.yaml", "--quiet", "--case", "1"]) == 2
        assert capsys.readouterr().err == f"parcontact: {in_use}"
    assert main(["job.yaml", "--quiet"]) == 0
    assert {row["state"] for row in table()} == {"done"}


def test_tables_are_written_by_one_program_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs of an array end together: the last one to write has read what all others left."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    out = Path("out/job")
    sweep.write_sweep_tables(out, cases)
    with (out / ".sweep.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        other = threading.Thread(target=sweep.write_sweep_tables, args=(out, cases))
        other.start()
        other.join(0.2)
        assert other.is_alive()
        fcntl.flock(lock, fcntl.LOCK_UN)
        other.join(20.0)
        assert not other.is_alive()


# -- what stops one case of a sweep stops all of them, and the same command goes on -----------------------------------


def begin(job: Job, begun: list[int], groups: Groups) -> None:
    """Note a case that begins; all groups of ranks begin their first one together; collective."""
    begun.append(int(job.output.directory.name))
    if len(begun) == 1:
        groups.everyone.Barrier()


def wait_for_others(groups: Groups, stop: StopFile) -> None:
    """Let the first group, where there are two, wait until the other one asks it to stop."""
    deadline = time.monotonic() + 100.0
    while groups.number == 0 and groups.count > 1 and not stop.asks and time.monotonic() < deadline:
        time.sleep(0.01)


def test_a_stop_file_ends_the_case_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It saves, and the same command goes on with it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(JOB)
    decide = stopping.Watch.decide

    def ask(self: stopping.Watch, step: int, *others: Any) -> stopping.Verdict:
        if step == 4:
            Path("out/job/stop").touch()
        return decide(self, step, *others)

    monkeypatch.setattr(stopping, "LOOK_SECONDS", -1.0)
    monkeypatch.setattr(stopping.Watch, "decide", ask)
    assert main(["job.yaml", "--quiet"]) == 3
    assert [row["state"] for row in table()] == ["begun", *"-----"]
    assert Path("out/job/stop").exists()  # and stops no later program
    monkeypatch.setattr(stopping.Watch, "decide", decide)
    assert main(["job.yaml", "--quiet"]) == 0
    assert "stopped after step 4 of" in Path("out/job/cases/000/run.log").read_text()
    assert {row["state"] for row in table()} == {"done"}


def test_a_stop_file_ends_all_that_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs with all cases or one stop by one file, which none removes; it stops none that begins later."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    stops, begun = [sweep.stop_file(cases) for _ in range(3)], list[str]()

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begun.append(job.output.directory.name)
        stops[0].path.mkdir(parents=True)
        return 3

    for chosen, stop in zip((cases, cases, cases[2:3]), stops, strict=True):
        assert sweep.SweepRun(cases, Groups(MPI.COMM_SELF), act, stop).run(chosen) == 3
    assert begun == ["000"]
    later = sweep.stop_file(cases)
    assert sweep.SweepRun(cases, Groups(MPI.COMM_SELF), lambda *_: 0, later).run(cases[1:3]) == 0
    asked = [later.asks]
    os.utime(later.path, ns=(1, 1))
    assert [*asked, later.asks] == [False, True]
    assert sweep.SweepRun(cases, Groups(MPI.COMM_SELF), lambda *_: 0, later).run(cases) == 3


@pytest.mark.mpi
@pytest.mark.parametrize("noted", [False, True], ids=["before the run of a case notes it", "after its last look"])
def test_a_signal_that_no_case_sees_ends_the_sweep(
    shared_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], noted: bool
) -> None:
    """To the last rank alone: its case goes on to its end, no further one is begun, and the table has what is done."""
    cases, groups = cases_in_groups(shared_path, monkeypatch)
    begun, stop = list[int](), groups.agree(sweep.stop_file(cases))

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begin(job, begun, groups)
        with Signals().noted() if noted else nullcontext():
            if groups.everyone.rank == groups.everyone.size - 1:
                os.kill(os.getpid(), signal.SIGTERM)
        wait_for_others(groups, stop)
        job.output.directory.mkdir(parents=True, exist_ok=True)
        return 0

    assert sweep.SweepRun(cases, groups, act, stop).run(cases) == 3
    assert groups.from_all(begun) == [[number] for number in range(groups.count)]
    if groups.root:
        assert [row["state"] for row in table()] == ["-"] * 6
        assert "run again to go on" in capsys.readouterr().out


@pytest.mark.mpi
def test_what_stops_one_group_stops_all(shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal to one rank, say, or a stop file for its case: the others begin no further case. Another program, which
    runs at the same time, is not asked."""
    cases, groups = cases_in_groups(shared_path, monkeypatch)
    stop, other = (groups.agree(sweep.stop_file(cases)) for _ in range(2))
    begun, asked = list[int](), list[bool]()

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begin(job, begun, groups)
        wait_for_others(groups, stop)
        asked.append(other.asks)
        return 3 if groups.number == groups.count - 1 else 0

    assert sweep.SweepRun(cases, groups, act, stop).run(cases) == 3
    assert groups.from_all(begun) == [[number] for number in range(groups.count)]
    assert (any(asked), stop.path.exists(), stop.own.exists()) == (False, False, False)
