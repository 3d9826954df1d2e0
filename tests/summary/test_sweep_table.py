"""Tables of a sweep, from what its cases have left in their directories."""

import math
from pathlib import Path

import numpy as np
import pytest
from sweeping import JOB, table

from parcontact.__main__ import main
from parcontact.files import sweep, tables
from parcontact.job import Case, load_cases
from parcontact.results import band_charts, results


@pytest.fixture
def cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Case, ...]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(JOB)
    return load_cases("job.yaml")


def test_before_a_slide_no_error_of_friction_is_stated(cases: tuple[Case, ...]) -> None:
    """There is no friction to be stated then; the residual is the worst of all rows."""
    directory = cases[0].job.output.directory
    directory.mkdir(parents=True)
    head = "step,time,distance,friction,contact_area,residual,seconds,error_friction,contact_area_corrected"
    (directory / "measures.csv").write_text(f"{head}\n0,0,0,0.1,0.2,2e-5,0.5,,0.1\n1,1,0,0.1,0.2,1e-5,0.25,3e-3,0.15\n")
    sweep.write_sweep_tables(Path("out/job"), cases)
    row = table()[0]
    assert [row[name] for name in ("residual", "error_friction", "error_area")] == ["2e-05", "", ""]
    assert (row["state"], row["seconds"], row["mu_max"]) == ("begun", "0.75", "")
    assert [row[name] for name in ("contact_area", "contact_area_corrected")] == ["0.2", "0.15"]


def test_errors_are_those_of_the_slide(cases: tuple[Case, ...]) -> None:
    """For which its friction and area stand: neither of the press before it nor of the rest after it. They are means
    over the distance slid, of friction in proportion to it, as at the end of a run: 0.1 and 0.3 over half of it each.
    """
    first = cases[0].job
    press = first.history[0].model_copy(update={"velocity": (0.0, 0.0), "distance": None, "duration": 1.0})
    slide = press.model_copy(update={"velocity": (1e-3, 0.0)})
    changed = cases[0]._replace(job=first.model_copy(update={"history": (press, slide, press)}))
    changed.job.output.directory.mkdir(parents=True)
    head = "step,time,distance,friction,contact_area,residual,seconds,error_friction,error_area"
    errors = [("", ""), ("0.9", "0.8"), ("0.02", "0.03"), ("0.01", "0.04"), ("0.7", "0.6")]
    instants = [(0.0, 0.0), (1.0, 0.0), (1.5, 5e-4), (2.0, 1e-3), (3.0, 1e-3)]
    lines = [
        f"{step},{time},{distance},{0.3 if step == 3 else 0.1},0.2,1e-5,1.0,{friction},{area}"
        for step, ((time, distance), (friction, area)) in enumerate(zip(instants, errors, strict=True))
    ]
    (changed.job.output.directory / "measures.csv").write_text("\n".join([head, *lines, ""]))
    sweep.write_sweep_tables(Path("out/job"), (changed,))
    found = [float(table()[0][name]) for name in ("error_friction", "error_area")]
    assert found == pytest.approx([(0.1 * 0.02 + 0.3 * 0.01) / 0.4, 0.035], rel=1e-9)


