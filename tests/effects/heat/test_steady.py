"""Friction curves at several temperatures: one curve over a_T v, with Persson's theory next to it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Main
from numpy.testing import assert_allclose
from scipy.special import lambertw

from parcontact import job as jobs
from parcontact.effects.heat.solver import Flash
from parcontact.effects.heat.steady import Feedback, rises_of
from parcontact.errors import InputError, JobError, RunError
from parcontact.files.tables import read_columns
from parcontact.march import scene
from parcontact.march.curve import request
from parcontact.march.steady import Point, SteadySliding
from parcontact.parallel.slab import Slab
from parcontact.results import band_charts
from parcontact.rubber.shift import WLF, Factors, highest_temperature
from parcontact.theory import wavy

C1, C2, REFERENCE = 17.4, 51.6, 20.0
WAVE = f"""\
grid: {{points: [64, 4], size: [2.5e-4, 1.5625e-5]}}
surface: {{shape: wave, amplitude: 5.0e-7, waves: [1, 0]}}
material:
  model: zener
  modulus_inf: 2.75e5
  branches: [{{modulus: 2.475e6, relaxation_time: 1.0e-3}}, {{modulus: 1.0e6, relaxation_time: 2.0e-2}}]
  shift: {{law: wlf, C1: {C1}, C2: {C2}, reference: {REFERENCE}}}
