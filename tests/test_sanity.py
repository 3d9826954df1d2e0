"""Scenes that mean nothing are told, each with its value, its limit and what to change; and no sound scene is."""

import math
import random
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import RunParcontact
from mpi4py import MPI
from numpy.typing import NDArray

from parcontact import sanity, scene
from parcontact.errors import InputError, RunError
from parcontact.job import Job, JobError, load, load_cases
from parcontact.job import size as size_advice
from parcontact.march.step import March
from parcontact.parallel.slab import Slab

Json = dict[str, Any]
SMALL = """\
grid: {points: 64, size: 1e-3}
surface: {shape: wave, amplitude: 1e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1e6}
history:
  - {pressure: 1e4}
"""
HERE = Path(__file__).parents[1] / "jobs"
RUBBER = {"model": "elastic", "shear_modulus": 1e6}
SPHERE = {"shape": "sphere", "radius": 1e-2}


def job_of(surface: Json | list[Json], history: Sequence[Json], **sections: Any) -> Job:
    sections = {"grid": {"points": 64, "size": 1e-3}, "material": RUBBER, **sections}
    return Job.model_validate({"surface": surface, "history": list(history), **sections})


def of_file(path: Path, heights: NDArray[np.floating], **sections: Any) -> list[str]:
    """What is said of heights on a box of 1 mm."""
    np.save(path, heights)
    grid = {"points": list(heights.shape[::-1]), "size": 1e-3}
    job = job_of({"shape": "file", "path": str(path)}, [{"pressure": 1e4}], grid=grid, **sections)
    return sanity.of_surface(scene.frame(job, Slab(MPI.COMM_SELF, *job.grid.points)))


def rough_heights(points: int, shortest: float, seed: int = 1) -> NDArray[np.floating]:
    """Periodic heights with waves down to so many cells, rms slope 0.1 on a box of 1 mm."""
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points)[None, :])  # rad per cell
    kept = (q > 0) & (q <= 2 * np.pi / shortest)
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
    spectrum = np.where(kept, noise * np.maximum(q, 1e-9) ** -1.8, 0.0)
    heights = np.fft.irfft2(spectrum, s=(points, points))
    cell = 1e-3 / points
    slope = np.sqrt(sum(((np.roll(heights, 1, axis) - heights) ** 2).mean() for axis in (0, 1))) / cell
    return np.asarray(heights * 0.1 / slope)


def run(job: Job, steps: int | None = None) -> list[str]:
    """What is said of the contacts of a job's steps."""
    march = March(scene.build(job, Slab(MPI.COMM_SELF, *job.grid.points)))
    watch, said = sanity.ContactWatch(job, job.timeline()), []
    for step in list(job.timeline())[:steps]:
        said += watch.judge(step.number, march.advance(step).measures)
    return said


# -- scenes that mean nothing -----------------------------------------------------------------------------------------

ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
FREE = {"points": 64, "size": 1.5e-3, "boundary": "free"}
WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]}
PRESS = {"pressure": 1e4}


