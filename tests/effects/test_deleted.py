"""A capability is a folder: a copy of the program without it runs jobs of others, and refuses its own keys."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD
from csv_rows import rows

import parcontact
from parcontact import __main__

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

HOUSE = Path(parcontact.__file__).parent
JOB: dict[str, Any] = {
    "grid": {"points": [24, 10], "size": [1e-3, 0.4e-3]},
    "surface": [{"shape": "wave", "amplitude": 4e-6, "waves": [2, 0]}],
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e5, "velocity": 0.2, "distance": 1e-4, "cells_per_step": 1}],
    "steady": {"velocities": [0.2], "pressures": [1e5]},
    "output": {"fields": ["pressure", "gap"], "directory": "out"},
}
KEYS: dict[str, tuple[dict[str, Any], str]] = {  # folder: what its section is refused with
    "leakage": ({"leakage": {}}, "leakage is not a known key"),
    "counterbody": ({"counterbody": {"model": "elastic", "shear_modulus": 5e6}}, "counterbody is not a known key"),
    "heat": ({"thermal": {"conductivity": 0.2, "diffusivity": 1e-7}}, "thermal is not a known key"),
    "interface": ({"interface": {"shear_stress": 1e5}}, "interface is not a known key"),
    "stick": ({"interface": {"shear_stress": 1e5, "stick": True}}, "interface.stick is not a key of interface"),
    "adhesion": ({"adhesion": {"work": 0.05}}, "adhesion is not a known key"),
    "softening": ({"softening": {"table": [[1e-3, 1.0, 1.0], [1.0, 0.5, 0.5]]}}, "softening is not a known key"),
}
OF_STEADY_STATES = ("heat", "softening", "counterbody")
CHECKED = ("time", "friction", "contact_area", "mean_gap", "max_pressure", "operator_calls", "error_friction")


def test_deleted_folders(tmp_path: Path) -> None:
    """Numbers are the same to the last digit; its keys are refused; pictures, reports and descriptions are made."""
    copy = tmp_path / "copy" / HOUSE.name
    shutil.copytree(HOUSE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    assert __main__.main([str(tmp_path / "job.yaml"), "--quiet", "--out", str(tmp_path / "whole")]) == 0
    for folder in KEYS:  # in one copy, whose loops are compiled once
        shutil.move(copy / "effects" / folder, tmp_path / folder)
        use_without(folder, tmp_path, copy.parent)
        shutil.move(tmp_path / folder, copy / "effects" / folder)


def use_without(folder: str, tmp_path: Path, copy: Path) -> None:
    """Do what a user does with the copy of the program that lacks a folder."""
    environment = {**os.environ, "PYTHONPATH": str(copy), "MPLBACKEND": "agg"}

    def program(*words: str) -> tuple[int, str]:
        command = [sys.executable, "-m", "parcontact", *words]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr

    keys, refusal = KEYS[folder]
    shutil.rmtree(tmp_path / "out", ignore_errors=True)
    (tmp_path / "other.yaml").write_text(yaml.safe_dump({**JOB, **keys}))
    for words in (
        ("job.yaml", "--quiet"),
        *([("steady", "job.yaml", "--quiet")] if folder in OF_STEADY_STATES else []),
        ("report", "out"),
        ("info", "out"),
        ("plan", "job.yaml", "--seconds", "0.2"),
    ):
        code, said = program(*words)
        assert code == 0, (folder, said)
        assert "Traceback" not in said, (folder, said)
    code, said = program("check", "other.yaml")
    assert code == 2, (folder, said)
    assert refusal in said, folder
    without, whole = (rows(tmp_path / name / "measures.csv") for name in ("out", "whole"))
    assert [[row[name] for name in CHECKED] for row in without] == [[row[name] for name in CHECKED] for row in whole]
