"""Every script runs, at a size so small that it says little; a claim that counts can show must hold.

Claims about time are not judged here: a busy machine would break them.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "scripts").glob("*.py"))
SCRIPTS = [path for path in FILES if "__main__" in path.read_text()]  # the others serve them


class Small(NamedTuple):
    """A small run: its words, what it must print, and the exit codes that are right."""

    words: list[str]
    printed: str
    codes: tuple[int, ...] = (0,)


SMALL = {
    "band_errors": Small(["--cases", "1"], r"(?m)^2 bands, friction: .*within 5 % in \d of 1"),
    "bench": Small(
        ["--points", "64", "--rounds", "1", "--json", "bench.json", "--picture", "bench.png"],
        r"(?s)double: operator calls +\d\d .*tolerance 0.005: operator calls per step +[4-9](\.| ).*"
        r"curve: the most of them +\d{2,3}[. ].*12 branches over.*info.*allowed 0.001: branches with a map +[45] .*"
        r"adhesion +operator calls +\d+ .*dilute +128\^2.*free +64\^2.*"
        r"flow along x and along y.*"
        r"each branch.*solve: speed of 2 ranks",
    ),
    "chosen_mesh": Small(
        ["--only", "5", "--seed", "100", "--finest", "240"], r"(?m)^1 made: \d with faults; 3 accuracies", (0, 1)
    ),
    "error_coverage": Small(
        ["--scenes", "2", "--from", "13"], r"(?s)first half: 2 \| both .*2 scenes, .*written: ", (0, 1)
    ),
    "fuzz_jobs": Small(["--jobs", "40"], r"(?m)^40 made: 0 with faults; "),
    "launch": Small(["sh", "-c", "echo started"], r"^started$"),  # how it stops: tests/robustness/test_disturbed.py
    "manual_pages": Small(["--to", "pages", "--no-notebooks"], r"(?m)^\d\d pages in pages"),
    "march_errors": Small(["--marches", "1"], r"(?m)^exponential +0.01 +[0-9.]+ "),
    "mutants": Small(["--count", "1", "--seed", "1", "parallel/slab.py"], r"(?m)^1 of 1 seen"),
    "paper_figures": Small(["7", "--to", "pictures"], r"(?m)^picture: pictures/fig07.png"),
    "random_adhesion": Small(["--scenes", "3"], r"(?m)^3 made: 0 with faults; .*[1-9]\d+ steps"),
    "random_scenes": Small(["--scenes", "2", "--steps", "10"], r"2 made: 0 with faults; .*[1-9]\d+ steps"),
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
