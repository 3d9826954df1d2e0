"""Charts of a sweep, as numbers: which key is along x, which rows are a line, where the theory is."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawing import ELASTIC, SPHERE, entries
from legible import assert_legible
from matplotlib.figure import Figure

from parcontact.results import band_charts
from parcontact.results.panels import Line, Panel
from parcontact.results.plots import PlotOptions, plot

SIZES = (1e-3, 2e-3, 3e-3)
RESULTS = ("mu_max", "mu_dyn", "contact_area_corrected")
HEAD = ("case", "a.velocity", "b.velocity", "surface.0.seed", "grid.size", "state", *RESULTS)


def saved(directory: Path, *rows: tuple[Any, ...], head: tuple[str, ...] = (*HEAD, "theory_mu_max")) -> Path:
    with (directory / "sweep.csv").open("w", newline="") as file:
        csv.writer(file).writerows([head, *rows])
    return directory


def case(velocity: float, seed: int, friction: float | str, size: float = 1.0, theory: float = 0.5) -> tuple[Any, ...]:
    return (0, velocity, velocity, seed, size, "done", friction, 0.1, 0.2, theory)


def lines_of(chart: Panel) -> list[Line]:
    """Return the lines of a chart without the entries of its legend."""
    return [one for one in chart.series if one.x.size]


def names_of(chart: Panel) -> list[str]:
    return [one.name for one in chart.series if one.name]


def test_means_over_seeds_with_cases_and_theory(tmp_path: Path) -> None:
    """Cases that are not done yet are left out; keys that move together are one."""
    rows = [case(1.0, 1, 3.0), case(1.0, 2, 5.0), case(20.0, 1, 7.0, theory=0.7), case(20.0, 2, "", theory=0.7)]
    friction, area = band_charts.panels_of_sweep(saved(tmp_path, *rows))
    assert (friction.key, friction.x.name, friction.x.unit, friction.log_x) == ("friction", "velocity", "m/s", True)
    highest, cases, theory, *_ = lines_of(friction)
    assert highest.y.tolist() == [4.0, 7.0]
    assert cases.y.tolist() == [3.0, 5.0, 7.0]
    assert theory.y.tolist() == [0.5, 0.7]
    assert {one.look["color"] for one in (highest, cases, theory)} == {highest.look["color"]}
    assert names_of(friction) == ["highest", "each case", "theory, highest", "dynamic"]
    assert np.allclose(lines_of(area)[0].y, 0.2)


def test_areas_in_a_free_box_are_in_square_metres(tmp_path: Path) -> None:
    """Its size is the user's choice; boxes of several sizes have no common area."""
    (tmp_path / "cases" / "000").mkdir(parents=True)
    sphere = SPHERE.replace("{shape: sphere, radius: 1.0e-2}", "[{shape: sphere, radius: 1.0e-2}]")
    text = f"{sphere}{ELASTIC}history: [{{force: 0.1}}]\ncheckpoint: {{}}\n"  # a box of 4 mm²
    (tmp_path / "cases" / "000" / "job.resolved.yaml").write_text(text)
    rows = [case(velocity, 1, 3.0) for velocity in (1.0, 20.0)]
    _, area = band_charts.panels_of_sweep(saved(tmp_path, *rows))
    assert (area.y.name, area.y.unit) == ("contact area", "m²")
    assert lines_of(area)[0].y.tolist() == pytest.approx([0.8e-6, 0.8e-6])
    _, shares = band_charts.panels_of_sweep(saved(tmp_path, *rows, case(1.0, 1, 3.0, size=2.0)))
    assert np.allclose(lines_of(shares)[0].y, 0.2)


def test_a_second_key_tells_lines_apart(tmp_path: Path) -> None:
    rows = [case(v, 1, 10 * v + size, size) for v in (1.0, 2.0) for size in (1e-3, 2e-3)]
    friction, _ = band_charts.panels_of_sweep(saved(tmp_path, *rows))
    colors = {one.name: one.look["color"] for one in friction.series if one.name.startswith("size")}
    found = {one.look["color"]: one.y.tolist() for one in lines_of(friction) if one.look.get("marker") == "o"}
    assert found == {colors["size 1 mm"]: [10.001, 20.001], colors["size 2 mm"]: [10.002, 20.002]}
    assert not friction.log_x


