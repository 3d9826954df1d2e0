"""Each precision keeps its promises: loads, certificates, and results next to those of double precision."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from conftest import Main
from judged_scenes import Json, job_of, rough_heights
from judged_scenes import run as warnings_of
from marched_jobs import begun, column, marched
from numpy.typing import NDArray
from short_job import JOB

from parcontact.job import Job
from parcontact.job.history import Timeline
from parcontact.march import sanity, scene
from parcontact.march.laws import StepError
from parcontact.parallel.slab import Slab
from parcontact.physics.energy import Probe
from parcontact.physics.records import Certificate, Measures

ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "rms_slope": 0.02, "seed": 1}
DECADES = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 3e6, "relaxation_time": 10.0**decade} for decade in (-6, -5, -4, -3)],
}


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
def test_marches_agree_with_double_precision(boundary: str) -> None:
    """Of what is largest in the march: to a thousandth of the tolerance, pressures to a hundredth; the same area."""
    double, p, calls = results(boundary, "double")
    series, found, took = results(boundary, "mixed")
    for name in NAMES:
        allowed = {"contact_area": 0.0, "max_pressure": 1e-7}.get(name, 1e-8)
        assert np.abs(series[name] - double[name]).max() <= allowed * np.abs(double[name]).max(), name
    assert np.abs(found - p).max() <= 1e-7 * p.max()
    assert took <= 1.1 * calls


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


# -- results that are not finite never pass for results, and a certificate that is not a number is none ---------------

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize("wrong", [NAN, INF])
@pytest.mark.parametrize("place", range(3))
def test_no_certificate(wrong: float, place: int) -> None:
    parts = [0.0, 0.0, 0.0]
    parts[place] = wrong
    assert not Certificate(*parts).worst <= 1.0


@pytest.mark.parametrize("wrong", [NAN, INF, 1e308])
def test_heights_that_are_not_finite(wrong: float) -> None:
    """Whatever the solver makes of them: no row, and the state is as it was."""
    march = begun(JOB)
    first, second = islice(Timeline.from_job(march.scene.job), 2)
    march.advance(first)
    before, pressure = march.row, march.field("pressure")
    motion: Any = march.scene.motion
    heights = motion.at(second.position)
    heights.parts[0][...] = wrong
    motion.at = lambda position: heights
    with np.errstate(all="ignore"), pytest.raises(StepError):
        march.advance(second)
    assert march.row is before
    assert np.array_equal(march.field("pressure"), pressure)


@pytest.fixture
def overflowing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measures one of which overflows, of solves that are as they should be."""
    measures = Probe.measure

    def overflow(self: Probe, *words: Any) -> Measures:
        return replace(measures(self, *words), force_y=INF)

    monkeypatch.setattr(Probe, "measure", overflow)


CURVE = ("steady", "--velocities", "0.1,1", "--pressures", "1e4")


@pytest.mark.usefixtures("overflowing")
@pytest.mark.parametrize(
    ("words", "said", "times"),
    [
        (("run",), "step 1 at t = 0 s (stage 'press'): force_y would not be finite", 1),
        (CURVE, "its results would not be finite", 3),  # of each point, and why points are missing
    ],
)
def test_no_run_and_no_point_of_a_curve_is_one(
    main: Main, tmp_path: Path, words: tuple[str, ...], said: str, times: int
) -> None:
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    code, shown, errors = main(words[0], "job.yaml", *words[1:], "--quiet")
    assert (code, (shown + errors).count(said)) == (1, times)


# -- of no sound scene anything is stated
# -------------------------------------------------------------------------------


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


def test_no_sound_scene_is_stated(tmp_path: Path) -> None:
    """50 random ones, each with its heights and its steps."""
    dice = random.Random(12)
    for number in range(50):
        job = sound(dice, tmp_path)
        assert job.warnings == (), (number, job.resolved())
        assert sanity.check_heights(scene.set_up(job, Slab.alone(*job.grid.points))) == [], job.resolved()
        assert warnings_of(job) == [], (number, job.resolved())
