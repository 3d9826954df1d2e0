"""`parcontact theory`: the job's waves, history and material in Persson's theory."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from conftest import RunParcontact
from csv_rows import rows
from marched_jobs import JOBS, PRONY, SLS, column, marched
from numpy.testing import assert_allclose

from parcontact import __version__
from parcontact.__main__ import main
from parcontact.errors import InputError
from parcontact.job import Job, load
from parcontact.march.curve import request
from parcontact.parallel.slab import Slab
from parcontact.physics.prony import complex_modulus
from parcontact.results import info, prediction
from parcontact.results.info import TheorySettings
from parcontact.theory import wavy

ROUGH: dict[str, Any] = {
    "shape": "rough",
    "hurst": 0.9,
    "long_wavelength": 2.5e-4,
    "short_wavelength": 1.25e-4,
    "rms_slope": 0.01,
}
WAVE = {"shape": "wave", "amplitude": 0.5e-6, "waves": [4, 0]}
HISTORY: list[dict[str, Any]] = [
    {"pressure": 0.0, "duration": 1e-4, "time_step": 5e-5},
    {"pressure": {"from": 0.0, "to": 2e5}, "duration": 1e-3, "time_step": 2.5e-4},
    {"force": 0.2, "velocity": 0.04, "distance": 1e-4, "cells_per_step": 1},
    {"pressure": 2e5, "duration": 1e-3, "time_step": {"first": 1e-5, "growth": 3.0}},
    {"pressure": 1e5, "velocity": -0.04, "duration": 1e-3, "time_step": 5e-4},
]


def job(**changes: Any) -> Job:
    grid = {"points": 16, "size": 1e-3}
    return Job.model_validate({"grid": grid, "surface": [WAVE], "material": SLS, "history": HISTORY, **changes})


def predicted(
    job: Job, waves: prediction.WavesOf = "lattice", gamma: float = 0.45
) -> list[prediction.PredictedInstant]:
    return list(prediction.predict(job, Slab.alone(*job.grid.points), gamma, waves))


def test_full_contact_is_that_of_the_run() -> None:
    """In full contact the theory is exact: friction of every row, to what the run's short steps err by.

    The pressure is high enough from the first row of the slide on. Cells are short: 64 a wave, 1 % of a radian of loss.
    """
    slide = [{"pressure": 4e5, "velocity": 0.04, "distance": 2.5e-4, "cells_per_step": 1}]
    stop = {"pressure": 4e5, "duration": 1e-3, "time_step": 1e-4}
    one = job(grid={"points": [256, 1], "size": 1e-3}, history=[*slide, stop], numerics={"tolerance": 1e-6})
    found, (_, rows) = predicted(one), marched(one)
    exact = column(rows, "friction")
    assert_allclose([row.friction for row in found], exact, atol=2e-3 * exact.max())
    assert exact.max() > 4e-4
    assert min(row.contact_area for row in found[1:]) > 1.0 - 1e-9


MAP, PROFILE = {"points": 64, "size": 1e-3}, {"points": [512, 1], "size": [8e-3, 1e-3]}
SLOPE, HEIGHT, CONSTANT = {"rms_slope": 0.01}, {"rms_height": 3e-7}, {"psd_constant": 1e-21}


@pytest.mark.parametrize(
    ("amount", "grid"), [(SLOPE, MAP), (HEIGHT, MAP), (CONSTANT, MAP), (SLOPE, PROFILE), (HEIGHT, PROFILE)]
)
def test_continuum_and_lattice(amount: dict[str, float], grid: dict[str, Any]) -> None:
    """In full contact friction depends on the spectrum only: a box with many waves of fixed amplitudes is near it.

    5 %: the map has 8 to 16 waves along each side, whose number in a ring differs from its area by some per cent. The
    profile has 64 waves.
    """
    rough: dict[str, Any] = {"shape": "rough", "hurst": 0.9, "amplitudes": "fixed", **amount}
    rough |= {"long_wavelength": 1.25e-4, "short_wavelength": 6.25e-5}
    stage = {"pressure": 1e8, "velocity": 0.04, "distance": 1e-3, "cells_per_step": 32}
    one = job(surface=[rough, {"shape": "flat"}], grid=grid, history=[stage])
    lattice, continuum = (predicted(one, waves)[-1] for waves in ("lattice", "continuum"))
    assert lattice.contact_area == continuum.contact_area == 1.0
    assert_allclose(lattice.friction, continuum.friction, rtol=0.05)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"history": [{"approach": 1e-6}]}, "history.0.approach"),
        ({"surface": [WAVE]}, "one isotropic rough surface"),
        ({"surface": [ROUGH, ROUGH]}, "one isotropic rough surface"),
        ({"surface": [{**ROUGH, "anisotropy": {"ratio": 2.0}}]}, "one isotropic rough surface"),
        ({"grid": {"points": 16, "size": 1e-3, "boundary": "free"}}, "grid.boundary"),
    ],
)
def test_jobs_that_the_theory_does_not_know(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        predicted(job(**changes), "continuum")


def test_the_verb(run_parcontact: RunParcontact, tmp_path: Path) -> None:
    """On two ranks it writes one table, also into the directory of a run that is there."""
    small = ["--set", "grid.points=64", "--set", "surface.0.short_wavelength=1e-4"]
    done = run_parcontact(["theory", JOBS / "velocity_step.yaml", *small, "--gamma", "1", "--out", "here"], ranks=2)
    assert (done.returncode, done.stderr) == (0, "")
    first, second = done.stdout.splitlines()
    assert first == "Persson's theory, gamma 1, for the spectrum of the surface: here/theory.csv"
    assert re.fullmatch(r"Persson's theory predicts mu_max \S+, mu_dyn \S+, contact area \S+", second)
    table = rows(tmp_path / "here" / "theory.csv")
    assert tuple(table[0]) == prediction.PredictedInstant._fields
    assert float(table[-1]["distance"]) == pytest.approx(4.32e-4)
    assert {path.name for path in (tmp_path / "here").iterdir()} == {"theory.csv", "theory.yaml"}
    assert yaml.safe_load((tmp_path / "here" / "theory.yaml").read_text()) == {
        "gamma": 1.0,
        "waves": "continuum",
        "program": f"parcontact {__version__}",
    }


def test_settings_are_read_with_their_table(tmp_path: Path) -> None:
    """A table that could not be written leaves those before; legends name what cases share."""
    ran, other = (job(output={"directory": str(tmp_path / name)}) for name in ("ran", "other"))
    first, second = TheorySettings(0.5, "lattice"), TheorySettings(0.6, "lattice")
    for one in (ran, other):
        prediction.write_theory(one, iter([]), first)
    paths = [one.output.directory for one in (ran, other)]
    assert info.read_settings(paths[0]) == first
    assert info.shared(paths) == first
    assert info.describe_settings(paths[0]) == "Persson's theory: gamma 0.5, for the waves of the surface in its box"
    prediction.write_theory(other, iter([]), second)
    assert info.shared(paths) is None
    table = (paths[0] / "theory.csv").read_bytes()
    with pytest.raises(ZeroDivisionError):
        prediction.write_theory(ran, (1 / 0 for _ in range(1)), second)  # type: ignore[misc]
    assert (paths[0] / "theory.csv").read_bytes() == table
    assert info.read_settings(paths[0]) == first


def test_damaged_settings_are_stated_by_name(tmp_path: Path) -> None:
    """By `parcontact info`, and where pictures and reports name them."""
    one = job(output={"directory": str(tmp_path / "out")})
    prediction.write_theory(one, iter([]), TheorySettings(0.5, "lattice"))
    path = tmp_path / "out" / "theory.yaml"
    path.write_text("gamma: 0.5\n")
    damaged = f"{path} is damaged: it does not say gamma and waves"
    assert info.describe_settings(path.parent) == f"theory of unknown settings: {damaged}"
    (path.parent / "measures.csv").write_text("")
    stated, sound = info.describe_path(path.parent)
    assert not sound
    assert "  Persson's theory: 0 rows, of unknown settings\n" in stated
    assert f"  {damaged}" in stated.splitlines()


def test_a_directory_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"theory.csv cannot be written"):
        prediction.write_theory(
            job(output={"directory": str(tmp_path / "file" / "x")}), iter([]), TheorySettings(0.45, "lattice")
        )


def test_gamma_is_a_share(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["theory", "job.yaml", "--gamma", "2"])
    assert "must be a number from 0 to 1, got '2'" in capsys.readouterr().err


def test_full_contact_of_a_lattice_is_exact() -> None:
    """The very surface in the box, steady, for any gamma: to rounding."""
    stage = {"pressure": 1e8, "velocity": 0.04, "duration": 1e-3, "time_step": 1e-3}
    start = {"state": "steady", "velocity": 0.04, "pressure": 1e8}
    one = job(surface=[{**WAVE, "waves": [3, 2]}, WAVE], history=[stage], initial=start)
    x, y = np.arange(16) / 16, np.arange(16)[:, None] / 16
    heights = 0.5e-6 * (np.cos(2 * np.pi * 4 * x) + np.cos(2 * np.pi * (3 * x + 2 * y)))
    waves = wavy.waves(heights, 1e-3, 1e-3)
    exact = np.hypot(*wavy.traction(*waves, complex_modulus(0.04 * waves.kx, *PRONY))) / 1e8
    for gamma in (0.0, 0.45):
        assert_allclose(predicted(one, gamma=gamma)[0].friction, exact, rtol=1e-10)


def test_theory_of_a_friction_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has a row for each point, may come before the curve, and is the same as that of the curve."""
    monkeypatch.chdir(tmp_path)
    curve = {"velocities": [0.01, 0.1], "pressures": [1e5, 3e5]}
    job = {"grid": {"points": 20, "size": 1e-3}, "surface": ROUGH, "material": SLS, "steady": curve}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(job))
    assert main(["theory", "job.yaml", "--quiet"]) == 0
    path = tmp_path / "out" / "job" / "steady_theory.csv"
    before = path.read_bytes()
    found = load("job.yaml")
    wanted = [str(row.friction) for row in prediction.predict_steady(found, request(found))]
    assert [row["friction"] for row in rows(path)] == wanted
    assert main(["steady", "job.yaml", "--quiet"]) == 0
    assert path.read_bytes() == before
    assert main(["theory", "job.yaml", "--gamma", "0.5"]) == 2
    assert main(["theory", "job.yaml", "--set", "grid.boundary=free"]) == 2
    assert path.read_bytes() == before
