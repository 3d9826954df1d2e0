"""Temperatures of contacts: exact for a wave in full contact, what they need, and that they cost nothing else."""

import math
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from parcontact import scene
from parcontact.errors import InputError
from parcontact.job import Job, load
from parcontact.parallel.slab import Slab
from parcontact.steady_sliding.sliding import SteadySliding

PRESSURE, SPEED, LENGTH = 1e5, 0.2, 1e-3
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 4e6, "relaxation_time": 1e-4}]}
WARM = {"conductivity": 0.2, "diffusivity": 1e-7}


def job(**more: Any) -> Job:
    """A wave on 32 cells, in full contact."""
    data = {
        "grid": {"points": [32, 4], "size": [LENGTH, LENGTH / 8]},
        "surface": {"shape": "wave", "amplitude": 1e-7, "waves": [2, 0]},
        "material": RUBBER,
        "steady": {"velocities": [SPEED], "pressures": [PRESSURE]},
        "numerics": {"tolerance": 1e-10},
        "thermal": WARM,
        **more,
    }
    return Job.model_validate({key: value for key, value in data.items() if value is not None})


def states(made: Job) -> SteadySliding:
    return SteadySliding(scene.set_up(made, Slab(MPI.COMM_WORLD, *made.grid.points)))


@pytest.mark.mpi
def test_a_wave_in_full_contact() -> None:
    """The pressure is P + p cos(k x - phase) and the heat in proportion, so that the rise is one wave, from a depth of
    1.5/k; to 1e-6, where the pressure is solved to 1e-10 of the height."""
    sliding = states(job())
    point = sliding.solve((SPEED, 0.0), PRESSURE)
    pressure, rise = (sliding.setup.slab.to_root(sliding.field(name)) for name in ("pressure", "temperature"))
    if pressure is None or rise is None:
        return
    k = 2 * math.pi * 2 / LENGTH
    beta = np.sqrt(k**2 - 1j * k * SPEED / WARM["diffusivity"])
    wave = np.fft.fft(pressure[0])[2] * point.friction * SPEED
    exact = wave / (WARM["conductivity"] * beta) * (1 + beta / (2 * k)) ** -3
    found = np.fft.fft(rise[0])
    assert abs(found[2] / exact - 1) < 1e-6
    assert abs(np.delete(found, [2, 30])).max() < 1e-6 * abs(exact)
    assert point.flash is not None
    assert point.flash.mean == pytest.approx(np.sum(rise * pressure) / pressure.sum(), rel=1e-9)
    assert point.flash.highest == rise.max()
    assert point.flash.lower <= point.flash.mean <= point.flash.upper <= point.flash.highest


def test_heat_of_the_interface_adds() -> None:
    """In full contact it is uniform, which changes no temperature that counts from the mean of the box, only its
    weights."""
    plain, rubbed = (states(job(interface=section)) for section in (None, {"shear_stress": 1e5}))
    for each in (plain, rubbed):
        each.solve((SPEED, 0.0), PRESSURE)
    one, other = plain.field("temperature"), rubbed.field("temperature")
    assert np.abs(one - other).max() < 1e-9 * np.abs(one).max()


def test_a_map_costs_as_a_branch() -> None:
    """Two transforms for the rise, and one of the pressure for the depths: what the map of one branch takes is two."""
    with_map, without = states(job()), states(job(thermal=None))
    for each in (with_map, without):
        each.solve((SPEED, 0.0), PRESSURE)
    counts = with_map.setup.slab.tally.since(without.setup.slab.tally)
    assert counts["fft"] == 3
    assert counts["operator"] == 1


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ("thermal: {conductivity: 0.2}", "5:10: thermal.diffusivity is missing"),
        ("thermal: {conductivity: -1, diffusivity: 1.0e-7}", "thermal.conductivity must be a positive conductivity"),
        ("output: {fields: [temperature]}", "output.fields has temperature, which needs a thermal section"),
        ("thermal: {conductivity: 0.2, diffusivity: 1.0e-7}\nhistory: [{pressure: 1.0e5}]", "is for steady sliding"),
    ],
)
def test_mistakes(tmp_path: Any, lines: str, sentence: str) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(
        "grid: {points: 8, size: 1.0e-3}\nsurface: {shape: flat}\n"
        "material: {model: elastic, shear_modulus: 1.0e6}\nsteady: {velocities: [1], pressures: [1.0e5]}\n"
        f"{lines}\n"
    )
    with pytest.raises(InputError) as failure:
        load(path)
    assert sentence in str(failure.value)
