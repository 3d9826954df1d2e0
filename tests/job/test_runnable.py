"""Jobs that no run could begin are mistakes, found when they are read."""

from pathlib import Path

import pytest

from parcontact.job.checks.cells import has_wave

from .texts import SMALL, job_of, mistakes_of, replaced

FLUID = "{model: zener, modulus_inf: 0, branches: [{modulus: 1e6, relaxation_time: 1}]}"
LINE = "{points: [64, 1], size: [1e-3, 1e-5]}"
CURVE = "{velocities: [1], pressures: [1e4]}"
ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: %s, short_wavelength: %s, rms_slope: 0.1}"


@pytest.mark.parametrize(
    ("key", "sections"),
    [
        ("steady", {"steady": CURVE}),
        ("steady", {"steady": CURVE, "grid": "{points: 64, size: 1e-3, boundary: free}"}),
        ("steady", {"steady": CURVE, "grid": LINE, "body": "{thickness: 1e-4}"}),
        ("steady", {"steady": CURVE.replace("{", "{direction: [0, 1], "), "grid": LINE}),
        ("initial", {"initial": "{state: steady, velocity: 1, pressure: 1}"}),
        ("initial", {"initial": "{state: steady, pressure: 1}", "grid": LINE}),
    ],
)
def test_a_body_that_flows_has_no_steady_state(key: str, sections: dict[str, str], tmp_path: Path) -> None:
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, **{"material": FLUID, **sections}))
    assert f": {key} needs a material with a long-term modulus" in mistake


def test_but_for_a_line_along_which_it_slides(tmp_path: Path) -> None:
    assert job_of(tmp_path, replaced(SMALL, material=FLUID, grid=LINE, steady=CURVE)).steady is not None


def test_energies_count_from_a_body_at_rest(tmp_path: Path) -> None:
    asked = replaced(SMALL, initial="{state: steady, pressure: 1}", output="{energy: true}")
    (mistake,) = mistakes_of(tmp_path, asked)
    assert mistake.startswith("job.yaml:2:18: output.energy needs initial: {state: virgin}")


def test_a_rough_surface_needs_a_wave(tmp_path: Path) -> None:
    """On a box of 1 mm there is none from 0.44 to 0.4 mm: (2, 1) has 0.447 mm, (2, 2) 0.354 mm."""
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, surface=ROUGH % ("4.4e-4", "4.0e-4")))
    assert mistake.startswith("job.yaml:1:54: surface.long_wavelength leaves no wave down to short_wavelength")
    assert job_of(tmp_path, replaced(SMALL, surface=ROUGH % ("4.5e-4", "4.0e-4"))).surface


def test_waves_of_a_box(tmp_path: Path) -> None:
    """The limits as in the spectrum: a wave of the longest length is one, of the shortest none; not even as one of a
    number of points that ends at two cells along y, where a wave has no phase."""
    grid = job_of(tmp_path, replaced(SMALL, grid="{points: [8, 4], size: [1e-3, 1e-3]}")).grid
    assert has_wave(grid, 2.5e-4, 1e-3)
    assert has_wave(grid, 9e-4, 1e-3)
    assert not has_wave(grid, 1e-3, 1.1e-3)
    line = grid.model_copy(update={"points": (1, 4)})
    assert has_wave(line, 6e-4, 1e-3)
    assert not has_wave(line, 4e-4, 6e-4)


def test_a_layer_is_in_proportion_to_its_box(tmp_path: Path) -> None:
    (mistake,) = mistakes_of(tmp_path, replaced(SMALL, body="{thickness: 1e-13}"))
    assert mistake.startswith("job.yaml:1:19: body.thickness must be at least 1e-09 of the box, 1e-12 m, got 1e-13")
