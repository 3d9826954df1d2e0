"""The first sentence of a report, from tables whose results are known."""

import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from drawing import ELASTIC, SLIDE, SPHERE, WAVE, ZENER, ran

from parcontact import job
from parcontact.effects.adhesion.results import Columns, PullOff, describe_pull_off, find
from parcontact.errors import InputError
from parcontact.files.hdf5 import cite_lines
from parcontact.job import Stage
from parcontact.results import info, page

ROW = ("time", "distance", "pressure", "friction", "contact_area", "contact_area_corrected", "approach", "max_pressure")


def write(path: Path, head: Sequence[str], *rows: Sequence[object]) -> None:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([head, *rows])


def replace_rows(out: Path, *rows: Sequence[float]) -> None:
    """Put made-up rows in place of those of a run, with an error of 10 % of friction and of 5 % of the area."""
    head = ("step", *ROW, "error_friction", "error_area")
    write(out / "measures.csv", head, *([step, *row, 0.1, 0.05] for step, row in enumerate(rows)))


def test_a_slide(tmp_path: Path) -> None:
    """Friction of 0.2 but for one row; its error is 10 % of it, that of an area of 0.5 is 5 % of this."""
    out = ran(tmp_path, WAVE + ZENER + SLIDE)
    assert f'<p class="headline">{page.whole_numbers(info.find_headline(out))}</p>' in page.render([out])
    ways = [k * 5.0e-5 for k in range(21)]
    replace_rows(out, *((way / 0.1, way, 1.0e3, 0.4 if k == 2 else 0.2, 0.5, 0.5, 0, 1) for k, way in enumerate(ways)))
    friction = "The mean friction is 0.200 ± 0.020 and the highest 0.400 ± 0.0"
    stated = info.find_headline(out)
    assert stated.startswith(friction)
    assert stated.endswith("; the mean contact area is 50.0 ± 2.5 % of the nominal area.")


def test_a_press(tmp_path: Path) -> None:
    """No friction is named where nothing slides. The area is Hertz's, within twice the estimate of its error."""
    stated = info.find_headline(ran(tmp_path, SPHERE + ELASTIC + "history: [{force: 0.1}]\n"))
    found = re.fullmatch(r"The contact area is ([\d.]+) ± ([\d.]+) mm² at 100 mN\.", stated)
    assert found
    radius = (3 * 0.1 * 1.0e-2 / (4 * 4.0e6)) ** (1 / 3)  # E* = 4 G of an incompressible body
    assert float(found[1]) == pytest.approx(1e6 * np.pi * radius**2, abs=2 * float(found[2]))


def test_a_pull_off_is_stated_with_the_area_at_it(tmp_path: Path) -> None:
    """The last load is 0 and nothing touches. The box has 4 mm². The parabola through 2, -3 and -2.5 Pa is lowest at
    -3 - 2.25^2/11 Pa; the tolerance adds 0.25 of 0.5 %, and the error of the area of 5 % 0.15 of it. Cells are much
    shorter than the process zone."""
    adhesion = "adhesion: {work: 0.01, range: 1.0e-5}\n"
    out = ran(tmp_path, WAVE + ELASTIC + adhesion + "history: [{pressure: 1.0e3}, {pressure: 2.0e3}]\n")
    loads, areas = [2.0, -3.0, -2.5, 0.0], [0.3, 0.2, 0.1, 0.0]
    rows = zip(range(4), loads, areas, strict=True)
    replace_rows(out, *((float(k), 0, load, 0, area, area, -k * 1e-6, 9) for k, load, area in rows))
    force = "The pull-off force is 13.8 ± 2.0 µN"
    assert info.find_headline(out) == f"{force}; the contact area is 20.0 ± 1.0 % of the nominal area at t = 1 s."


def test_leakage_with_its_error(tmp_path: Path) -> None:
    out = ran(tmp_path, WAVE + ELASTIC + "history: [{pressure: 1.0e3}]\n")
    write(out / "leak.csv", ("time", "flow_x", "flow_y", "error_x", "error_y"), (0, 2e-18, 0, 0.1, "nan"))
    flow = "The conductivity of the gap is 2.00e-18 ± 2.0e-19 m³ along x; contact closes the gap along y; "
    assert info.find_headline(out).startswith(flow)


