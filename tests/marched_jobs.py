"""Jobs as dictionaries or worked examples, marched in this process."""

import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.files.recorder import StepRow
from parcontact.job import Job, load
from parcontact.march import steady
from parcontact.march.loop import March, run_steps
from parcontact.parallel.slab import Slab

# the paper's Hertz material as one Maxwell branch next to the long-term spring: modulus 2.75 MPa at once, a tenth of it
# in the end, relaxation time 1 ms, creep time 10 ms
BRANCHES = [{"modulus": 2.475e6, "relaxation_time": 1e-3}]
SLS = {"model": "zener", "modulus_inf": 0.275e6, "branches": BRANCHES}
PRONY = (0.275e6, [2.475e6], [1e-3])  # the same for the closed forms


ROOT = Path(__file__).parents[1]
JOBS = ROOT / "jobs"


def load_script(name: str) -> ModuleType:
    """A script of scripts/, or a part of one like `bench.meter`, as a module."""
    sys.path.insert(0, str(ROOT / "scripts"))  # where it finds its neighbours, as when it runs
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(ROOT / "scripts"))


def example(name: str, *overrides: str) -> Job:
    """A job of jobs/."""
    return load(JOBS / f"{name}.yaml", overrides)


def begun(data: dict[str, Any] | Job, comm: MPI.Intracomm = MPI.COMM_SELF) -> March:
    """A march at the start of a job."""
    job = data if isinstance(data, Job) else Job.model_validate(data)
    return steady.first(job, Slab(comm, *job.grid.points))


def marched(
    data: dict[str, Any] | Job, tasks: Sequence[Callable[[March], None]] = (), comm: MPI.Intracomm = MPI.COMM_SELF
) -> tuple[March, list[StepRow]]:
    """A march at the end of a job, and the row of every instant, the initial one first."""
    march, rows = begun(data, comm), list[StepRow]()
    run_steps(march, [lambda state: rows.append(state.row), *tasks])
    return march, rows


def column(rows: Sequence[StepRow], name: str) -> NDArray[np.float64]:
    """One number of every row, by the name of its measure or of its own."""
    return np.array([getattr(row, name) if hasattr(row, name) else getattr(row.measures, name) for row in rows])
