"""A grid on which a job can be tried in little time: its own, or a coarser one."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..effects import decisions
from ..job import Job
from ..job.sections.listing import plain
from . import memory

PER_POINT = 1.2e-8  # seconds of an operator call per point, and of what belongs to it: enough to choose a grid by
PADDED = 3.0  # times that in an isolated contact
CALLS = 200  # operator calls that a trial makes at least
STEADY_START = 150  # and those of the steady state from which a job begins
SHARE = 0.7  # of the memory that is free
MEMINFO = Path("/proc/meminfo")
FEW, FLAT = 16, 1e-3  # points along each side of a tiny scene; its wave over its length
WAVE = 2.0  # cells that the shortest wave needs


def grid_for(job: Job, ranks: int, seconds: float) -> Job | None:
    """The job, or the same on a coarser grid, that can be tried by so many ranks here; None if there is none."""
    return next((each for each in _coarser(job) if _feasible(each, ranks, seconds)), None)


def on_grid(job: Job, points: Sequence[int]) -> Job | None:
    """The job on the grid of so many points that another number of ranks has tried."""
    return next((each for each in _coarser(job) if each.grid.points == tuple(points)), None)


def tiny(job: Job) -> Job | None:
    """The job with a single wave, or a sphere, on the fewest points: all that runs is the same, and costs nothing."""
    data: dict[str, Any] = plain(job)
    free, long = decisions.isolated(job).on, max(job.grid.size)
    data["grid"]["points"] = [min(n, FEW) for n in job.grid.points]
    wave = {"shape": "wave", "amplitude": FLAT * long, "waves": [1, 0] if job.grid.nx > 1 else [0, 1]}
    data["surface"] = [{"shape": "sphere", "radius": long} if free else wave]
    data["numerics"]["accept_unconverged"] = True
    try:
        return Job.model_validate(data)
    except ValidationError:
        return None


def _feasible(job: Job, ranks: int, seconds: float) -> bool:
    points = job.grid.nx * job.grid.ny
    per_point = PER_POINT * (PADDED if decisions.isolated(job).on else 1.0)
    calls = CALLS + (STEADY_START if decisions.steady_start(job).on else 0)
    quick = calls * per_point * points / ranks <= seconds
    return quick and memory.total(job, ranks) * ranks <= SHARE * free_bytes()


def _coarser(job: Job) -> Iterator[Job]:
    """The job with 1, 2, 4, ... times its cells, as long as its surface can be put on them."""
    yield job
    data: dict[str, Any] = plain(job)
    while all(n % 2 == 0 for n in data["grid"]["points"]) and min(data["grid"]["points"]) > 64:
        data["grid"]["points"] = [n // 2 for n in data["grid"]["points"]]
        cell = max(length / n for length, n in zip(data["grid"]["size"], data["grid"]["points"], strict=True))
        for shape in data["surface"]:
            if shape["shape"] == "file":
                return
            if "short_wavelength" in shape:
                shape["short_wavelength"] = max(shape["short_wavelength"], WAVE * cell)
        try:
            yield Job.model_validate(data)
        except ValidationError:  # waves that a coarser grid does not have
            return


def free_bytes() -> int:
    """Bytes of memory that are free, as far as that is known."""
    try:
        facts = dict(line.split(":") for line in MEMINFO.read_text().splitlines())
        return int(facts["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return sys.maxsize
