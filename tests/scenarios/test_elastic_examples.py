"""The elastic examples of jobs/ against closed forms.

Tolerances are what the examples promise: Hertz's approach and peak pressure to 0.5 %, Westergaard's contact to one cell
and pressures to 1 % of the highest, Johnson's mean gap to 1e-3 of the amplitude and peak pressure to 0.2 %. What is
measured is given where it is far better.
"""

import itertools
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wavy_contact
from marched_jobs import JOBS, example, marched
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from static_jobs import run

import parcontact as pc
from parcontact.contact import starts
from parcontact.errors import RunError
from parcontact.files.recorder import StepRow
from parcontact.theory import hertz, wavy

SPHERE = (0.15, 1e-2, 2.75e6)  # force [N], radius [m], shear modulus [Pa] of jobs/hertz.yaml
WAVE = (5e-7, 2.5e-4, 1e6)  # amplitude [m], wavelength [m], shear modulus [Pa] of jobs/westergaard.yaml and waves.yaml
X = WAVE[1] / 1024 * np.arange(1024.0)  # where the points of jobs/westergaard.yaml are [m]


def test_hertz() -> None:
    """Measured: approach 5e-6, peak pressure 8e-6; the displacement 1e-4 of the approach everywhere."""
    [(row, fields)] = run(JOBS / "hertz.yaml")
    assert_allclose(row.measures.approach, hertz.approach(*SPHERE), rtol=5e-3)
    assert_allclose(row.measures.max_pressure, hertz.peak_pressure(*SPHERE), rtol=5e-3)
    x = np.linspace(-0.75e-3, 0.75e-3, 256, endpoint=False)
    r = np.hypot(x[None, :], x[:, None])
    wrong = np.abs(fields["displacement"] - hertz.displacement(r, *SPHERE))
    assert wrong.max() < 1e-3 * hertz.approach(*SPHERE)
    wrong = np.abs(fields["pressure"] - hertz.pressure(r, *SPHERE))
    assert wrong[r < 0.95 * hertz.contact_radius(*SPHERE)].max() < 1e-3 * hertz.peak_pressure(*SPHERE)
    assert_allclose(row.measures.pressure * 1.5e-3**2, 0.15, rtol=1e-13)


def test_hertz_converges() -> None:
    """Orders over 64, 128, 256 points; measured: approach 1.8, peak 2.1, pressures 1.55, where the edge allows 1.5."""
    points, errors = [64, 128, 256], []
    for count in points:
        march, (*_, row) = marched(example("hertz", f"grid.points={count}", "numerics.tolerance=1e-8"))
        x = march.scene.job.grid.dx * np.arange(count) - march.scene.job.grid.lx / 2
        exact = hertz.pressure(np.hypot(x[None, :], x[:, None]), *SPHERE)
        approach = row.measures.approach / hertz.approach(*SPHERE) - 1
        peak = row.measures.max_pressure / hertz.peak_pressure(*SPHERE) - 1
        errors.append((abs(approach), abs(peak), np.abs(march.field("pressure") - exact).sum() / exact.sum()))
    for name, least, wrong in zip(("approach", "peak", "pressure"), (1.5, 1.8, 1.4), np.transpose(errors), strict=True):
        observed = -float(np.polyfit(np.log(points), np.log(wrong), 1)[0])
        print(f"{name}: errors {wrong}, order {observed:.2f}")
        assert observed > least