def test_curves_sweeps_and_studies(tmp_path: Path) -> None:
    write(tmp_path / "steady.csv", ("velocity", "pressure", "friction"), (0.1, 1e5, 0.2), (1.0, 2e5, 0.1))
    assert info.find_headline(tmp_path) == "The highest friction of the curve is 0.2, at 100 mm/s and 100 kPa."
    (tmp_path / "steady.csv").unlink()
    head = ("case", "history.0.velocity", "state", "mu_max", "mu_dyn", "mu_dyn_error")
    write(tmp_path / "sweep.csv", head, (0, 0.1, "done", 0.3, 0.2, 0.02), (1, 1.0, "done", 0.2, 0.1, ""))
    swept = "The mean friction of the cases is from 0.1 (case 1) to 0.200 ± 0.020 (case 0)."
    assert info.find_headline(tmp_path) == swept
    write(tmp_path / "study.csv", ("mesh",), (64,))
    limits = [f"{name} with exponential, mesh alone: 0.25 ± 0.01 (4 %), order 2" for name in ("mu_max", "mu_dyn")]
    lines = ["the time steps of press are chosen in every case", *limits, "for 1 %: mesh 64"]
    (tmp_path / "study.txt").write_text("".join(f"{line}\n" for line in lines))
    assert info.find_headline(tmp_path) == f"The study finds {limits[1]}."
    assert not info.find_headline(tmp_path / "nowhere")


# -- `parcontact info`: what it says of friction ----------------------------------------------------------------------


@pytest.mark.parametrize(("history", "stated"), [(SLIDE, True), ("history: [{pressure: 1.0e3}]\n", False)])
def test_friction_is_stated_where_something_slides(tmp_path: Path, history: str, stated: bool) -> None:
    said, sound = info.describe_path(ran(tmp_path, WAVE + ZENER + history))
    assert sound
    assert "last row: pressure 1 kPa, " in said
    assert (", friction " in said) == stated


# -- the references of a run follow from its job ----------------------------------------------------------------------

JOB: dict[str, Any] = {
    "grid": {"points": 64, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 1e-7, "waves": [1, 1]},
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e3, "duration": 1e-3}],
}


