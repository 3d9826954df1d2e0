"""Jobs run by scripts: marched in this process, or started by mpirun outside of it."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from parcontact.files.recorder import StepRow
    from parcontact.job import Job
    from parcontact.march.loop import March

ROOT = Path(__file__).resolve().parents[1]
Json = dict[str, Any]


def begun(
    job: "Job | Mapping[str, Any] | Path", sets: Mapping[str, Any] | Sequence[str] = (), comm: Any = None
) -> "March":
    """Return a march before its first step, on this process unless a communicator is given; `sets` replaces keys."""
    from mpi4py import MPI

    from parcontact.job import Job
    from parcontact.march import steady
    from parcontact.march.mesh import load
    from parcontact.parallel.slab import Slab

    read = job if isinstance(job, Job) else load(job, sets)
    return steady.first(read, Slab(MPI.COMM_SELF if comm is None else comm, *read.grid.points))


def marched(march: "March", note: Callable[["March"], None] | None = None) -> tuple[list["StepRow"], list[float]]:
    """Return all rows of a march, the initial one first, and the CPU time [s] after each; `note` is called with the
    march after each."""
    from parcontact.march.loop import run_steps

    rows, clock = list["StepRow"](), list[float]()

    def keep(now: "March") -> None:
        rows.append(now.row)
        clock.append(time.process_time())
        if note is not None:
            note(now)

    run_steps(march, [keep])
    return rows, clock


def environment() -> dict[str, str]:
    """Return the environment without variables of MPI, which would confuse another mpirun.

    An mpirun whose ranks failed ends at once, instead of after two waits of 3 s. Waiting ranks yield their cores to
    other programs.
    """
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    times = {f"{name}_MCA_odls_base_sigkill_timeout": "0" for name in ("OMPI", "PRTE")}
    return clean | times | {"OMPI_MCA_mpi_yield_when_idle": "1"}


def ranks_of(pid: int) -> list[int]:
    """Return the process numbers of the ranks of an mpirun of scripts/setup, in order: they are the children of its
    only child."""
    return [rank for launcher in _children(pid) for rank in _children(launcher)]


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
