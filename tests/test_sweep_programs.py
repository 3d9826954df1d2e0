"""Several programs on the cases of one sweep: a job array, or the same command given twice."""

import fcntl
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI
from test_sweeps import cases_in_groups, table

from parcontact.__main__ import main
from parcontact.errors import TakenError
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.run import sweep
from parcontact.storage import directory
from parcontact.storage.directory import Directory
from parcontact.summary import sweep_table

AGAIN = "has been taken by another run meanwhile; run again to go on with it"


@pytest.fixture
def faster(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """`faster(where, *words)`: another program runs a case, and ends, when this one comes to make its directory."""

    def make_faster(where: Path, *words: str) -> None:
        make = Directory.make

        def late(self: Directory, *arguments: Any) -> None:
            if self.path == where and not where.exists():
                where.mkdir(parents=True)
                assert main(["job.yaml", "--quiet", "--case", str(int(where.name)), *words]) == 0
            make(self, *arguments)

        monkeypatch.setattr(Directory, "make", late)

    return make_faster


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
        assert main(["job.yaml", "--quiet"]) == 0
        in_use = f"the output directory {where} is in use by another run (just started)\n"
        assert capsys.readouterr().err == f"parcontact: case 1 is being run by another program: {in_use}"
        assert [row["state"] for row in table()] == ["done", "-", *["done"] * 4]
        assert main(["job.yaml", "--quiet", "--case", "1"]) == 2
        assert capsys.readouterr().err == f"parcontact: {in_use}"
    assert main(["job.yaml", "--quiet"]) == 0
    assert {row["state"] for row in table()} == {"done"}


def test_a_case_that_another_program_has_finished_meanwhile(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, faster: Callable[..., None]
) -> None:
    """It is done, also if it is the only one."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    where = cases[1].job.output.directory
    faster(where)
    for words, states in (([], ["done"] * 6), (["--case", "1"], ["-", "done", *["-"] * 4])):
        shutil.rmtree("out", ignore_errors=True)
        assert main(["job.yaml", *words]) == 0
        said = capsys.readouterr()
        assert (said.err, said.out.count("case 1: done by another program\n")) == ("", 1)
        assert [row["state"] for row in table()] == states


def test_a_case_that_another_program_has_stopped_meanwhile(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, faster: Callable[..., None]
) -> None:
    """It is passed over, like one that another program runs: the same command goes on with it."""
    cases, _ = cases_in_groups(tmp_path, monkeypatch)
    where = cases[1].job.output.directory
    faster(where, "--until", "5e-4")
    assert main(["job.yaml", "--quiet", "--case", "1"]) == 2
    assert capsys.readouterr().err == f"parcontact: the output directory {where} {AGAIN}\n"
    shutil.rmtree("out")
    assert main(["job.yaml", "--quiet"]) == 0
    told = f"parcontact: case 1 has been run by another program: the output directory {where} {AGAIN}\n"
    assert capsys.readouterr().err == told
    assert [row["state"] for row in table()] == ["done", "begun", *["done"] * 4]
    assert main(["job.yaml", "--quiet"]) == 0
    assert {row["state"] for row in table()} == {"done"}


@pytest.mark.mpi
def test_groups_that_find_cases_taken(
    shared_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every rank of a group agrees whether the case is done, which root alone sees."""
    (cases, groups), world = cases_in_groups(shared_path, monkeypatch), MPI.COMM_WORLD
    first = groups.comm.rank == 0
    monkeypatch.setattr(sweep_table, "state", lambda case: "done" if first and case.number < 2 else "begun")

    def act(job: Job, slab: Slab, shows: sweep.Shows) -> int:
        raise TakenError("taken")

    assert sweep.run(cases[:4], cases[:4], groups, act, sweep.stop_file(cases)) == 0
    said = capsys.readouterr()
    out, err = ("".join(world.allgather(text)).splitlines() for text in (said.out, said.err))
    assert sorted(err) == [f"parcontact: case {number} has been run by another program: taken" for number in (2, 3)]
    done = [line for line in out if line.endswith(": done by another program")]
    assert sorted(done) == [f"case {number}: done by another program" for number in (0, 1)]


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
