"""Cells per shortest wave of measured surfaces, from their spectra, in what is said of them and in their budgets."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from judging import job_of

import parcontact as pc
from parcontact import scene
from parcontact.march.errors import properties_of
from parcontact.parallel.slab import Slab
from parcontact.scene import sanity

SLIDE = {"pressure": 1e5, "velocity": 0.3, "distance": 1e-4, "cells_per_step": 1}


def frame_of(surface: dict[str, Any], points: int, boundary: str = "periodic") -> scene.Setup:
    job = job_of(surface, [SLIDE], grid={"points": points, "size": 1e-3, "boundary": boundary})
    return scene.set_up(job, Slab.alone(points, points))


def rough(hurst: float, short: float) -> dict[str, Any]:
    waves = {"long_wavelength": 2.5e-4, "short_wavelength": short, "rms_slope": 0.1, "seed": 1}
    return {"shape": "rough", "hurst": hurst, **waves}


def saved(path: Path, surface: dict[str, Any], points: int) -> dict[str, Any]:
    """A topography in a file, of the heights of another surface on so many points."""
    made = frame_of(surface, points)
    np.save(path, made.surface.heights((0.0, 0.0), made.slab.empty()) * made.units.height)
    return {"shape": "topography", "path": str(path), "unit": "m", "size": [1e-3, 1e-3]}


def cells(setup: scene.Setup) -> float:
    found = properties_of(setup, 0.0, True, None).cells_per_wave
    assert found is not None
    return found


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
@pytest.mark.parametrize("kind", ["topography", "file"])
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_a_map_has_the_cells_per_wave_of_its_rough_surface(
    tmp_path: Path, hurst: float, kind: str, boundary: str
) -> None:
    """To 5 %: 16 waves side by side are told apart by 6 %; the mesh part of the budget, which goes with the
    power 2.5 of it, to 12 %."""
    wanted = rough(hurst, 1e-3 / 16)
    part = saved(tmp_path / "road.npy", wanted, 128)
    if kind == "file":
        part = {"shape": "file", "path": part["path"]}
    expected = cells(frame_of(wanted, 128))
    assert expected == pytest.approx(8.0)
    assert cells(frame_of(part, 128, boundary)) == pytest.approx(expected, rel=0.05)


def test_a_map_on_a_coarse_grid_is_told(tmp_path: Path) -> None:
    """As a rough surface is; on its own fine grid nothing is said."""
    part = saved(tmp_path / "road.npy", rough(0.8, 1e-3 / 16), 144)
    assert sanity.check_heights(frame_of(part, 144)) == []
    (text,) = sanity.check_heights(frame_of(part, 64))
    assert text.startswith("surface: only 4.")
    assert "cells per shortest wave along x" in text
    assert "needs 8: use 12" in text


def test_friction_of_a_map_whose_waves_the_grid_lacks(tmp_path: Path) -> None:
    """On 1.8 cells per shortest wave steady friction is 28 % less than on 7, and its estimate covers that; it is not
    more than four times as much."""
    part = saved(tmp_path / "road.npy", {**rough(0.8, 1e-3 / 40), "rms_slope": 0.3}, 288)
    friction, error = {}, {}
    for points in (72, 288):
        data = {"grid": {"points": points, "size": 1e-3}, "surface": part, "material": {"include": "synthetic_tyre"}}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # coarse grids are told
            found = pc.steady({**data, "history": [{"pressure": 1e5}]}, velocities=[0.1], pressures=[1e5])
        friction[points], error[points] = found.friction[0], found.error_friction[0]
    wrong = 1.0 - friction[72] / friction[288]
    assert wrong > 0.2
    assert wrong <= error[72] < 4.0 * wrong
