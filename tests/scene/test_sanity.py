"""Scenes that mean nothing are stated, each with its value, its limit and what to change."""

import math
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import RunParcontact
from judged_scenes import RUBBER, SPHERE, Json, job_of, of_file, rough_heights, run
from mpi4py import MPI

from parcontact.errors import InputError, RunError
from parcontact.job import Job, JobError, limits, load
from parcontact.job.advice import cells_for_area
from parcontact.job.history import Timeline
from parcontact.march import sanity, scene
from parcontact.parallel.slab import Slab

SMALL = """\
grid: {points: 64, size: 1e-3}
surface: {shape: wave, amplitude: 1e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1e6}
history:
  - {pressure: 1e4}
"""


# -- scenes that mean nothing -----------------------------------------------------------------------------------------

ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]}
ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 1.25e-4, "rms_slope": 0.1}
FREE = {"points": 64, "size": 1.5e-3, "boundary": "free"}
WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]}
PRESS = {"pressure": 1e4}


@pytest.mark.parametrize(
    ("job", "words"),
    [
        (job_of({**WAVE, "amplitude": 1.0}, [PRESS]), ["rms slope is 4.44e+03", "up to 0.5", "lengths in m?"]),
        (job_of({**ROUGH, "rms_slope": 1.1}, [PRESS]), ["rms slope is 1.1", "up to 0.5"]),
        (job_of(WAVE, [PRESS], material={**RUBBER, "shear_modulus": 2.75}), ["2.75 Pa", "1000 Pa", "MPa"]),
        (job_of(WAVE, [{"pressure": 1e8}]), ["1e+08 Pa exceeds 2 G/(1 - nu) = 4e+06 Pa", "linear theory"]),
        (
            job_of(ROUGH, [{"pressure": 0.1}]),
            ["under the largest load, 0.1 Pa", "points of the grid would touch", "0.1 MPa is 1e+05"],
        ),
        (job_of(WAVE, [{"force": 1e2}]), ["history.0.force: a mean pressure of 1e+08 Pa"]),
        (
            job_of(SPHERE, [{"force": 1000.0}], grid=FREE),
            ["history.0: the contact has a radius", "0.0015 m", "grid.size"],
        ),
        (
            job_of(SPHERE, [{"force": 0.05, "velocity": 1.0, "distance": 7e-4, "cells_per_step": 1}], grid=FREE),
            ["history.0: a free box does not move", "of the 0.0007 m that it slides", "grid.size"],
        ),
        (
            job_of(ROUGH, [{**PRESS, "velocity": 1e9, "duration": 1e-12, "time_step": 1e-13}], material=ZENER),
            ["all more than 100 times faster than the branches, which relax at 1e+03", "instantaneous modulus"],
        ),
        (
            job_of(ROUGH, [{**PRESS, "velocity": 1e-9, "duration": 1.0, "time_step": 0.1}], material=ZENER),
            ["all more than 100 times slower than the branches", "long-term modulus"],
        ),
        (
            job_of(WAVE, [{**PRESS, "duration": 1.0, "time_step": 1e-7}], output={"fields": ["gap"]}),
            ["1e+07 instants need 328 GB", "output.every"],
        ),
        (job_of(WAVE, [PRESS], grid={"points": 200_000, "size": 1e-3}), ["2.88e+03 GB of memory", "such machines"]),
    ],
    ids=str,
)
def test_absurd_jobs_are_stated(job: Job, words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "_memory", lambda: 64e9)
    monkeypatch.setattr(limits, "_free", lambda directory: 100e9)
    found = [warning for warning in job.warnings if all(word in warning for word in words)]
    assert len(found) == 1, job.warnings


def test_branches_relax_at_the_temperatures_of_the_job() -> None:
    """A slide at 250 to 500 rad/s is near the 1000 rad/s of the branch at 20 C. At -50 C, log10 a_T is 3e5/(R ln 10)
    (1/223.15 - 1/293.15) = 16.8, and the slide far too fast; a curve at both temperatures is not too fast at one."""
    shift = {"law": "arrhenius", "energy": 3e5, "reference": 20}
    slide = [{**PRESS, "velocity": 0.01, "distance": 1e-4}]
    for temperature, stated in ((20.0, False), (-50.0, True)):
        rubber = {**ZENER, "shift": shift, "temperature": temperature}
        texts = job_of(ROUGH, slide, material=rubber).warnings
        assert any("times faster than the branches" in text for text in texts) == stated
    curve = {"velocities": [0.01], "pressures": [1e4]}
    for temperatures, stated in (([-50.0], True), ([-50.0, 20.0], False)):
        job = job_of(ROUGH, [], material={**ZENER, "shift": shift}, steady={**curve, "temperatures": temperatures})
        assert any("times faster than the branches" in text for text in job.warnings) == stated


