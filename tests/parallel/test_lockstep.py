"""Ranks that do different things are stated so; nothing hangs."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

import parcontact as pc
from parcontact.parallel import root
from parcontact.parallel.root import on_root

JOB: dict[str, Any] = {
    "grid": {"points": 8, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
    "material": {"model": "elastic", "shear_modulus": 1e6},
    "history": [{"pressure": 1e3, "duration": 1.0, "time_step": 0.25}],
}
PROGRAM = """
import sys
import parcontact as pc
from mpi4py import MPI
run, first = pc.Simulation({job!r}), MPI.COMM_WORLD.rank == 0
def lack(*_): raise MemoryError("nothing left")
for row in run.steps():
    if row.step == 1 and first:
        {act}
"""


class OddError(Exception):
    """One that cannot be sent to other processes."""

    def __init__(self, first: int, second: int) -> None:
        super().__init__(f"{first} and {second}")


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("made", "found", "said"),
    [(KeyError("a"), KeyError, "'a'"), (OddError(1, 2), pc.RunError, "OddError on rank 0: 1 and 2")],
)
def test_any_exception_of_root_reaches_all(comm: MPI.Intracomm, made: Exception, found: type, said: str) -> None:
    def act() -> None:
        raise made

    if comm.size > 1:
        with pytest.raises(type(made) if comm.rank == 0 else found) as caught:
            on_root(comm, act)
        assert str(caught.value) == (str(made) if comm.rank == 0 else said)


@pytest.mark.mpi
def test_what_cannot_be_sent_reaches_all(comm: MPI.Intracomm) -> None:
    if comm.size > 1:
        with pytest.raises(Exception, match=r"pickle|local object"):
            on_root(comm, lambda: lambda: None)


@pytest.mark.mpi
def test_a_break_of_one_rank(comm: MPI.Intracomm) -> None:
    """The others are at the next step while it gathers a map: all are stated, and may go on together."""
    if comm.size == 1:
        return
    run = pc.Simulation(JOB, comm=comm)
    steps = run.steps()
    next(steps)
    with pytest.raises(pc.RunError, match=r"makes step 1 of <Sim.*takes the map gap of <Sim.*make the same calls"):
        _ = run.gather("gap") if comm.rank == comm.size - 1 else next(steps)
    assert [row.step for row in run.steps()] == [1, 2, 3, 4, 5]


@pytest.mark.mpi
def test_different_jobs_are_refused(comm: MPI.Intracomm) -> None:
    """The first key that differs is named with both values; root's job is not taken for that of all."""
    if comm.size == 1:
        return
    other = {**JOB, "grid": {"points": 8 if comm.rank == 0 else 16, "size": 1e-3}}
    with pytest.raises(pc.JobError, match=r"grid\.points is 8 on rank 0 and 16 on rank 1; give all of them the same"):
        pc.Simulation(other, comm=comm)
    with pytest.raises(pc.JobError, match=r"set\.title is 'x0' on rank 0 and 'x1' on rank 1"):
        pc.Simulation(JOB, {"title": f"x{comm.rank}"}, comm)
    with pytest.raises(pc.JobError, match=r"steady\.velocities\.0 is 1\.0 on rank 0 and 2\.0 on rank 1"):
        pc.steady(JOB, [1.0 + comm.rank], comm=comm)


def test_ranks_in_a_row_are_stated_together() -> None:
    assert root._ranks_of(["a", "b", "b", "a"]) == "rank 0 a, ranks 1 to 2 each b, rank 3 a"


@pytest.mark.parametrize(
    ("act", "said"),
    [
        ("raise ValueError('oops')", "rank 0 has ended the program with ValueError: oops, rank 1 makes step 2 of"),
        ("sys.exit(0)", "rank 0 has ended the program, rank 1 makes step 2 of"),
        ("run._march.advance = lack", "rank 0 has ended the program with MemoryError: nothing left, and other ranks"),
    ],
    ids=["raise", "exit", "within"],
)
def test_a_rank_that_ends_ends_the_others(tmp_path: Path, outside_mpi: dict[str, str], act: str, said: str) -> None:
    """At the next step, or after 5 s where the others wait for it within one."""
    (tmp_path / "program.py").write_text(PROGRAM.format(job=JOB, act=act))
    mpirun = [str(Path(sys.executable).with_name("mpirun")), "-n", "2", sys.executable, "program.py"]
    done = subprocess.run(mpirun, cwd=tmp_path, env=outside_mpi, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 1
    assert said in done.stderr
