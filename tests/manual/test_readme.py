"""README is short and true: its commands are parsed, its job is run, its files and pages exist."""

import re
import shlex
from pathlib import Path

import numpy as np
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
    for words in ("plot", "report", "cite", "info"):  # as README has them, below its job and at its end
        assert f"parcontact {words} out/slide" in README or words == "info"
        assert __main__.main([words, "out/slide"]) == 0
    assert "Bugnicourt" in capsys.readouterr().out


def test_the_first_picture_is_of_the_first_job() -> None:
    """README begins with the picture of the job that it explains, and scripts/demo runs and draws the same job."""
    first, *others = re.findall(r"!\[[^]]+\]\(([^)]+)\)", README)
    assert (first, others) == ("jobs/pictures/gallery/slide.png", [])
    demo = (ROOT / "scripts" / "demo").read_text().partition("<<'END'")[0]
    assert re.findall(r"parcontact ((?:plot )?\S+)$", demo, re.M) == ["jobs/slide.yaml", "plot out/slide"]


def test_a_road_and_a_rubber(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The commands of README on a table of heights and one of moduli, of a body whose moduli are known."""
    monkeypatch.chdir(tmp_path)
    x, y = np.meshgrid(np.arange(16) / 16, np.arange(16) / 16)
    np.savetxt("road.txt", 0.5 * np.cos(2 * np.pi * (2 * x + y)) + 0.3 * np.cos(2 * np.pi * 3 * y))
    f = np.logspace(-1, 5, 25)
    z = 2 * np.pi * f * 1e-3
    moduli = 3 * (1 + 9 * z**2 / (1 + z**2)), 3 * 9 * z / (1 + z**2)  # [MPa], tension
    np.savetxt("compound.csv", np.transpose([f, *moduli]), delimiter=",", header="f[Hz],E'[MPa],E''[MPa]", comments="")
    (block,) = (block for block in blocks("sh") if "compound.csv" in block)
    for line in block.splitlines():
        words = shlex.split(line.removeprefix("mpirun -n 2 "))
        assert __main__.main([*words[1:], *(["--quiet"] if "steady" in words else [])]) == 0, line
    (modulus,) = re.findall(r"material.modulus_inf +(\S+)", capsys.readouterr().out)
    assert float(modulus) == pytest.approx(1e6, rel=0.05)  # the fit's error is 2 % (rms)
    assert len(Path("out/job/steady.csv").read_text().splitlines()) == 1 + 9
    assert Path("out/job/report.html").is_file()
