"""What a run advises where it is more wrong than asked for."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from parcontact.__main__ import main
from parcontact.job import Job
from parcontact.run.run import chosen_by_accuracy
from parcontact.storage import tables


@pytest.mark.parametrize(
    ("slide", "numerics", "parts"),
    [
        ({}, {}, {"solver", "time", "folded"}),
        ({"cells_per_step": 1}, {}, {"solver", "folded"}),
        ({}, {"accuracy": 0.03, "tolerance": 1e-4}, {"time", "folded"}),
        ({}, {"tolerance": 1e-4, "branch_error": 0.0}, {"time"}),
        ({}, {"tolerance": 5e-3, "branch_error": 1e-3}, {"time"}),  # given, though they are what would be chosen
    ],
)
def test_what_a_smaller_accuracy_would_help(slide: dict[str, Any], numerics: dict[str, Any], parts: set[str]) -> None:
    """The settings that it has chosen; steps are those of the slide, whatever a press has."""
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [
            {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-4},
            {"pressure": 1e4, "velocity": 0.1, "distance": 1e-4, **slide},
        ],
        "numerics": numerics,
    }
    assert chosen_by_accuracy(Job.model_validate(data)) == parts


def test_no_error_is_stated_where_the_box_cuts_a_contact_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps at the edge have no error, and the end says so; a step inside has one."""
    data = {
        "grid": {"points": 32, "size": 1e-3, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-2},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"force": 0.01}, {"force": 1.0}],
    }
    (tmp_path / "job.yaml").write_text(json.dumps(data))
    monkeypatch.chdir(tmp_path)
    for force, inside, name in ((1.0, False, "edge"), (0.011, True, "room")):
        assert main(["job.yaml", "--set", f"history.1.force={force}", "--set", f"output.directory={name}"]) == 0
        out = capsys.readouterr().out
        assert ("no error is stated of steps whose contact reaches the edge of the box" in out) != inside
        errors = tables.read(tmp_path / name / "measures.csv")["error_area"]
        assert [math.isnan(error) for error in errors] == [True, False, not inside]
