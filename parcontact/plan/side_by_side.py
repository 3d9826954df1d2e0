"""How many cases of a sweep are done at a time: small ones one on each rank, as they gain little from several."""

from collections.abc import Sequence

from ..job import Job
from ..job.checks.size import machines
from . import memory, trial

MOST_POINTS = 2**20  # of a small case
SPARE = 2.0  # times the maps of steps: what a first contact or steady state on nested grids may hold besides


def count(jobs: Sequence[Job], ranks: int) -> int:
    """Of these cases on so many ranks; 1 where they are not small, or where so many do not fit into the memory."""
    at_once = min(ranks, len(jobs))
    if at_once < 2:
        return 1
    largest = max(jobs, key=lambda job: job.grid.nx * job.grid.ny)
    if largest.grid.nx * largest.grid.ny > MOST_POINTS:
        return 1
    here = -(-at_once // machines())
    held = here * SPARE * memory.total(largest, max(1, ranks // at_once))
    return at_once if held <= trial.SHARE * trial.free_bytes() else 1
