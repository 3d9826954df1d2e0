"""A seal whose fluid carries a part of the load: against dry contacts, closed forms, and energy."""

import math
from typing import Any

import numpy as np
import pytest
from conftest import WORLD

import parcontact as pc

pytestmark = pytest.mark.filterwarnings("ignore::parcontact.doubts.ParcontactWarning")  # small samples
LENGTH, MODULUS, CLOSING = 2.5e-4, 1.0e6, 1.0e5  # of a wave [m], G [Pa], pressure of full contact p* [Pa]
AMPLITUDE = CLOSING * LENGTH / (math.pi * 4 * MODULUS)  # Westergaard (1939): p* = pi E* A/lambda, E* = 4 G
Json = dict[str, Any]
ROUGH: Json = {
    "grid": {"points": 32, "size": 4e-4},
    "surface": {
        "shape": "rough",
        "hurst": 0.8,
        "long_wavelength": 2e-4,
        "short_wavelength": 5e-5,
        "rms_slope": 0.2,
        "seed": 1,
    },
    "material": {"model": "elastic", "shear_modulus": 2e6},
    "history": [{"pressure": 3e5}],
    "numerics": {"tolerance": 1e-6},
}


def last(job: Json, **more: Any) -> Any:
    """The last row of a run of a job with further sections; collective."""
    run = pc.Simulation({**job, **more}, comm=WORLD)
    run.run()
    return run


def total(high: float, low: float, **more: Any) -> Json:
    return {"pressures": [high, low], "load": "total", "fluid": "water", **more}


def test_ambient_pressure_changes_no_digit() -> None:
    """A fluid at the ambient pressure: the same as under a net load, with the same calls of the operator."""
    net, wet = last(ROUGH, leakage={}), last(ROUGH, leakage=total(2e5, 2e5))
    names = set(net.row) & set(wet.row) - {"seconds"}
    assert {name: net.row[name] for name in names} == {name: wet.row[name] for name in names}


def test_a_uniform_pressure_is_a_smaller_load() -> None:
    """With P on both sides the contact is the dry one under p0 - P."""
    wet, dry = last(ROUGH, leakage=total(1e5, 1e5, ambient=0.0)), last(ROUGH, history=[{"pressure": 2e5}])
    assert wet.row.contact_area == dry.row.contact_area
    difference = wet.field("pressure") - 1e5 - dry.field("pressure")
    assert np.abs(difference).max() <= 1e-4 * 2e5
    np.testing.assert_array_equal(wet.field("fluid_pressure"), 1e5)