def test_slow_shear_of_a_contact_that_sticks_is_not_slow_sliding() -> None:
    """It is sheared within far less than a wave. Fast sliding gives the warning with stick, too."""
    for velocity, stated in ((1e-9, [False, True]), (1e9, [True, True])):
        slide = {**PRESS, "velocity": velocity, "duration": 1.0 / velocity, "time_step": 0.1 / velocity}
        jobs = (
            job_of(ROUGH, [slide], material=ZENER, interface={"shear_stress": 1e5, "stick": stick})
            for stick in (True, False)
        )
        assert [any("sliding excites" in text for text in job.warnings) for job in jobs] == stated


def test_loads_that_press_less_than_one_point_are_stated() -> None:
    """One of 64 x 64 points is a share of 2.4e-4, which sqrt(8/pi) p/(E* h') is at 61 Pa, with E* of 4 MPa and a slope
    of 0.1; a load that is approached, or sticks, says nothing."""
    grid = {"points": 64, "size": 1e-3}
    limit = math.sqrt(math.pi / 8.0) * 4e6 * 0.1 / 64**2
    for factor, stated in ((0.99, True), (1.01, False)):
        loads = [{"pressure": {"from": 0.0, "to": factor * limit}, "duration": 1.0}]
        found = [text for text in job_of(ROUGH, loads, grid=grid).warnings if "would touch" in text]
        assert bool(found) == stated
    sticking = job_of(ROUGH, [{"pressure": 1.0}], grid=grid, adhesion={"work": 0.05, "range": 1e-6})
    assert not any("would touch" in text for text in sticking.warnings)
    assert not any("would touch" in text for text in job_of(ROUGH, [{"approach": -1e-7}], grid=grid).warnings)


def test_strains_are_judged_after_relaxation() -> None:
    """10 MPa on G_inf of 2 MPa, E* of 8 MPa: nothing at once, where 1 GPa carries it, nor after ten relaxation times,
    when the mean of 1 GPa exp(-t/tau) is 0.1 GPa; after 10 000 of them the bound is E* + 0.01 % of 4 GPa."""
    body = {"model": "zener", "modulus_inf": 2e6, "branches": [{"modulus": 1e9, "relaxation_time": 1e-3}]}

    def said(*history: Json) -> list[str]:
        return [text for text in job_of(WAVE, history, material=body).warnings if "linear theory" in text]

    def hold(seconds: float, pressure: Any = 1e7) -> Json:
        return {"pressure": pressure, "duration": seconds, "time_step": seconds / 10}

    assert said({"pressure": 1e7}) == said(hold(0.01)) == said(hold(10.0, {"from": 0.0, "to": 1e7})) == []
    (text,) = said(hold(10.0))
    assert text.startswith("history.0.pressure: a mean pressure of 1e+07 Pa, held for ")
    assert [text.split(":")[0] for text in said({"pressure": 1e7}, hold(1.0), hold(9.0))] == ["history.2.pressure"]


def test_rubber_under_several_loads_at_one_instant() -> None:
    """It does not relax: not so of elastic bodies, of one load, before a stage that lasts, or of a steady start."""
    loads = [PRESS, {"pressure": 2e4}]

    def said(history: list[Json], **changes: Any) -> list[str]:
        return [text for text in job_of(WAVE, history, **changes).warnings if "have no duration" in text]

    (text,) = said(loads, material=ZENER)
    assert "its 2 stages have no duration" in text
    assert "of 2e+06 Pa; give them a duration [s] to let it relax to 1e+06 Pa" in text
    assert not said(loads)
    assert not said(loads[:1], material=ZENER)
    assert not said([*loads, {**PRESS, "duration": 1.0, "time_step": 0.1}], material=ZENER)
    assert not said(loads, material=ZENER, initial={"state": "steady", "velocity": 0.1, "pressure": 1e4})


@pytest.mark.parametrize(("slope", "stated"), [(0.4, False), (0.6, True), (590.0, True)])
def test_slopes_of_more_than_some_tenths(tmp_path: Path, slope: float, stated: bool) -> None:
    """Of a job and of a file."""
    found = [*job_of({**ROUGH, "rms_slope": slope}, [PRESS]).warnings]
    found += of_file(tmp_path / "road.npy", 10.0 * slope * rough_heights(64, 16.0))
    assert sum("theory assumes small slopes, up to 0.5" in text for text in found) == 2 * stated