@pytest.mark.parametrize(
    ("job", "words"),
    [
        (job_of({**WAVE, "amplitude": 1.0}, [PRESS]), ["rms slope is 4.44e+03", "below 1", "scale"]),
        (job_of({**ROUGH, "rms_slope": 1.1}, [PRESS]), ["rms slope is 1.1", "below 1"]),
        (job_of(WAVE, [PRESS], material={**RUBBER, "shear_modulus": 2.75}), ["2.75 Pa", "1000 Pa", "MPa"]),
        (job_of(WAVE, [{"pressure": 1e8}]), ["1e+08 Pa is above 2 G/(1 - nu) = 4e+06 Pa", "linear theory"]),
        (job_of(WAVE, [{"force": 1e2}]), ["history.0.force: a mean pressure of 1e+08 Pa"]),
        (job_of(SPHERE, [{"force": 1000.0}], grid=FREE), ["history.0: the contact, there,", "0.0015 m", "grid.size"]),
        (
            job_of(
                SPHERE,
                [{"force": 0.05, "velocity": 1.0, "distance": 7e-4, "cells_per_step": 1}],
                grid=FREE,
            ),
            ["history.0: the contact, centred at (0.00145, 0.00075) m in the end", "leaves the box"],
        ),
        (
            job_of(ROUGH, [{**PRESS, "velocity": 1e9, "duration": 1e-12, "time_step": 1e-13}], material=ZENER),
            ["all more than 100 times faster than the branches, which relax at 1e+03", "instantaneous modulus"],
        ),
        (
            job_of(ROUGH, [{**PRESS, "velocity": 1e-9, "duration": 1.0, "time_step": 0.1}], material=ZENER),
            ["all more than 100 times slower than the branches", "long-term modulus"],
        ),
        (job_of(WAVE, [{**PRESS, "duration": 5e8, "time_step": 1e-3}]), ["5e+11 steps", "years", "time_step"]),
        (
            job_of(WAVE, [{**PRESS, "duration": 1.0, "time_step": 1e-7}], output={"fields": ["gap"]}),
            ["1e+07 instants need 328 GB", "output.every"],
        ),
        (job_of(WAVE, [PRESS], grid={"points": 200_000, "size": 1e-3}), ["2.88e+03 GB of memory", "such machines"]),
    ],
    ids=str,
)
def test_absurd_jobs_are_told(job: Job, words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(size_advice, "_memory", lambda: 64e9)
    monkeypatch.setattr(size_advice, "_free", lambda directory: 100e9)
    found = [warning for warning in job.warnings if all(word in warning for word in words)]
    assert len(found) == 1, job.warnings


def test_heights_in_micrometres(tmp_path: Path) -> None:
    """The rms slope of a file is known when it has been read."""
    (text,) = of_file(tmp_path / "road.npy", 1e6 * rough_heights(64, 16.0))
    assert "rms slope is 1" in text
    assert "e+05, and the theory is one of small slopes" in text
    assert "scale: 1.0e-6" in text


def test_a_measured_road_is_looked_at_before_it_runs(tmp_path: Path) -> None:
    """Of a topography the job alone does not tell slopes: its file is read by `check` and `plan`."""
    np.save(tmp_path / "road.npy", 1e6 * rough_heights(64, 16.0))
    road = {"shape": "topography", "path": str(tmp_path / "road.npy"), "unit": "m", "size": [1e-3, 1e-3]}
    job = job_of(road, [{"pressure": 1e4}], grid={"points": 64, "size": 1e-3})
    assert sanity.is_quickly_made(job)
    (text,) = sanity.of_surface(scene.frame(job, Slab(MPI.COMM_SELF, 64, 64)))
    assert "unit: um in a topography" in text


def test_a_seam_across_the_periodic_edge(tmp_path: Path) -> None:
    """Half of a periodic surface is none; along each direction."""
    half = rough_heights(128, 32.0)
    for name, part in (("x", half[:, :48]), ("y", half[:48])):
        found = of_file(tmp_path / "road.npy", part)
        assert [text for text in found if f"along {name} the heights jump by" in text], found
        assert all("cut it where it fits" in text for text in found)


def test_a_tilt(tmp_path: Path) -> None:
    """Of 0.1 mm over the box of 1 mm; a neighbour more or less, and an increment of the roughness."""
    ramp = 1e-4 * np.arange(64) / 64
    for name, tilt in (("x", ramp), ("y", -ramp[:, None])):
        (text,) = of_file(tmp_path / "road.npy", rough_heights(64, 16.0) + tilt)
        assert f"along {name} the heights jump by" in text
        found = re.search(r"tilted by ([-+.e0-9]+): subtract its mean plane", text)
        assert found
        assert float(found.group(1)) == pytest.approx(0.1, rel=1 / 64 + 0.02)


def test_a_file_that_does_not_resolve_itself(tmp_path: Path) -> None:
    """White noise: the second difference is 1, -2, 1, what is left of it over two cells 1/4, 0, -1/2, 0, 1/4."""
    noise = 1e-7 * np.random.default_rng(1).standard_normal((256, 256))
    (text,) = of_file(tmp_path / "road.npy", noise)
    assert "less than 4 cells, the limit is 50%" in text
    found = re.search(r"([0-9]+)% of the curvature", text)
    assert found
    share = math.sqrt((2 * 0.25**2 + 2 + 1.5**2) / 6)
    assert float(found.group(1)) / 100 == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("cells", [3.0, 3.9, 4.1, 6.0])
def test_the_limit_of_resolution_is_four_cells(tmp_path: Path, cells: float) -> None:
    """A single wave loses half of its second difference over two cells where it is four cells long."""
    x = np.arange(400)
    wave = np.cos(2 * np.pi * round(400 / cells) / 400 * x) * np.ones((8, 1))
    found = [text for text in of_file(tmp_path / "road.npy", 1e-8 * wave) if "curvature" in text]
    assert bool(found) == (cells < 4.0)


def test_a_contact_that_reaches_the_edge_of_the_box() -> None:
    """Told once, by the first step in which it does; also along one line of points, where there is no edge across."""
    cylinder = {"shape": "cylinder", "radius": 1e-2}
    grid = {"points": [64, 1], "size": [1e-3, 1e-3], "boundary": "free"}
    history = [{"approach": d} for d in (1e-6, 1e-5, 3e-5, 4e-5)]
    (text,) = run(job_of(cylinder, history, grid=grid, material={**RUBBER, "shear_modulus": 1e6}))
    assert text.startswith("step 3: the contact reaches the edge of the box")
    assert "larger grid.size" in text


def test_contacts_of_a_few_cells() -> None:
    """A sphere whose contact has 3 cells across, at the end of a stage; with strict the run ends."""
    job = job_of(SPHERE, [{"approach": 1e-7}], grid=FREE)
    (text,) = run(job)
    assert text.startswith("step 1: contacts are a few cells wide")
    assert "15% is the limit; use more grid.points" in text
    with pytest.raises(RunError, match=r"numerics\.strict"):
        run(job_of(SPHERE, [{"approach": 1e-7}], grid=FREE, numerics={"strict": True}))


@pytest.mark.mpi
def test_every_rank_says_the_same(comm: MPI.Intracomm, communicators: list[MPI.Intracomm], shared_path: Path) -> None:
    noise = 1e-8 * np.random.default_rng(1).standard_normal((48, 30))
    for heights, words in ((rough_heights(48, 16.0)[:, :30], "jump"), (noise, "curvature")):
        if comm.rank == 0:
            np.save(shared_path / "road.npy", heights)
        comm.Barrier()
        shape = {"shape": "file", "path": str(shared_path / "road.npy")}
        job = job_of(shape, [PRESS], grid={"points": [30, 48], "size": 1e-3})
        (alone,) = sanity.of_surface(scene.frame(job, Slab(MPI.COMM_SELF, 30, 48)))
        assert words in alone
        for group in communicators:
            assert group.allgather(sanity.of_surface(scene.frame(job, Slab(group, 30, 48)))) == [[alone]] * group.size
        comm.Barrier()


# -- strict -----------------------------------------------------------------------------------------------------------


def test_strict_refuses_before_anything_is_written(tmp_path: Path, run_parcontact: RunParcontact) -> None:
    """By the job, and by its heights."""
    text = SMALL.replace("1e6}", "2.75}")
    (tmp_path / "job.yaml").write_text(text + "numerics: {strict: true}\n")
    with pytest.raises(JobError, match=r"MPa would be 2\.75e\+06 \(an error with numerics\.strict\)"):
        load(tmp_path / "job.yaml")
    np.save(tmp_path / "road.npy", rough_heights(64, 16.0) + 1e-4 * np.arange(64) / 64)
    (tmp_path / "job.yaml").write_text(
        SMALL.replace("{shape: wave, amplitude: 1e-6, waves: [1, 0]}", "{shape: file, path: road.npy}")
    )
    before = sorted(tmp_path.iterdir())
    done = run_parcontact(["job.yaml", "--set", "numerics.strict=true"], ranks=2)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("tilted by") == 1
    assert "Traceback" not in done.stderr
    assert sorted(tmp_path.iterdir()) == before
    done = run_parcontact(["job.yaml", "--quiet", "--set", "output.fields=gap"], ranks=2)
    assert done.returncode == 0
    assert done.stderr.count("tilted by") == 1
    assert "tilted by" in (tmp_path / "out" / "job" / "run.log").read_text()
    for path in (tmp_path / "out" / "job").rglob("*.h5"):
        with h5py.File(path) as file:
            assert b"tilted by" in bytes(file.attrs["warnings"])


def test_what_no_machine_here_can_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With or without strict: there would be a MemoryError later."""
    monkeypatch.setattr(size_advice, "_memory", lambda: 64e9)
    large = job_of(WAVE, [PRESS], grid={"points": 200_000, "size": 1e-3})
    with pytest.raises(InputError, match=r"need at least 2\.88e\+03 GB of memory"):
        sanity.refuse_impossible(large, large.timeline())
    monkeypatch.setenv("SLURM_JOB_NUM_NODES", "64")
    sanity.refuse_impossible(large, large.timeline())
    long = job_of(WAVE, [{**PRESS, "duration": 5e8, "time_step": 1e-3}], output={"fields": ["gap"], "every": 64})
    with pytest.raises(InputError, match=r"7\.812e\+09 instants of fields .* use every: 500000 or more"):
        sanity.refuse_impossible(long, long.timeline())


# -- sound scenes -----------------------------------------------------------------------------------------------------


OURS = sorted(path for path in HERE.rglob("*.yaml") if path.parent.name != "road")  # that one: tests/road/test_chain.py


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.stem)
def test_no_job_of_ours_is_told(path: Path) -> None:
    """Of a sweep, the last case: that over the size of the box begins with boxes that are told to be too small."""
    job = load_cases(path)[-1].job
    assert job.warnings == ()
    if sanity.is_quickly_made(job):
        assert sanity.of_surface(scene.frame(job, Slab(MPI.COMM_SELF, *job.grid.points))) == []


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
        assert sanity.of_surface(scene.frame(job, Slab(MPI.COMM_SELF, *job.grid.points))) == [], job.resolved()
        assert run(job) == [], (number, job.resolved())
