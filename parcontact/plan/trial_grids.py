"""Grids on which a job can be tried in a short time: its own, or a coarser one."""

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from ..job import Job
from ..job.sections.listing import plain_data
from ..scene import choices
from . import memory

PER_POINT = 1.2e-8  # tuning: time of an operator call per point, to choose a grid [s]
PADDED = 3.0  # tuning: factor of this time in an isolated contact
CALLS = 200  # tuning: least operator calls of a trial
STEADY_START = 150  # tuning: operator calls of an initial steady state
FEW, FLAT = 16, 1e-3  # tiny scene: most points along a side; amplitude of its wave over the side
WAVE = 2.0  # least cells of the shortest wave on a coarser grid


def choose_grid(job: Job, ranks: int, seconds: float) -> Job | None:
    """Return the job on a grid that `ranks` ranks can try in about `seconds` [s]; None if it is too large."""
    return next((each for each in _coarser(job) if _feasible(each, ranks, seconds)), None)


def make_tiny(job: Job) -> Job | None:
    """Return the job with a single wave, or a sphere, on few points; None if not possible."""
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
    """Yield the job with 1, 2, 4, ... times its cells, as long as the surface allows it."""
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
        except ValidationError:  # the grid is too coarse for its waves
            return
