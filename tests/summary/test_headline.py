"""The first sentence of a report, from tables whose results are known."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from drawing import ELASTIC, SLIDE, SPHERE, WAVE, ZENER, ran

from parcontact.report import page
from parcontact.summary import headline

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
    assert f'<p class="headline">{headline.describe(out)}</p>' in page.render([out])
    ways = [k * 5.0e-5 for k in range(21)]
    replace_rows(out, *((way / 0.1, way, 1.0e3, 0.4 if k == 2 else 0.2, 0.5, 0.5, 0, 1) for k, way in enumerate(ways)))
    friction = "The mean friction is 0.200 ± 0.020 and the highest 0.400 ± 0.0"
    told = headline.describe(out)
    assert told.startswith(friction)
    assert told.endswith("; the mean contact area is 50.0 ± 2.5 % of the nominal area.")


def test_a_press(tmp_path: Path) -> None:
    """No friction is named where nothing slides. The area is Hertz's, within twice the estimate of its error."""
    told = headline.describe(ran(tmp_path, SPHERE + ELASTIC + "history: [{force: 0.1}]\n"))
    found = re.fullmatch(r"The contact area is ([\d.]+) mm² ± ([\d.]+) mm² at 100 mN\.", told)
    assert found
    radius = (3 * 0.1 * 1.0e-2 / (4 * 4.0e6)) ** (1 / 3)  # E* = 4 G of an incompressible body
    assert float(found[1]) == pytest.approx(1e6 * np.pi * radius**2, abs=2 * float(found[2]))


def test_a_pull_off_is_told_with_the_area_at_it(tmp_path: Path) -> None:
    """The last load is 0 and nothing touches. The box has 4 mm²."""
    out = ran(tmp_path, WAVE + ELASTIC + "history: [{pressure: 1.0e3}, {pressure: 2.0e3}]\n")
    loads, areas = [2.0, -3.0, -2.5, 0.0], [0.3, 0.2, 0.1, 0.0]
    rows = zip(range(4), loads, areas, strict=True)
    replace_rows(out, *((float(k), 0, load, 0, area, area, -k * 1e-6, 9) for k, load, area in rows))
    force = "The pull-off force is 12 µN ± 20 µN"
    assert headline.describe(out) == f"{force}; the contact area is 20.0 ± 1.0 % of the nominal area at t = 1 s."


def test_leakage_with_its_error(tmp_path: Path) -> None:
    out = ran(tmp_path, WAVE + ELASTIC + "history: [{pressure: 1.0e3}]\n")
    write(out / "leak.csv", ("time", "flow_x", "flow_y", "error_x", "error_y"), (0, 2e-18, 0, 0.1, "nan"))
    flow = "The conductivity of the gap is 2.00e-18 ± 2.0e-19 m³ along x and 0 along y, where contact closes the gap; "
    assert headline.describe(out).startswith(flow)


def test_curves_sweeps_and_studies(tmp_path: Path) -> None:
    write(tmp_path / "steady.csv", ("velocity", "pressure", "friction"), (0.1, 1e5, 0.2), (1.0, 2e5, 0.1))
    assert headline.describe(tmp_path) == "The highest friction of the curve is 0.2, at 100 mm/s and 100 kPa."
    (tmp_path / "steady.csv").unlink()
    head = ("case", "history.0.velocity", "state", "mu_max", "mu_dyn", "mu_dyn_error")
    write(tmp_path / "sweep.csv", head, (0, 0.1, "done", 0.3, 0.2, 0.02), (1, 1.0, "done", 0.2, 0.1, ""))
    (tmp_path / "study.txt").write_text("for 1 %: mesh 64\n")
    swept = "The mean friction of the cases is from 0.1 (case 1) to 0.200 ± 0.020 (case 0)."
    assert headline.describe(tmp_path) == f"{swept} for 1 %: mesh 64"
    assert not headline.describe(tmp_path / "nowhere")
