"""Steady states, surfaces and materials from Python."""

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import parcontact as pc

MATERIAL: dict[str, Any] = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}],
}


def test_steady() -> None:
    """One wave in full contact: friction `Im G (q A)^2/(2 (1 - nu) p)`; the power lost is force times speed."""
    wave, load = 2 * np.pi / 1e-3, 1e5
    job = {
        "grid": {"points": [32, 4], "size": [1e-3, 1.25e-4]},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
        "material": MATERIAL,
        "history": [{"pressure": load}],
        "numerics": {"tolerance": 1e-10},
    }
    speeds = np.array([0.05, 0.2])
    curve = pc.steady(job, velocities=speeds, pressures=[load], comm=MPI.COMM_SELF)
    loss = pc.material(MATERIAL).complex_modulus(wave * speeds).imag
    # pressure has the amplitude |G| q A/(1 - nu); its part out of phase pushes, by the mean of p dh/dx
    expected = loss / (1 - 0.5) * (wave * 1e-6) ** 2 / 2 / load
    assert np.allclose(curve.friction, expected, rtol=1e-9)
    assert np.allclose(curve.contact_area, 1.0)
    assert curve.power.shape == (2, 1)
    assert np.allclose(curve.power.sum(axis=1), -curve.force_x * speeds, rtol=1e-9)
    assert curve.failures == ()
    assert np.array_equal(pc.steady(job, "0.05:0.2:2", load, comm=MPI.COMM_SELF).velocity, speeds)
    with pytest.raises(pc.InputError, match="no velocities"):
        pc.steady(job, comm=MPI.COMM_SELF)


def test_steady_at_temperatures() -> None:
    """Arrhenius: a_T = exp(Q/R (1/T - 1/T0)), and friction is that at the velocity a_T v; strings are refused."""
    job = {
        "grid": {"points": [32, 4], "size": [1e-3, 1.25e-4]},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
        "material": {**MATERIAL, "shift": {"law": "arrhenius", "energy": 1e5, "reference": 20.0}},
        "numerics": {"tolerance": 1e-10},
    }
    curve = pc.steady(job, [0.05, 0.2], 1e5, [20.0, 40.0], comm=MPI.COMM_SELF)
    factor = np.exp(1e5 / 8.31446261815324 * (1 / 313.15 - 1 / 293.15))
    assert np.allclose(curve.temperature, [20.0, 20.0, 40.0, 40.0])
    assert np.allclose(curve.shift_factor, [1.0, 1.0, factor, factor], rtol=1e-12)
    shifted = pc.steady(job, [0.05 * factor, 0.2 * factor], 1e5, comm=MPI.COMM_SELF)
    assert np.allclose(curve.friction[2:], shifted.friction, rtol=1e-9)
    assert np.all(np.isnan(shifted.temperature))
    with pytest.raises(pc.InputError, match="temperatures"):
        pc.steady(job, [0.05], 1e5, "20:40:3", comm=MPI.COMM_SELF)


def test_surface() -> None:
    """Heights as given, to round-off, with their mean; a mistake names the key."""
    heights = pc.surface({"shape": "wave", "amplitude": 2e-6, "waves": [1, 2]}, {"points": [8, 6], "size": [8.0, 6.0]})
    x, y = np.meshgrid(np.arange(8), np.arange(6))
    assert heights.shape == (6, 8)
    assert np.allclose(heights, 2e-6 * np.cos(2 * np.pi * (x / 8 + 2 * y / 6)), rtol=0.0, atol=1e-20)
    with pytest.raises(pc.JobError, match=r"^surface.0?.*waves"):
        pc.surface({"shape": "wave", "amplitude": 2e-6, "waves": [5, 2]}, {"points": [8, 6], "size": 1.0})


def test_material() -> None:
    """One branch: `G = G_inf + G_1 i w tau/(1 + i w tau)`, and its relaxation and creep at the ends."""
    material = pc.material(
        {"model": "zener", "modulus_inf": "1e6", "branches": [{"modulus": 3e6, "relaxation_time": 0.5}]}
    )
    omega = np.array([[0.1, 2.0], [10.0, 1e3]])
    turn = 1j * omega * 0.5
    assert np.allclose(material.complex_modulus(omega), 1e6 + 3e6 * turn / (1 + turn), rtol=1e-14)
    assert material.relaxation(0.0) == pytest.approx(4e6)
    assert material.relaxation(0.5) == pytest.approx(1e6 + 3e6 / np.e)
    assert material.creep([0.0, 1e6]) == pytest.approx([1 / 4e6, 1 / 1e6])
    assert material.poisson == 0.5
    assert pc.material({"model": "elastic", "shear_modulus": 2e6}).complex_modulus(1.0) == 2e6
    with pytest.raises(pc.JobError, match=r"material\.model must be"):
        pc.material({"model": "rubber"})