def test_hertz_area_corrected() -> None:
    """Counted areas are 1.4 % too large in the mean at 17 cells per radius; corrected by their edges 0.4 % too small.

    Five loads, each with the sphere over a point and next to one; a circle of the right size that falls badly between
    points stays wrong by 1 %, measured 0.9 %.
    """
    counted, corrected = [], []
    cell = 1.5e-3 / 64
    for force, alongside in itertools.product((0.05, 0.07, 0.1, 0.15, 0.2), ([0.0, 0.0], [0.31, 0.17])):
        centre = [0.75e-3 + share * cell for share in alongside]
        sphere = {"shape": "sphere", "radius": SPHERE[1], "center": centre}
        _, rows = marched(
            {
                "grid": {"points": 64, "size": 1.5e-3, "boundary": "free"},
                "surface": sphere,
                "material": {"model": "elastic", "poisson": 0.5, "shear_modulus": SPHERE[2]},
                "history": [{"force": force}],
                "numerics": {"tolerance": 1e-6},
            }
        )
        area = math.pi * float(hertz.contact_radius(force, *SPHERE[1:])) ** 2 / 1.5e-3**2
        counted.append(rows[-1].measures.contact_area / area - 1)
        corrected.append(rows[-1].measures.contact_area_corrected / area - 1)
    print(f"counted {np.mean(counted):.4f}, corrected {np.mean(corrected):.4f}, at most {np.abs(corrected).max():.4f}")
    assert 0.01 < np.mean(counted) < 0.018
    assert -0.006 < np.mean(corrected) < 0.0
    assert np.abs(corrected).max() < 0.01


def test_errors_of_areas_of_coarse_spheres_are_stated() -> None:
    """Over a point, where chance makes the most of it: radii of 3 to 20 cells. At least 0.4 of each error is stated,
    and less than three times the sum of all; measured 0.42 at least, and 0.7 times."""
    radius = float(hertz.contact_radius(*SPHERE))
    stated, true = [], []
    for count in (10, 12, 14, 16, 18, 20, 24, 32, 48, 64):
        size = radius / 0.31
        _, (*_, row) = marched(
            {
                "grid": {"points": count, "size": size, "boundary": "free"},
                "surface": {"shape": "sphere", "radius": SPHERE[1]},
                "material": {"model": "elastic", "poisson": 0.5, "shear_modulus": SPHERE[2]},
                "history": [{"force": SPHERE[0]}],
            }
        )
        assert row.errors is not None
        stated.append(row.errors.area.total)
        true.append(abs(row.measures.contact_area_corrected * size**2 / (math.pi * radius**2) - 1.0))
    print(np.divide(stated, true), sum(stated) / sum(true))
    assert min(np.divide(stated, true)) > 0.4
    assert sum(stated) < 3.0 * sum(true)


def test_johnson_area_corrected() -> None:
    """The surface wavy in two directions, mean over 16 loads from 11 to 90 % of contact, of waves between the points.

    The reference is the counted area at 128 and 256 cells per wave, extrapolated to the first order: in this mean it is
    good to 1e-3. At 64 cells counted areas are then 1.3 % too large, corrected ones right to 2e-4.
    """
    full = float(wavy_contact.full_contact_pressure(*WAVE))
    areas = {}
    for points in (64, 128, 256):
        waves = [
            {"shape": "wave", "amplitude": WAVE[0] / 2, "waves": [1, sign], "phase": phase}
            for sign, phase in ((1, 0.48), (-1, 0.14))
        ]
        _, rows = marched(
            {
                "grid": {"points": points, "size": WAVE[1]},
                "surface": waves,
                "material": {"model": "elastic", "poisson": 0.5, "shear_modulus": WAVE[2]},
                "history": [{"pressure": share * full} for share in np.linspace(0.05, 0.8, 16).tolist()],
                "numerics": {"tolerance": 1e-6},
            }
        )
        both = [(row.measures.contact_area, row.measures.contact_area_corrected) for row in rows[1:]]
        areas[points] = np.array(both)
    reference = 2 * areas[256][:, 0] - areas[128][:, 0]
    counted, corrected = (areas[64] / reference[:, None] - 1).mean(axis=0)
    print(f"counted {counted:.4f}, corrected {corrected:.4f}")
    assert 0.01 < counted < 0.02
    assert abs(corrected) < 2e-3


def check_westergaard(row: StepRow, pressures: NDArray[Any], edge: float, wrong: float) -> None:
    """Each of the two edges of the contact to `edge` cells, and the pressures to `wrong` of the highest."""
    mean = row.measures.pressure
    cells = X.size * (row.measures.contact_area - float(wavy.contact_fraction(mean, *WAVE)))
    assert abs(cells) <= 2 * edge
    expected = wavy.pressure(X, mean, *WAVE)
    assert np.abs(pressures - expected).max() <= wrong * expected.max()
    assert_allclose(row.measures.max_pressure, expected.max(), rtol=1e-3)
    assert_allclose(row.measures.mean_gap, wavy.mean_gap(mean, *WAVE), atol=1e-5 * WAVE[0])


