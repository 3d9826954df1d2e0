"""What stops one case of a sweep stops all of them, and the same command goes on."""

import time
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI
from test_sweeps import JOB, cases_in_groups, table

from parcontact.__main__ import main
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.run import sweep, watch


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
    assert not Path("out/job/stop").exists()
    monkeypatch.setattr(watch.Watch, "judge", judge)
    assert main(["job.yaml", "--quiet"]) == 0
    assert "stopped after step 4 of" in Path("out/job/cases/000/run.log").read_text()
    assert {row["state"] for row in table()} == {"done"}


@pytest.mark.mpi
def test_what_stops_one_group_stops_all(shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal to one rank, say: the others begin no further case."""
    (cases, groups), stop = cases_in_groups(shared_path, monkeypatch), Path("out/job/stop")
    begun: list[int] = []

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        begun.append(int(job.output.directory.name))
        deadline = time.monotonic() + 20.0
        while groups.number == 0 and groups.count > 1 and not stop.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        return 3 if groups.number == groups.count - 1 else 0

    assert sweep.run(cases, cases, groups, act) == 3
    assert groups.from_all(begun) == [[number] for number in range(groups.count)]
    MPI.COMM_WORLD.Barrier()  # root removes it
    assert not stop.exists()
