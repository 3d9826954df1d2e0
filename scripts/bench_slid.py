"""A march for scripts/bench.py: its rows, and when each was done."""

import time

from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.march.loop import March, run
from parcontact.parallel.slab import Slab
from parcontact.storage.row import Row


def slid(planned: jobs.Job) -> tuple[March, list[Row], list[float]]:
    """A run on one rank, its rows, and the CPU time [s] when each was done."""
    march = March(scene.build(planned, Slab(MPI.COMM_SELF, *planned.grid.points)))
    seen, clock = list[Row](), list[float]()

    def note(now: March) -> None:
        seen.append(now.row)
        clock.append(time.process_time())

    run(march, [note])
    return march, seen, clock
