"""Histories of more steps than anybody makes: they cost nothing until they are made."""

import time
from pathlib import Path

import pytest

from parcontact import scene
from parcontact.errors import InputError
from parcontact.history.cells import first_between_cells
from parcontact.history.timeline import Timeline
from parcontact.job.resolved import shown_job

from .texts import SMALL, job_of, with_stage

STEPS = [10**7, 10**12, 10**18]


@pytest.mark.parametrize("count", STEPS)
@pytest.mark.parametrize("way", ["", "velocity: 1, ", "velocity: [0.3, 0.2], "])
def test_a_timeline_of_so_many_steps(tmp_path: Path, count: int, way: str) -> None:
    """Its length, any of its steps, what a plan asks of it: in less than a second of CPU time."""
    text = with_stage(f"{{pressure: 1e5, {way}duration: {count}.0, time_step: 1.0}}")
    job = job_of(tmp_path, text)
    began = time.process_time()
    timeline = Timeline.of(job)
    # a duration within 1e-9 of a whole number of steps is one
    assert timeline.count == pytest.approx(count + 1, rel=2e-9)
    assert timeline[timeline.count].time == float(count)
    assert timeline[timeline.count // 2].time == pytest.approx(count / 2, rel=2e-7)
    assert timeline[timeline.count].dt == pytest.approx(1.0, rel=2e-9)
    assert scene.choices(job).effects
    assert time.process_time() - began < 1.0


@pytest.mark.parametrize("count", STEPS)
def test_the_first_step_between_cells_of_so_many(tmp_path: Path, count: int) -> None:
    """A drift of 1e-12 cells a step, or more, counts where it has come to 1e-6 cells, and not before."""
    cell = 1e-3 / 64
    stage = f"{{pressure: 1e5, velocity: {cell * (1 + 1e-12)!r}, duration: {count}.0, time_step: 1.0}}"
    job = job_of(tmp_path, with_stage(stage))
    step = first_between_cells(Timeline.of(job), job.grid)
    assert step is not None

    def off(number: int) -> float:
        cells = Timeline.of(job)[number].position[0] / cell
        return abs(cells - round(cells))

    assert off(step.number) >= 1e-6 > off(step.number - 1)


def test_going_on_to_a_far_end(tmp_path: Path) -> None:
    """`--until` of 1e9 s, in steps of a microsecond and up to 1e18 of them."""
    job = job_of(tmp_path, with_stage("{pressure: 1e5, velocity: 1, duration: 1e-3, time_step: 1e-6}"))
    for until in (1e9, 1e12):
        timeline: Timeline = Timeline.of(job, until)
        assert timeline.count == pytest.approx(1e6 * until, rel=3e-9)
        assert timeline[timeline.count].time == pytest.approx(until, rel=3e-9)


@pytest.mark.parametrize(
    "title", ["2026-01-01", "010", "1e3", "0x1F", "yes", "~", "12:30", "a: b", "# no", "é\u2028", "=", "<<"]
)
def test_a_resolved_job_reads_back_with_any_title(tmp_path: Path, title: str) -> None:
    """By the reader of pictures, too."""
    job = job_of(tmp_path, SMALL)
    titled = job.model_copy(update={"title": title})
    path = tmp_path / "job.resolved.yaml"
    path.write_text(titled.resolved())
    assert shown_job(path).title == title


def test_a_resolved_job_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "job.resolved.yaml"
    path.write_text("[1, 2")
    with pytest.raises(InputError, match=r"job\.resolved\.yaml cannot be read"):
        shown_job(path)
