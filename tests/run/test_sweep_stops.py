"""What stops one case of a sweep stops all of them, and the same command goes on."""

import os
import time
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

from parcontact.__main__ import main
from parcontact.job import Job
from parcontact.parallel.groups import Groups
from parcontact.parallel.slab import Slab
from parcontact.run import sweep, watch

from .test_sweep import JOB, cases_in_groups, table


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
        assert sweep.Sweep(cases, Groups(MPI.COMM_SELF), act, stop).run(chosen) == 3
    assert begun == ["000"]
    later = sweep.stop_file(cases)
    assert sweep.Sweep(cases, Groups(MPI.COMM_SELF), lambda *_: 0, later).run(cases[1:3]) == 0
    asked = [later.asks]
    os.utime(later.path, ns=(1, 1))
    assert [*asked, later.asks] == [False, True]
    assert sweep.Sweep(cases, Groups(MPI.COMM_SELF), lambda *_: 0, later).run(cases) == 3


@pytest.mark.mpi
def test_what_stops_one_group_stops_all(shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal to one rank, say, or a stop file for its case: the others begin no further case. Another program, which
    runs at the same time, is not asked."""
    cases, groups = cases_in_groups(shared_path, monkeypatch)
    stop, other = (groups.agree(sweep.stop_file(cases)) for _ in range(2))
    begun, asked = list[int](), list[bool]()

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begun.append(int(job.output.directory.name))
        deadline = time.monotonic() + 20.0
        while groups.number == 0 and groups.count > 1 and not stop.asks and time.monotonic() < deadline:
            time.sleep(0.01)
        asked.append(other.asks)
        return 3 if groups.number == groups.count - 1 else 0

    assert sweep.Sweep(cases, groups, act, stop).run(cases) == 3
    assert groups.from_all(begun) == [[number] for number in range(groups.count)]
    assert (any(asked), stop.path.exists(), stop.own.exists()) == (False, False, False)