def test_heights_in_micrometres(tmp_path: Path) -> None:
    """The rms slope of a file is known when it has been read."""
    (text,) = of_file(tmp_path / "road.npy", 1e6 * rough_heights(64, 16.0))
    assert "rms slope is 1" in text
    assert "e+05; the theory assumes small slopes" in text
    assert "scale: 1.0e-6" in text


def test_a_measured_road_is_looked_at_before_it_runs(tmp_path: Path) -> None:
    """Of a topography the job alone does not tell slopes: its file is read by `check` and `plan`."""
    np.save(tmp_path / "road.npy", 1e6 * rough_heights(64, 16.0))
    road = {"shape": "topography", "path": str(tmp_path / "road.npy"), "unit": "m", "size": [1e-3, 1e-3]}
    job = job_of(road, [{"pressure": 1e4}], grid={"points": 64, "size": 1e-3})
    assert sanity.is_quickly_made(job)
    (text,) = map(str, sanity.check_heights(scene.set_up(job, Slab.alone(64, 64))))
    assert "unit: um (shape: topography)" in text


def test_a_tilt(tmp_path: Path) -> None:
    """Of 0.1 mm over the box of 1 mm; a neighbour more or less, and an increment of the roughness."""
    ramp = 1e-4 * np.arange(64) / 64
    for name, tilt in (("x", ramp), ("y", -ramp[:, None])):
        *_, text = of_file(tmp_path / "road.npy", rough_heights(64, 16.0) + tilt)  # next to the slope of that wall
        assert f"the heights at the two ends along {name}" in text
        found = re.search(r"tilted by ([-+.e0-9]+): subtract its mean plane", text)
        assert found
        assert float(found.group(1)) == pytest.approx(0.1, rel=1 / 64 + 0.02)


def test_a_file_that_does_not_resolve_itself(tmp_path: Path) -> None:
    """White noise has waves down to the diagonal of two cells: the shortest is that one, but for 1 % of the mean square
    slope in the corners."""
    noise = 1e-7 * np.random.default_rng(1).standard_normal((256, 256))
    (text,) = of_file(tmp_path / "road.npy", noise)
    found = re.search(r"only ([0-9.]+) cells per shortest wave along x", text)
    assert found
    assert math.sqrt(2.0) < float(found.group(1)) < 1.1 * math.sqrt(2.0)


@pytest.mark.parametrize(("cells", "accuracy"), [(4.0, 0.01), (7.5, 0.01), (8.2, 0.01), (4.0, 0.06), (4.4, 0.05)])
def test_the_limit_of_resolution_is_that_of_rough_surfaces(tmp_path: Path, cells: float, accuracy: float) -> None:
    """A single wave of a given number of cells, its length known to 0.5 %."""
    x = np.arange(400)
    wave = 1e-8 * np.cos(2 * np.pi * round(400 / cells) / 400 * x) * np.ones((400, 1))
    found = of_file(tmp_path / "road.npy", wave, numerics={"accuracy": accuracy})
    assert bool(found) == (cells < cells_for_area(accuracy))


def test_a_contact_that_reaches_the_edge_of_the_box() -> None:
    """Stated once, by the first step in which it does; also along one line of points, where there is no edge across."""
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
    assert text.startswith("step 1: spots of contact are only a few cells wide")
    assert "(limit: 15 %); use more grid.points" in text
    with pytest.raises(RunError, match=r"numerics\.strict"):
        run(job_of(SPHERE, [{"approach": 1e-7}], grid=FREE, numerics={"strict": True}))


@pytest.mark.mpi
def test_every_rank_says_the_same(comm: MPI.Intracomm, communicators: list[MPI.Intracomm], shared_path: Path) -> None:
    noise = 1e-8 * np.random.default_rng(1).standard_normal((48, 30))
    for heights, words in ((rough_heights(48, 16.0)[:, :30], "the two ends along x"), (noise, "per shortest wave")):
        if comm.rank == 0:
            np.save(shared_path / "road.npy", heights)
        comm.Barrier()
        shape = {"shape": "file", "path": str(shared_path / "road.npy")}
        job = job_of(shape, [PRESS], grid={"points": [30, 48], "size": 1e-3})
        (alone,) = map(str, sanity.check_heights(scene.set_up(job, Slab.alone(30, 48))))
        assert words in alone
        for group in communicators:
            (doubt,) = sanity.check_heights(scene.set_up(job, Slab(group, 30, 48)))
            assert group.allgather(str(doubt)) == [alone] * group.size
        comm.Barrier()


