"""A surface given by waves keeps its lowest ones, which are all that it has."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.job import Job
from parcontact.march import rigid_surface, scene
from parcontact.parallel.slab import Slab
from parcontact.physics.loops import rows_of
from parcontact.physics.surface import Surface

NX, NY = 40, 30
SIZE = (1e-3, 7.5e-4)
WAVE: dict[str, Any] = {"shape": "wave", "amplitude": 1e-6, "waves": [-4, 9]}
ROUGH: dict[str, Any] = {
    "shape": "rough",
    "hurst": 0.8,
    "long_wavelength": 5e-4,
    "short_wavelength": 1.2e-4,  # 8.3 in the box along x, 6.25 along y
    "rms_slope": 0.02,
    "seed": 1,
}


def surface_of(*parts: dict[str, Any]) -> tuple[Job, Surface]:
    job = Job.model_validate(
        {
            "grid": {"points": [NX, NY], "size": SIZE},
            "surface": list(parts),
            "material": {"model": "elastic", "shear_modulus": 1e6},
            "history": [{"pressure": 1e4}],
        }
    )
    return job, scene.set_up(job, Slab.alone(NX, NY)).surface


@pytest.mark.parametrize(
    ("parts", "highest"), [([WAVE], (4, 9)), ([ROUGH], (8, 6)), ([ROUGH, WAVE], (8, 9))], ids=["wave", "rough", "both"]
)
def test_kept_waves_are_all_there_are(
    parts: list[dict[str, Any]], highest: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that the whole transform has, to its rounding, and none that is 0 along a whole side."""
    job, kept = surface_of(*parts)
    assert rigid_surface.highest_waves(job) == highest
    monkeypatch.setattr(rigid_surface, "highest_waves", lambda job: (NX // 2, NY // 2))
    _, whole = surface_of(*parts)
    assert kept.waves is not None
    assert whole.waves is not None
    present = np.abs(whole.waves) > 1e-12 * np.abs(whole.waves).max()
    rows, columns = (np.flatnonzero(present.any(axis=axis)) for axis in (1, 0))
    assert (columns.max(), np.abs(np.fft.fftfreq(NY, 1 / NY))[rows_of(NY, NY)][rows].max()) == highest
    few, all_heights = (np.asarray(surface.heights((0.0, 0.0), np.empty((NY, NX)))) for surface in (kept, whole))
    assert_allclose(few, all_heights, rtol=0.0, atol=1e-14 * float(np.ptp(all_heights)))


@pytest.mark.parametrize(("angle", "axis"), [(0.0, 1), (90.0, 0), (180.0, 1)])
def test_an_anisotropic_surface_of_a_job(angle: float, axis: int) -> None:
    """Slopes along the angle [deg], from x towards y, are the smaller ones; the rms slope is as asked."""
    _, surface = surface_of({**ROUGH, "anisotropy": {"ratio": 4.0, "angle": angle}})
    heights = surface.heights((0.0, 0.0), surface.slab.empty())
    gentle = np.std(np.diff(heights, axis=axis)) / (SIZE[1 - axis] / heights.shape[axis])
    steep = np.std(np.diff(heights, axis=1 - axis)) / (SIZE[axis] / heights.shape[1 - axis])
    assert gentle < 0.5 * steep
