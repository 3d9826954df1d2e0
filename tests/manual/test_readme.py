"""README is short and true: its commands are parsed, its job is run, its files and pages exist."""

import re
from pathlib import Path

import pytest
from marching import JOBS, ROOT

from manual.printed import compare_lines
from manual.test_manual import parse_command
from parcontact import __main__
from parcontact.job.text import yamltext
from parcontact.manual import texts

README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.M | re.S)


def test_length() -> None:
    assert len(README.splitlines()) <= 150


@pytest.mark.parametrize("line", [line for block in blocks("sh") for line in block.splitlines()])
def test_a_command(line: str) -> None:
    parse_command(line)


def test_files_exist() -> None:
    linked = re.findall(r"\]\(([^)]+)\)", README)
    quoted = re.findall(r"`((?:scripts|jobs)/[^` ]+|[A-Z]+\.cff)`", README)
    assert linked
    assert quoted
    assert [name for name in (*linked, *quoted) if not (ROOT / name).exists()] == []


def test_it_names_the_pages_of_the_manual() -> None:
    (section,) = re.findall(r"^## Manual\n(.*?)^## ", README, re.M | re.S)
    lists = re.findall(r"^\* .*", section, re.M)
    assert [name for line in lists for name in re.findall(r"`(\w+)`", line)] == texts.names()[1:]
    assert set(re.findall(r"parcontact manual (\w+)`", README)) <= set(texts.names())


def test_the_first_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The block is the file, and the run prints what README says."""
    (block,) = blocks("yaml")
    assert yamltext.parse(block, "README").data == yamltext.parse((JOBS / "slide.yaml").read_text(), "slide").data
    monkeypatch.chdir(tmp_path)
    assert __main__.main([str(JOBS / "slide.yaml"), "--quiet"]) == 0
    log = capsys.readouterr().out + (tmp_path / "out" / "slide" / "run.log").read_text()
    compare_lines(blocks("text")[0], log)
