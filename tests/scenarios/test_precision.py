"""What each precision promises: loads, certificates, and results beside those of double precision."""

import math
from typing import Any

import numpy as np
import pytest
from marching import begun, column, marched
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact.march.loop import March, run

ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "rms_slope": 0.02, "seed": 1}
RUBBER = {"model": "elastic", "shear_modulus": 1e6}
DECADES = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 3e6, "relaxation_time": 10.0**decade} for decade in (-6, -5, -4, -3)],
}


def mean(march: March) -> float:
    """Of the pressure [Pa], from a sum without rounding of all points of all ranks."""
    rows = [math.fsum(row) for row in march.field("pressure").astype(np.float64)]
    slab = march.scene.slab
    return math.fsum(math.fsum(part) for part in slab.from_all(rows)) / slab.points


@pytest.mark.mpi(3)
@pytest.mark.parametrize(("precision", "limit"), [("double", 1e-14), ("mixed", 1e-14)])
def test_mean_load(comm: MPI.Intracomm, precision: str, limit: float) -> None:
    """Sums taken row by row lose some ten roundings, whatever the grid and the ranks; at 4096 x 4096 it was 7e-16."""
    loads = [1e3, 1e4, 3.3333e4]
    surface = {**ROUGH, "short_wavelength": 3e-5}
    data = {"grid": {"points": [512, 256], "size": 1e-3}, "surface": surface, "material": RUBBER}
    found: list[float] = []
    run(
        begun({**data, "history": [{"pressure": load} for load in loads], "numerics": {"precision": precision}}, comm),
        [lambda now: found.append(mean(now))],
    )
    np.testing.assert_allclose(found[1:], loads, rtol=limit)


Results = tuple[dict[str, NDArray[np.float64]], NDArray[np.float64], int]
NAMES = ("friction", "contact_area", "approach", "max_pressure", "work", "dissipated")


def results(boundary: str, precision: str, tolerance: float = 9e-6, energy: bool = True) -> Results:
    """Of pressing and sliding over a third of the box: what was measured, the last pressures, operator calls."""
    surface: list[dict[str, Any]] = [{**ROUGH, "short_wavelength": 6.2e-5, "rms_slope": 0.05}]
    if boundary == "free":
        surface = [{"shape": "sphere", "radius": 1e-2}, {**surface[0], "rms_slope": 0.01}]
    data = {
        "grid": {"points": 64, "size": 1e-3, "boundary": boundary},
        "surface": surface,
        "material": DECADES,
        "history": [
            {"pressure": 1e5, "duration": 1e-4, "time_step": {"first": 1e-6, "growth": 1.3}},
            {"pressure": 1e5, "velocity": 1.0, "distance": 3e-4, "cells_per_step": 1},
        ],
        "numerics": {"precision": precision, "tolerance": tolerance},  # 1e-5: rounding ends the second step sooner
        "output": {"energy": energy},
    }
    march, found = marched(data)
    series = {name: column(found, name)[2:] for name in NAMES}
    return series, march.field("pressure").astype(np.float64), march.scene.slab.tally["operator"]


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_marches_beside_double_precision(boundary: str) -> None:
    """Of what is largest in the march: to a thousandth of the tolerance, pressures to a hundredth; the same area."""
    double, p, calls = results(boundary, "double")
    series, found, took = results(boundary, "mixed")
    for name in NAMES:
        allowed = {"contact_area": 0.0, "max_pressure": 1e-7}.get(name, 1e-8)
        assert np.abs(series[name] - double[name]).max() <= allowed * np.abs(double[name]).max(), name
    assert np.abs(found - p).max() <= 1e-7 * p.max()
    assert took <= 1.1 * calls


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_loose_marches_beside_double_precision(boundary: str) -> None:
    """With an operator in single precision, too: rounding may end a solve an iteration sooner or later, so that results
    agree to the tolerance of what is largest (measured: 2e-7 to 1e-4), with at most a fifth more calls (measured: a
    tenth, of the free body)."""
    tolerance = 1e-3
    double, p, calls = results(boundary, "double", tolerance, energy=False)
    series, found, took = results(boundary, "mixed", tolerance, energy=False)
    for name in NAMES[:4]:
        assert np.abs(series[name] - double[name]).max() <= tolerance * np.abs(double[name]).max(), name
    assert np.abs(found - p).max() <= tolerance * p.max()
    assert took <= 1.2 * calls


@pytest.mark.parametrize(("tolerance", "kept"), [(1e-3, np.float32), (0.9e-3, np.float64)])
def test_displacements_have_the_digits_of_the_operator(tolerance: float, kept: type) -> None:
    """And the map in which a march keeps the displacement of the body, to take a step back, those of the body."""
    data = {
        "grid": {"points": 32, "size": 1e-3},
        "surface": {**ROUGH, "short_wavelength": 1.25e-4},
        "material": DECADES,
    }
    numerics = {"precision": "mixed", "tolerance": tolerance}
    scene = begun({**data, "history": [{"pressure": 1e4}], "numerics": numerics}).scene
    assert scene.solver.workspace.displacement.dtype == kept
    assert scene.solver.workspace.pressure.dtype == np.float64
