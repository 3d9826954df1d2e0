"""Contact with a layer: thin and thick limits, absolute approach, sliding waves, any number of ranks."""

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import parcontact as pc
from parcontact.door.simulation import Row
from parcontact.effects.layer.effect import Layer


def last_row(job: dict[str, Any], comm: MPI.Intracomm = MPI.COMM_SELF) -> Row:
    *_, row = pc.Simulation(job, comm=comm).steps()
    return row


def rough(pressure: float, boundary: str = "periodic", **body: Any) -> dict[str, Any]:
    return {
        "grid": {"points": 128, "size": 1e-3, "boundary": boundary},
        "surface": {
            "shape": "rough",
            "hurst": 0.8,
            "long_wavelength": 2.5e-4,
            "short_wavelength": 6.25e-5,
            "rms_slope": 0.1,
        },
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": pressure}],
        **body,
    }


@pytest.mark.filterwarnings("ignore::UserWarning")  # strains that a real layer would not bear
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_thin_incompressible_layer_under_a_sphere(boundary: str) -> None:
    """P = pi G a^6/(32 R d^3) and delta = a^2/(4 R) for a thin layer; here d/a is 1/40, and what is left is 0.6 d/a in
    the load."""
    modulus, radius, thickness, a = 1e6, 1.0, 5e-4, 0.02
    job = {
        "grid": {"points": 256, "size": 0.06, "boundary": boundary},
        "surface": {"shape": "sphere", "radius": radius},
        "material": {"model": "elastic", "shear_modulus": modulus},
        "body": {"thickness": thickness},
        "history": [{"approach": a**2 / (4 * radius)}],
        "numerics": {"accuracy": 1e-3},
    }
    load = last_row(job).pressure * 0.06**2
    assert load == pytest.approx(np.pi * modulus * a**6 / (32 * radius * thickness**3), rel=0.02)


@pytest.mark.filterwarnings("ignore:.*the contact reaches the edge of the box")
@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_a_thick_layer_is_a_half_space(boundary: str) -> None:
    """A thousand times as thick as the box is long; a free body moves as a whole by box over thickness less."""
    half_space = last_row(rough(3e4, boundary))
    layer = last_row(rough(3e4, boundary, body={"thickness": 1.0}))
    assert layer.contact_area == half_space.contact_area
    assert layer.max_pressure == pytest.approx(half_space.max_pressure, rel=1e-3 if boundary == "free" else 1e-12)


@pytest.mark.parametrize("base", ["bonded", "smooth"])
def test_the_approach_to_a_compressible_layer_is_absolute(base: str) -> None:
    """A flat surface moves it by p d (1 - 2 nu)/(2 G (1 - nu)), from its undeformed level on; the load follows from the
    approach as well."""
    poisson, thickness, pressure = 0.3, 2e-4, 1e4
    job = {
        "grid": {"points": 8, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6, "poisson": poisson},
        "body": {"thickness": thickness, "base": base},
        "history": [{"pressure": pressure}],
    }
    exact = pressure * thickness * (1 - 2 * poisson) / (2e6 * (1 - poisson))
    assert last_row(job).approach == pytest.approx(exact, rel=1e-8)
    assert last_row({**job, "history": [{"approach": exact}]}).pressure == pytest.approx(pressure, rel=1e-8)


def test_an_incompressible_layer_cannot_be_pushed_beyond_full_contact() -> None:
    with pytest.raises(pc.InputError, match="beyond full contact"):
        last_row({**rough(1.0, body={"thickness": 1e-4}), "history": [{"approach": 1e-4}]})


def sliding_wave(layer: dict[str, Any] | None) -> dict[str, Any]:
    """A wave in full contact that slides for ever."""
    job = {
        "grid": {"points": [32, 4], "size": [1e-3, 1e-3]},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [2, 0]},
        "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 3e6, "relaxation_time": 1e-3}]},
        "initial": {"state": "steady", "velocity": 0.1, "pressure": 1e6},
        "history": [{"pressure": 1e6, "velocity": 0.1, "distance": 1e-4, "cells_per_step": 0.5}],
    }
    return job if layer is None else {**job, "body": layer}


