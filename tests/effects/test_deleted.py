"""A capability is a folder: the program without it runs jobs of others, and refuses its own keys."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from conftest import WORLD
from csv_rows import rows

import parcontact
from parcontact import capabilities
from parcontact import job as jobs

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

HOUSE = Path(parcontact.__file__).parent
JOB: dict[str, Any] = {
    "grid": {"points": [24, 10], "size": [1e-3, 0.4e-3]},
    "surface": [{"shape": "wave", "amplitude": 4e-6, "waves": [2, 0]}],
    "material": {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [{"pressure": 1e5, "velocity": 0.2, "distance": 1e-4, "cells_per_step": 1}],
    "steady": {"velocities": [0.2], "pressures": [1e5]},
    "output": {"fields": ["gap"], "every": 100, "directory": "out"},
}
KEYS: dict[str, tuple[dict[str, Any], str]] = {  # folder: what its section is refused with
    "leakage": ({"leakage": {}}, "leakage is not a known key"),
    "counterbody": ({"counterbody": {"model": "elastic", "shear_modulus": 5e6}}, "counterbody is not a known key"),
    "heat": ({"thermal": {"conductivity": 0.2, "diffusivity": 1e-7}}, "thermal is not a known key"),
    "interface": ({"interface": {"shear_stress": 1e5}}, "interface is not a known key"),
    "stick": ({"interface": {"shear_stress": 1e5, "stick": True}}, "interface.stick is not a key of interface"),
    "adhesion": ({"adhesion": {"work": 0.05}}, "adhesion is not a known key"),
    "layer": ({"body": {"thickness": 1e-3}}, "body is not a known key"),
    "softening": ({"softening": {"table": [[1e-3, 1.0, 1.0], [1.0, 0.5, 0.5]]}}, "softening is not a known key"),
}
LACKING = {"interface": ("steady",), "softening": ("history",), "adhesion": ("steady",)}  # what a section excludes
OF_STEADY_STATES = ("heat", "softening", "counterbody", "layer")
CHECKED = ("time", "friction", "contact_area", "mean_gap", "max_pressure", "operator_calls", "error_friction")


def test_without_each_folder(tmp_path: Path) -> None:
    """Numbers are the same to the last digit; its keys are refused; pictures, reports and descriptions are made."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    commands = {"": [["job.yaml", "--quiet", "--out", "whole"]]}  # with all folders
    for folder, (keys, _) in KEYS.items():
        (tmp_path / f"{folder}.yaml").write_text(yaml.safe_dump({**JOB, **keys}))
        commands[folder] = [
            ["check", f"{folder}.yaml"],
            ["job.yaml", "--quiet", "--out", folder],
            ["report", folder],
            ["info", folder],
            *([["steady", "job.yaml", "--quiet", "--out", f"{folder}-curve"]] if folder in OF_STEADY_STATES else []),
            ["plan", "job.yaml", "--seconds", "0.1"],
        ]
    (tmp_path / "plan.json").write_text(json.dumps(commands))
    environment = {**os.environ, "PYTHONPATH": str(HOUSE.parent), "MPLBACKEND": "agg"}
    words = [sys.executable, str(Path(__file__).with_name("hiding.py")), "plan.json"]
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found.pop("")[0][0] == 0
    whole = numbers_of(tmp_path / "whole")
    for folder, ((code, said), *others) in found.items():
        assert (code, KEYS[folder][1] in said) == (2, True), (folder, said)
        for words, (code, said) in zip(commands[folder][1:], others, strict=True):
            assert (code, "Traceback" in said) == (0, False), (folder, words, said)
        assert numbers_of(tmp_path / folder) == whole, folder


def test_every_folder_is_tried() -> None:
    """The sections above belong to all folders, and keys of a program with them."""
    assert sorted(KEYS) == sorted(each.__name__.rpartition(".")[2] for each in capabilities.folders())
    for keys, _ in KEYS.values():
        data = {name: part for name, part in JOB.items() if name not in LACKING.get(next(iter(keys)), ())}
        assert jobs.load({**data, **keys}).section(next(iter(keys))) is not None


def numbers_of(directory: Path) -> list[list[str]]:
    return [[row[name] for name in CHECKED] for row in rows(directory / "measures.csv")]
