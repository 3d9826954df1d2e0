"""Elastic jobs whichever way the load is given, and from other starts."""

from pathlib import Path
from typing import Any

import pytest
from numpy.testing import assert_allclose
from static_jobs import run

from parcontact.errors import RunError
from parcontact.solve import nested
from parcontact.solve.fallback import cold_start

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


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_pressure_force_and_approach_agree(bumps: Path, boundary: str) -> None:
    """Tolerance 1e-10 on gaps: pressures to 1e-8 of the highest."""
    body = f"grid.boundary={boundary}"
    [(pressed, expected)] = run(bumps, body)
    force = 5e3 * 1e-3 * 8e-4
    [(forced, by_force)] = run(bumps, body, f"history=[{{force: {force!r}}}]")
    [(moved, by_approach)] = run(bumps, body, f"history=[{{approach: {pressed.measures.approach!r}}}]")
    highest = pressed.measures.max_pressure
    assert_allclose(by_force["pressure"], expected["pressure"], atol=1e-8 * highest)
    assert_allclose(by_approach["pressure"], expected["pressure"], atol=1e-8 * highest)
    assert_allclose(forced.measures.pressure, 5e3, rtol=1e-13)
    assert_allclose(moved.measures.pressure, 5e3, rtol=1e-7)


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
    monkeypatch.setattr(cold_start, "WORTHWHILE", 64 * 64)
    grids, descend = list[int](), nested.descend

    def counted(levels: list[nested.Level], *given: Any) -> None:
        grids.append(len(levels))
        descend(levels, *given)

    monkeypatch.setattr(nested, "descend", counted)
    (large, expected), (large_after, _) = run(bumps, *words)
    assert grids == [2]
    assert_allclose(fields["pressure"], expected["pressure"], rtol=0, atol=1e-7 * expected["pressure"].max())
    assert large.operator_calls < small.operator_calls
    assert abs(large_after.operator_calls - small_after.operator_calls) <= 3  # an iteration