# -- strict -----------------------------------------------------------------------------------------------------------


def test_strict_refuses_before_anything_is_written(tmp_path: Path, run_parcontact: RunParcontact) -> None:
    """By the job, and by its heights."""
    text = SMALL.replace("1e6}", "2.75}")
    (tmp_path / "job.yaml").write_text(text + "numerics: {strict: true}\n")
    with pytest.raises(JobError, match=r"yaml:\d+:\d+: .*MPa would be 2\.75e\+06 \(an error with numerics\.strict"):
        load(tmp_path / "job.yaml")
    np.save(tmp_path / "road.npy", rough_heights(64, 16.0) + 1e-4 * np.arange(64) / 64)
    (tmp_path / "job.yaml").write_text(
        SMALL.replace("{shape: wave, amplitude: 1e-6, waves: [1, 0]}", "{shape: file, path: road.npy}")
    )
    before = sorted(tmp_path.iterdir())
    done = run_parcontact(["job.yaml", "--set", "numerics.strict=true"], ranks=2)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("tilted by") == 1
    assert "--set numerics.strict=true: surface" in done.stderr
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
    monkeypatch.setattr(limits, "_memory", lambda: 64e9)
    large = job_of(WAVE, [PRESS], grid={"points": 200_000, "size": 1e-3})
    with pytest.raises(InputError, match=r"need at least 2\.88e\+03 GB of memory"):
        sanity.refuse_impossible(large, Timeline.from_job(large))
    monkeypatch.setenv("SLURM_JOB_NUM_NODES", "64")
    sanity.refuse_impossible(large, Timeline.from_job(large))
    long = job_of(WAVE, [{**PRESS, "duration": 9e4, "time_step": 1e-3}], output={"fields": ["gap"], "every": 64})
    with pytest.raises(InputError, match=r"1\.406e\+06 instants of fields .* use every: 91 or more"):
        sanity.refuse_impossible(long, Timeline.from_job(long))


def test_approaches_beyond_full_contact_are_stated_with_their_places(tmp_path: Path) -> None:
    """All of them at once, each with its line and column."""
    path = tmp_path / "job.yaml"
    stages = "{approach: 1e-7}\n  - {name: up, approach: {from: 0, to: 1e-6}, duration: 1}"
    path.write_text(SMALL.replace("{pressure: 1e4}", stages))
    with pytest.raises(JobError) as caught:
        sanity.refuse_approaches(scene.set_up(load(path), Slab.alone(64, 64)))
    found = [text.partition(" an approach")[0] for text in caught.value.mistakes]
    assert found == [f"{path}:5:16: history.0:", f"{path}:6:26: history.1:"]


@pytest.mark.parametrize(("approach", "lost"), [(0.0, False), (-2.3e-6, False), (-2.2e-6, True), (1e-9, True)])
def test_approaches_below_the_rounding_of_heights_are_refused(tmp_path: Path, approach: float, lost: bool) -> None:
    """A wave of 5 km spans 10 km. Heights are rounded to 2.2e-12 m then, a millionth of 2.2e-6 m."""
    path, wave = tmp_path / "job.yaml", "surface: {shape: wave, amplitude: 5.0e+3, waves: [1, 0]}\n"
    path.write_text(
        "grid: {points: 8, size: 1.0e-3}\n" + wave + "material: {model: elastic, shear_modulus: 1.0e6}\n"
        f"history: [{{approach: {approach!r}}}]\n"
    )
    job = load(path) if approach else load(path, ["history.0.approach={from: 0, to: 0}", "history.0.duration=1"])
    setup = scene.set_up(job, Slab.alone(8, 8))
    if not lost:
        return sanity.refuse_approaches(setup)
    with pytest.raises(JobError) as caught:
        sanity.refuse_approaches(setup)
    (text,) = caught.value.mistakes
    assert text.startswith(f"{path}:4:22: history.0: an approach of {approach:.3g} m is lost in the rounding of")
    assert "at least 2.23e-06 m" in text