def test_energies_balance_on_a_layer() -> None:
    """Work = stored + dissipated, to the tolerance of the solver."""
    job = sliding_wave({"thickness": 1e-4}) | {"initial": {"state": "virgin"}, "output": {"energy": True}}
    row = last_row(job | {"history": [{**sliding_wave(None)["history"][0], "pressure": 5e4}]})
    assert row.work == pytest.approx(row.stored + row.dissipated, rel=1e-6, abs=0.0)


@pytest.mark.filterwarnings("ignore:body.thickness")
@pytest.mark.parametrize(("base", "poisson"), [("bonded", 0.5), ("bonded", 0.45), ("bonded", 0.3), ("smooth", 0.5)])
def test_a_layer_costs_no_iterations(base: str, poisson: float) -> None:
    """As many calls as on a half space within 10 %, and one iteration (two calls) that the count is rounded to, at all
    thicknesses from four times the longest wave to 3 cells; loads are such that about a fifth of the area is in
    contact."""

    def solved(load: float, **body: Any) -> Row:
        material = {"model": "elastic", "shear_modulus": 1e6, "poisson": poisson}
        return last_row(rough(load, material=material, numerics={"tolerance": 1e-5}, **body))

    half_space = solved(6e4 * 0.5 / (1 - poisson)).operator_calls
    for thickness in (1e-3, 1e-4, 5e-5, 2.5e-5):
        load = 2e4
        while (row := solved(load, body={"thickness": thickness, "base": base})).contact_area < 0.15:
            load *= 1.5
        assert row.contact_area < 0.4
        assert row.operator_calls <= 1.1 * half_space + 2


def test_theory_of_a_layer_in_full_contact(tmp_path: Any) -> None:
    """Persson's theory is exact in full contact: friction of all waves over S."""
    from parcontact.door.python import of_parts
    from parcontact.parallel.slab import Slab
    from parcontact.results import prediction

    job = of_parts(**sliding_wave({"thickness": 1e-4}))
    *_, row = prediction.predict(job, Slab.alone(32, 4), 0.45, "lattice")
    assert row.contact_area == pytest.approx(1.0)
    assert row.friction == pytest.approx(last_row(sliding_wave({"thickness": 1e-4})).friction, rel=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"body": {"thickness": 0}}, "body.thickness must be a positive thickness"),
        ({"body": {"thickness": 1e-4, "base": "glued"}}, "body.base"),
        ({"body": {"thickness": 1.5e-5}}, "must be at least two cells"),
        ({"body": {"thickness": 1e-4}, "steady": {"velocities": [1.0], "pressures": [1e4]}}, "must be periodic"),
    ],
)
def test_mistakes(change: dict[str, Any], message: str) -> None:
    with pytest.raises(pc.JobError, match=message):
        pc.Simulation({**rough(3e4, "free"), **change})


@pytest.mark.parametrize(("base", "poisson"), [("bonded", 0.5), ("bonded", 0.3), ("smooth", 0.5)])
def test_pressure_of_a_wave_in_full_contact(base: Any, poisson: float) -> None:
    """p = G q h/((1 - nu) S) about the mean, to the tolerance of the solve."""
    thickness, amplitude, q = 1e-4, 1e-6, 2 * np.pi * 2 / 1e-3
    job = sliding_wave({"thickness": thickness, "base": base}) | {
        "material": {"model": "elastic", "shear_modulus": 1e6, "poisson": poisson},
        "initial": {"state": "virgin"},
        "history": [{"pressure": 1e6}],
        "numerics": {"tolerance": 1e-12},
    }
    run = pc.Simulation(job, comm=MPI.COMM_SELF)
    list(run.steps())
    ratio = float(Layer(thickness, base, poisson=poisson).compliance_ratio(np.array(q)))
    exact = 1e6 * q * amplitude / (1 - poisson) / ratio
    wave = 2 * np.abs(np.fft.fft(run.field("pressure")[0]))[2] / 32
    assert wave == pytest.approx(exact, rel=1e-10)
