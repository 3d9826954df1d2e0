"""Errors of friction that rises from rest in steps of whole cells: it comes late, most of all in the first step."""

from typing import Any

import numpy as np
import pytest
from marching import SLS, column, marched
from sliding import TYRE

import parcontact.march.errors

POINTS, CELLS, FINER = 48, 4, 16
ROUGH = {"shape": "rough", "hurst": 0.8, "rms_slope": 0.05, "long_wavelength": 5e-4, "short_wavelength": 1.25e-4}


def job(material: Any, speed: float, seed: int, cells_per_step: float = 1.0) -> dict[str, Any]:
    """A load of 20 kPa at once, and a slide of some cells."""
    slide = {"velocity": speed, "distance": CELLS * 1e-3 / POINTS, "cells_per_step": cells_per_step}
    return {
        "grid": {"points": POINTS, "size": 1e-3},
        "surface": {**ROUGH, "seed": seed},
        "material": material,
        "history": [{"pressure": 2e4, **slide}],
    }


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(("material", "speed"), [(TYRE, 1e-4), (TYRE, 1e-3), (SLS, 1e-3)])
def test_stated_errors_cover_what_comes_late(material: Any, speed: float, seed: int) -> None:
    """Errors by time steps, in the mean over the slide: at least 0.7 and at most 4 times those of its steps against
    sixteen times shorter ones. Without what comes late they are 0.05 to 0.25 times."""
    march, rows = marched(job(material, speed, seed))
    _, finer = marched(job(material, speed, seed, 1.0 / FINER))
    found, exact = column(rows, "friction")[-CELLS:], column(finer, "friction")[-FINER * CELLS :][FINER - 1 :: FINER]
    true = np.abs(found - exact).mean() / found.mean()
    assert march.state.errors.friction is not None
    assert 0.7 * true < march.state.errors.friction.time < 4.0 * true


def test_solves_do_not_follow_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """All results are the same without that error, digit by digit."""
    with_it, rows = marched(job(TYRE, 1e-3, 1))
    monkeypatch.setattr(parcontact.march.errors, "error_of_rise", lambda *_: 0.0)
    without, others = marched(job(TYRE, 1e-3, 1))
    for name in ("friction", "contact_area", "approach", "operator_calls"):
        np.testing.assert_array_equal(column(rows, name), column(others, name))
    assert with_it.state.tolerance == without.state.tolerance
    one, other = with_it.state.errors.friction, without.state.errors.friction
    assert one is not None
    assert other is not None
    assert one.time > 2.0 * other.time