def test_every_value_of_every_other_key_has_a_line(tmp_path: Path) -> None:
    """Two compounds and two sizes are four lines, each the mean over seeds: a colour for each compound, and dashes for
    each size."""
    head = ("case", "history.0.velocity", "material.include", "surface.0.seed", "grid.size", "state", *RESULTS)
    rows = [
        (0, v, compound, seed, size, "done", 10 * v + seed + friction + 1e3 * size, 0.1, 0.2)
        for v in (1.0, 2.0)
        for compound, friction in (("soft", 0.1), ("hard", 0.2))
        for seed in (1, 3)
        for size in SIZES[:2]
    ]
    friction, _ = band_charts.panels_of_sweep(saved(tmp_path, *rows, head=head))
    looks = {one.name: one.look for one in friction.series if one.name}
    found = {
        (one.look["color"], one.look["linestyle"]): one.y.tolist()
        for one in lines_of(friction)
        if one.look.get("marker") == "o"
    }
    assert found == {
        (looks[compound]["color"], looks[f"size {size} mm"]["linestyle"]): pytest.approx(
            [12.0 + own + size, 22.0 + own + size]
        )
        for compound, own in (("soft", 0.1), ("hard", 0.2))
        for size in (1, 2)
    }


def test_bars_of_errors(tmp_path: Path) -> None:
    """Those of forces and of friction of slides are absolute in the table, those of curves relative: shares here."""
    head = (*HEAD[:2], "state", *RESULTS, "pull_off", "pull_off_error", "mu_dyn_error")
    rows = [(0, v, "done", "", 0.2, 0.0, 1e-3 * v, 1e-4, 0.05) for v in (1.0, 2.0)]
    shares = {
        chart.key: [one.error.tolist() for one in chart.series if one.error is not None]
        for chart in band_charts.panels_of_sweep(saved(tmp_path, *rows, head=head))
    }
    assert shares["friction"] == [pytest.approx([0.25, 0.25])]
    assert shares["pull-off"] == [pytest.approx([0.1, 0.05])]


def test_what_a_sweep_with_adhesion_is_about(tmp_path: Path) -> None:
    """Friction and area that are 0 throughout are not drawn; pull-off, energies and leakage are."""
    head = (*HEAD[:2], "state", *RESULTS, "pull_off", "dissipated", "flow_x", "flow_y")
    rows = [(0, v, "done", "", "", 0.0, 1e-3 * v, 2e-9 * v, 3e-18, 4e-18) for v in (1.0, 2.0)]
    found = {
        chart.key: list(zip(names_of(chart), (one.y.tolist() for one in lines_of(chart)), strict=True))
        for chart in band_charts.panels_of_sweep(saved(tmp_path, *rows, head=head))
    }
    assert found == {
        "pull-off": [("pull-off", [1e-3, 2e-3])],
        "energy": [("dissipated", [2e-9, 4e-9])],
        "leakage": [("along x", [3e-18, 3e-18]), ("along y", [4e-18, 4e-18])],
    }


@pytest.mark.parametrize("rows", [[], [case(1.0, 1, 3.0), case(1.0, 2, 3.0)], [case(1.0, 1, ""), case(2.0, 1, "")]])
def test_nothing_to_draw(tmp_path: Path, rows: list[tuple[Any, ...]]) -> None:
    found = band_charts.panels_of_sweep(saved(tmp_path, *rows))
    assert [chart.key for chart in found] in ([], ["friction", "area"])
    assert all(np.isfinite(one.y).all() for chart in found for one in chart.series)


@pytest.mark.rendered
def test_the_picture(tmp_path: Path) -> None:
    (picture,) = plot([saved(tmp_path, case(1.0, 1, 3.0), case(2.0, 1, 4.0))], PlotOptions())
    assert picture == tmp_path / "picture.png"
    assert picture.stat().st_size > 10_000


def test_one_legend_of_all_panels_is_below_them(tmp_path: Path, drawn: list[Figure]) -> None:
    """Three values of a second key, means, cases and theories of all."""
    head = (*HEAD, "theory_mu_max", "theory_mu_dyn", "theory_contact_area")
    rows = [case(v, seed, v * seed + 1e3 * size, size) for v in (1.0, 2.0) for seed in (1, 2) for size in SIZES]
    plot([saved(tmp_path, *((*row, 0.4, 0.3) for row in rows), head=head)], PlotOptions())
    assert_legible(drawn[0])
    sizes = [name for name in entries(drawn[0]) if name.startswith("size")]
    assert sizes == ["size 1 mm", "size 2 mm", "size 3 mm"]
