"""Friction by the slopes of the rigid surface and by energy, and what their difference says of the mesh."""

import warnings
from typing import Any

import numpy as np
import pytest
from marched_jobs import marched

import parcontact as pc
from parcontact.door.python import Curve
from parcontact.job import Job
from parcontact.march.budget import ErrorSums

Json = dict[str, Any]
TYRE: Json = {"include": "synthetic_tyre"}
ONE: Json = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 9e6, "relaxation_time": 1e-3}]}
ELASTIC: Json = {"model": "elastic", "shear_modulus": 1e6}
CELLS = 6.25e-5  # m: the shortest wave, 16 in the box
FIVE = [  # Hurst exponent, rms slope, body, pressure [Pa], velocity [m/s]: friction of 2e-4 to 1e-2, 7 to 86 % contact
    (0.9, 0.02, TYRE, 1e5, 0.1),
    (0.7, 0.03, TYRE, 5e5, 0.01),
    (0.6, 0.1, ONE, 1e5, 0.1),
    (0.8, 0.1, ONE, 1e5, 0.6),
    (0.8, 0.05, ONE, 1e5, 3.0),
]


def scene(cells: int, body: Json, hurst: float = 0.8, slope: float = 0.1, **more: Any) -> Json:
    """A rough surface with a given number of cells per shortest wave."""
    rough = {"shape": "rough", "hurst": hurst, "long_wavelength": 2.5e-4, "short_wavelength": CELLS, "rms_slope": slope}
    grid = {"points": 16 * cells, "size": 1e-3}
    return {"grid": grid, "surface": {**rough, "seed": 1}, "material": body, "history": [{"pressure": 1e5}], **more}


def steady(data: Json, velocity: float, pressure: float) -> Curve:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # coarse meshes are stated
        return pc.steady(data, velocities=[velocity], pressures=[pressure], set={"numerics.tolerance": 2e-4})


@pytest.mark.parametrize(("hurst", "slope", "body", "pressure", "velocity"), FIVE)
def test_friction_by_energy_on_coarse_meshes(
    hurst: float, slope: float, body: Json, pressure: float, velocity: float
) -> None:
    """Within 3 % with 4 cells per shortest wave, 1 % with 8, of that with 32; its estimate is at least half of its
    error, in addition to what the solver may make of both (2e-4). The force across is small: `friction_slopes` counts
    it."""
    exact = steady(scene(32, body, hurst, slope), velocity, pressure).friction[0]
    for cells, bound in ((4, 3e-2), (8, 1e-2)):
        found = steady(scene(cells, body, hurst, slope), velocity, pressure)
        error = abs(found.friction[0] / exact - 1.0)
        assert error < bound
        assert found.error_friction[0] > 0.5 * error - 2e-4
        assert abs(found.force_x[0]) / np.hypot(found.force_x[0], found.force_y[0]) > 0.97


@pytest.mark.parametrize("radius", [2.0, 4.0])
def test_estimates_of_fast_small_spots(radius: float) -> None:
    """A sphere with a spot of a given number of cells, in four places between the points, on a body that loses most of
    the work. The estimate is at least each error: 1.1 to 10 times. Its mean is at most five times the root of the mean
    square error (1.9 and 4.2 times), as the spots are strips along the grid."""
    body = {"model": "zener", "modulus_inf": 1e5, "branches": ONE["branches"]}
    cell, velocity = 1e-3 / 32, 3.0 * radius / 32
    stiffness = abs(complex(pc.material(body).complex_modulus(np.pi * velocity / (radius * cell))))
    pressure = stiffness * 16.0 / 3.0 * (radius * cell) ** 3 / 1e-3 / 1e-6
    errors, estimates = [], []
    for place in ((16.0, 16.0), (16.25, 16.5), (16.5, 16.25), (16.75, 16.75)):
        sphere = {"shape": "sphere", "radius": 1e-3, "center": [cell * place[0], cell * place[1]]}
        fine, found = (steady({**scene(cells, body), "surface": sphere}, velocity, pressure) for cells in (8, 2))
        errors.append(abs(found.friction[0] / fine.friction[0] - 1.0))
        estimates.append(found.error_friction[0])
    assert all(estimate > error for estimate, error in zip(estimates, errors, strict=True))
    assert np.mean(estimates) < 5.0 * np.sqrt(np.mean(np.square(errors)))


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_estimates_where_contacts_are_alike(phase: float) -> None:
    """Ridges at an angle with the grid, wrong all along by 1 to 2 %, which is all of the difference of the views: three
    tenths of it would be 0.38 to 0.53 of the error."""
    body = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
    ridges = {"shape": "wave", "amplitude": 5e-7, "waves": [1, 1], "phase": phase}
    fine, found = (steady({**scene(cells, body), "surface": ridges}, 0.05, 1e3) for cells in (8, 2))
    error = abs(found.friction[0] / fine.friction[0] - 1.0)
    assert error > 0.01
    assert found.error_friction[0] > 0.5 * error


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_an_elastic_body_dissipates_nothing(boundary: str) -> None:
    """Its steady friction is 0, where that by the slopes is the mesh's."""
    data = scene(4, ELASTIC)
    data["grid"]["boundary"] = boundary
    found = steady(data, 1.0, 1e5)
    assert abs(found.friction[0]) < 1e-15 < abs(found.friction_slopes[0])


