"""Friction curves from the command line, and marches that start from steady sliding."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import Main
from csv_rows import rows
from mpi4py import MPI

from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.files.tables import read_columns
from parcontact.march import steady
from parcontact.march.curve import request
from parcontact.march.loop import run_steps
from parcontact.parallel.fft import pyfftw
from parcontact.parallel.slab import Slab
from parcontact.theory import wavy

WAVE = """\
grid: {points: [64, 4], size: [2.5e-4, 1.5625e-5]}
surface: {shape: wave, amplitude: 5.0e-7, waves: [1, 0]}
material: {model: zener, modulus_inf: 2.75e5, branches: [{modulus: 2.475e6, relaxation_time: 1.0e-3}]}
initial: {state: steady, velocity: 0.04, pressure: 2.0e5}
history: [{pressure: 2.0e5, velocity: 0.04, distance: 6.25e-5, cells_per_step: 1}]
numerics: {tolerance: 1.0e-10}
"""
ROUGH = """\
grid: {points: 128, size: 1.0e-3}
surface: {shape: rough, hurst: 0.9, long_wavelength: 5.0e-4, short_wavelength: 2.5e-4, rms_slope: 0.02, seed: 3}
material:
  model: zener
  modulus_inf: 1.0e+6
  branches: [{modulus: 7.0e+6, relaxation_time: 5.0e-4}, {modulus: 2.4e+6, relaxation_time: 3.0e-3}]
