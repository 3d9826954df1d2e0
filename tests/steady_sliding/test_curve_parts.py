"""A friction curve in parts: it goes on where it was stopped, next to a run, and a point that fails does so alone."""

import os
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from conftest import WORLD
from matplotlib.figure import Figure

from parcontact import __main__
from parcontact.contact.splitting import SteadySolver
from parcontact.files import sweep
from parcontact.files.fields import SteadyMaps
from parcontact.files.tables import read_columns
from parcontact.march.mesh import load_cases
from parcontact.march.steady import SteadySliding
from parcontact.results import page

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="in this process, on one rank")

JOB: dict[str, Any] = {
    "grid": {"points": [32, 4], "size": [2.5e-4, 3.125e-5]},
    "surface": {"shape": "wave", "amplitude": 5.0e-7, "waves": [1, 0]},
    "material": {"model": "zener", "modulus_inf": 2.75e5, "branches": [{"modulus": 2.475e6, "relaxation_time": 1e-3}]},
}
HISTORY = [{"pressure": 2.0e5, "velocity": 0.04, "distance": 2.34375e-5, "cells_per_step": 1}]
CURVE = ("steady", "job.yaml", "--out", "out", "--velocities", "0.01:1:3", "--pressures", "2e5,4e5")
DONE, FAILED, BAD_INPUT, AGAIN = 0, 1, 2, 3
Main = Callable[..., tuple[int, str]]


@pytest.fixture
def main(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Main:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    (tmp_path / "run.yaml").write_text(yaml.safe_dump({**JOB, "history": HISTORY}))

    def run(*words: str) -> tuple[int, str]:
        capsys.readouterr()
        code = __main__.main([*words] if words[0] in ("info", "plot") else [*words, "--quiet"])
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out + said.err

    return run


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """The points that are solved, as they are."""
    found: list[tuple[float, float]] = []
    solve = SteadySliding.solve

    def noted(self: SteadySliding, velocity: tuple[float, float], pressure: float) -> Any:
        found.append((velocity[0], pressure))
        return solve(self, velocity, pressure)

    monkeypatch.setattr(SteadySliding, "solve", noted)
    return found


@pytest.fixture
def losing(monkeypatch: pytest.MonkeyPatch) -> set[float]:
    """Speeds [m/s] at which no solve succeeds."""
    speed, solve, solve_on_grid, lost = [0.0], SteadySliding.solve, SteadySolver.solve, set[float]()

    def noted(self: SteadySliding, velocity: tuple[float, float], pressure: float) -> Any:
        speed[0] = velocity[0]
        return solve(self, velocity, pressure)

    def failing(self: SteadySolver, h: Any, mean: float, start: Any) -> Any:
        contact = solve_on_grid(self, h, mean, start)
        return replace(contact, failure="no contact was found") if round(speed[0], 9) in lost else contact

    monkeypatch.setattr(SteadySliding, "solve", noted)
    monkeypatch.setattr(SteadySolver, "solve", failing)
    return lost


def points(table: Path) -> list[tuple[float, float]]:
    columns = read_columns(table)
    return [
        (float(f"{v:.6g}"), float(f"{p:.6g}")) for v, p in zip(columns["velocity"], columns["pressure"], strict=True)
    ]


ALL = [(v, p) for p in (2e5, 4e5) for v in (0.01, 0.1, 1.0)]


def test_job_without_history(main: Main, tmp_path: Path) -> None:
    """The flags say all that a curve needs."""
    assert main(*CURVE) == (DONE, "")
    assert points(tmp_path / "out" / "steady.csv") == ALL


def test_stopped_curve_goes_on(
    main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solved: list[tuple[float, float]]
) -> None:
    """A signal stops it between two points with 3; the same command solves the others only; so does a longer list."""
    solve = SteadySliding.solve

    def interrupted(self: SteadySliding, velocity: tuple[float, float], pressure: float) -> Any:
        if len(solved) == 1:
            os.kill(os.getpid(), signal.SIGTERM)
        return solve(self, velocity, pressure)

    with monkeypatch.context() as patch:
        patch.setattr(SteadySliding, "solve", interrupted)
        assert main(*CURVE) == (AGAIN, "")
    first = (tmp_path / "out" / "steady.csv").read_bytes()
    assert len(solved) == 2
    with (tmp_path / "out" / "steady.csv").open("ab") as file:
        file.write(b"0.5,2e5,0.1")  # as a run that was killed leaves it
    assert main(*CURVE) == (DONE, "")
    assert len(solved) == 6
    assert (tmp_path / "out" / "steady.csv").read_bytes().startswith(first)
    assert points(tmp_path / "out" / "steady.csv") == ALL
    assert main("steady", "job.yaml", "--out", "out", "--velocities", "0.05,0.1", "--pressures", "2e5") == (DONE, "")
    assert len(solved) == 7
    assert points(tmp_path / "out" / "steady.csv") == sorted([*ALL, (0.05, 2e5)], key=lambda point: point[::-1])
    assert main(*CURVE, "--restart", "never") == (DONE, "")
    assert len(solved) == 13


def test_curve_of_a_sweep_has_only_begun_while_points_lack(
    main: Main, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solved: list[tuple[float, float]]
) -> None:
    """Stopped after a point of three it has begun; with all three it is done; where a fourth is asked for it is not."""
    asked = {"steady": {"velocities": [0.01, 0.1, 1.0], "pressures": [2e5]}}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**JOB, **asked, "sweep": [{"surface.amplitude": [5e-7, 4e-7]}]}))
    solve = SteadySliding.solve

    def interrupted(self: SteadySliding, velocity: tuple[float, float], pressure: float) -> Any:
        os.kill(os.getpid(), signal.SIGTERM)
        return solve(self, velocity, pressure)

    def states(*overrides: str) -> list[str]:
        return [sweep.state_of(case) for case in load_cases("job.yaml", overrides)]

    with monkeypatch.context() as patch:
        patch.setattr(SteadySliding, "solve", interrupted)
        assert main("steady", "job.yaml") == (AGAIN, "")
    assert (len(solved), states()) == (1, ["begun", "-"])
    assert main("steady", "job.yaml") == (DONE, "")
    assert (len(solved), states()) == (6, ["done", "done"])
    assert states("steady.velocities=[0.01, 0.1, 0.5, 1.0]") == ["begun", "begun"]
    shift = "material.shift={law: arrhenius, energy: 1.0e5, reference: 20.0}"
    assert states("steady.temperatures=[20.0]", shift) == ["begun", "begun"]


