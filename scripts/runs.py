"""Jobs run by scripts: marched in this process, or started by mpirun outside of it."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from parcontact.job import Job
    from parcontact.march.loop import March
    from parcontact.storage.step_row import StepRow

ROOT = Path(__file__).resolve().parents[1]
Json = dict[str, Any]


def begun(
    job: "Job | Mapping[str, Any] | Path", sets: Mapping[str, Any] | Sequence[str] = (), comm: Any = None
) -> "March":
    """A march before its first step, by this process unless a communicator is given; `sets` replaces keys."""
    from mpi4py import MPI

    from parcontact.job import Job
    from parcontact.mesh import load
    from parcontact.parallel.slab import Slab
    from parcontact.steady_sliding import start

    read = job if isinstance(job, Job) else load(job, sets)
    return start.first(read, Slab(MPI.COMM_SELF if comm is None else comm, *read.grid.points))


def marched(march: "March", note: Callable[["March"], None] | None = None) -> tuple[list["StepRow"], list[float]]:
    """All rows of a march, the initial one first, and the CPU time [s] when each was done; `note` sees each state."""
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
    """The environment without the marks that MPI leaves in it, which would confuse another mpirun.

    An mpirun whose ranks have ended with an error ends at once, too: it would give each 3 s and again 3 s to do so.
    A rank that waits for another one gives its core away, as other programs may need it.
    """
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    times = {f"{name}_MCA_odls_base_sigkill_timeout": "0" for name in ("OMPI", "PRTE")}
    return clean | times | {"OMPI_MCA_mpi_yield_when_idle": "1"}


def ranks_of(pid: int) -> list[int]:
    """The ranks of an mpirun of scripts/setup, in their order: they are the children of its only child."""
    return [rank for launcher in _children(pid) for rank in _children(launcher)]


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
