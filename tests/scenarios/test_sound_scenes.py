"""Of no sound scene anything is told."""

import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from judging import HERE, Json, job_of, rough_heights, run

from parcontact import scene
from parcontact.job import Job, load_cases
from parcontact.parallel.slab import Slab
from parcontact.scene import sanity

OURS = sorted(
    path for path in HERE.rglob("*.yaml") if path.parent.name != "road" and path.stem != "rubber"
)  # that one: tests/road/test_chain.py


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.stem)
def test_no_job_of_ours_is_told(path: Path) -> None:
    """Of a sweep, the last case: that over the size of the box begins with boxes that are told to be too small."""
    job = load_cases(path)[-1].job
    assert job.warnings == ()
    if sanity.is_quickly_made(job):
        assert sanity.check_heights(scene.set_up(job, Slab.alone(*job.grid.points))) == []


def sound(dice: random.Random, directory: Path) -> Job:
    """A scene of rubber that a tribologist would set up: roughness, waves, a sphere, a measured road."""
    make: Callable[[random.Random, Path], Job] = dice.choice([_road, _road, _sphere, _measured])
    return make(dice, directory)


def _material(dice: random.Random) -> tuple[Json, float]:
    modulus = 10.0 ** dice.uniform(5, 8)
    if dice.random() < 0.4:
        return {"model": "elastic", "shear_modulus": modulus, "poisson": dice.choice([0.3, 0.45, 0.5])}, modulus
    branches = [{"modulus": modulus / 4, "relaxation_time": 10.0**n} for n in range(-6, 1)]
    return {"model": "zener", "modulus_inf": modulus / 4, "branches": branches}, 2 * modulus


def _road(dice: random.Random, directory: Path) -> Job:
    length, points = 10.0 ** dice.uniform(-5, 0), dice.choice([64, 96])
    material, modulus = _material(dice)
    slope = dice.uniform(0.01, 0.3)
    short = length / points * dice.uniform(8.5, 14.0)
    rough = {"shape": "rough", "hurst": dice.uniform(0.5, 1.0), "long_wavelength": length / 4}
    rough |= {"short_wavelength": min(short, length / 4), "rms_slope": slope, "seed": dice.randint(0, 99)}
    pressure = modulus * slope * dice.uniform(0.05, 0.5)
    history: list[Json] = [{"pressure": pressure}]
    if dice.random() < 0.5:
        slide = {"velocity": dice.uniform(0.1, 10.0), "distance": 2 * length / points, "cells_per_step": 1}
        history.append({"pressure": pressure, **slide})
    return job_of(rough, history, grid={"points": points, "size": length}, material=material)


def _sphere(dice: random.Random, directory: Path) -> Job:
    radius = 10.0 ** dice.uniform(-4, 0)
    material, _ = _material(dice)
    contact = radius * dice.uniform(0.01, 0.2)
    grid = {"points": 64, "size": contact * dice.uniform(3.0, 5.0), "boundary": "free"}
    return job_of(
        {"shape": "sphere", "radius": radius}, [{"approach": contact**2 / radius}], grid=grid, material=material
    )


def _measured(dice: random.Random, directory: Path) -> Job:
    path = directory / f"{dice.getrandbits(32)}.npy"
    np.save(path, rough_heights(64, dice.uniform(8.5, 16.0), dice.randint(0, 99)) + dice.uniform(-1e-3, 1e-3))
    material, modulus = _material(dice)
    history = [{"pressure": 0.1 * modulus * dice.uniform(0.05, 0.5)}]
    return job_of({"shape": "file", "path": str(path)}, history, material=material)


def test_no_sound_scene_is_told(tmp_path: Path) -> None:
    """50 random ones, each with its heights and its steps."""
    dice = random.Random(12)
    for number in range(50):
        job = sound(dice, tmp_path)
        assert job.warnings == (), (number, job.resolved())
        assert sanity.check_heights(scene.set_up(job, Slab.alone(*job.grid.points))) == [], job.resolved()
        assert run(job) == [], (number, job.resolved())
