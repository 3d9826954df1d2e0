"""Cells along and across the sliding: the mesh of fewest points, found as well by trying all."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from csv_rows import rows
from mpi4py import MPI

import parcontact as pc
from parcontact.__main__ import main
from parcontact.job import Job, advice
from parcontact.job.advice import describe_sample
from parcontact.job.calculation import Accuracy
from parcontact.job.surfaces import GivenHeights

SIZE = (1e-3, 1e-3)
WAVE = 6.25e-5
BOTH = Accuracy(friction=0.01, area=0.01)
FRICTION = Accuracy(friction=0.003, area=0.1)
GUESS = advice.Guess(0.05, 0.4, 24.0)


@pytest.mark.parametrize("count", [1, 16, 17, 100, 416, 1000])
def test_fast_lengths(count: int) -> None:
    found = advice.fast_length(count)
    assert found >= count
    assert found % advice.MULTIPLE == 0
    assert max(p for p in range(1, found + 1) if found % p == 0 and all(p % q for q in range(2, p))) <= 5


def errors(points: tuple[int, int], way: tuple[float, float]) -> tuple[float, float]:
    """Return the errors of friction and area in a slide along a unit vector."""
    (nx, ny), (x, y) = points, way
    cx, cy = nx * WAVE / SIZE[0], ny * WAVE / SIZE[1]
    sides = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
    return advice.friction_error(*sides, GUESS), advice.area_error(*sides, GUESS)


@pytest.mark.parametrize("asked", [BOTH, FRICTION, Accuracy(friction=0.05, area=0.3)])
@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 90.0])
def test_the_mesh_of_fewest_points(asked: Accuracy, angle: float) -> None:
    """It keeps both errors, with no more points than the best of all meshes that transform fast."""
    way = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    found = advice.choose_points(WAVE, SIZE, [way], asked, [GUESS])
    lengths = [n for n in range(16, 800, 16) if advice.fast_length(n) == n]

    def keeps(points: tuple[int, int]) -> bool:
        """The grid has the shortest wave, too, and cells that are no longer than tried."""
        resolved = min(points) * WAVE / SIZE[0] >= advice.LEAST_CELLS and max(points) <= advice.LONGEST * min(points)
        return resolved and all(a <= b for a, b in zip(errors(points, way), asked.both, strict=True))

    least = min(nx * ny for nx in lengths for ny in lengths if keeps((nx, ny)))
    assert keeps(found)
    assert found[0] * found[1] == least


# -- what is stated of a random surface as one sample, and of a slide that returns to its box --------------------------

ROUGH = {"shape": "rough", "hurst": 0.8, "long_wavelength": 2.5e-4, "short_wavelength": 6.25e-5, "rms_slope": 0.1}
SAMPLE_WAVE = {"shape": "wave", "amplitude": 1e-6, "waves": [4, 0]}
RUBBER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-2}]}
ROUND = {"pressure": 1e4, "velocity": 0.1, "distance": 9.5e-4, "cells_per_step": 1}


def sample(slides: bool = True, **changes: Any) -> str:
    found = job(**changes)
    return describe_sample(found.grid, found.surface, slides)


def job(slide: dict[str, Any] = ROUND, **changes: Any) -> Job:
    data = {"grid": {"points": 128, "size": 1e-3}, "surface": ROUGH, "material": RUBBER, "history": [slide]}
    return Job.model_validate(data | changes)


def test_waves_have_no_seed() -> None:
    assert sample(surface=SAMPLE_WAVE) == ""


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        ({}, "0.0009 m of its 0.00095 m"),  # 0.4 of the longest wave before the box is round
        ({"velocity": [0.06, 0.08], "distance": 5.5e-3}, "0.0049 m of its 0.0055 m"),  # 3 boxes along x, 4 along y
        ({"velocity": [0.06, 0.0799], "distance": 5.5e-3}, "0.0049 m"),
    ],
)
def test_a_slide_round_the_box(changes: dict[str, Any], start: str) -> None:
    """The imprint is that of 4 boxes before: stated with the distance from which."""
    (text,) = (text for text in job(ROUND | changes).warnings if "imprint" in text)
    assert text.startswith(f"history.0: after {start}")
    assert "remembers for 0.01 s" in text


@pytest.mark.parametrize(
    "changes",
    [
        {"history": [ROUND | {"distance": 8.9e-4}]},
        {"history": [ROUND | {"velocity": [0.06, 0.08], "distance": 4.8e-3}]},
        {"material": RUBBER | {"branches": [{"modulus": 1e6, "relaxation_time": 8e-4}]}},  # it has forgotten
        {"material": {"model": "elastic", "shear_modulus": 1e6}},
        {"grid": {"points": 128, "size": 1e-3, "boundary": "free"}},
        {"surface": SAMPLE_WAVE},
        {"surface": ROUGH | {"long_wavelength": 2.5e-3}, "history": [ROUND | {"distance": 5e-4}]},
        {"initial": {"state": "steady", "velocity": 0.1, "pressure": 1e4}},
    ],
)
def test_a_slide_that_meets_no_imprint(changes: dict[str, Any]) -> None:
    assert not [text for text in job(**changes).warnings if "imprint" in text]


def test_stages_of_one_slide_count_together() -> None:
    half = ROUND | {"distance": 4.75e-4}
    (text,) = (text for text in job(history=[half, half | {"pressure": 2e4}]).warnings if "imprint" in text)
    assert text.startswith("history.0: after 0.0009 m of its 0.00095 m")


# -- heights as a numpy array in a job from Python: as good as a file, stored next to results, dealt out to the ranks --


WORLD = MPI.COMM_WORLD
NX, NY = 16, 12
PHASE = 2 * np.pi * (2 * np.arange(NX) / NX + np.arange(NY)[:, None] / NY)
HEIGHTS = 1e-6 * np.cos(PHASE) + 4e-7 * np.sin(2 * PHASE)
JOB: dict[str, Any] = {
    "grid": {"points": [NX, NY], "size": [1e-3, 7.5e-4]},
    "surface": HEIGHTS,
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e4, "velocity": 0.1, "distance": 2.5e-4, "cells_per_step": 1}],
    "numerics": {"tolerance": 1e-8, "accuracy": 0.5},  # of such coarse meshes nothing better is asked
}


@pytest.fixture(autouse=True)
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Root's directory, on all ranks."""
    place: Path = WORLD.bcast(tmp_path)
    monkeypatch.chdir(place)
    return place


