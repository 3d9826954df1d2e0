"""An effect of another package brings pictures, sentences and headlines like those of this package."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import short_job
import yaml
from conftest import WORLD, Main

from parcontact import capabilities
from parcontact.results import plotted_run
from parcontact.results.plotted_run import PlottedRun

from .tread_wear import forget, install, shown

pytestmark = pytest.mark.skipif(WORLD.size > 1, reason="for one process")

ANSWERS = """
    @staticmethod
    def sentences(run):
        yield f"the tread is worn by {run.table['wear_depth'][-1]:.3g} m"

    @staticmethod
    def headline(run):
        yield "the tread is worn"

    KEYS = ("wear",)

    @staticmethod
    def panels(run, along):
        from parcontact.results.panels import Axis, Panel

        yield Panel("wear", along.axis, Axis("wear", "m"), along.series({"": run.columns["wear_depth"]}))

    def last_lines(self, memory):
        from parcontact.errors import Kind

        worn, allowed = float(memory[1]), 1e-15
        yield "the tread was worn"
        yield Kind("worn", "the tread is worn by {worn:.3g} m, more than {allowed:g} m; use a smaller coefficient")(
            "wear", {"worn": worn, "allowed": allowed}
        )

    def follow("""


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "job.yaml").write_text(yaml.safe_dump({**short_job.JOB, "wear": {"coefficient": 1e-12}}))
    install(tmp_path, shown().replace("\n    def follow(", ANSWERS, 1))
    forget()
    yield tmp_path / "job.yaml"
    forget()


def test_sentences_headlines_and_panels(main: Main, job: Path) -> None:
    code, _, warned = main("job.yaml", "--quiet", "--out", "out")
    assert code == 0
    assert "warning: wear: the tread is worn by 5.15e-12 m, more than 1e-15 m; use a smaller coefficient" in warned
    code, said, _ = main("info", "out")
    assert code == 0
    assert re.search(r"^  the tread is worn by \S+ m$", said, re.MULTILINE)
    assert main("report", "out")[0] == 0
    reported = (job.parent / "out" / "report.html").read_text()
    assert "the tread is worn; " in reported
    assert "use a smaller coefficient" in reported
    assert "wear" in [chart.key for chart in plotted_run.panels_of_run(PlottedRun(job.parent / "out"))]
    assert main("plot", "out", "--panels", "wear")[0] == 0


def test_a_sentence_that_fails_names_the_effect(main: Main, job: Path) -> None:
    install(job.parent, shown().replace("\n    def follow(", ANSWERS.replace("[-1]", "['last']"), 1))
    forget()
    assert main("job.yaml", "--quiet", "--out", "out")[0] == 0
    code, _, said = main("info", "out")
    assert code == 1
    assert "the effect wear (tread_wear:Wear) has failed: TypeError" in said


def test_order_follows_from_needs() -> None:
    """What gives comes before what uses it, else the alphabet decides, also in a circle."""
    none: tuple[str, ...] = ()
    needs = {"a": (none, ("heat",)), "b": (none, none), "c": (("heat",), none)}
    assert capabilities.in_order(needs) == ["b", "c", "a"]
    assert capabilities.in_order({"b": (("x",), ("y",)), "a": (("y",), ("x",))}) == ["a", "b"]