def test_westergaard() -> None:
    """The contact to one cell. Measured: pressures 0.8 % of the highest, in the last cell of the contact."""
    steps = run(JOBS / "westergaard.yaml")
    assert len(steps) == 5
    for row, fields in steps:
        check_westergaard(row, fields["pressure"], 0.5, 0.01)
        expected = wavy.gap(X, row.measures.pressure, *WAVE)
        assert np.abs(fields["gap"] - expected).max() <= 1e-4 * WAVE[0]
    closed = wavy.pressure(X, steps[-1][0].measures.pressure, *WAVE)
    assert np.abs(steps[-1][1]["pressure"] - closed).max() <= 1e-9 * closed.max()


def test_westergaard_at_all_loads() -> None:
    """Each edge to one cell (measured 0.7). Where an edge falls just so, the pressure next to it misses 1.8 %."""
    full = float(wavy.full_contact_pressure(*WAVE))
    history = ", ".join(f"{{pressure: {share * full / 50}}}" for share in range(1, 50))
    for row, fields in run(JOBS / "westergaard.yaml", "grid.points=[1024, 1]", f"history=[{history}]"):
        check_westergaard(row, fields["pressure"], 1.0, 0.02)


def test_rough() -> None:
    """On a coarser grid. Contact grows with the load, and at the lightest is 2 to 2.5 times p/(E* slope).

    The tolerance is 1e-4 of the surface's height.
    """
    steps = run(JOBS / "rough.yaml", "grid.points=256", "numerics.tolerance=1e-3")
    areas = [row.measures.contact_area for row, _ in steps]
    assert areas == sorted(areas)
    assert 2.0 < areas[0] / (2e4 / (4e6 * 0.25)) < 2.6
    assert areas[-1] < 2.0 * 2.5e5 / (4e6 * 0.25)
    for row, fields in steps:
        assert row.certificate.worst <= 1e-3
        assert fields["pressure"].min() >= 0.0
        assert_allclose(fields["gap"].mean(), row.measures.mean_gap, rtol=1e-9)


# -- elastic jobs whichever way the load is given, and from other starts ----------------------------------------------

BUMPS = """
grid: {points: [48, 40], size: [1.0e-3, 8.0e-4]}
surface: {shape: rough, hurst: 0.8, long_wavelength: 5.0e-4, short_wavelength: 1.0e-4, rms_height: 1.0e-6, seed: 4}
material: {model: elastic, poisson: 0.5, shear_modulus: 1.0e6}
history: [{pressure: 5.0e3}]
numerics: {tolerance: 1.0e-10}
"""


@pytest.fixture
def bumps(tmp_path: Path) -> Path:
    """A small rough periodic job in a file."""
    path = tmp_path / "bumps.yaml"
    path.write_text(BUMPS)
    return path


# -- the same contact, given in other ways -----------------------------------------------------------------------------


def test_periodic_approach_beyond_full_contact_is_refused(bumps: Path) -> None:
    """With the approach that would be just full contact; below it all is well."""
    closed = 0.0  # a surface of mean height 0 is closed when its mean is where the body's was
    run(bumps, f"history=[{{approach: {closed - 1e-9}}}]")
    with pytest.raises(RunError, match=r"approach of 1e-07 m is beyond full contact.*prescribe a pressure") as refusal:
        run(bumps, "history=[{approach: 1.0e-7}]")
    assert "step 1" in str(refusal.value)


# -- invariance --------------------------------------------------------------------------------------------------------


def test_poisson_ratio(bumps: Path) -> None:
    """Only (1 - nu)/G enters."""
    [(_, expected)] = run(bumps)
    [(row, found)] = run(bumps, "material.poisson=0.2", "material.shear_modulus=1.6e6")
    assert_allclose(found["pressure"], expected["pressure"], atol=1e-8 * row.measures.max_pressure)