def test_what_to_cite(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no run"):
        info.describe_citations(tmp_path)
    data = {**JOB, "grid": {**JOB["grid"], "boundary": "free"}, "surface": {"shape": "sphere", "radius": 1e-2}}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**data, "material": {"model": "elastic", "shear_modulus": 1e6}}))
    (tmp_path / "job.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    elastic = info.describe_citations(tmp_path)
    assert "Love" in elastic
    assert "Bugnicourt" not in elastic
    assert "Persson" not in elastic
    (tmp_path / "theory.csv").touch()
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    (tmp_path / "job.resolved.yaml").write_text(job.load(tmp_path / "job.yaml").resolved())
    rubber = info.describe_citations(tmp_path)
    assert "Love" not in rubber
    assert "Bugnicourt" in rubber
    assert "Persson" in rubber
    assert "Taylor" in rubber
    for name, cited in (("map.x3p", True), ("map.npy", False)):  # SurfaceTopography reads the first
        measured = yaml.safe_load(job.load(tmp_path / "job.yaml").resolved())
        lines = cite_lines({**measured, "surface": [{"shape": "topography", "path": name}]})
        assert any("Röttger" in line for line in lines) == cited


# -- results of Persson's theory and of a run, from tables whose means are known --------------------------------------

LONG_SLIDE = Stage.model_validate({"pressure": 1.0, "velocity": 1.0, "duration": 4.0, "time_step": 1.0})
HEAD = "time,distance,friction,contact_area"


def write_table(path: Path, head: str, *rows: str) -> None:
    path.write_text("\n".join([head, *rows, ""]))


def test_both_are_measured_alike_and_the_area_is_the_corrected_one(tmp_path: Path) -> None:
    """Constant friction after a peak: the mean over the last three quarters, 1 m to 4 m, is that constant exactly."""
    write_table(tmp_path / "theory.csv", HEAD, "0,0,0,0.5", "1,1,0.2,0.25", "4,4,0.2,0.25")
    assert list(info.describe_theory(tmp_path, [LONG_SLIDE], 1.0)) == [
        "Persson's theory predicts mu_max 0.2, mu_dyn 0.2, contact area 0.25"
    ]
    write_table(
        tmp_path / "measures.csv", f"{HEAD},contact_area_corrected", "0,0,0,1,1", "1,1,0.4,0.75,0.5", "4,4,0.4,0.75,0.5"
    )
    assert info.compare_with_theory(tmp_path, [LONG_SLIDE], 1.0) == [
        ("mu_max", pytest.approx(0.2), pytest.approx(0.4), math.nan),
        ("mu_dyn", pytest.approx(0.2), pytest.approx(0.4), math.nan),
        ("contact area", pytest.approx(0.25), pytest.approx(0.5), math.nan),
    ]


def test_errors_of_the_run_follow_its_results(tmp_path: Path) -> None:
    """10 % of the constant friction, and 4 % of the constant area."""
    write_table(tmp_path / "theory.csv", HEAD, "0,0,0,0.5", "1,1,0.2,0.25", "4,4,0.2,0.25")
    head = f"{HEAD},contact_area_corrected,error_friction,error_area"
    rows = "1,1,0.4,0.75,0.5,0.1,0.04", "4,4,0.4,0.75,0.5,0.1,0.04"
    write_table(tmp_path / "measures.csv", head, "0,0,0,1,1,,", *rows)
    assert list(info.describe_theory(tmp_path, [LONG_SLIDE], 1.0)) == [
        "Persson's theory predicts mu_max 0.2 (run: 0.400 ± 0.040), mu_dyn 0.2 (run: 0.400 ± 0.040), "
        "contact area 0.25 (run: 0.500 ± 0.020)"
    ]


def test_nothing_slides_or_nothing_was_predicted(tmp_path: Path) -> None:
    assert info.compare_with_theory(tmp_path, [LONG_SLIDE], 1.0) == []
    rest = Stage.model_validate({"pressure": 1.0, "duration": 1.0})
    write_table(tmp_path / "theory.csv", HEAD, "0,0,0,0", "1,0,0,0.3")
    assert info.compare_with_theory(tmp_path, [rest], 1.0) == [("contact area", 0.3, None, math.nan)]


# -- pull-offs from made-up rows: of pulls by approach and by load, of several, of a contact that holds ---------------


AREA_ERROR = 0.1
MESH = 0.15 * AREA_ERROR  # relative, of the pull-off


def table(*rows: tuple[float, float, float]) -> Columns:
    """Pressure, approach and area, a row a second."""
    pressure, approach, area = (list(column) for column in zip(*rows, strict=True))
    highest = [abs(each) + 1.0 for each in pressure]
    found = {"pressure": pressure, "approach": approach, "contact_area": area, "max_pressure": highest}
    return {"time": [float(row) for row in range(len(rows))], "error_area": [AREA_ERROR] * len(rows), **found}


def where(columns: Columns, detached: bool = False) -> list[tuple[int, int | None]]:
    """Rows of pull-offs, and of their ends."""
    return [(pull.row, pull.lost) for pull in find(columns, detached)]


NEAR = [
    (0.0, -5e-6, 0.0),
    (-9.0, -1e-6, 0.0),
    (-1.0, 0.0, 0.1),
    (2.0, 1e-6, 0.3),
]  # they pull hardest before they touch
PULL = [(-3.0, -1e-6, 0.2), (-2.5, -2e-6, 0.1)]
OFF = [(-0.5, -3e-6, 0.0), (-0.1, -5e-6, 0.0)]


def test_by_approach() -> None:
    """Loads of 2, -3 and -2.5 Pa have a parabola of 2.75 t^2 - 2.25 t - 3 Pa, whose vertex is 2.25^2/11 Pa lower."""
    rows = table(*NEAR, *PULL, *OFF)
    (pull,) = find(rows)
    below = 2.25**2 / 11.0
    assert (pull.row, pull.lost) == (4, 6)
    assert (pull.pressure, pull.between) == pytest.approx((-3.0 - below, below), rel=1e-14)
    text = "pull-off: 1.73 N (3.46 Pa), at t = 4 s, approach -1 µm; its error is 260 mN"
    assert list(describe_pull_off(find(rows), rows, 0.5, 1e-9)) == [f"{text}, and contact was lost by t = 6 s"]


@pytest.mark.parametrize("before", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("late", [-0.3, 0.0, 0.4])
def test_the_vertex_of_a_parabola(before: float, late: float) -> None:
    """Loads on a parabola give its lowest value from steps of any lengths. Their error is 0.25 of the tolerance, and
    0.15 of the median error of the area up to the lowest load, where one is known."""
    time = np.array([-before - 1.0, -before, 0.0, 1.0, 2.0])
    pressure = (0.5 * (time - late) ** 2 - 7.0).tolist()
    row = int(np.argmin(pressure))
    found = {"time": time.tolist(), "pressure": pressure, "max_pressure": [9.0] * 5, "approach": (-time).tolist()}
    found |= {"contact_area": [0.3, 0.2, 0.1, 0.0, 0.0]}
    (pull,) = find({**found, "error_area": [math.nan, 0.2, 0.2, 0.9, 0.9]})
    (unknown,) = find({**found, "error_area": [math.nan] * 5})
    assert pull.pressure == pytest.approx(-7.0, rel=1e-14)
    assert pull.between == pytest.approx(pressure[row] + 7.0, abs=1e-14)
    assert pull.error(0.02) == pytest.approx(pull.between + (0.25 * 0.02 + 0.15 * 0.2) * 7.0, rel=1e-12)
    assert math.isnan(unknown.error(0.02))


def test_a_contact_that_snaps() -> None:
    """No parabola is near a load of which more than half is lost at once; the step before says what is left open."""
    rows = table(*NEAR, (-2.9, -1e-6, 0.2), (-3.0, -1e-6, 0.2), *OFF)
    (pull,) = find(rows)
    assert pull == (5, -3.0, pytest.approx(0.1), 6, MESH)


def test_surfaces_that_pull_hardest_when_they_have_come_off() -> None:
    """A stiff sphere pulls so: its lowest load is behind the end of contact, but not on the way back."""
    rows = table(*NEAR, *PULL, (-4.0, -3e-6, 0.0), (-2.0, -4e-6, 0.0), (-6.0, -3e-6, 0.0))
    assert where(rows) == [(6, 6)]


def test_a_contact_under_tension_throughout() -> None:
    """Its load is highest at the end of the pull, where little still holds."""
    under_tension = [(-1.0, -1e-6, 0.1), (-2.0, 0.0, 0.3), *PULL, (-0.5, -3e-6, 0.05)]
    assert where(table(*under_tension, *OFF)) == [(2, 5)]
    assert find(table(*under_tension)) == [PullOff(2, -3.0, 1.0, None, MESH)]


def test_under_a_load() -> None:
    """The load before the last one that held says what is left open: open surfaces carry none."""
    rows = table(*NEAR, *PULL, (0.0, -5e-6, 0.0), (0.0, -5e-6, 0.0))
    assert where(rows) == [(4, 6)]
    rows = table(*NEAR[:-1], (-2.0, 0.0, 0.1), (-2.5, 0.0, 0.1), (0.0, -5e-6, 0.0))
    assert find(rows) == [PullOff(4, -2.5, 0.5, 5, MESH)]


def test_flat_surfaces_are_pulled_at_no_approach() -> None:
    rows = table((0.0, 0.0, 1.0), (-2.0, -0.0, 1.0))
    (text,) = describe_pull_off(find(rows), rows, 1.0, 1e-9)
    assert "approach 0 m" in text


def test_two_pulls() -> None:
    rows = table(*NEAR, *PULL, *OFF, *NEAR, (-2.0, 0.0, 0.1), *OFF)
    assert where(rows) == [(4, 6), (12, 13)]
    assert [text.split(":")[0] for text in describe_pull_off(find(rows), rows, 1.0, 1e-9)] == [
        "pull-off 1",
        "pull-off 2",
    ]


def test_a_pull_that_was_held_is_no_pull_off() -> None:
    """Rubber holds a fast pull, and detaches slowly under less."""
    again = [(-8.0, -1e-6, 0.2), (1.0, 0.0, 0.2), *PULL]
    assert where(table(*NEAR, *again, *OFF)) == [(6, 8)]
    assert find(table(*NEAR, *again)) == [PullOff(4, -8.0, 10.0, None, MESH)]


def test_a_contact_that_holds_has_none() -> None:
    rows = table(*NEAR, *PULL)
    (held,) = describe_pull_off(find(rows), rows, 0.5, 1e-9)
    assert held == "largest pull so far: 1.5 N (3 Pa), at t = 4 s, approach -1 µm; contact holds"


def test_a_run_that_ended_with_its_contact_has_one() -> None:
    """The load after the last row was held by nothing."""
    rows = table(*NEAR, (-2.0, -1e-6, 0.2), (-2.25, -1e-6, 0.2))
    assert find(rows, detached=True) == [PullOff(5, -2.25, 0.25, 6, MESH)]
    (reported,) = describe_pull_off(find(rows, detached=True), rows, 1.0, 1e-9)
    assert reported.endswith("its error is 280 mN, and the next load had no equilibrium")


def test_nothing_is_said_without_a_pull() -> None:
    assert find(table((0.0, 0.0, 0.0), (2.0, 1e-6, 0.1), (0.0, 0.0, 0.0))) == []
    assert find(table(*NEAR[:2])) == []
    assert find(table((0.0, 0.0, 0.0), (-1e-12, 0.0, 0.1), (-2e-12, 0.0, 0.1))) == []  # rounding of no load