@pytest.mark.parametrize(
    ("first", "second", "sentence"),
    [
        (
            "interface={shear_stress: 1.0e5}",
            "interface={shear_stress: 2.0e5}",
            "interface.shear_stress was 100000.0, is 200000.0",
        ),
        (
            "softening={table: [[1.0e-3, 1.0, 1.0], [1.0, 0.5, 0.5]]}",
            "softening={table: [[1.0e-3, 1.0, 1.0], [1.0, 0.2, 0.5]]}",
            "softening.table was",
        ),
    ],
)
def test_points_of_another_effect_are_not_gone_on_with(
    main: Main, tmp_path: Path, first: str, second: str, sentence: str
) -> None:
    """An interface or softening changes friction of all points, as another material does."""
    assert main(*CURVE, "--set", first) == (DONE, "")
    before = (tmp_path / "out" / "steady.csv").read_bytes()
    code, said = main(*CURVE, "--set", second)
    assert code == BAD_INPUT
    assert f"another job: {sentence}" in said
    assert (tmp_path / "out" / "steady.csv").read_bytes() == before


def test_sweep_of_another_job_leaves_all_as_it_is(main: Main, tmp_path: Path) -> None:
    """Its cases are in the way: nothing is written, not even the tables of the sweep."""
    asked = {"steady": {"velocities": [0.1], "pressures": [2e5]}}
    for name, amplitudes in (("one", [5e-7, 4e-7]), ("other", [5e-7, 3e-7])):
        swept = [{"surface.amplitude": amplitudes}]
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump({**JOB, **asked, "sweep": swept}))
    assert main("steady", "one.yaml", "--out", "there") == (DONE, "")
    before = {path: path.read_bytes() for path in (tmp_path / "there").rglob("*.csv")}
    code, said = main("steady", "other.yaml", "--out", "there")
    assert (code, "cases/001 has a friction curve of another job: surface.0.amplitude" in said) == (BAD_INPUT, True)
    assert {path: path.read_bytes() for path in (tmp_path / "there").rglob("*.csv")} == before


def test_curve_and_a_directory_named_stop(main: Main, tmp_path: Path) -> None:
    """It stops a curve like any stop file; a sentence says that it cannot be removed."""
    (tmp_path / "out" / "stop").mkdir(parents=True)
    code, said = main(*CURVE)
    assert (code, "stop, which cannot be removed: Is a directory; remove it" in said) == (FAILED, True)