def test_points_of_curves_and_their_means_over_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A point is the same in all curves, whatever the rounding of the load that it was solved under."""
    monkeypatch.chdir(tmp_path)
    curve = "steady: {velocities: [0.1, 1.0], pressures: [1.0e+4]}\n"
    Path("job.yaml").write_text(JOB[: JOB.index("history:")] + curve + "sweep: [{surface.seed: [1, 2, 3]}]\n")
    cases = load_cases(Path("job.yaml"))
    for case, friction in zip(cases, (0.1, 0.2, 0.6), strict=True):
        case.job.output.directory.mkdir(parents=True)
        rows = f"0.1,{1e4 * (1 + case.number * 1e-15)!r},{friction},0.5\n1.0,1e4,{friction / 2},0.25\n"
        text = "velocity,pressure,friction,contact_area_corrected\n" + rows
        (case.job.output.directory / "steady.csv").write_text(text)
    sweep.write_sweep_tables(Path("out/job"), cases)
    points, means = table("sweep_curves.csv"), table("sweep_curves_mean.csv")
    assert [(row["surface.seed"], row["velocity"], row["friction"]) for row in points[2:4]] == [
        ("2", "0.1", "0.2"),
        ("2", "1.0", "0.1"),
    ]
    assert [(row["velocity"], row["pressure"], row["number"]) for row in means] == [
        ("0.1", "10000.0", "3"),
        ("1.0", "10000.0", "3"),
    ]
    assert [float(row["friction_mean"]) for row in means] == pytest.approx([0.3, 0.15], rel=1e-12)
    assert float(means[0]["friction_std"]) == pytest.approx(0.07**0.5, rel=1e-12)
    assert not Path("out/job/sweep_mean.csv").exists()
    chart, _ = band_charts.panels_of_sweep(Path("out/job"))
    mean, each = (one for one in chart.series if one.x.size)  # the others are entries of the legend
    assert (chart.x.name, mean.x.tolist(), each.x.size) == ("velocity", [0.1, 1.0], 6)
    assert mean.y.tolist() == pytest.approx([0.3, 0.15], rel=1e-12)


@pytest.mark.parametrize(
    ("text", "state"),
    [
        ("velocity,pressure,friction\n0.1,1e4,0.1\n1.0,1e4,0.1\n", "done"),
        ("velocity,pressure,friction\n0.1,1e4,0.1\n1.0,1e4,x\n", "damaged"),
        ("velocity,pressure,friction\n0.1,1e4\n", "damaged"),
        ("elocity,pressure,friction\n0.1,1e4,0.1\n", "damaged"),
    ],
)
def test_a_damaged_table_concerns_its_case_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, state: str
) -> None:
    """The tables of the sweep are written, and the case is still to do."""
    monkeypatch.chdir(tmp_path)
    curve = "steady: {velocities: [0.1, 1.0], pressures: [1.0e+4]}\n"
    Path("job.yaml").write_text(JOB[: JOB.index("history:")] + curve + "sweep: [{surface.seed: [1, 2]}]\n")
    cases = load_cases(Path("job.yaml"))
    sound = "velocity,pressure,friction\n0.1,1e4,0.1\n1.0,1e4,0.1\n"
    for case, lines in zip(cases, (text, sound), strict=True):
        case.job.output.directory.mkdir(parents=True)
        (case.job.output.directory / "steady.csv").write_text(lines)
    sweep.write_sweep_tables(Path("out/job"), cases)
    assert [row["state"] for row in table()] == [state, "done"]
    assert {row["case"] for row in table("sweep_curves.csv")} == ({"0", "1"} if state == "done" else {"1"})
    assert len(sweep.to_do(cases, afresh=False)) == (state != "done")


def test_so_does_a_table_without_a_column(cases: tuple[Case, ...]) -> None:
    for case, name in zip(cases, ("contact_area", "area"), strict=False):
        case.job.output.directory.mkdir(parents=True)
        head = f"step,time,distance,friction,{name},residual,seconds"
        rows = "0,0,0,0,0,0,0\n1,1,0,0.1,0.2,2e-5,0.5\n"
        (case.job.output.directory / "measures.csv").write_text(f"{head}\n{rows}")
    sweep.write_sweep_tables(Path("out/job"), cases)
    assert [(row["state"], row["contact_area"]) for row in table()[:2]] == [("begun", "0.2"), ("damaged", "")]


def test_lines_of_curves_differ_in_all_that_is_no_sample(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two pressures and two moduli make four lines over the velocity, each the mean over two seeds."""
    monkeypatch.chdir(tmp_path)
    curve = "steady: {velocities: [0.1, 1.0], pressures: [1.0e+4, 2.0e+4]}\n"
    swept = "sweep: [{material.modulus_inf: [2.0e+5, 3.0e+5]}, {surface.seed: [1, 2]}]\n"
    Path("job.yaml").write_text(JOB[: JOB.index("history:")] + curve + swept)
    cases = load_cases(Path("job.yaml"))
    for case in cases:
        case.job.output.directory.mkdir(parents=True)
        rows = [f"{v},{p},{case.number + p / 1e5 + v},0.5" for p in (1e4, 2e4) for v in (0.1, 1.0)]
        text = "\n".join(["velocity,pressure,friction,contact_area", *rows, ""])
        (case.job.output.directory / "steady.csv").write_text(text)
    sweep.write_sweep_tables(Path("out/job"), cases)
    series = band_charts.panels_of_sweep(Path("out/job"))[0].series
    dashes = {one.name: one.look["linestyle"] for one in series if one.name.startswith("modulus inf")}
    colors = {one.name: one.look["color"] for one in series if one.name.endswith("kPa") and one.name not in dashes}
    found = {
        (one.look["color"], one.look["linestyle"]): one.y.tolist() for one in series if one.look.get("marker") == "o"
    }
    assert found == {
        (colors[f"{p:.0f} kPa"], dashes[f"modulus inf {m:.0f} kPa"]): pytest.approx(
            [mean + p / 100 + v for v in (0.1, 1.0)]
        )
        for m, mean in ((200, 0.5), (300, 2.5))
        for p in (10, 20)
    }