@pytest.mark.mpi
def test_an_array_is_the_surface(nowhere: Path) -> None:
    """It steps like the file of the same heights, whatever becomes of the array meanwhile; nothing is written."""
    if WORLD.rank == 0:
        np.save("heights.npy", HEIGHTS)
    WORLD.barrier()
    mine = HEIGHTS.copy()
    run = pc.Simulation({**JOB, "surface": mine})
    mine[:] = 0.0
    of_file = pc.Simulation({**JOB, "surface": {"shape": "file", "path": "heights.npy"}})
    assert [row.friction for row in run.steps()] == [row.friction for row in of_file.steps()]
    assert [path.name for path in nowhere.iterdir()] == ["heights.npy"]


def test_heights_with_names_of_axes() -> None:
    """They are taken by these, whatever their order."""
    xarray = pytest.importorskip("xarray")
    heights = np.arange(12.0).reshape(3, 4)
    named = xarray.DataArray(heights, dims=("y", "x"))
    assert GivenHeights(named) == GivenHeights(named.transpose("x", "y")) == GivenHeights(heights)


def test_heights_with_coordinates() -> None:
    """They are sorted, and have to be those of the grid, wherever it begins."""
    xarray = pytest.importorskip("xarray")
    heights, x, y = 1e-7 * np.arange(12.0).reshape(3, 4), 5.0 + 1e-3 * np.arange(4), 2e-3 * np.arange(3)
    grid = {"points": [4, 3], "size": [4e-3, 6e-3]}
    named = xarray.DataArray(heights, {"y": y, "x": x}, ("y", "x"))
    fallen = xarray.DataArray(heights[::-1], {"y": y[::-1], "x": x}, ("y", "x"))
    for each in (named, fallen, named.transpose("x", "y")):
        assert np.array_equal(pc.surface(each, grid), pc.surface(heights, grid))
    wrong = {
        "surface has a spacing of 0.001 m along x, but cells of the grid are 0.002 m": (named, [8e-3, 6e-3]),
        "surface has a spacing of 2 m along y": (named.assign_coords(y=1e3 * y), [4e-3, 6e-3]),
        "got coordinates x that are not equally spaced": (named.assign_coords(x=[0.0, 1e-3, 3e-3, 4e-3]), [4e-3, 6e-3]),
    }
    for words, (given, size) in wrong.items():
        with pytest.raises(pc.JobError, match=words):
            pc.surface(given, {"points": [4, 3], "size": size})