@pytest.mark.parametrize(("pressure", "interface"), [(1e5, True), (1e3, True), (1e5, False)])
def test_a_periodic_box_that_sticks_as_a_whole(pressure: float, interface: bool) -> None:
    """A box in full contact that may stick is warned of once; one with gaps, or without stick, is not. The wave closes
    at a pressure of 2 pi G/(1 - nu) times its amplitude over its length, 2.5e4 Pa."""
    section = {"interface": {"shear_stress": 1e4, "stick": interface}}
    said = run(job_of(WAVE, [{"pressure": pressure}, {"pressure": pressure}], **section))
    assert [text for text in said if "all of the periodic box is in contact" in text] == said
    assert len(said) == (1 if interface and pressure > 2.5e4 else 0)


def test_a_contact_that_creeps_out_of_its_box() -> None:
    """At once Hertz' contact, a = (3 F R/(4 E*))^(1/3), is within the box; with the long-term modulus it slides out of
    it, a before its centre would. It stays within if it slides before the rubber relaxes."""
    sphere = {"shape": "sphere", "radius": 8e-3}
    rubber = {"model": "zener", "modulus_inf": 1e4, "branches": [{"modulus": 3e4, "relaxation_time": 0.1}]}
    grid = {"points": 16, "size": 1.2e-2, "boundary": "free"}
    for speed, warned in ((1e-3, True), (1e2, False)):
        slide = {"force": 0.2, "velocity": speed, "distance": 3e-3}
        job = job_of(sphere, [{"force": 0.2}, slide], material=rubber, grid=grid)
        texts = [str(doubt) for doubt in job.doubts if "does not move with" in str(doubt)]
        assert [text.partition(":")[0] for text in texts] == ["history.1"] * warned
        radius = (0.75 * 0.2 * 8e-3 / 4e4) ** (1 / 3)  # E* = 4 G of an incompressible body
        words = f"a radius of some {radius:.3g} m", f"after {6e-3 - radius:.3g} m of the 0.003 m"
        assert all(word in text for word in words for text in texts)


@pytest.mark.parametrize(
    ("shape", "center", "axes"),
    [
        ({"shape": "cone", "slope": 0.1}, [0.01, 1e-3], "x"),
        ({"shape": "sphere", "radius": 1e-2}, [-1e-3, 2e-3], "xy"),
        ({"shape": "cylinder", "radius": 1e-2, "axis": "y"}, [1e-3, 0.01], ""),
        ({"shape": "punch", "radius": 1e-4, "edge": 1e-4}, [1.5e-3, 0.0], ""),
    ],
)
def test_a_centre_outside_a_free_box(shape: Json, center: list[float], axes: str) -> None:
    """A periodic box has no outside, and a cylinder no place along its axis."""
    for grid in (FREE, {**FREE, "boundary": "periodic"}):
        doubts = job_of({**shape, "center": center}, [{"force": 1e-5}], grid=grid).doubts
        said = [str(doubt) for doubt in doubts if "edge of the box" in str(doubt) or "outside" in str(doubt)]
        assert ["".join(re.findall("centre at ([xy])", text)) for text in said] == (list(axes) if grid is FREE else [])


def test_strains_below_a_punch_are_those_of_its_face() -> None:
    """E* = 4 MPa on a face of 3.1e-8 m^2 bears 0.126 N; the box of 2.25e-6 m^2 would bear 9 N."""
    punch = {"shape": "punch", "radius": 1e-4, "edge": 1e-6}
    for force, stated in ((0.12, False), (0.13, True)):
        said = " ".join(job_of(punch, [{"force": force}], grid=FREE).warnings)
        assert ("Pa on the face of the punch exceeds 2 G/(1 - nu) = 4e+06 Pa" in said) == stated


def test_a_contact_that_swings_out_of_its_box() -> None:
    """A velocity V cos(2 pi f t) moves the contact by V/(2 pi f) to each side, and back by the end of the stage."""
    grid = {"points": 16, "size": 1.2e-2, "boundary": "free"}
    for way, y, leaves in (
        (2e-3, 6e-3, False),
        (8e-3, 6e-3, True),
        (2e-3, 9e-3, False),
        (4e-3, 9e-3, True),
        (4e-3, 3e-3, True),
    ):
        sphere = {"shape": "sphere", "radius": 8e-3, "center": [6e-3, y]}
        swing = {"force": 1e-3, "velocity": {"amplitude": [0.0, 2 * np.pi * way], "frequency": 1.0}, "cycles": 1}
        said = " ".join(map(str, job_of(sphere, [swing], grid=grid).doubts))
        assert (f"of the {way:.3g} m that it slides" in said) == leaves, said
