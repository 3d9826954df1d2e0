"""Solves that a sudden change follows: their tolerance, and that stated errors hold after the change."""

import math
import warnings
from typing import Any

import pytest
from marching import begun

import parcontact as pc
from parcontact.march.sudden import ALLOWED, LEAST, tolerance_at_end, tolerance_of_start

INF, ONE, TAU = 1e6, 4e6, 1e-3
ZENER = {"model": "zener", "modulus_inf": INF, "branches": [{"modulus": ONE, "relaxation_time": TAU}]}
SURFACE = {"shape": "rough", "hurst": 0.9, "rms_slope": 0.02, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4}
PRESSURE, SLOW, CELL = 1e5, 1e-2, 1e-3 / 128
STEADY = {"state": "steady", "velocity": SLOW, "pressure": PRESSURE}
BEFORE = {"pressure": PRESSURE, "velocity": SLOW, "distance": 4 * CELL, "cells_per_step": 1}
FAST = {"pressure": PRESSURE, "velocity": 3.0, "distance": 0.25 * CELL, "time_step": {"first": 1e-9, "growth": 1.5}}


def job(history: list[dict[str, Any]], **sections: Any) -> dict[str, Any]:
    return {
        "grid": {"points": 128, "size": 128 * CELL},
        "surface": {**SURFACE, "seed": 1},
        "material": ZENER,
        "history": history,
        **sections,
    }


def before(modulus: complex, dt: float) -> float:
    """The tolerance before a step of this length, of a body that had this modulus."""
    at_once = INF + ONE * (-math.expm1(-dt / TAU) * TAU / dt if dt else 1.0)
    return ALLOWED / (at_once / abs(modulus) - 1.0)


def modulus(frequency: float) -> complex:
    turn = 1j * frequency * TAU
    return INF + ONE * turn / (1.0 + turn)


def at_ends(history: list[dict[str, Any]], **sections: Any) -> list[float]:
    """The largest tolerance of all steps."""
    march = begun(job(history, **sections))
    return [tolerance_at_end(march.scene.choices, step) for step in march.timeline()]


def test_before_a_step_of_velocity() -> None:
    """ALLOWED over by how much the modulus rises, from that of waves of two cells; before the history, or a stage."""
    slow = {**BEFORE, "velocity": 2e-3}
    start = begun(job([FAST], initial={**STEADY, "velocity": 2e-3}))
    expected = before(modulus(math.pi * 2e-3 / CELL), next(iter(start.timeline())).dt)
    assert tolerance_of_start(start.scene.choices) == pytest.approx(expected, rel=1e-12)
    found = at_ends([slow, FAST])
    assert found[4] == pytest.approx(expected, rel=1e-12)  # after a jump of the load
    assert all(map(math.isinf, found[:4] + found[5:]))


def test_before_a_jump_of_the_load() -> None:
    """In which nothing relaxes; after a rest of 10 ms the modulus is that of its time."""
    rest, more = {"pressure": PRESSURE, "duration": 1e-2, "time_step": 5e-3}, {"pressure": 2 * PRESSURE}
    assert at_ends([rest, more])[2] == pytest.approx(before(modulus(1e2), 0.0), rel=1e-12)


def test_where_nothing_is_sudden() -> None:
    """Velocity and load go on; a body without memory; a long first step of a stage, in which the body is no stiffer."""
    ramp = {**BEFORE, "pressure": {"from": PRESSURE, "to": 2 * PRESSURE}}
    assert all(map(math.isinf, at_ends([BEFORE, BEFORE, ramp])))
    assert tolerance_of_start(begun(job([BEFORE], initial=STEADY)).scene.choices) == math.inf
    elastic = {"model": "elastic", "shear_modulus": 1e6}
    assert all(map(math.isinf, at_ends([BEFORE, FAST], material=elastic)))
    assert all(map(math.isinf, at_ends([FAST, BEFORE])))


def test_no_smaller_than_needed() -> None:
    """A body that is a thousand times as stiff at once."""
    stiff = {"model": "zener", "modulus_inf": INF, "branches": [{"modulus": 1e3 * INF, "relaxation_time": TAU}]}
    still = {"pressure": PRESSURE, "duration": 1e3 * TAU, "time_step": 5e2 * TAU}
    assert at_ends([still, FAST], material=stiff)[2] == LEAST


@pytest.mark.parametrize(("history", "first"), [([FAST], 1), ([BEFORE, FAST], 5)])
def test_stated_errors_hold_after_a_step_of_velocity(history: list[dict[str, Any]], first: int) -> None:
    """Friction and the corrected area of the first steps at 10 %, against the same steps at a tolerance of 1e-6; the
    compound becomes forty times as stiff."""
    found = []
    for numerics in ({"accuracy": 0.1}, {"tolerance": 1e-6, "branch_error": 1e-2}):
        data = job(history, initial=STEADY, numerics=numerics, material={"include": "synthetic_tyre"})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            found.append(list(pc.Simulation(data).steps())[first:])
    for row, exact in zip(*found, strict=True):
        assert abs(row.friction / exact.friction - 1.0) < row.error_friction
        assert abs(row.contact_area_corrected / exact.contact_area_corrected - 1.0) < row.error_area
