"""Every script runs, at a size so small that it says little; a claim that counts can show must hold.

Claims about time are not judged here: a busy machine would break them.
"""

import ast
import random
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from marched_jobs import ROOT, load_script

ROOT_scripts = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT_scripts / "scripts").glob("*.py"))
SCRIPTS = [path for path in FILES if "__main__" in path.read_text()]  # the others serve them


class Small(NamedTuple):
    """A small run: its words, what it must print, and the exit codes that are right."""

    words: list[str]
    printed: str
    codes: tuple[int, ...] = (0,)


SMALL = {
    "band_history_errors": Small(
        ["--events", "4", "--points", "48", "--samples", "1"], r"(?m)^4 three branches.*peak 0\.\d+ -> 0\.\d+.*covers"
    ),
    "band_errors": Small(["--cases", "1", "--points", "64"], r"(?m)^2 bands, friction: .*within 5 % in \d of 1"),
    "bench": Small(
        ["--points", "64", "--rounds", "1", "--json", "bench.json"],
        r"(?s)double: operator calls +\d\d .*tolerance 0.005: operator calls per step +[4-9](\.| ).*"
        r"curve: most operator calls per point +\d{2,3}[. ].*"
        r"adhesion +operator calls +\d+ .*dilute +128\^2.*free +64\^2.*"
        r"flow along x and along y.*"
        r"per branch.*solve: speed of 2 ranks",
    ),
    "chosen_mesh": Small(
        ["--only", "5", "--seed", "100", "--finest", "240"],
        r"(?ms)^1 made: \d with faults; 3 accuracies.*^excess of .*long cells \d",
        (0, 1),
    ),
    "error_coverage": Small(["--scenes", "2", "--from", "15"], r"(?s)fitted: 2 \| area .*2 scenes; written: ", (0, 1)),
    "fit_errors": Small(["--rubbers", "4"], r"(?m)^time +upper end +2 "),
    "fuzz_jobs": Small(["--jobs", "4"], r"(?m)^4 made: 0 with faults; "),
    "launch": Small(["sh", "-c", "echo started"], r"^started$"),  # how it stops: tests/robustness/test_faults.py
    "manual_pages": Small(["--to", "pages", "--no-notebooks"], r"(?m)^\d\d pages in pages"),
    "march_errors": Small(["--marches", "1"], r"(?m)^exponential +0.01 +[0-9.]+ "),
    "mutants": Small(["--count", "1", "--seed", "1", "effects/counterbody/effect.py"], r"(?m)^1 of 1 seen"),
    "paper_figures": Small(["7", "--to", "pictures"], r"(?m)^picture: pictures/fig07.png"),
    "random_adhesion": Small(["--scenes", "3"], r"(?m)^3 made: 0 with faults; .*[1-9]\d+ steps"),
    "random_scenes": Small(["--scenes", "2", "--steps", "10"], r"2 made: 0 with faults; .*[1-9]\d+ steps"),
    "solver_errors": Small(["--from", "1", "--marches", "1"], r"(?m)^friction +0.01 +[0-9]+ "),
    "random_steady": Small(["--bodies", "3"], r"(?m)^3 made: 0 with faults; 3 solved"),
}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_small_run(script: Path, tmp_path: Path, outside_mpi: dict[str, str]) -> None:
    small = SMALL[script.stem]  # a new script needs a small run
    command = [sys.executable, str(script), *small.words]
    done = subprocess.run(command, cwd=tmp_path, env=outside_mpi, capture_output=True, text=True, timeout=290)
    assert "Traceback" not in done.stderr
    assert done.returncode in small.codes, done.stderr
    assert re.search(small.printed, done.stdout), done.stdout


def test_the_settings_of_sphinx_need_no_package() -> None:
    """Sphinx executes its settings outside of any package, in a namespace without a name."""
    settings: dict[str, object] = {}
    exec((ROOT_scripts / "scripts" / "sphinx_conf.py").read_text(), settings)
    assert settings["project"] == "parcontact"


# -- what scripts/bench.py counts and concludes; what it times is judged by nobody but its reader ---------------------


@pytest.fixture(scope="module")
def peers() -> ModuleType:
    return load_script("bench.peers")


@pytest.mark.parametrize(
    ("begins", "needs"),
    [(-2.0, 1e-3), (-4.0, 1e-3)],  # the first tolerance is too loose, or tighter than it need be
)
def test_the_loosest_tolerance_is_found(peers: ModuleType, begins: float, needs: float) -> None:
    """A program whose error is its tolerance, and which takes a second for each digit."""
    code = "def attempt(tolerance):\n    return -float(np.log10(tolerance)), tolerance"
    given = {"heights": np.zeros((2, 2)), "load": 1.0, "wanted": needs * (1.0 + 1e-12)}
    found = peers.search(Path(sys.executable), peers.Task("it", code, begins), given)
    assert found.reached
    assert found.seconds == pytest.approx(3.0)
    assert found.error == pytest.approx(1e-3)


def test_a_program_that_is_too_slow(peers: ModuleType) -> None:
    """What its last try took at least counts, or a longer one before."""
    first = [{"began": 0.0}, {"seconds": 100.0, "error": 1e-5}, {"began": 120.0}]
    assert peers.judge(first, 1e-7).seconds == peers.LIMIT - 120.0
    assert not peers.judge(first, 1e-7).reached
    assert peers.judge([*first[:2], {"began": 400.0}], 1e-7).seconds == 100.0


def test_a_slide_goes_on_for_as_many_rounds_as_are_asked_for() -> None:
    """Also past the length of the box, whose surface returns to again."""
    slide = load_script("bench.work").Slide(64)
    for _ in range(66):
        slide.step()
    assert slide.march.row.distance == pytest.approx(65e-3 / 64, rel=1e-12)  # the first step is the jump of the load


# -- scripts/mutants.py finds files with tests of their own, and something to break in each of them -------------------


@pytest.fixture(scope="module")
def mutants() -> ModuleType:
    return load_script("mutants")


def test_enough_can_be_broken(mutants: ModuleType) -> None:
    """Most of what computes has tests of its own name, and the scenarios that are named are there; something can be
    broken in each part."""
    parts = mutants.parts()
    assert len(parts) >= 20
    assert set(mutants.OTHERS) <= set(parts)
    assert all((ROOT / name).exists() for part in parts for name in mutants.tests_of(part))
    for part in parts:
        what, changed = mutants.draw(part, random.Random(0))
        assert what
        assert changed != ast.unparse(ast.parse((ROOT / "parcontact" / part).read_text())), part
