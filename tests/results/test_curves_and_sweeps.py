"""Tables for other programs and for reports, from a made-up curve, and how far a sweep is."""

import csv
import shutil
from itertools import product
from pathlib import Path

import pytest

from parcontact import job
from parcontact.errors import InputError
from parcontact.results import export, info, report_sections
from parcontact.results.results import Results

JOB = """
grid: {points: 32, size: 1.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 0]}
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e7, relaxation_time: 1.0e-4}], band: [50, 3000],
  shift: {law: wlf, C1: 8.86, C2: 101.6, reference: 20}}
steady: {velocities: [0.1, 1.0, 10], pressures: [1.0e5, 2.0e5], temperatures: [20, 40]}
"""
SHARE = 10 ** (-8.86 * 20.0 / (101.6 + 20.0))  # a_T at 40 C


@pytest.fixture
def curve(tmp_path: Path) -> Path:
    """A curve whose points are not in order; the waves of 1 mm excite the speed over their length."""
    (tmp_path / "job.yaml").write_text(JOB)
    (tmp_path / "steady.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    points = list(product((10.0, 0.1, 1.0), (2e5, 1.0000000001e5), (40.0, 20.0)))[1:]  # one is not solved
    rows = [
        "velocity,pressure,temperature,friction,error_friction",
        *(f"{v},{p},{t},{v * t},0.1" for v, p, t in points),
    ]
    (tmp_path / "steady.csv").write_text("\n".join([*rows, ""]))
    return tmp_path


def test_a_table_for_abaqus(curve: Path) -> None:
    """The slip rate varies fastest, then the pressure, then the temperature."""
    said = list(export.export_results(curve, "abaqus"))
    lines = [line for line in (curve / "friction.inp").read_text().splitlines() if not line.startswith("**")]
    rows = [tuple(map(float, line.split(", "))) for line in lines[1:]]
    assert lines[0] == "*FRICTION"
    assert [row[:0:-1] for row in rows] == sorted(row[:0:-1] for row in rows)
    assert all(mu == pytest.approx(v * t) for mu, v, _, t in rows)
    wanted = {(v, p, t) for v, p, t in product((0.1, 1.0, 10.0), (1e5, 2e5), (20.0, 40.0))} - {(10.0, 2e5, 40.0)}
    reduced = {point: point[0] / 1e-3 * (SHARE if point[2] == 40.0 else 1.0) for point in wanted}
    assert {row[1:] for row in rows} == {point for point, frequency in reduced.items() if 25.0 < frequency < 6000.0}
    low, words = f"{100 * SHARE:.3g} Hz", "(reduced to the reference temperature)"
    assert said[1:5] == [
        "left out: 4 of 11 points, at which the surface excites the rubber outside of its measured range",
        f"10 m/s at 20 C (2 points) needs moduli at 10 kHz {words}, 0.5 decades above the measured 50 Hz to 3 kHz",
        f"100 mm/s at 40 C (2 points) needs moduli at {low} {words}, 1.2 decades below the measured 50 Hz to 3 kHz",
        f"to keep these points, measure the moduli from {low} to 10 kHz {words}: at these frequencies, or at "
        "temperatures whose shift reaches them",
    ]
    assert "not solved: 1 of 12 points are not solved yet" in said


def test_points_left_out_without_a_shift(tmp_path: Path) -> None:
    """Waves of 1 mm at 10 and 100 m/s excite 10 and 100 kHz, and 3 kHz were measured."""
    shift = "\n  shift: {law: wlf, C1: 8.86, C2: 101.6, reference: 20}"
    text = JOB.replace(f",{shift}", "").replace(", temperatures: [20, 40]", "").replace("[0.1, 1.0, 10]", "[10, 100]")
    (tmp_path / "job.yaml").write_text(text)
    (tmp_path / "steady.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    (tmp_path / "steady.csv").write_text(
        "velocity,pressure,friction\n10,1e5,0.1\n100,1e5,0.2\n10,2e5,0.1\n100,2e5,0.2\n"
    )
    with pytest.raises(InputError, match="no point of the curve lies within the measured range") as error:
        list(export.export_results(tmp_path, "abaqus"))
    said = str(error.value)
    assert "10 m/s to 100 m/s (4 points) needs moduli at 10 kHz to 100 kHz, 1.5 decades above the measured" in said
    assert "measure the moduli from 10 kHz to 100 kHz, or at several temperatures and give material.shift" in said


def test_a_table_with_units(curve: Path) -> None:
    list(export.export_results(curve, "csv", curve / "table.csv"))
    with (curve / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(export.HEAD)
    assert {row["pressure [Pa]"] for row in rows} == {"100000.0", "200000.0"}
    with pytest.raises(InputError, match=r"must end in \.inp"):
        list(export.export_results(curve, "abaqus", curve / "table.csv"))


def test_leakage_over_the_load(tmp_path: Path) -> None:
    """Of equal loads the last row counts."""
    (tmp_path / "measures.csv").write_text("step\n0\n")
    (tmp_path / "leak.csv").write_text("time,pressure,flow_x,flow_y\n0,2,5,6\n1,1,7,8\n2,2,3,4\n")
    assert list(export.export_results(tmp_path, "csv")) == [f"conductivity: 2 rows in {tmp_path}/conductivity.csv"]
    head, *rows = (tmp_path / "conductivity.csv").read_text().splitlines()
    assert head == "pressure [Pa],conductivity K along x [m^3],conductivity K along y [m^3]"
    assert rows == ["1.0,7.0,8.0", "2.0,3.0,4.0"]
    with pytest.raises(InputError, match="has no table for abaqus"):
        list(export.export_results(tmp_path, "abaqus"))
    with pytest.raises(InputError, match="is not a directory"):
        list(export.export_results(tmp_path / "nowhere", "csv"))
    (tmp_path / "leak.csv").unlink()
    columns = "step,time,pressure,flow_x,flow_y"
    (tmp_path / "measures.csv").write_text(f"{columns}\n0,0,0,,\n1,1,1,7,8\n2,2,2,,\n")  # of `leakage: {every: 2}`
    list(export.export_results(tmp_path, "csv"))
    assert (tmp_path / "conductivity.csv").read_text().splitlines() == [head, "1.0,7.0,8.0"]
    (tmp_path / "measures.csv").write_text("step,time,pressure\n0,0,0\n")
    with pytest.raises(InputError, match="has no table for csv"):
        list(export.export_results(tmp_path, "csv"))


# -- the first tables of a report ------------------------------------------------------------------------------------


def test_friction_over_speed_and_temperature(curve: Path) -> None:
    """A table for each pressure; a point that is lost is named, one that is to come is a dash."""
    lost = '[{"velocity": 0.1, "pressure": 3e5, "temperature": 20, "why": "no"}]'
    (curve / "steady.lost.json").write_text(lost)
    tables = report_sections.friction_tables(Results(curve, "steady"))
    assert [table.caption for table in tables] == [f"friction under {p} kPa" for p in (100, 200, 300)]
    assert all(list(table.head) == ["velocity", "at 20 °C", "at 40 °C"] for table in tables)
    assert list(tables[0].rows[0]) == ["100 mm/s", "2.00 ± 0.20", "4.00 ± 0.40"]
    assert list(tables[1].rows[2]) == ["10 m/s", "200 ± 20", "–"]
    assert list(tables[2].rows[0]) == ["100 mm/s", "not solved", "–"]
    scales = {row[0]: row[1] for row in report_sections.scales_table(Results(curve, "steady"))[0].rows}
    assert scales["frequencies that the job excites at 40 °C"] == "100 Hz to 10 kHz"
    assert scales["measured frequencies, at the reference temperature"] == "50 Hz to 3 kHz"
    (compared,) = report_sections.compared_table([curve, curve], ["soft", "hard"])
    assert list(compared.head) == ["velocity", "pressure", "temperature", "soft", "hard"]
    assert list(compared.rows[0]) == ["100 mm/s", "100 kPa", "20 °C", "2.00 ± 0.20", "2.00 ± 0.20"]


def test_a_headline_names_the_conditions_and_that_friction_still_rises(curve: Path) -> None:
    said = info.find_headline(curve)
    assert said.endswith("is 400 ± 40, at 10 m/s and 100 kPa, 40 °C; it still rises at the highest velocity.")
    assert Results(curve, "steady").unfinished == ["1 of 12 points are not solved yet"]


def test_how_far_a_running_sweep_is(curve: Path) -> None:
    """Case 1 runs; the others take 20 s each."""
    home = curve / "sweep"
    (home / "cases" / "001").mkdir(parents=True)
    text = JOB.partition("steady:")[0] + "history: [{pressure: 1.0e5, duration: 2.0, time_step: 0.1}]\n"
    (home / "job.yaml").write_text(text)
    (home / "cases" / "001" / "job.resolved.yaml").write_text(job.load(home / "job.yaml").resolved())
    (home / "cases" / "001" / "measures.csv").write_text("step,time\n0,0\n1,0.5\n")
    rows = [f"{k},{k + 1.0},-,," if k % 2 else f"{k},{k + 1.0},done,{k + 1},20" for k in range(5)]
    (home / "sweep.csv").write_text("\n".join(["case,history.0.velocity,state,mu_dyn,seconds", *rows, ""]))
    said, sound = info.describe_path(home)
    assert sound
    assert "case 1: step 1 of 21, t = 500 ms of 2 s" in said
    assert "2 cases to go: 40 s" in said
    assert info.find_headline(home).endswith("to 5 (case 4); it still rises at the highest velocity.")


def test_a_sweep_of_curves_has_the_headline_of_each_case(curve: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    home = tmp_path_factory.mktemp("sweep")
    shutil.copytree(curve, home / "cases" / "000")
    (home / "sweep.csv").write_text("case,material.poisson,state\n0,0.5,done\n")
    said, sound = info.describe_path(home)
    assert sound
    assert f"  case 0: {info.find_headline(home / 'cases' / '000')}" in said.splitlines()
    assert "case 0: The highest friction of the curve is 400 ± 40" in said
