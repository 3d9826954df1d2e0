"""`points: auto`: from the accuracy, the shortest wave and the directions of sliding; what is said, and mistakes."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from job.texts import job_of, mistakes_of, replaced
from mpi4py import MPI

import parcontact as pc
from parcontact.files import run
from parcontact.files.run import chosen_by_accuracy
from parcontact.files.stopping import Options
from parcontact.job import Job
from parcontact.job.advice import Guess
from parcontact.job.surfaces import Rough
from parcontact.march import curve
from parcontact.march.mesh import UNKNOWN, guesses, load, load_cases, slope_of
from parcontact.parallel.root import on_root
from parcontact.parallel.slab import Slab
from parcontact.results import info

ROUGH = "{shape: rough, hurst: 0.8, long_wavelength: 5e-4, short_wavelength: 6.25e-5, rms_slope: 0.1, seed: 1}"
AUTO = f"""\
grid: {{points: auto, size: 1e-3}}
surface: {ROUGH}
material: {{model: zener, modulus_inf: 1e6, branches: [{{modulus: 1e6, relaxation_time: 1e-4}}]}}
numerics: {{accuracy: {{friction: 0.05, area: 0.3}}}}
history:
  - {{pressure: 1e5, velocity: 1, distance: 2e-5, cells_per_step: 1}}
"""


def points_of(directory: Path, *changes: str, text: str = AUTO) -> tuple[int, int]:
    found: tuple[int, int] = job_of(directory, text, *changes).grid.points
    return found


def test_more_accuracy_takes_more_points_where_it_pays(tmp_path: Path) -> None:
    coarse = points_of(tmp_path)
    finer = points_of(tmp_path, "numerics.accuracy.friction=0.001")
    for_area = points_of(tmp_path, "numerics.accuracy.area=0.01")
    assert finer[0] > coarse[0] >= coarse[1]
    assert finer[0] / finer[1] > 2.0
    assert for_area[1] >= 2 * coarse[1]
    assert points_of(tmp_path, "numerics.accuracy=0.01") >= for_area


def test_the_direction_decides(tmp_path: Path) -> None:
    fine = "numerics.accuracy.friction=0.01"
    along = points_of(tmp_path, fine)
    assert points_of(tmp_path, fine, "history.0.velocity=[0, 1]") == along[::-1]
    still = replaced(AUTO.split("history")[0], history="[{pressure: 1e5}]")
    assert len(set(points_of(tmp_path, text=still))) == 1
    curve = replaced(AUTO.split("history")[0], steady="{velocities: [1.0], pressures: [1e5], direction: [0, 1]}")
    nx, ny = points_of(tmp_path, fine, text=curve)
    assert nx < ny <= along[0]  # time steps leave less for the mesh of a march


def test_a_measured_map_and_a_table_have_the_mesh_of_their_waves(tmp_path: Path) -> None:
    """To one step of fast lengths: the shortest wave of a map is known to 5 %; the share in contact is not."""
    own = points_of(tmp_path)
    np.save(tmp_path / "road.npy", pc.surface(yaml.safe_load(ROUGH), grid={"points": 128, "size": 1e-3}))
    there = "{shape: topography, path: road.npy, unit: m, size: [1e-3, 1e-3]}"
    assert np.all(np.abs(np.subtract(points_of(tmp_path, f"surface={there}"), own)) <= 16)
    q = 2 * np.pi / np.array([5e-4, 2.5e-4, 6.25e-5])
    rows = "\n".join(f"{k:.9g} {1e-18 * (k / q[0]) ** -3.6:.9g}" for k in q)
    (tmp_path / "psd.txt").write_text(f"q[1/m] C2D[m^4]\n{rows}\n")
    of_table = points_of(tmp_path, "surface={shape: rough, spectrum: psd.txt}")
    assert np.all(np.abs(np.subtract(of_table, own)) <= 16)


def test_nothing_is_asked_of_the_mesh_of_a_map(tmp_path: Path) -> None:
    """The map's own mesh is too coarse for another wave and for a range, and a box may be too large for any mesh."""
    np.save(tmp_path / "road.npy", pc.surface(yaml.safe_load(ROUGH), grid={"points": 32, "size": 1e-3}))
    there = "{shape: topography, path: road.npy, unit: m, size: [1e-3, 1e-3]}"
    shorter = "{shape: rough, hurst: 0.8, long_wavelength: 2e-4, short_wavelength: 3.125e-5, rms_slope: 0.1, seed: 1}"
    assert points_of(tmp_path, f"surface=[{there}, {shorter}]")[0] > points_of(tmp_path, f"surface={there}")[0]
    for change, sentence in (
        ("adhesion={work: 0.05, range: 1e-9}", "adhesion.range must be at least"),
        ("grid.size=100.0", "the box is 100 m along y, but the map only 0.001 m"),
    ):
        assert any(sentence in text for text in mistakes_of(tmp_path, AUTO, f"surface={there}", change))


