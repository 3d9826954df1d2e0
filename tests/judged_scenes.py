"""Scenes that are judged: jobs, measured heights, and what is said of both."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import sanity, scene
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab

Json = dict[str, Any]
HERE = Path(__file__).parents[1] / "jobs"
RUBBER = {"model": "elastic", "shear_modulus": 1e6}
SPHERE = {"shape": "sphere", "radius": 1e-2}


def job_of(surface: Json | list[Json], history: Sequence[Json], **sections: Any) -> Job:
    sections = {"grid": {"points": 64, "size": 1e-3}, "material": RUBBER, **sections}
    return Job.model_validate({"surface": surface, "history": list(history), **sections})


def of_file(path: Path, heights: NDArray[np.floating], **sections: Any) -> list[str]:
    """What is said of heights on a box of 1 mm."""
    np.save(path, heights)
    grid = {"points": list(heights.shape[::-1]), "size": 1e-3}
    job = job_of({"shape": "file", "path": str(path)}, [{"pressure": 1e4}], grid=grid, **sections)
    return [*map(str, sanity.check_heights(scene.set_up(job, Slab.alone(*job.grid.points))))]


def rough_heights(points: int, shortest: float, seed: int = 1) -> NDArray[np.floating]:
    """Periodic heights with waves down to a given number of cells, rms slope 0.1 on a box of 1 mm."""
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points)[None, :])  # rad per cell
    kept = (q > 0) & (q <= 2 * np.pi / shortest)
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
    spectrum = np.where(kept, noise * np.maximum(q, 1e-9) ** -1.8, 0.0)
    heights = np.fft.irfft2(spectrum, s=(points, points))
    cell = 1e-3 / points
    slope = np.sqrt(sum(((np.roll(heights, 1, axis) - heights) ** 2).mean() for axis in (0, 1))) / cell
    return np.asarray(heights * 0.1 / slope)


def run(job: Job, steps: int | None = None) -> list[str]:
    """What is said of the contacts of a job's steps."""
    march = March(scene.build(job, Slab.alone(*job.grid.points)))
    watch, said = sanity.ContactWatch.of(job, Timeline.from_job(job)), list[str]()
    for step in list(Timeline.from_job(job))[:steps]:
        said += map(str, watch.check_step(step.number, march.advance(step).measures))
    return said