def test_curve_of_another_job(main: Main, tmp_path: Path) -> None:
    """It is refused, and nothing of the curve that is there changes."""
    assert main(*CURVE)[0] == DONE
    before = (tmp_path / "out" / "steady.csv").read_bytes()
    code, said = main(*CURVE, "--set", "numerics.tolerance=1e-5")
    assert code == BAD_INPUT
    assert "out holds the friction curve of another job: numerics.tolerance was 0.005, is 1e-05" in said
    assert "to keep its mesh" not in said
    assert (tmp_path / "out" / "steady.csv").read_bytes() == before


def test_curve_in_the_directory_of_a_run(main: Main, tmp_path: Path) -> None:
    """Each has its own files in one directory; of another scene neither may be there."""
    assert main("run.yaml", "--out", "out")[0] == DONE
    names = ("job.yaml", "job.resolved.yaml", "measures.csv")
    before = {name: (tmp_path / "out" / name).read_bytes() for name in names}
    assert main(*CURVE)[0] == DONE
    assert {name: (tmp_path / "out" / name).read_bytes() for name in names} == before
    assert main("run.yaml", "--out", "out", "--restart", "never")[0] == DONE
    assert points(tmp_path / "out" / "steady.csv") == ALL
    for words in (CURVE, ("run.yaml", "--out", "out")):
        code, said = main(*words, "--set", "surface.0.amplitude=1e-6")
        assert code == BAD_INPUT
        assert "surface.0.amplitude was 5e-07, is 1e-06" in said


def test_points_that_are_lost_are_named(main: Main, tmp_path: Path, losing: set[float], drawn: list[Figure]) -> None:
    """A point of the curve whose solve fails is left out, and the others are solved. The end of the run, its
    description, report and picture name it, until a later run solves it."""
    out, why = tmp_path / "out", "no contact was found"
    named = "4 of 6 points, without 0.1 m/s under 200 kPa, 0.1 m/s under 400 kPa: " + why
    losing.add(0.1)
    code, said = main(*CURVE)
    assert code == FAILED
    assert said.count("steady sliding at 0.1 m/s under") == 2
    assert named in said
    assert points(out / "steady.csv") == [point for point in ALL if point[0] != 0.1]
    assert title(drawn.pop()).endswith(named)
    assert main("plot", "out")[0] == DONE
    assert title(drawn.pop()).endswith(named)
    assert main("plot", "out", "out", "--compare")[0] == DONE
    assert named in title(drawn.pop())
    assert named in main("info", "out")[1]
    assert named in page.write_report([out]).read_text().replace("\xa0", " ").replace("<wbr>", "")
    drawn.clear()

    losing.clear()
    code, said = main(*CURVE)
    assert (code, points(out / "steady.csv")) == (DONE, ALL)
    assert "points, without" not in title(drawn.pop())
    assert "points, without" not in main("info", "out")[1]
    assert not (out / "steady.lost.json").exists()


def test_lost_points_of_earlier_runs_are_kept(main: Main, tmp_path: Path, losing: set[float]) -> None:
    """A run of other points does not forget them; one from the beginning does."""
    losing.add(0.1)
    assert main(*CURVE)[0] == FAILED
    assert main(*CURVE[:-3], "0.02", *CURVE[-2:])[0] == DONE
    assert "6 of 8 points, without 0.1 m/s" in main("info", "out")[1]
    assert main(*CURVE[:-3], "0.02", *CURVE[-2:], "--restart", "never")[0] == DONE
    assert "points, without" not in main("info", "out")[1]


def test_failed_cases_of_a_sweep_are_named(main: Main, tmp_path: Path, losing: set[float], drawn: list[Figure]) -> None:
    """Curves that lack points, and those without any, of which tables and pictures of points have nothing."""
    losing.add(0.1)
    sweep = {**JOB, "sweep": [{"material.modulus_inf": [2.75e5, 3e5]}]}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(sweep))
    assert main(*CURVE)[0] == FAILED
    named = "case 1 failed: 4 of 6 points, without 0.1 m/s under 200 kPa"
    assert named in main("info", "out")[1]
    drawn.clear()
    assert main("plot", "out")[0] == DONE
    assert named in title(drawn.pop())
    assert named in page.write_report([tmp_path / "out"]).read_text().replace("\xa0", " ").replace("<wbr>", "")