@pytest.mark.parametrize("velocity", [1.0, [0.6, 0.8]])
def test_friction_of_an_elastic_slide_is_0_within_its_error(velocity: Any) -> None:
    """Friction by slopes is an error of the mesh, and its budget says so: all of it is wrong."""
    slide = {"pressure": 1e5, "velocity": velocity, "distance": 2.5e-4, "cells_per_step": 1}
    _, rows = marched(Job.model_validate(scene(8, ELASTIC, history=[slide], numerics={"tolerance": 1e-9})))
    summary = ErrorSums()
    for row in rows:
        if row.errors is not None:
            summary = summary.plus(row.errors, row.measures.friction, 1.0, 1.0)
            assert row.errors.friction is not None
            assert row.errors.friction.of_friction == 1.0
    mean = np.mean([row.measures.friction for row in rows if row.errors])
    assert summary.friction_within == pytest.approx(mean, rel=1e-12)
    assert any(line.startswith("friction is 0 ± ") for line in summary.lines((0.01, 0.01)))


def test_friction_across_the_slide_has_an_error() -> None:
    """Ridges that slide along themselves have no friction; what the mesh makes is across, where the views differ."""
    ridges = {"shape": "wave", "amplitude": 1e-6, "waves": [3, 0], "phase": 0.4}
    slide = {"pressure": 6e4, "velocity": [0.0, 0.1], "distance": 1.25e-4, "cells_per_step": 1}
    data = {**scene(8, ONE), "grid": {"points": [32, 8], "size": [1e-3, 2.5e-4]}, "surface": ridges, "history": [slide]}
    _, rows = marched(Job.model_validate({**data, "numerics": {"tolerance": 1e-6}}))
    judged = [row for row in rows if row.errors is not None and row.measures.friction > 1e-7]
    assert judged
    for row in judged:
        assert row.errors is not None
        assert row.errors.friction is not None
        assert row.error_friction >= 1.0  # stated as 1 or more


def test_small_friction_of_a_march() -> None:
    """Friction of 2e-4 of a body far above its loss peak, on slopes of 0.1 and cells of an eighth of the shortest wave,
    in steps of a cell: the mesh makes more than a tenth of it, where cells per wave alone would say 0.9 %. The estimate
    is half to four times the difference to that by energy, which is exact to 1 % there."""
    slide = {"pressure": 1e5, "velocity": 3.0, "distance": 2.5e-4, "cells_per_step": 1}
    _, rows = marched(Job.model_validate(scene(8, ONE, history=[slide])))
    exact = steady(scene(32, ONE), 3.0, 1e5).friction[0]
    late = [
        (row.measures.friction, row.errors.friction.total)
        for row in rows[len(rows) // 2 :]
        if row.errors is not None and row.errors.friction is not None
    ]
    friction = np.mean([mu for mu, _ in late])
    estimate = np.mean([mu * error for mu, error in late])
    error = abs(friction - exact)
    assert error > 0.1 * exact
    assert 0.5 < estimate / error < 4.0
