"""jobs/road: from measured files to friction, against a truth that its script knows."""

import shutil
import subprocess
import sys
from importlib import util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from parcontact import job as jobs
from parcontact.plotting import compound as files
from parcontact.rubber import compound

ROAD = Path(__file__).resolve().parents[2] / "jobs" / "road"


@pytest.fixture(scope="module")
def compare(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The script that compares, in a directory with the measured files and the material that is fitted to them."""
    there = tmp_path_factory.mktemp("chain") / "road"
    there.mkdir()
    for name in ("make.py", "compare.py", "road.yaml"):
        shutil.copy(ROAD / name, there)
    subprocess.run([sys.executable, there / "make.py"], check=True, timeout=120)
    made = compound.fitted(there / "measured" / "compound.csv", 0.5, 20.0, "wlf", 0.02)
    list(files.write(made, there / "materials" / "compound.yaml", None))
    spec = util.spec_from_file_location("compare", there / "compare.py")
    assert spec
    assert spec.loader
    script = util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


def test_friction_of_the_fitted_rubber_and_of_the_treated_road(
    compare: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """3 % and 5 %, which are asked of the chain; 1 % and 3 % are found."""
    monkeypatch.setattr(compare, "VELOCITIES", np.array([0.01, 0.3]))
    truth = compare.friction(material=compare.TRUE_RUBBER, **compare.TRUE_ROAD)
    assert compare.friction(**compare.TRUE_ROAD) == pytest.approx(truth, rel=0.03)
    assert compare.friction(material=compare.TRUE_RUBBER) == pytest.approx(truth, rel=0.05)
    assert truth.min() > 0.02


def test_more_branches_err_less(compare: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of twelve decades: at least twelve branches, more the less error is asked for, and 2 % of error by a noise of
    2 %."""
    monkeypatch.setattr(compare, "STEPS", 2)
    found = [compare.cost(error)[:2] for error in (0.02, 0.1)]
    assert found[0][0] > found[1][0] >= 12
    assert found[0][1] < 0.02
    assert found[1][1] < 0.1


def test_the_job_asks_for_what_the_readme_says(compare: ModuleType) -> None:
    job = jobs.load(compare.HERE / "road.yaml")
    assert job.warnings == ()
    assert job.steady is not None
    assert job.steady.temperatures == (0.0, 20.0, 40.0)
    assert isinstance(job.surface[0], jobs.Topography)