def title(figure: Figure) -> str:
    """Return the title of a picture, or that of its legend, in one line."""
    found = figure.get_suptitle() or figure.legends[0].get_title().get_text()
    return " ".join(found.split())


def test_maps_of_each_point(main: Main, tmp_path: Path) -> None:
    """Their means are the pressures, and full contact leaves no gap; a curve that goes on adds to them."""
    fields = ("--set", "output.fields=[pressure, displacement, gap, height]")
    assert main(*CURVE, *fields)[0] == DONE
    with h5py.File(tmp_path / "out" / "steady.h5") as file:
        assert file["pressure"].shape == (6, 4, 32)
        assert np.allclose(np.array([file["velocity"][...], file["load"][...]]).T, ALL)
        assert np.allclose(file["pressure"][...].mean(axis=(1, 2)), file["load"][...], rtol=1e-9)
        assert np.abs(file["gap"][...]).max() < 1e-4 * 1e-6  # the tolerance, of the height
        bare = file["displacement"][...] - file["height"][...]
        assert np.ptp(bare, axis=(1, 2)).max() < 1e-4 * 1e-6


def test_maps_of_points_that_are_there(main: Main, tmp_path: Path, solved: list[tuple[float, float]]) -> None:
    """They are made by solving these again, once; the table stays as it is."""
    fields = ("--set", "output.fields=[pressure]")
    assert main(*CURVE)[0] == DONE
    before = (tmp_path / "out" / "steady.csv").read_bytes()
    for _ in range(2):
        assert main(*CURVE, *fields)[0] == DONE
    assert len(solved) == 2 * len(ALL)
    assert (tmp_path / "out" / "steady.csv").read_bytes() == before
    with h5py.File(tmp_path / "out" / "steady.h5") as file:
        assert np.allclose(file["pressure"][...].mean(axis=(1, 2)), [pressure for _, pressure in ALL], rtol=1e-9)


def test_more_points_keep_the_maps_of_others(
    main: Main, tmp_path: Path, solved: list[tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A longer list of speeds, stopped within, solves new points only; other kinds of maps begin a new file."""
    path, fields = tmp_path / "out" / "steady.h5", ("--set", "output.fields=[pressure]")
    assert main(*CURVE, *fields)[0] == DONE
    with h5py.File(path) as file:
        first = file["pressure"][...]
    more = ("steady", "job.yaml", "--out", "out", "--pressures", "2e5", "--velocities", "0.05,0.1,0.2")
    save = SteadyMaps.save

    def killed(self: SteadyMaps, index: int, maps: Any) -> None:
        if len(solved) == len(ALL) + 2:
            raise KeyboardInterrupt
        save(self, index, maps)

    with monkeypatch.context() as patch:
        patch.setattr(SteadyMaps, "save", killed)
        with pytest.raises(SystemExit):
            main(*more, *fields)
    assert main(*more, *fields)[0] == DONE
    assert [speed for speed, _ in solved[len(ALL) :]] == [0.05, 0.2, 0.2]
    with h5py.File(path) as file:
        places = list(zip(file["velocity"][...], file["load"][...], strict=True))
        maps = file["pressure"][...]
    assert places == [(0.05, 2e5), (0.1, 2e5), (0.2, 2e5), *(one for one in ALL if one != (0.1, 2e5))]
    for (speed, load), rows in zip(places, maps, strict=True):
        assert rows.mean() == pytest.approx(load, rel=1e-9)
        if (speed, load) in ALL:
            assert np.array_equal(rows, first[ALL.index((speed, load))])
    assert main(*CURVE, "--set", "output.fields=[gap]")[0] == DONE
    assert len(solved) == 2 * len(ALL) + 3
    assert path.with_name("steady.h5.aside").is_file()


def test_kernel_of_cells(main: Main, tmp_path: Path) -> None:
    """With `love` a wave of n cells is stiffer by the factor of a cell, 1/sinc(1/n), and so is friction."""
    assert main(*CURVE)[0] == DONE
    assert main(*CURVE[:3], "love", *CURVE[4:], "--set", "numerics.kernel=love")[0] == DONE
    frictions = [np.array(read_columns(tmp_path / out / "steady.csv")["friction"]) for out in ("out", "love")]
    assert frictions[1] / frictions[0] == pytest.approx(1.0 / np.sinc(1.0 / 32.0), rel=1e-3)
