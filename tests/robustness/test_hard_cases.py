"""The cases in which contact codes fail, each at its physical outcome, in every precision, on any number of ranks.

What is expected and how far off it may be stands with the cases in parcontact/doctor.
"""

import pytest
from marching import ROOT
from mpi4py import MPI

from parcontact import __main__
from parcontact.doctor import cases
from parcontact.doctor.bench import Bench, Finding
from parcontact.doctor.cases import CASES, Case, Outcome, examine, table

NAMES = [case.examine.__name__ for case in CASES]
BY_NAME = dict(zip(NAMES, CASES, strict=True))


@pytest.mark.mpi(3)
@pytest.mark.parametrize("name", NAMES)
def test_double_precision(comm: MPI.Intracomm, name: str) -> None:
    assert examine(BY_NAME[name], comm).wrong == []


@pytest.mark.mpi(2)
@pytest.mark.parametrize("name", NAMES)
def test_mixed_precision(comm: MPI.Intracomm, name: str) -> None:
    assert examine(BY_NAME[name], comm, "mixed").wrong == []


def test_a_case_that_goes_wrong_is_seen() -> None:
    """Numbers beyond their limit, numbers that are none, solves that fail."""

    def wrong(bench: Bench) -> None:
        bench.expect("area", 0.5, 0.6, 0.1)
        bench.expect("force", float("nan"), 1.0, 0.1)
        bench.expect("peak", 1.0, 1.05, 0.1)

    outcome = examine(Case("name", "expected", wrong), MPI.COMM_SELF)
    assert outcome.wrong == ["area = 0.5 (0.6 +- 0.06)", "force = nan (1 +- 0.1)"]
    assert "WRONG" in table([outcome])
    failed = Outcome(outcome.case, (), 0.0, 0, "the contact solve stalled")
    assert failed.wrong == ["the contact solve stalled"]
    assert Finding("gap", 0.0, 0.0, 0.0).ok
    assert not Finding("gap", 1e-300, 0.0, 0.0).ok


@pytest.mark.parametrize(
    ("allowed", "code", "said"), [(0.2, 0, "all is well"), (0.1, 1, "a case: area = 0.5 (0.6 +- 0.06)")]
)
def test_verb(
    allowed: float, code: int, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = Case("a case", "an area", lambda bench: bench.expect("area", 0.5, 0.6, allowed))
    monkeypatch.setattr(cases, "CASES", (case,))
    assert __main__.main(["doctor"]) == code
    assert capsys.readouterr().out.splitlines()[-1] == said


def test_table_of_the_readme() -> None:
    """It has every case, with what is expected of it."""
    text = (ROOT / "README.md").read_text()
    for number, case in enumerate(CASES, start=1):
        assert f"| {number} | {case.name} | {case.expected} |" in " ".join(text.split())
