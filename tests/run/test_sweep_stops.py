"""What stops one case of a sweep stops all of them, and the same command goes on."""

import os
import signal
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

from parcontact.__main__ import main
from parcontact.job import Job
from parcontact.parallel.groups import Groups
from parcontact.parallel.signals import Signals
from parcontact.parallel.slab import Slab
from parcontact.run import sweep, watch
from parcontact.storage.stopfile import StopFile

from .test_sweep import JOB, cases_in_groups, table


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
    judge = watch.Watch.judge

    def ask(self: watch.Watch, step: int, *others: Any) -> watch.Verdict:
        if step == 4:
            Path("out/job/stop").touch()
        return judge(self, step, *others)

    monkeypatch.setattr(watch, "LOOK_SECONDS", -1.0)
    monkeypatch.setattr(watch.Watch, "judge", ask)
    assert main(["job.yaml", "--quiet"]) == 3
    assert [row["state"] for row in table()] == ["begun", *"-----"]
    assert Path("out/job/stop").exists()  # and stops no later program
    monkeypatch.setattr(watch.Watch, "judge", judge)
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
