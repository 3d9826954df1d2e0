"""Scenes of `scripts/error_coverage.py`: a reference on a finer grid is of the same surface."""

from pathlib import Path

import numpy as np
import pytest
from marched_jobs import load_script

from parcontact import job as jobs
from parcontact.march import scene
from parcontact.parallel.slab import Slab

coverage_scenes = load_script("coverage_scenes")


def sampled(number: int, finer: int, directory: Path) -> np.ndarray:
    """Heights of the surface of a scene at the points of the coarse grid, above their mean."""
    job = jobs.Job.model_validate(coverage_scenes.sketch(number).job(directory, finer))
    base = scene.set_up(job, Slab.alone(*job.grid.points))
    heights = base.surface.heights((0.0, 0.0), base.slab.empty())
    rows = heights[:: finer if job.grid.ny > 1 else 1, ::finer] * base.units.height
    return np.asarray(rows - rows.mean())


@pytest.mark.parametrize("shape", list(coverage_scenes.SURFACES))
def test_a_finer_grid_sees_the_same_surface(shape: str, tmp_path: Path) -> None:
    """To round-off: 1e-12 of the height, times some tens of waves."""
    number = next(n for n in range(100) if coverage_scenes.sketch(n).kind["surface"] == shape)
    coarse, fine = (sampled(number, finer, tmp_path) for finer in (1, coverage_scenes.FINER))
    assert np.ptp(coarse) > 0.0
    assert np.abs(fine - coarse).max() < 1e-11 * np.ptp(coarse)
