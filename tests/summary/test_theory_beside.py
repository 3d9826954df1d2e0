"""Results of Persson's theory and of a run, from tables whose means are known."""

import math
from pathlib import Path

import pytest

from parcontact.job import Stage
from parcontact.summary import theory_beside

SLIDE = Stage.model_validate({"pressure": 1.0, "velocity": 1.0, "duration": 4.0, "time_step": 1.0})
HEAD = "time,distance,friction,contact_area"


def write(path: Path, head: str, *rows: str) -> None:
    path.write_text("\n".join([head, *rows, ""]))


def test_both_are_measured_alike_and_the_area_is_the_corrected_one(tmp_path: Path) -> None:
    """Constant friction after a peak: the mean over the last three quarters, 1 m to 4 m, is that constant exactly."""
    write(tmp_path / "theory.csv", HEAD, "0,0,0,0.5", "1,1,0.2,0.25", "4,4,0.2,0.25")
    assert list(theory_beside.describe(tmp_path, [SLIDE], 1.0)) == [
        "Persson's theory predicts mu_max 0.2, mu_dyn 0.2, contact area 0.25"
    ]
    write(
        tmp_path / "measures.csv", f"{HEAD},contact_area_corrected", "0,0,0,1,1", "1,1,0.4,0.75,0.5", "4,4,0.4,0.75,0.5"
    )
    assert theory_beside.compare(tmp_path, [SLIDE], 1.0) == [
        ("mu_max", pytest.approx(0.2), pytest.approx(0.4), math.nan),
        ("mu_dyn", pytest.approx(0.2), pytest.approx(0.4), math.nan),
        ("contact area", pytest.approx(0.25), pytest.approx(0.5), math.nan),
    ]


def test_errors_of_the_run_stand_beside_its_results(tmp_path: Path) -> None:
    """10 % of the constant friction, and 4 % of the constant area."""
    write(tmp_path / "theory.csv", HEAD, "0,0,0,0.5", "1,1,0.2,0.25", "4,4,0.2,0.25")
    head = f"{HEAD},contact_area_corrected,error_friction,error_area"
    rows = "1,1,0.4,0.75,0.5,0.1,0.04", "4,4,0.4,0.75,0.5,0.1,0.04"
    write(tmp_path / "measures.csv", head, "0,0,0,1,1,,", *rows)
    assert list(theory_beside.describe(tmp_path, [SLIDE], 1.0)) == [
        "Persson's theory predicts mu_max 0.2 (run: 0.400 ± 0.040), mu_dyn 0.2 (run: 0.400 ± 0.040), "
        "contact area 0.25 (run: 0.500 ± 0.020)"
    ]


def test_nothing_slides_or_nothing_was_predicted(tmp_path: Path) -> None:
    assert theory_beside.compare(tmp_path, [SLIDE], 1.0) == []
    rest = Stage.model_validate({"pressure": 1.0, "duration": 1.0})
    write(tmp_path / "theory.csv", HEAD, "0,0,0,0", "1,0,0,0.3")
    assert theory_beside.compare(tmp_path, [rest], 1.0) == [("contact area", 0.3, None, math.nan)]
