"""Results of Persson's theory and of a run, from tables whose means are known."""

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
    assert list(theory_beside.describe(tmp_path, [SLIDE])) == [
        "Persson's theory predicts mu_max 0.2, mu_dyn 0.2, contact area 0.25"
    ]
    write(
        tmp_path / "measures.csv", f"{HEAD},contact_area_corrected", "0,0,0,1,1", "1,1,0.4,0.75,0.5", "4,4,0.4,0.75,0.5"
    )
    assert theory_beside.compare(tmp_path, [SLIDE]) == [
        ("mu_max", pytest.approx(0.2), pytest.approx(0.4)),
        ("mu_dyn", pytest.approx(0.2), pytest.approx(0.4)),
        ("contact area", pytest.approx(0.25), pytest.approx(0.5)),
    ]


def test_nothing_slides_or_nothing_was_predicted(tmp_path: Path) -> None:
    assert theory_beside.compare(tmp_path, [SLIDE]) == []
    rest = Stage.model_validate({"pressure": 1.0, "duration": 1.0})
    write(tmp_path / "theory.csv", HEAD, "0,0,0,0", "1,0,0,0.3")
    assert theory_beside.compare(tmp_path, [rest]) == [("contact area", 0.3, None)]