def test_errors_of_the_highest_and_the_mean_friction(cases: tuple[Case, ...]) -> None:
    """The highest friction, 0.3, has the error of its own step, and the mean of 0.3 and 0.2 that of both. No step is
    shorter than a cell, so there is no ripple."""
    slide = cases[0].job.history[-1]
    changed = cases[0]._replace(job=cases[0].job.model_copy(update={"history": (slide,)}))
    changed.job.output.directory.mkdir(parents=True)
    head = "step,time,distance,friction,contact_area,residual,seconds,error_friction,error_area"
    way = slide.seconds * slide.velocity[0]
    rows = [(0, 0.0, 0.0, 0.0, ""), (1, 0.25, 0.25, 0.3, "0.1"), (2, 1.0, 1.0, 0.2, "0.3")]
    lines = [f"{k},{t * slide.seconds},{x * way},{mu},0.2,1e-5,1.0,{error},0.1" for k, t, x, mu, error in rows]
    (changed.job.output.directory / "measures.csv").write_text("\n".join([head, *lines, ""]))
    sweep.write_sweep_tables(Path("out/job"), (changed,))
    row = table()[0]
    found = [float(row[name]) for name in ("mu_max", "mu_max_error", "mu_dyn", "mu_dyn_error")]
    assert found == pytest.approx([0.3, 0.03, 0.25, (0.03 + 0.06) / 2], rel=1e-9)


def test_sweep_table_has_theory_of_all_cases(cases: tuple[Case, ...]) -> None:
    for case in cases[:2]:
        directory = case.job.output.directory
        directory.mkdir(parents=True)
        text = "time,distance,pressure,friction,contact_area\n0.0,0.0,1e5,0.0,0.1\n0.001,0.0,1e5,0.0,0.2\n"
        (directory / "theory.csv").write_text(f"{text}0.051,0.0005,1e5,0.02,0.3\n")
    sweep.write_sweep_tables(Path("out/job"), cases)
    assert [row["theory_mu_max"] for row in table()] == ["0.02", "0.02", "", "", "", ""]
    assert [row["mu_max"] for row in table()] == [""] * 6


def test_pull_offs_of_cases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A case that ends as its surfaces detach is done, and has its pull-off; one that holds is done without."""
    monkeypatch.chdir(tmp_path)
    pull = "{force: {from: 0.0, to: -6.0e-4}, duration: 1.0, time_step: 0.1}"
    lines = (
        "grid: {points: 24, size: 4.0e-4, boundary: free}",
        "surface: {shape: sphere, radius: 2.0e-3}",
        "material: {model: elastic, shear_modulus: 0.3e6}",
        f"adhesion: {{work: 0.05, range: 2.0e-6}}\nhistory: [{{force: 0.0, duration: 1.0}}, {pull}]",
        "sweep: {adhesion.work: [0.05, 0.1]}\nnumerics: {accuracy: 0.1}\noutput: {energy: true}\nleakage: {}\n",
    )
    Path("pulls.yaml").write_text("\n".join(lines))
    assert main(["pulls.yaml", "--quiet"]) == 0
    came_off, holds = results.read_cases(Path("out/pulls/sweep.csv"))
    rows = tables.read_columns(Path("out/pulls/cases/000/measures.csv"))
    assert came_off["state"] == holds["state"] == "done"
    assert came_off["pull_off"] == pytest.approx(-min(rows["pressure"]) * 4e-4**2, rel=1e-15)
    assert came_off["pull_off_approach"] == rows["approach"][-1]
    assert math.isnan(holds["pull_off"])
    k = int(np.argmin(rows["pressure"]))
    before, last = rows["pressure"][k - 1 :]
    known = [error for error in rows["error_area"][: k + 1] if not math.isnan(error)]
    zone = 1.2e6 * 2.0e-6**2 / 0.05  # [m], of cells of 4e-4/24 m
    mesh = 2.2 * (0.15 * float(np.median(known)) + 0.03 * (4.0e-4 / 24 / zone) ** 4)  # the sphere is in the middle
    share = mesh + 0.25 * 0.05  # 0.05 is the tolerance
    error = before - last - share * last
    assert came_off["pull_off_error"] == pytest.approx(error * 4e-4**2, rel=1e-12)
    for case, number in ((came_off, 0), (holds, 1)):
        rows = tables.read_columns(Path(f"out/pulls/cases/00{number}/measures.csv"))
        assert case["dissipated"] == rows["dissipated"][-1]
        assert case["flow_x"] == rows["flow_x"][-1] > 0.0
