"""A job is warned of odd values, and refused for impossible ones, as it is read."""

from pathlib import Path

import pytest

from parcontact.errors import InputError

from .texts import SMALL, job_of, replaced

ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: 5e-4, short_wavelength: 6.25e-5, rms_slope: 0.1}"
SLIDING = "[{pressure: 1e4, velocity: 1, distance: 1e-4, cells_per_step: 2}]"


def test_warning_of_few_long_waves_and_few_cells(tmp_path: Path) -> None:
    long, short = job_of(tmp_path, replaced(SMALL, surface=ROUGH)).warnings
    assert "only 2 of the longest waves fit into the box along x" in long
    assert "a grid.size of 0.002 m or a long_wavelength of 0.00025 m" in long
    assert "only 4 cells per shortest wave along x" in short
    assert "needs 8: use 128 points (4 times the memory) or a short_wavelength of 0.000125 m" in short
    stage = "{pressure: 1e5, velocity: 1.0, distance: 1e-4, cells_per_step: 1}"
    _, short, *_ = job_of(tmp_path, replaced(SMALL, surface=ROUGH).replace("{pressure: 1e5}", stage)).warnings
    assert "128 points (2.9 times the memory, about 5.7 times the time in sliding)" in short


def test_the_longest_waves_of_an_anisotropic_surface_are_those_along_its_lay(tmp_path: Path) -> None:
    """They are four times as long as those across, of which four fit into the box of 1 mm."""
    rough = ROUGH.replace("5e-4", "2.5e-4").replace("6.25e-5", "1.25e-4")
    for angle, axis in ((0, "x"), (90, "y")):
        text = replaced(SMALL, surface=rough.replace("}", f", anisotropy: {{ratio: 4, angle: {angle}}}}}"))
        (warning,) = job_of(tmp_path, text).warnings
        assert f"only 1 of the longest waves fit into the box along {axis}" in warning
        assert "use a grid.size of 0.004 m or a long_wavelength of 6.25e-05 m" in warning


def test_where_nothing_slides_friction_asks_for_no_cells(tmp_path: Path) -> None:
    """Its accuracy is of no meaning there: 4 cells do for an error of the area of 3 %, 8 (1/3)^(1/1.6)."""
    strict = replaced(SMALL, surface=ROUGH, numerics="{accuracy: {friction: 0.001, area: 0.031}}")
    assert not any("cells per shortest wave" in text for text in job_of(tmp_path, strict).warnings)


@pytest.mark.parametrize(("size", "warned"), [("[5e-2, 5e-2]", False), ("[1.0, 5e-2]", True)])
def test_warning_of_a_box_that_is_out_of_proportion(tmp_path: Path, size: str, warned: bool) -> None:
    """With cells enough: 400 of the longest waves along a side, and 8000; one in mm, taken for m, has 1000 and more."""
    rough = ROUGH.replace("5e-4", "1.25e-4")
    text = replaced(SMALL, surface=rough, grid=f"{{points: 1, size: {size}}}")
    found = job_of(tmp_path, text, "grid.points=[32000, 2400]").warnings
    stated = "grid.size: a side of 1 m, 8000 times surface.0.long_wavelength, 0.000125 m; is it in m?"
    assert [warning.startswith(stated) for warning in found if warning.startswith("grid.size")] == [True] * warned


def test_no_warning_of_a_few_points_that_lack(tmp_path: Path) -> None:
    """64^2 points are 8 cells per shortest wave; 3 and 6 % of them lack on 63^2 and on 62^2."""
    text = replaced(SMALL, surface=ROUGH.replace("5e-4", "2.5e-4").replace("6.25e-5", "1.25e-4"))
    points = [f"grid.points={points}" for points in (64, 63, 62)]
    assert [bool(job_of(tmp_path, text, one).warnings) for one in points] == [False, False, True]


def test_warning_of_backward_euler_with_long_steps(tmp_path: Path) -> None:
    zener = "{model: zener, branches: [{modulus: 1e6, relaxation_time: 1e-3}, {modulus: 1e6, relaxation_time: 1}]}"
    history = "[{pressure: 1, duration: 1, time_step: {first: 1e-5, growth: 1.25}}]"
    text = replaced(SMALL.split("history")[0], material=zener, history=history)
    (warning,) = job_of(tmp_path, text, "numerics.integrator=backward-euler").warnings
    assert "time steps of up to 0.2 s exceed the shortest relaxation time, 0.001 s" in warning
    assert job_of(tmp_path, text).warnings == ()
    assert job_of(tmp_path, text, "numerics.integrator=backward-euler", "history.0.time_step=1e-3").warnings == ()
    shift = "material.shift={law: factors, temperatures: [0, 20], logs: [3, 0], reference: 20}"
    cold = job_of(tmp_path, text, "numerics.integrator=backward-euler", shift, "material.temperature=0")
    assert cold.warnings == ()  # the shortest time is 1 s there


def test_warning_of_steps_that_skip_waves(tmp_path: Path) -> None:
    text = replaced(SMALL.split("history")[0], surface=ROUGH, history=SLIDING)
    fine = ("grid.points=128", "surface.long_wavelength=2.5e-4")
    assert job_of(tmp_path, text, *fine).warnings == ()
    (warning,) = job_of(tmp_path, text, *fine, "history.0.cells_per_step=4").warnings
    assert "0.5 of its shortest wave" in warning
    assert "cells_per_step of at most 2)" in warning


def test_warning_of_velocity_without_duration(tmp_path: Path) -> None:
    (warning,) = job_of(tmp_path, SMALL, "history.0.velocity=3").warnings
    assert warning == "history.0: a stage without duration or distance does not slide; its velocity has no effect"


def test_waves_of_a_free_box_are_refused(tmp_path: Path) -> None:
    """They are not independent there. Without them the same job is read."""
    steady = "{velocities: 1, pressures: 1e5, waves: %s}"
    free = SMALL.split("history")[0].replace("grid: {", "grid: {boundary: free, ")
    job_of(tmp_path, replaced(free, steady=steady % "false"))
    with pytest.raises(InputError, match=r"steady\.waves needs a periodic box"):
        job_of(tmp_path, replaced(free, steady=steady % "true"))
