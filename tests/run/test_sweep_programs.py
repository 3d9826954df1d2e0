"""Several programs on the cases of one sweep: a job array, or the same command given twice."""

import fcntl
import threading
from pathlib import Path

import pytest
from mpi4py import MPI

from parcontact.__main__ import main
from parcontact.errors import InUseError
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.run import sweep
from parcontact.storage import directory
from parcontact.summary import sweep_table

from .test_sweep import cases_in_groups, table


def test_a_case_that_another_program_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is passed over, and has not failed; if it is the only one, the command is refused like a single run's."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    monkeypatch.setattr(directory, "MAX_SECONDS_TO_RELEASE", 0.1)
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


@pytest.mark.mpi
def test_groups_that_find_cases_taken(
    shared_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One rank of each group says so, and the others go on with it."""
    (cases, groups), world = cases_in_groups(shared_path, monkeypatch), MPI.COMM_WORLD

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        raise InUseError("taken")

    assert sweep.SweepRun(cases[:4], groups, act, sweep.stop_file(cases)).run(cases[:4]) == 0
    err = "".join(world.allgather(capsys.readouterr().err)).splitlines()
    assert sorted(err) == [f"parcontact: case {n} is being run by another program: taken" for n in range(4)]


def test_tables_are_written_by_one_program_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs of an array end together: the last one to write has read what all others left."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    out = Path("out/job")
    sweep_table.write(out, cases)
    with (out / ".sweep.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        other = threading.Thread(target=sweep_table.write, args=(out, cases))
        other.start()
        other.join(0.2)
        assert other.is_alive()
        fcntl.flock(lock, fcntl.LOCK_UN)
        other.join(20.0)
        assert not other.is_alive()
