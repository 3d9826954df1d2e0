"""Grids on which a job can be tried in little time: its own, or a coarser one."""

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from ..job import Job
from ..job.sections.listing import plain_data
from ..scene import choices
from . import memory

PER_POINT = 1.2e-8  # tuning: seconds of an operator call per point, enough to choose a grid by
PADDED = 3.0  # tuning: times that in an isolated contact
CALLS = 200  # tuning: operator calls that a trial makes at least
STEADY_START = 150  # tuning: and those of the steady state from which a job begins
FEW, FLAT = 16, 1e-3  # points along each side of a tiny scene; its wave over its length
WAVE = 2.0  # cells that the shortest wave needs


def choose_grid(job: Job, ranks: int, seconds: float) -> Job | None:
    """The job, or the same on a coarser grid, that can be tried by so many ranks here; None if there is none."""
    return next((each for each in _coarser(job) if _feasible(each, ranks, seconds)), None)


def make_tiny(job: Job) -> Job | None:
    """The job with a single wave, or a sphere, on the fewest points: all that runs is the same, and costs nothing."""
    data: dict[str, Any] = plain_data(job)
    free, long = choices(job).isolated.on, max(job.grid.size)
    data["grid"]["points"] = [min(n, FEW) for n in job.grid.points]
    wave = {"shape": "wave", "amplitude": FLAT * long, "waves": [1, 0] if job.grid.nx > 1 else [0, 1]}
    data["surface"] = [{"shape": "sphere", "radius": long} if free else wave]
    data["numerics"]["accept_unconverged"] = True
    try:
        return Job.model_validate(data)
    except ValidationError:
        return None


def _feasible(job: Job, ranks: int, seconds: float) -> bool:
    per_point = PER_POINT * (PADDED if choices(job).isolated.on else 1.0)
    calls = CALLS + (STEADY_START if choices(job).steady_start.on else 0)
    quick = calls * per_point * job.grid.nx * job.grid.ny / ranks <= seconds
    return quick and memory.total_bytes(job, ranks) * ranks <= memory.FREE_SHARE * memory.free_bytes()


def _coarser(job: Job) -> Iterator[Job]:
    """The job with 1, 2, 4, ... times its cells, as long as its surface can be put on them."""
    yield job
    data: dict[str, Any] = plain_data(job)
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