numerics: {{tolerance: 1.0e-10}}
steady: {{velocities: [0.01, 0.3], pressures: [2.0e5], temperatures: [-5.0, 20.0, 60.0]}}
"""
ROUGH = """\
grid: {points: 64, size: 1.0e-3}
surface: {shape: rough, hurst: 0.9, long_wavelength: 5.0e-4, short_wavelength: 1.25e-4, rms_slope: 0.02, seed: 3}
"""
PARTS = WAVE[WAVE.index("material") :]


def factor(temperature: float) -> float:
    """a_T, from the formula of Williams, Landel and Ferry itself."""
    return float(10.0 ** (-C1 * (temperature - REFERENCE) / (C2 + temperature - REFERENCE)))


def solver(tmp_path: Path, text: str, changes: Sequence[str] = ()) -> SteadySliding:
    path = tmp_path / "job.yaml"
    path.write_text(text)
    job = jobs.load(path, changes)
    return SteadySliding(scene.set_up(job, Slab.alone(*job.grid.points)))


def test_friction_of_a_wave_at_each_temperature(tmp_path: Path) -> None:
    """The closed form in full contact, with relaxation times that are a_T as long; to the tolerance of the solve."""
    sliding = solver(tmp_path, WAVE)
    wave = (np.array([5.0e-7]), np.array([2 * np.pi / 2.5e-4]), np.array([0.0]))
    for temperature in (-5.0, 20.0, 60.0, -5.0):
        sliding.set_temperature(temperature)
        point = sliding.solve((0.03, 0.0), 2.0e5)
        law = (2.75e5, np.array([2.475e6, 1.0e6]), factor(temperature) * np.array([1.0e-3, 2.0e-2]))
        exact = float(wavy.friction_coefficient(2.0e5, *wave, 0.03, 0.0, *law))
        assert point.measures.friction == pytest.approx(exact, rel=1e-8)
        assert point.shift_factor == pytest.approx(factor(temperature), rel=1e-12)


def test_partial_contact_depends_on_the_reduced_velocity_alone(tmp_path: Path) -> None:
    """Friction at T and v is that at the reference and a_T v: the same equations but for the rounding of a_T.

    Both are solved cold. Rounding of the times by 1e-16 moves what a solve to 1e-10 ends with by less than 1e-10.
    """
    text = ROUGH + PARTS
    warm, reference = solver(tmp_path, text), solver(tmp_path, text)
    warm.set_temperature(24.0)
    one, other = warm.solve((0.5, 0.0), 2.0e4), reference.solve((factor(24.0) * 0.5, 0.0), 2.0e4)
    assert 0.0 < one.measures.contact_area < 1.0
    assert one.measures.friction == pytest.approx(other.measures.friction, rel=1e-10)
    assert one.measures.contact_area == other.measures.contact_area
    assert one.measures.friction != pytest.approx(solver(tmp_path, text).solve((0.5, 0.0), 2.0e4).measures.friction)


def test_bell_of_an_interface_is_shifted_like_the_bulk(tmp_path: Path) -> None:
    """With an interface too; what of friction is its own has columns in the table."""
    bell = ROUGH + PARTS + "interface: {shear_stress: 2.0e5, velocity: 0.1, width: 1.5}\n"
    warm, reference = solver(tmp_path, bell), solver(tmp_path, bell)
    warm.set_temperature(33.0)
    one, other = warm.solve((0.5, 0.0), 1.0e5), reference.solve((factor(33.0) * 0.5, 0.0), 1.0e5)
    assert one.measures.friction_interface > 0.0
    assert one.measures.friction == pytest.approx(other.measures.friction, rel=1e-10)


def test_table_theory_and_picture(tmp_path: Path, main: Main) -> None:
    """A row for each temperature, sorted, also where the curve goes on; theory over the same points; a master curve."""
    changes = ["--set", "numerics.tolerance=1e-6", "--set", "interface={shear_stress: 1.0e4}"]
    (tmp_path / "job.yaml").write_text(ROUGH + PARTS)
    words = ["steady", "job.yaml", "--out", "out", "--quiet", *changes]
    code, _, err = main(*words, "--temperatures=20")
    assert code == 0, err
    before = (tmp_path / "out/steady.csv").read_text().splitlines()[1:]
    assert main(*words, "--temperatures=20,-5,60")[0] == 0
    found = read_columns(tmp_path / "out/steady.csv")
    assert found["temperature"] == [-5.0, -5.0, 20.0, 20.0, 60.0, 60.0]
    assert (tmp_path / "out/steady.csv").read_text().splitlines()[3:5] == before
    assert found["shift_factor"] == pytest.approx([factor(t) for t in found["temperature"]], rel=1e-12)
    parts = np.array(found["friction_viscous"]) + np.array(found["friction_interface"])
    assert parts == pytest.approx(found["friction_x"], rel=1e-12)
    share = np.array(found["contact_area_corrected"]) * 1.0e4 / 2.0e5
    assert found["friction_interface"] == pytest.approx(share, rel=1e-6)  # the pressure is met to the tolerance
    friction, area, master = band_charts.panels_of_curve(tmp_path / "out")
    lines = ["-5 °C", "20 °C", "60 °C"]
    for chart in (friction, area):  # "theory" is an entry of the legend without a line
        assert [one.name for one in chart.series] == [*lines, "theory", "", "", ""]
    assert [one.name for one in master.series] == [*lines, "theory", ""]
    for one, temperature in zip(master.series, (-5.0, 20.0, 60.0), strict=False):
        assert one.x == pytest.approx(factor(temperature) * np.array([0.01, 0.3]), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "stated"),
    [
        (["material.shift=null"], "needs material.shift"),
        (["material={model: elastic, shear_modulus: 1.0e6}"], "relaxation times depend on it"),
        (["steady.temperatures=[-40.0]"], "outside of the shift"),
    ],
)
def test_temperatures_that_the_material_does_not_know(tmp_path: Path, changes: list[str], stated: str) -> None:
    (tmp_path / "job.yaml").write_text(WAVE)
    with pytest.raises(JobError, match=stated):
        jobs.load(tmp_path / "job.yaml", changes)


@pytest.mark.parametrize(
    ("law", "temperature", "stated"),
    [
        ("{law: arrhenius, energy: 1.0e5, reference: 20.0}", -270.0, r"relaxation times by a factor of 10\^1.64e\+03"),
        ("{law: wlf, C1: 17.4, C2: 51.6, reference: 20.0}", -31.59, r"relaxation times by a factor of 10\^8.98e\+04"),
        ("{law: wlf, C1: 17.4, C2: 51.6, reference: 20.0}", 1e9, r"\[deg C\], up to 5000: a list, got 1000000000.0"),
    ],
)
def test_temperatures_beyond_computing(tmp_path: Path, law: str, temperature: float, stated: str) -> None:
    """Stated in a sentence, with the limit."""
    (tmp_path / "job.yaml").write_text(WAVE)
    changes = [f"material.shift={law}", f"steady.temperatures=[{temperature}]"]
    with pytest.raises(InputError, match=stated):
        request(jobs.load(tmp_path / "job.yaml", changes))


def test_a_curve_says_its_temperature(tmp_path: Path, main: Main) -> None:
    """Before its points, unless each point has one of its own."""
    (tmp_path / "job.yaml").write_text(WAVE.replace(", temperatures: [-5.0, 20.0, 60.0]", ""))
    words = ["steady", tmp_path / "job.yaml", "--velocities", "0.3"]
    for degrees, expected in ((20.0, "material: at 20 C, the reference"), (60.0, "material: at 60 C (a_T = ")):
        more = [] if degrees == REFERENCE else ["--set", f"material.temperature={degrees}"]
        code, out, err = main(*words, *more, "--set", f"output.directory=out{degrees}")
        assert code == 0, err
        assert expected in out
    code, out, err = main(*words, "--temperatures", "20", "--set", "output.directory=own")
    assert code == 0, err
    assert "material: at" not in out


NOTHING: Any = None


def rise_in_round(friction_of: Callable[[float], float], guesses: list[float]) -> Callable[[float], Point]:
    """A body whose flash temperature is a function of its own; the rises that are tried are listed."""

    def warmed(rise: float) -> Point:
        guesses.append(rise)
        found: Any = {"thermal": Flash(friction_of(rise))}
        return Point((1.0, 0.0), 1e5, 0.0, 1.0, NOTHING, 0.1, NOTHING, NOTHING, 1.0, 0.0, (), found)

    return warmed


def test_trial_temperatures_stay_within_the_shift() -> None:
    """T = 80 exp(-T/20): the first trial, 80 K, is beyond the table, the solution, 24.06 K, is not. Of T = 80 there is
    none up to 40 K, which a sentence names with velocity and temperature."""
    tried: list[float] = []
    body = rise_in_round(lambda rise: 80.0 * np.exp(-rise / 20.0), tried)
    point = Feedback().solve_fixed_point(body, 1.0, (1e5, 5.0), 1e-3, most=40.0)
    exact = 20.0 * float(lambertw(4.0).real)
    assert max(tried) == 40.0
    assert point.effects["thermal"].mean == pytest.approx(exact, abs=0.05)  # stops at a difference of .02 K and 1e-3
    with pytest.raises(RunError, match=r"at 1 m/s under 1e\+05 Pa and 5 C.*is above 45 C.*warmed to 85 C"):
        Feedback().solve_fixed_point(rise_in_round(lambda _: 80.0, tried), 1.0, (1e5, 5.0), 1e-3, most=40.0)
    assert max(tried) == 40.0


def test_tables_of_a_shift_end() -> None:
    """The lower end of two tables; laws have none."""
    vertical = Factors((0.0, 50.0), (0.0, 0.1), 20.0)
    assert highest_temperature(Factors((0.0, 60.0), (1.0, -1.0), 20.0, vertical)) == 50.0
    assert highest_temperature(WLF(8.86, 101.6, 20.0)) == np.inf


def test_bands_warm_each_other_equally() -> None:
    """Heat of band i warms band k as the same heat of band k warms band i (reciprocity of conduction), heat of the
    interface warms all as that of a finest band on the surface, and waves of finer bands do not warm a coarser one."""
    draw = np.random.default_rng(5).random
    weights, uniform, shares, warmings = draw(7), draw(7), [*draw((2, 7)), np.ones(7)], list(draw((3, 7)))
    given = weights, uniform, shares, warmings
    rises = np.array([rises_of(*given, heats, 0.0) for heats in np.eye(3).tolist()])
    assert_allclose(rises, rises.T, rtol=1e-13)
    assert_allclose(np.array(rises_of(*given, [0.0, 0.0, 0.0], 1.0)), rises[2], rtol=1e-13)
    assert_allclose(
        rises[0], [np.sum(weights * shares[0] * one * (uniform + warmings[0])) for one in shares], rtol=1e-13
    )