def test_coming_from_another_load_changes_nothing(bumps: Path) -> None:
    """An elastic body has no memory: to the tolerance of the solves."""
    direct, detour = run(bumps)[-1], run(bumps, "history=[{pressure: 5.0e4}, {pressure: 1.0}, {pressure: 5.0e3}]")[-1]
    assert_allclose(detour[1]["pressure"], direct[1]["pressure"], atol=1e-8 * direct[0].measures.max_pressure)


# -- starts ------------------------------------------------------------------------------------------------------------


def test_only_the_first_solve_of_a_large_job_starts_on_coarser_grids(
    bumps: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the limit lowered: its pressure is the same to the tolerance, at fewer calls; later steps start as ever."""
    words = ("grid.points=64", "surface.short_wavelength=1.25e-4", "history=[{pressure: 5.0e3}, {pressure: 6.0e3}]")
    (small, fields), (small_after, _) = run(bumps, *words)
    monkeypatch.setattr(starts, "WORTHWHILE", 64 * 64)
    grids, descend = list[int](), starts.descend

    def counted(levels: list[starts.Level], *given: Any) -> None:
        grids.append(len(levels))
        descend(levels, *given)

    monkeypatch.setattr(starts, "descend", counted)
    (large, expected), (large_after, _) = run(bumps, *words)
    assert grids == [2]
    assert_allclose(fields["pressure"], expected["pressure"], rtol=0, atol=1e-7 * expected["pressure"].max())
    assert large.operator_calls < small.operator_calls
    assert abs(large_after.operator_calls - small_after.operator_calls) <= 3  # an iteration


# -- cells four times as long across the sliding as along it: friction and the area of a finer mesh of ----------------

BODY = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 2e-5}]}
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1e-3 / 12, "rms_slope": 0.1}


def steady(points: tuple[int, int], along: tuple[int, int] = (1, 0)) -> tuple[float, float, float]:
    job: dict[str, Any] = {
        "grid": {"points": list(points), "size": 1e-3},
        "surface": {**ROUGH, "seed": 4},
        "material": BODY,
        "numerics": {"tolerance": 1e-3, "accuracy": 0.5},
        "steady": {"velocities": [1.0], "pressures": [1.5e5], "direction": list(along)},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = pc.steady(job)
    return found.friction[0], found.contact_area_corrected[0], found.error_friction[0]


def test_friction_comes_from_the_cells_along_the_sliding() -> None:
    """With 16 and 4 cells per shortest wave, against 16 and 16: friction within 1 %, the corrected area within 2 %.
    With 4 along and 16 across friction is more wrong; either is within twice its estimate, as 95 % are, and
    the one of short cells along the sliding states less."""
    (fine, area, _), (long, of_long, stated), (wide, _, of_wide) = (
        steady(points) for points in ((192, 192), (192, 48), (48, 192))
    )
    assert long == pytest.approx(fine, rel=0.01)
    assert of_long == pytest.approx(area, rel=0.02)
    assert abs(long / fine - 1.0) < abs(wide / fine - 1.0) < 2.0 * of_wide
    assert abs(long / fine - 1.0) < 2.0 * stated
    assert stated < 0.5 * of_wide


def calls_of_a_slide(points: tuple[int, int], velocity: tuple[float, float]) -> float:
    """Operator calls per step of a slide by half a shortest wave, in steps of a cell."""
    slide = {"pressure": 1.5e5, "velocity": list(velocity), "distance": 1e-3 / 24, "cells_per_step": 1}
    job = {"grid": {"points": list(points), "size": 1e-3}, "surface": {**ROUGH, "seed": 4}, "material": BODY}
    rows = marched({**job, "history": [{"pressure": 1.5e5}, slide], "numerics": {"tolerance": 5e-3}})[1]
    calls = [row.operator_calls for row in rows[2:]]
    return sum(calls) / len(calls)


@pytest.mark.parametrize(("points", "velocity"), [((192, 48), (1.0, 0.0)), ((48, 192), (0.0, 1.0))])
def test_a_slide_takes_as_many_calls_as_on_squares(points: tuple[int, int], velocity: tuple[float, float]) -> None:
    """Within 15 %, of squares with the same cells along the sliding; 40 % more without pairs along it."""
    squares, long = calls_of_a_slide((192, 192), velocity), calls_of_a_slide(points, velocity)
    assert long <= 1.15 * squares
