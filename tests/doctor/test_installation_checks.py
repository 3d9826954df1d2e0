"""The doctor's verb, and what it says of checks that go wrong; that they are right is tested with all hard cases."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from marched_jobs import JOBS
from mpi4py import MPI

from parcontact import __main__
from parcontact.door import doctor, manual_texts
from parcontact.door.doctor import CHECKS, Bench, Check, Finding, markdown, run_check
from parcontact.errors import RunError
from parcontact.files import run as runner
from parcontact.files.stopping import Options


def test_a_case_that_goes_wrong_is_seen() -> None:
    """Numbers beyond their limit, numbers that are none, solves that fail."""

    def wrong(bench: Bench) -> None:
        bench.expect("area", 0.5, 0.6, 0.1)
        bench.expect("force", float("nan"), 1.0, 0.1)
        bench.expect("peak", 1.0, 1.05, 0.1)

    def stalled(bench: Bench) -> None:
        raise RunError("the contact solve stalled")

    check = Check("name", "expected", wrong)
    result = run_check(check, Bench(MPI.COMM_SELF))
    assert result.wrong == ["area = 0.5 (0.6 ± 0.06)", "force = nan (1 ± 0.1)"]
    assert "WRONG" in markdown([(check, result)])
    failed = run_check(Check("name", "expected", stalled), Bench(MPI.COMM_SELF))
    assert failed.wrong == ["the contact solve stalled"]
    assert failed.nearest == "the contact solve stalled"
    assert Finding("gap", 0.0, 0.0, 0.0).ok
    assert not Finding("gap", 1e-300, 0.0, 0.0).ok


@pytest.mark.parametrize(
    ("allowed", "code", "said"), [(0.2, 0, "all is well"), (0.1, 1, "a case: area = 0.5 (0.6 ± 0.06)")]
)
def test_verb(
    allowed: float,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    check = Check("a case", "an area", lambda bench: bench.expect("area", 0.5, 0.6, allowed))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "CHECKS", (check,))
    assert __main__.main(["doctor"]) == code
    assert capsys.readouterr().out.splitlines()[-1] == said
    assert list(tmp_path.iterdir()) == []


def test_table_of_the_manual() -> None:
    """It has every check, with what is expected of it."""
    text = manual_texts.page("hard_cases")
    for number, check in enumerate(CHECKS, start=1):
        assert f"| {number} | {check.name} | {check.expected} |" in " ".join(text.split())


@pytest.mark.mpi(2)
def test_files_that_come_back_as_they_were(comm: MPI.Intracomm, tmp_path: Path) -> None:
    where = Path(comm.bcast(str(tmp_path)))
    assert doctor.find_broken_files(comm, where) == ""
    assert any("ms per operator call" in line for line in doctor.describe_machine(comm))


def test_files_that_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run whose result is another one, as after a stop from which it went on wrongly."""
    run = runner.run_job
    monkeypatch.setattr(runner, "run_job", lambda job, slab, options: run(job, slab, Options(until=0.5e-3)))
    assert "fields.h5" in doctor.find_broken_files(MPI.COMM_SELF, tmp_path)
    assert list(tmp_path.iterdir()) == []


PREPARED = """
import sys
from parcontact.__main__ import main

def loops():
    parts = [vars(module).items() for name, module in list(sys.modules.items()) if name.startswith("parcontact")]
    found = {one for part in parts for _, one in part if hasattr(one, "py_func") and hasattr(one, "signatures")}
    return {(loop.py_func.__qualname__, str(types)) for loop in found for types in loop.signatures}

assert main(["doctor"]) == 0
ready = loops()
for words in {jobs}:
    assert main(words.split()) == 0
print("more:", sorted(loops() - ready), len(ready))
"""
SMALL = "--quiet --set grid.points=64 --set numerics.accuracy=0.5"
PREPARED_FOR = [
    f"{JOBS}/slide.yaml {SMALL} --set output.energy=true",
    f"steady {JOBS}/slide.yaml {SMALL} --velocities 0.1 --out steady",
    f"{JOBS}/slide.yaml {SMALL} --set numerics.precision=mixed --out mixed",
    f"{JOBS}/creep.yaml {SMALL}",
    f"{JOBS}/adhesion/sphere.yaml {SMALL} --case 0 --until 1e-6",
    f"{JOBS}/seal/load.yaml {SMALL} --out seal",
    "leak seal",
]


def test_loops_are_prepared(tmp_path: Path, outside_mpi: dict[str, str]) -> None:
    """After the doctor, common jobs compile no loop: those that they call have been called with the same types."""
    words = [sys.executable, "-c", PREPARED.replace("{jobs}", repr(PREPARED_FOR))]
    done = subprocess.run(words, cwd=tmp_path, env=outside_mpi, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (more,) = (line for line in done.stdout.splitlines() if line.startswith("more: "))
    assert re.fullmatch(r"more: \[\] [4-9]\d", more)
