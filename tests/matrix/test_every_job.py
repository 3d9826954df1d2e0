"""Each job of the project, of the manual and of the README does what a user does with it: check, plan, run, run again,
stop and go on; each verb of the program has its place here."""

import csv
import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest
from mpi4py import MPI
from small_jobs import JOBS, smallest

from parcontact.__main__ import main
from parcontact.door.arguments import NAMES
from parcontact.job.history import Timeline
from parcontact.march import mesh

OF_JOBS = {"check", "plan", "run", "steady", "theory", "study", "surface"}
OF_RESULTS = {"export", "plot", "report", "leak", "info", "cite"}
OTHERS = {"fit", "doctor", "manual", "schema"}  # take no job and no result


class Said(NamedTuple):
    """Exit code of a command, and its output."""

    code: int
    out: str
    err: str


def do(*words: str | Path) -> Said:
    """Run a command line in this process. A refusal is one sentence without a traceback."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            code = main([str(word) for word in words])
        except SystemExit as ended:
            code = int(ended.code or 0)
    said = Said(code, out.getvalue(), err.getvalue())
    assert "Traceback" not in said.err, said.err
    if MPI.COMM_WORLD.rank == 0 and code == 2:
        assert said.err.strip(), words
    return said


def done(*words: str | Path) -> Said:
    said = do(*words)
    assert said.code == 0, (words, said.err)
    return said


def tables(out: Path) -> dict[str, list[list[str]]]:
    """All tables of results in a directory, without the columns that count time."""
    found = {}
    for path in sorted(out.rglob("*.csv")):
        with path.open() as file:
            head, *lines = list(csv.reader(file))
        kept = [index for index, name in enumerate(head) if name != "seconds"]
        found[str(path.relative_to(out))] = [[line[index] for index in kept] for line in (head, *lines)]
    return found


def test_every_verb_has_its_place() -> None:
    """A verb that is added is put into one of these kinds, and with it into the tests below."""
    assert set(NAMES) == OF_JOBS | OF_RESULTS | OTHERS


def middle(path: Path) -> float:
    """The middle of the shortest history of all cases [s]."""
    return min(Timeline.from_job(case.job).end for case in mesh.load_cases(path)) / 2.0


@pytest.fixture
def place(shared_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, the same on all ranks."""
    monkeypatch.chdir(shared_path)
    return shared_path


def small(name: str, place: Path) -> Path:
    """The path of the small version of a job."""
    comm = MPI.COMM_WORLD
    return comm.bcast(smallest(JOBS[name], place) if comm.rank == 0 else None)


@pytest.mark.mpi(2)
@pytest.mark.parametrize("name", JOBS)
def test_a_job_from_check_to_going_on(name: str, place: Path) -> None:
    """A second run changes no result. On one rank a run that is stopped in the middle goes on to the rows of one that
    was not."""
    alone, job = MPI.COMM_WORLD.size == 1, small(name, place)
    if alone:  # what is checked and planned does not depend on ranks
        done("check", job)
        done("plan", job, "--seconds", "0.1")
    whole = run(place, job)
    assert any(name.endswith(("measures.csv", "steady.csv")) for name in whole)
    assert run(place, job) == whole
    if not alone:
        return
    if mesh.load_cases(job)[0].job.history:
        run(place, job, "part", "--until", repr(middle(job)))
        assert run(place, job, "part") == whole
    else:
        said = do("run", job, "--out", "part", "--until", "1.0")
        assert (said.code, "a friction curve has no time" in said.err) == (2, True)


def run(place: Path, job: Path, out: str = "whole", *words: str) -> dict[str, list[list[str]]]:
    """Run a job on all ranks; return its tables."""
    done("run", job, "--out", out, "--quiet", *words)
    MPI.COMM_WORLD.Barrier()
    found = tables(place / out)
    MPI.COMM_WORLD.Barrier()
    return found
