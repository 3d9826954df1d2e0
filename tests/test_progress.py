"""How far long work has come: shown on a terminal, and nowhere else."""

import io
import re
import sys
import time
from pathlib import Path
from time import sleep

import pytest
from drawing import ELASTIC, LOADS, MAPS, SLIDE, WAVE, ZENER, ran

from parcontact import printed
from parcontact.__main__ import main
from parcontact.files.recorder import Console, StepRow
from parcontact.results import report_sections
from parcontact.results.plotted_run import PlottedRun


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(WAVE + ZENER + SLIDE + "steady: {velocities: [0.01, 0.1, 1.0]}\n")
    return tmp_path / "job.yaml"


def stated(monkeypatch: pytest.MonkeyPatch, terminal: io.StringIO, *words: str) -> str:
    """What a verb writes next to its results, to a terminal or not."""
    monkeypatch.setattr(sys, "stderr", terminal)
    assert main(list(words)) == 0
    return terminal.getvalue()


def test_a_bar_stands_before_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    items = printed.with_bar([1, 2, 3], "maps", "map")
    assert next(items) == 1
    assert "maps:   0%" in terminal.getvalue()
    assert "0/3" in terminal.getvalue()
    sleep(0.11)  # tqdm draws no more often than every tenth of a second
    assert list(items) == [2, 3]
    assert re.search(r"1/3 \[\d\d:\d\d<\d\d:\d\d", terminal.getvalue())  # time passed and time left


def test_the_time_left_of_a_run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Without a terminal: two steps after the first one have taken 100 s, and seven are left."""
    now = 5.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    console = Console(quiet=False, total=10)
    for step in (0, 1):
        console.step(StepRow(step))
    now += 100.0
    console.step(StepRow(3))
    console.close()
    assert capsys.readouterr().out.splitlines()[-1] == "# step 3 of 10, about 0:05:50 left"


def test_steady_states(job: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """How many of how many, below the lines of the table; nothing where errors go to a file."""
    text = stated(monkeypatch, Terminal(), "steady", "job.yaml")
    assert "steady states:   0%" in text
    assert "0/3" in text
    assert len([line for line in capsys.readouterr().out.splitlines() if "e-" in line]) >= 3
    assert "0/3" not in stated(monkeypatch, io.StringIO(), "steady", "job.yaml", "--restart", "never")
    assert "steady states" not in (job.parent / "out/job/steady.log").read_text()


def test_the_maps_of_a_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = ran(tmp_path, WAVE + ELASTIC + LOADS + MAPS)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    assert [len(images) for _, images, _ in report_sections.browse_run(PlottedRun(out))] == [2, 2]
    assert "maps of pressure:   0%" in terminal.getvalue()
    assert "0/2" in terminal.getvalue()


def test_a_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [f"{f:g} {1 + f / (f + 10):g} {f / (f * f + 100):g}\n" for f in (0.1, 1, 10, 100)]
    (tmp_path / "rubber.csv").write_text("f[Hz] E'[MPa] E''[MPa]\n" + "".join(rows))
    assert "number of branches:" in stated(monkeypatch, Terminal(), "fit", str(tmp_path / "rubber.csv"))


def test_a_plan(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = stated(monkeypatch, Terminal(), "plan", "job.yaml", "--ranks", "1", "--seconds", "0.1")
    assert "trying some steps of the job:   0%" in text
