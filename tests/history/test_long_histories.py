"""Histories of more steps than anybody makes: they cost nothing until they are made."""

import time
from pathlib import Path

import pytest
from job.texts import job_of, with_stage

from parcontact import scene
from parcontact.errors import InputError, JobError
from parcontact.history.timeline import Timeline
from parcontact.scene import sanity

COUNT = 10**8


@pytest.mark.parametrize("way", ["", "velocity: 1, ", "velocity: [0.3, 0.2], "])
def test_a_timeline_of_so_many_steps(tmp_path: Path, way: str) -> None:
    """Its length, any of its steps, what a plan asks of it: in less than 10 s of CPU time;
    a list of all steps takes minutes."""
    text = with_stage(f"{{pressure: 1e5, {way}duration: {COUNT}.0, time_step: 1.0}}")
    job = job_of(tmp_path, text)
    began = time.process_time()
    timeline = Timeline.of(job)
    assert timeline.count == COUNT + 1
    assert timeline[timeline.count].time == float(COUNT)
    assert timeline[timeline.count // 2].time == pytest.approx(COUNT / 2, rel=2e-8)
    assert timeline[timeline.count].dt == 1.0
    assert scene.choices(job).effects
    assert time.process_time() - began < 10.0


def test_the_first_step_between_cells_of_so_many(tmp_path: Path) -> None:
    """A drift of 1e-12 cells a step counts where it has come to 1e-6 cells, and not before."""
    cell = 1e-3 / 64
    stage = f"{{pressure: 1e5, velocity: {cell * (1 + 1e-12)!r}, duration: {COUNT}.0, time_step: 1.0}}"
    timeline = Timeline.of(job_of(tmp_path, with_stage(stage)))
    step = timeline.first_between_cells()
    assert step is not None

    def off(number: int) -> float:
        cells = timeline[number].position[0] / cell
        return abs(cells - round(cells))

    assert off(step.number) >= 1e-6 > off(step.number - 1)


def test_more_steps_are_refused(tmp_path: Path) -> None:
    """In a job, and where a run is to go on so far."""
    with pytest.raises(JobError, match=r"leads to 2e\+08 steps; a history has at most 1e\+08"):
        job_of(tmp_path, with_stage("{pressure: 1e5, duration: 2e8, time_step: 1.0}"))
    job = job_of(tmp_path, with_stage("{pressure: 1e5, velocity: 1, duration: 1e-3, time_step: 1e-6}"))
    with pytest.raises(InputError, match=r"the history would have 1e\+09 steps; it has at most 1e\+08"):
        sanity.refuse_impossible(job, Timeline.of(job, 1e3))