def frictions(directory: Path) -> list[str]:
    return [row["friction"] for row in rows(directory / "measures.csv")]


def test_a_run_is_repeated_from_its_directory(nowhere: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Moved to another place; its command finds it finished, and runs it afresh to the same end."""
    pc.Simulation(JOB, set={"output.directory": "out/run"}, comm=MPI.COMM_SELF).run()
    (nowhere / "out").rename(nowhere / "moved")
    first = frictions(nowhere / "moved/run")
    assert main(["moved/run/job.yaml", "--out", "moved/run"]) == 0
    assert "finished before" in capfd.readouterr().out
    for name in ("job.yaml", "job.resolved.yaml"):
        assert main([f"moved/run/{name}", "--quiet", "--out", "moved/run", "--restart", "never"]) == 0
        assert frictions(nowhere / "moved/run") == first


def test_other_heights_are_another_job() -> None:
    pc.Simulation(JOB, set={"output.directory": "out"}, comm=MPI.COMM_SELF).run()
    with pytest.raises(pc.InputError, match=r"another job.*content was"):
        pc.Simulation({**JOB, "surface": 2 * HEIGHTS}, set={"output.directory": "out"}, comm=MPI.COMM_SELF).run()


@pytest.mark.mpi
def test_a_checkpoint_finds_its_heights(nowhere: Path) -> None:
    """Next to a checkpoint that was saved by hand, also where both were moved; up to rounding by what is recomputed."""
    run = pc.Simulation(JOB)
    next(run.steps())
    (nowhere / "there").mkdir(exist_ok=True)
    WORLD.barrier()
    run.save("there/state.h5")
    if WORLD.rank == 0:
        (nowhere / "there").rename(nowhere / "elsewhere")
    WORLD.barrier()
    assert pc.Simulation.restore("elsewhere/state.h5").run().friction == pytest.approx(run.run().friction, rel=1e-7)


def test_a_checkpoint_without_its_heights(nowhere: Path) -> None:
    """The message names both files; one may say where the heights are."""
    run = pc.Simulation(JOB, comm=MPI.COMM_SELF)
    next(run.steps())
    run.save("state.h5")
    (heights,) = nowhere.glob("surface-*.npy")
    (nowhere / "there").mkdir()
    heights = heights.rename(nowhere / "there" / heights.name)
    with pytest.raises(pc.InputError, match=f"state.h5 needs {heights.name}, the heights of its surface"):
        pc.Simulation.restore("state.h5", comm=MPI.COMM_SELF)
    again = pc.Simulation.restore("state.h5", {"surface.0.path": str(heights)}, MPI.COMM_SELF)
    assert again.row.step == run.row.step


MISTAKES = [
    (HEIGHTS.T, "has shape (16, 12), but the grid has (ny, nx) = (12, 16)"),
    (HEIGHTS[0], "must be a numpy array of heights [m], real and finite, of shape (ny, nx), got"),
    (HEIGHTS + 0j, "got an array of shape (12, 16) of complex128"),
    (HEIGHTS.astype("M8[s]"), "got an array of shape (12, 16) of datetime64[s]"),
    (HEIGHTS > 0, "got an array of shape (12, 16) of bool"),
    (np.empty((0, 0)), "got an array of shape (0, 0)"),
    (np.where(HEIGHTS > 0, HEIGHTS, np.nan), "got 96 of 192 that are not finite"),
    (np.ma.masked_less(HEIGHTS, 0), "got 96 of 192 that are not finite"),
    (1e-300 * HEIGHTS, "e-3"),  # 1e-305 m, say
    (1e200 * HEIGHTS, "outside of 1e-60 to 1e+60 m"),
    (HEIGHTS.tolist(), "a job file names a file instead"),
]


@pytest.mark.parametrize(("heights", "says"), MISTAKES)
def test_wrong_arrays_are_one_short_mistake(heights: Any, says: str) -> None:
    for job, changes in ((JOB, {"surface": heights}), ({**JOB, "surface": heights}, {})):
        with pytest.raises(pc.JobError) as found:
            pc.Simulation(job, set=changes, comm=MPI.COMM_SELF)
        (mistake,) = found.value.mistakes
        assert len(mistake) < 300
        assert "surface" in mistake
        assert says in mistake