@pytest.mark.mpi(2)
def test_a_run_and_a_curve_say_what_was_chosen(comm: MPI.Intracomm, shared_path: Path) -> None:
    """On all ranks the same points; in the logs, and by `info`."""
    path = shared_path / "job.yaml"
    if comm.rank == 0:
        path.write_text(AUTO + "steady: {velocities: [1.0], pressures: [1e5]}\n")
    comm.barrier()
    job = on_root(comm, lambda: load(path, [f"output.directory={shared_path / 'out'}"]))
    slab = Slab(comm, *job.grid.points)
    assert run.run_job(job, slab, Options(quiet=True)) == 0
    assert curve.run_curve(job, slab, curve.request(job), Options(quiet=True)) == 0
    if comm.rank == 0:
        said, sound = info.describe_path(shared_path / "out")
        assert sound
        nx, ny = points_of(shared_path)
        text = f"mesh: {nx} x {ny} points, chosen by numerics.accuracy (friction 5 %, area 30 %): the shortest wave, "
        assert said.count(text) == 1
        for name in ("run.log", "steady.log"):
            assert text in (shared_path / "out" / name).read_text()


def test_where_it_is_too_coarse_more_accuracy_helps(tmp_path: Path) -> None:
    assert "mesh" in chosen_by_accuracy(job_of(tmp_path, AUTO))
    assert "mesh" not in chosen_by_accuracy(job_of(tmp_path, AUTO, "grid.points=64"))


def test_a_chosen_mesh_is_not_called_too_coarse(tmp_path: Path) -> None:
    """Near full contact fewer cells do than a job with points of its own is advised to take."""
    full = "history.0.pressure=1e7"
    nx, ny = points_of(tmp_path, full)
    stated = [f"grid.points=[{nx}, {ny}]", full]
    assert any("cells per shortest wave" in warning for warning in job_of(tmp_path, AUTO, *stated).warnings)
    assert not any("cells per shortest wave" in warning for warning in job_of(tmp_path, AUTO, full).warnings)


def test_from_python_and_in_a_sweep(tmp_path: Path) -> None:
    text = AUTO + "sweep: {numerics.accuracy.friction: [0.05, 0.01]}\n"
    (tmp_path / "job.yaml").write_text(text)
    coarse, fine = (case.job.grid.points for case in load_cases(tmp_path / "job.yaml"))
    assert (coarse, fine) == (points_of(tmp_path), points_of(tmp_path, "numerics.accuracy.friction=0.01"))
    assert load(yaml.safe_load(AUTO)).grid.points == coarse


@pytest.mark.parametrize(
    ("surface", "sentence"),
    [
        ("{shape: sphere, radius: 1e-2}", "1:16: grid.points: auto: the surface has no shortest wave"),
        ("{shape: file, path: job.npy}", "1:16: grid.points: auto: heights from a file or an array are given on one"),
        (ROUGH.replace("6.25e-5", "1.25e-9"), "1:16: grid.points: auto: a side of 0.001 m has 8e+05 of the surface"),
        ("{shape: rough, hurst: 2}", "2:32: surface.hurst must be a Hurst exponent above 0 and up to 1"),
    ],
)
def test_mistakes(tmp_path: Path, surface: str, sentence: str) -> None:
    np.save(tmp_path / "job.npy", np.zeros((4, 4)))
    stated = mistakes_of(tmp_path, AUTO.replace(ROUGH, surface))
    assert any(sentence in text for text in stated), stated
    assert not any("points must" in text for text in stated)


@pytest.mark.parametrize("value", ["{friction: 0}", "{friction: 0.1, areas: 0.1}", "1", "big"])
def test_mistakes_of_the_accuracy(tmp_path: Path, value: str) -> None:
    (text,) = mistakes_of(tmp_path, AUTO, f"numerics.accuracy={value}")
    assert "numerics.accuracy" in text


# -- the guess of what touches, against closed forms of spectra, of Persson's theory and of moduli --------------------

WAVES: dict[str, Any] = {"hurst": 0.5, "long_wavelength": 1e-3, "short_wavelength": 1e-5}
LOW, HIGH = 2.0 * math.pi / 1e-3, 2.0 * math.pi / 1e-5


def guessed(**sections: Any) -> list[Guess]:
    data = {
        "grid": {"points": 256, "size": 1e-3},
        "surface": {"shape": "rough", **WAVES, "rms_slope": 0.1},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"pressure": 1e4}],
        **sections,
    }
    job = Job.model_validate({key: value for key, value in data.items() if value is not None})
    return guesses(job, 1e-5, 1e-6)


def share(**sections: Any) -> float:
    return min(guessed(**sections)).share


def test_waves_along_a_side() -> None:
    """Of a box of 1 mm with shortest waves of 10 um."""
    assert guessed()[0].waves == pytest.approx(100.0)


def test_rms_slope_of_a_self_affine_surface() -> None:
    """Hurst exponent 0.5: m0 = int k^-2 dk (in units of C k_0^3/2 pi), m2 = int k^0 dk; to 1e-4."""
    m0, m2 = LOW**3 * (1.0 / LOW - 1.0 / HIGH), LOW**3 * (HIGH - LOW)
    given = slope_of(Rough(**WAVES, rms_height=1e-6))
    assert given == pytest.approx(1e-6 * math.sqrt(m2 / m0), rel=1e-4)
    assert slope_of(Rough(**WAVES, psd_constant=1e-20)) == pytest.approx(
        math.sqrt(1e-20 * m2 / (2 * math.pi)), rel=1e-4
    )
    assert slope_of(Rough(**WAVES, rms_slope=0.3)) == 0.3


def test_what_is_not_known() -> None:
    """Loads by their approach, and waves whose slope is in a file or a single amplitude."""
    wave = {"shape": "wave", "amplitude": 1e-6, "waves": [2, 0]}
    assert share(history=[{"approach": 1e-6}]) == share(surface=wave) == UNKNOWN
