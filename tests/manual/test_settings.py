"""The jobs of the page "Which settings?": each runs, meets its accuracy without a warning, has the numbers there."""

import re
from pathlib import Path

import pytest
from csv_rows import rows

from manual.printed import compare_lines
from parcontact import __main__
from parcontact.manual import texts

CASES = re.findall(r"^```yaml\n(title: .*?)^```\n(.*?)(?=^```yaml|\Z)", texts.page("settings"), re.M | re.S)


def test_the_four_users() -> None:
    assert len(CASES) == 4


@pytest.mark.parametrize(("job", "after"), CASES, ids=["tyre", "seal", "indenter", "student"])
def test_a_job(
    job: str, after: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(job)
    assert __main__.main(["job.yaml", "--quiet"]) == 0
    assert "warning" not in capsys.readouterr().err
    log = (tmp_path / "out" / "job" / "run.log").read_text()
    assert log.count("; within the") == log.count("estimated error of") > 0  # as budget.advice says
    for text in re.findall(r"^```text\n(.*?)^```", after, re.M | re.S):
        compare_lines(text, log)
    compare_table(after, Path("out/job/measures.csv"))


def compare_table(text: str, path: Path) -> None:
    """Hold each line of a table of columns to a row of measures.csv: three digits are printed, and machines round."""
    head = re.search(r"^(\| `\w+` (?:\| `\w+` )+\|)\n\|[-|]+\n((?:\|.*\n)+)", text, re.M)
    if head is None:
        return
    names = re.findall(r"`(\w+)`", head[1])
    for line in head[2].splitlines():
        expected = [float(cell) for cell in line.strip("|").split("|")]
        found = [[float(row[name] or "nan") for name in names] for row in rows(path)]
        assert any(each == pytest.approx(expected, rel=0.05, abs=1e-40) for each in found), (names, expected)