initial: {state: steady, velocity: 0.2, pressure: 1.0e5}
history: [{pressure: 1.0e5, velocity: 0.2, distance: 1.25e-4, cells_per_step: 1}]
numerics: {tolerance: 1.0e-7}
"""
FREE = """\
grid: {points: 96, size: 3.3e-3, boundary: free}
surface: {shape: sphere, radius: 1.0e-2}
material: {model: zener, modulus_inf: 2.75e5, branches: [{modulus: 2.475e6, relaxation_time: 1.0e-3}]}
initial: {state: steady, velocity: 0.047, pressure: 13774.0}
history: [{pressure: 13774.0, velocity: 0.047, distance: 1.375e-4, cells_per_step: 1}]
numerics: {tolerance: 1.0e-7}
"""
LAW = (2.75e5, np.array([2.475e6]), np.array([1.0e-3]))


def friction_of_wave(pressure: float, speed: float) -> float:
    """The closed form for WAVE in full contact."""
    waves = (np.array([5.0e-7]), np.array([2 * np.pi / 2.5e-4]), np.array([0.0]))
    return float(wavy.friction_coefficient(pressure, *waves, speed, 0.0, *LAW))


@pytest.fixture
def frictions(shared_path: Path, comm: MPI.Intracomm) -> Callable[..., list[float]]:
    """Friction at all instants of a job."""

    def run(text: str, *overrides: str) -> list[float]:
        path = shared_path / f"job-{comm.rank}.yaml"
        path.write_text(text)
        job = jobs.load(path, overrides)
        marching = steady.first(job, Slab(comm, *job.grid.points))
        found: list[float] = []
        run_steps(marching, [lambda m: found.append(m.row.measures.friction)])
        return found

    return run


@pytest.mark.mpi(2)
@pytest.mark.parametrize(("integrator", "least", "most"), [("exponential-linear", 3.6, 4.4), ("exponential", 5.6, 9.0)])
def test_steady_wave_stays_with_error_of_the_integrator(
    frictions: Callable[..., list[float]], integrator: str, least: float, most: float
) -> None:
    """Full contact: the start is the closed form to 1e-9, and a march leaves it by the integrator's error, which falls
    by 4 for a half of the step of second order, and towards 8 for the third."""
    exact = friction_of_wave(2.0e5, 0.04)
    errors = []
    for cells in (2, 1, 0.5):
        found = frictions(WAVE, f"history.0.cells_per_step={cells}", f"numerics.integrator={integrator}")
        assert found[0] == pytest.approx(exact, rel=1e-9)
        errors.append(abs(found[-1] / found[0] - 1.0))
    assert least < errors[0] / errors[1] < most
    assert least < errors[1] / errors[2] < most


def test_cells_much_longer_than_wide(frictions: Callable[..., list[float]]) -> None:
    """A strip whose shortest waves, across it, are 1/2000 of its length: in full contact the closed form, to 1e-9."""
    assert frictions(WAVE, "grid.size=[2.5e-4, 2.5e-7]")[0] == pytest.approx(friction_of_wave(2.0e5, 0.04), rel=1e-9)


@pytest.mark.mpi(2)
@pytest.mark.parametrize(("text", "bound"), [(ROUGH, 4e-4), (FREE, 1.2e-3)], ids=["rough", "free sphere"])
def test_steady_contact_stays(frictions: Callable[..., list[float]], text: str, bound: float) -> None:
    """A march from the steady state of a partial contact stays there. The bounds are some three times what quarters of
    a cell give at 32 cells per shortest wave, and at 13 cells per contact radius, as points come and go."""
    for cells in (1, 0.25):
        found = frictions(text, f"history.0.cells_per_step={cells}")
        assert found[-1] == pytest.approx(found[0], rel=bound)


def test_curve_from_the_command_line(run_parcontact: Callable, tmp_path: Path) -> None:
    (tmp_path / "wave.yaml").write_text(WAVE)
    done = run_parcontact(["steady", "wave.yaml", "--velocities", "0.004:0.4:3", "--pressures", "2e5,4e5"], ranks=2)
    assert done.returncode == 0, done.stderr
    columns = read_columns(tmp_path / "out/wave/steady.csv")
    assert columns["friction_x"] == columns["friction"]  # along +x, the force against it
    assert columns["friction_slopes"] == pytest.approx(columns["friction"], rel=1e-9)  # in full contact, all waves seen
    last = ["friction_x", "contact_area_corrected", "error_friction", "error_area", "friction_slopes"]
    assert list(columns)[-5:] == last
    for speed, pressure, friction, force, power in zip(
        *(columns[name] for name in ("velocity", "pressure", "friction", "force_x", "dissipated_0")), strict=True
    ):
        assert friction == pytest.approx(friction_of_wave(pressure, speed), rel=1e-9)
        assert power == pytest.approx(-force * speed, rel=1e-9)
    assert len(columns["velocity"]) == 6
    assert (tmp_path / "out/wave/steady.png").stat().st_size > 0


def test_a_curve_made_again_has_the_same_transforms(
    cache: Path, main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """FFTW measures which are the fastest, and others have other last digits. Those of the first run are kept: all of
    a second one, in which none may be measured, are there, and both tables are the same to the last digit."""
    (tmp_path / "job.yaml").write_text(ROUGH.replace("points: 128", "points: 48"))

    def curve(out: str) -> list[dict[str, str]]:
        pyfftw.forget_wisdom()
        assert main("steady", "job.yaml", "--velocities", "0.1,0.2", "--out", out, "--quiet")[0] == 0
        return [{**row, "seconds": ""} for row in rows(tmp_path / out / "steady.csv")]

    found, make = curve("one"), pyfftw.FFTW
    known = lambda *given: make(*given[:-1], (*given[-1], "FFTW_WISDOM_ONLY"))  # noqa: E731
    monkeypatch.setattr(pyfftw, "FFTW", known)
    assert curve("other") == found


def test_shares_of_wavelengths_add_up(main: Main, tmp_path: Path) -> None:
    text = ROUGH.split("initial")[0] + "steady: {velocities: [0.2], pressures: [1.0e5], waves: true}\n"
    (tmp_path / "rough.yaml").write_text(text)
    assert main("rough.yaml", "--quiet")[:2] == (0, "")
    shares = read_columns(tmp_path / "out/rough/steady_waves.csv")["share"]
    assert sum(shares) == pytest.approx(1.0, rel=1e-12)
    assert max(shares[1:3]) > 0.3  # the waves of the surface, 0.5 to 0.25 mm, in a box of 1 mm


def test_curve_without_velocities_or_pressure(tmp_path: Path) -> None:
    path = tmp_path / "wave.yaml"
    path.write_text(WAVE)
    with pytest.raises(InputError, match="no velocities"):
        request(jobs.load(path))
    with pytest.raises(InputError, match="no pressure"):
        request(jobs.load(path, ["history.0.pressure=null", "history.0.approach=-1e-6"]), [0.1])


@pytest.mark.parametrize("added", [[], ["steady.velocities=[0.1]"]])
def test_a_force_is_a_pressure_over_the_box(tmp_path: Path, added: list[str]) -> None:
    """1e-4 N on 2.5e-4 m x 1.5625e-5 m are 25.6 kPa."""
    path = tmp_path / "wave.yaml"
    path.write_text(WAVE)
    job = jobs.load(path, ["history.0.pressure=null", "history.0.force=1e-4", *added])
    assert request(job, [0.1]).pressures == pytest.approx((25.6e3,), rel=1e-12)
