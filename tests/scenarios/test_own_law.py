"""A contact law of one's own: a fluid of the pressure q in the gap. Where `p > q` the surfaces touch.

The reference is the usual law, `p - q >= 0`, under the load that the fluid does not bear: an even pressure moves no
point of a periodic half space against another.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from marched_jobs import column, marched
from numpy.testing import assert_allclose

import parcontact as pc
from parcontact.door import manual_texts
from parcontact.effects import effect
from parcontact.effects.leakage.over_time import Gaps
from parcontact.errors import RunError
from parcontact.job import Job
from parcontact.results import maps

FLUID, LOAD = 4e4, 6e4  # pressure of the fluid, and the load that it does not bear [Pa]
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e6, "relaxation_time": 1e-4}]}
CELL = 1e-3 / 32


@pytest.fixture
def with_fluid(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """The constraint of the manual's page `effects`, in place of the usual one."""
    (module,) = re.findall(r"```python\n(# in_fluid.py\n.*?)```", manual_texts.page("effects"), re.S)
    names: dict[str, Any] = {}
    exec(module, names)
    assert names["FLUID"] == FLUID
    return lambda: monkeypatch.setattr(effect, "constraint_of", names["constraint_of"])


def job(load: float, points: int = 32, **changes: Any) -> dict[str, Any]:
    found = {
        "grid": {"points": points, "size": 1e-3},
        "surface": ROUGH,
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": load}],
        "numerics": {"tolerance": 1e-8},
    }
    return found | changes


def slide(load: float) -> dict[str, Any]:
    history = [
        {"pressure": load, "duration": 1e-4, "time_step": 2e-5},
        {"pressure": load, "velocity": 0.5, "distance": 6 * CELL, "cells_per_step": 1},
    ]
    return job(load, material=ZENER, history=history, leakage={}, interface={"shear_stress": 1e4})


@pytest.mark.parametrize("points", [32, 256])
def test_the_area_is_where_the_pressure_is_above_that_of_the_fluid(points: int, with_fluid: Any) -> None:
    """One press, on a small grid and on one that coarser grids and tiles prepare; pressures to the tolerance."""
    expected, rows = marched(job(LOAD, points))
    with_fluid()
    found, others = marched(job(LOAD + FLUID, points))
    dry, wet = rows[-1].measures, others[-1].measures
    assert 0.05 < dry.contact_area < 0.6
    assert wet.contact_area == dry.contact_area
    assert wet.contact_area_corrected == dry.contact_area_corrected
    assert_allclose(wet.pressure, LOAD + FLUID, rtol=1e-12)
    assert_allclose(found.field("pressure") - FLUID, expected.field("pressure"), rtol=0, atol=1e-6 * dry.max_pressure)


def test_effects_ask_the_law(with_fluid: Any) -> None:
    """A slide of a viscoelastic body: contact area, tangential force with that of the interface, and leakage."""
    march, rows = marched(slide(LOAD))
    with_fluid()
    wet, others = marched(slide(LOAD + FLUID))
    for name in ("contact_area", "contact_area_corrected"):
        assert np.array_equal(column(rows, name), column(others, name))
    scale = np.abs(column(rows, "force_x")).max()
    assert scale > 0.0
    assert_allclose(column(others, "force_x"), column(rows, "force_x"), rtol=0, atol=1e-6 * scale)
    flows, dry = (np.array([row.added for row in each])[1:, -3:] for each in (others, rows))
    assert dry.max() > 0.0
    assert_allclose(flows, dry, rtol=1e-4, atol=1e-6 * dry.max())
    apart, errors = (column(each[1:], "error_area") for each in (others, rows))
    assert_allclose(apart, errors, rtol=0.05, atol=1e-6)  # certificates are relative to the load
    assert march.scene.slab.tally["retry"] == wet.scene.slab.tally["retry"] == 0


def test_saved_maps_ask_the_law(tmp_path: Path, with_fluid: Any) -> None:
    """Leakage from saved gaps, and pictures of these, are closed where the surfaces touch."""
    with_fluid()
    out = {"directory": str(tmp_path / "out"), "fields": ["pressure", "gap"]}
    pc.Simulation(job(LOAD + FLUID, 64, output=out)).run()
    touching = Gaps(tmp_path / "out").read(-1) == 0.0
    with h5py.File(tmp_path / "out" / "fields.h5") as file:
        pressure, gap = file["pressure"][-1], file["gap"][-1]
    assert 0.05 < np.mean(pressure > FLUID) < 0.6
    assert np.array_equal(touching | (gap <= 0.0), (pressure > FLUID) | (gap <= 0.0))
    drawn = maps.mask("gap", gap, pressure, Job.model_validate(job(LOAD)))
    assert np.array_equal(np.isnan(drawn), pressure > FLUID)


def test_a_start_from_the_fluid_alone(with_fluid: Any) -> None:
    """The first guess is 0 everywhere, which the bound makes q: no point is free then. The sum of q over
    16 x 16 points has no rounding."""
    wave = {"grid": {"points": 16, "size": 1e-3}, "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]}}
    stages = [{"pressure": FLUID + LOAD, "duration": 1e-3}, {"pressure": FLUID + 2 * LOAD, "duration": 1e-3}]
    job = {**wave, "material": {"model": "elastic", "shear_modulus": 1e6}, "history": stages}
    with_fluid()
    rows = list(pc.Simulation(job).steps())
    assert rows[-1].pressure == pytest.approx(FLUID + 2 * LOAD, rel=1e-6)


def test_a_load_below_that_of_the_fluid_is_refused(with_fluid: Any) -> None:
    """It says both numbers; pressures of at least q cannot have a smaller mean."""
    with_fluid()
    with pytest.raises(
        RunError, match=r"pressures of at least 4e\+04 Pa cannot have the mean 3e\+04 Pa; change the load"
    ):
        marched(job(0.75 * FLUID))
