"""Steps that choose themselves: they follow the error asked for, end with their stages, and do not depend on how a run
was cut into pieces or on how many ranks made it."""

import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from csv_rows import Rows, measures
from job.texts import job_of, with_stage
from marched_jobs import SLS, begun, column, marched
from mpi4py import MPI
from restarting import Bench

from parcontact.errors import InputError, JobError
from parcontact.job import Job
from parcontact.job.history import ChosenEnds, ChosenSteps, StepLadder, Timeline
from parcontact.march import choices, sanity

POINTS = 32
CELL = 1e-3 / POINTS
WAVES = {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]}
PRESS = {"name": "press", "pressure": 1e4, "duration": 5e-3}
SLIDE = {"name": "slide", "pressure": 1e4, "velocity": 0.1, "distance": 6.5 * CELL}
STEADY = {"initial": {"state": "steady", "velocity": 0.1, "pressure": 1e4}, "history": [SLIDE]}
LIFT = {"name": "lift", "pressure": {"from": 1e4, "to": 2e3}, "velocity": 0.1, "distance": 3 * CELL}


def data(*history: dict[str, Any], **sections: Any) -> dict[str, Any]:
    scene = {"grid": {"points": POINTS, "size": 1e-3}, "surface": WAVES, "material": SLS}
    return {**scene, "history": list(history or (PRESS, SLIDE, LIFT)), **sections}


def job(*history: dict[str, Any], **sections: Any) -> Job:
    return Job.model_validate(data(*history, **sections))


@pytest.mark.parametrize(
    ("first", "most", "seconds"),
    [(1.0, 8.0, 30.0), (1.0, 8.0, 5.0), (3.0, 3.0, 7.5), (0.1, 64, 64), (1.0, 8.0, 300.0), (1.0, 7.0, 300.0)],
)
def test_ladder(first: float, most: float, seconds: float) -> None:
    """Steps double up to the longest and end where they should; none is longer than twice the one before."""
    ladder = StepLadder(first, most, seconds)
    ends = [ladder.end(n) for n in range(ladder.count + 1)]
    steps = np.diff(ends)
    assert ends[-1] == seconds
    assert steps[0] == min(first, seconds)
    assert (steps > 0.0).all()
    assert (steps[1:] <= 2.0 * steps[:-1] * (1 + 1e-12)).all()
    assert steps.max() <= 2.0 * most


def test_stages_end_when_they_should() -> None:
    """To the last bit, and each where the surface was to be; whole cells are reached again after a part of one."""
    march, rows = marched(data())
    timeline = march.timeline()
    assert timeline.count == rows[-1].step
    for span in timeline.spans:
        assert timeline[span.last].time == span.start + span.stage.seconds
        assert rows[span.last].time == timeline[span.last].time
    slide = timeline.spans[1]
    cells = [timeline[n].position[0] / CELL for n in range(slide.before + 1, slide.last + 1)]
    assert cells[-1] == pytest.approx(6.5, abs=1e-9)
    assert sum(abs(c - round(c)) < 1e-9 for c in cells) >= 5
    assert column(rows, "pressure")[-1] == pytest.approx(2e3)


def test_steps_grow_at_rest() -> None:
    """After a jump of the load they begin below the relaxation time; when the body has crept they are far longer."""
    _, rows = marched(data({**PRESS, "duration": 0.1}))
    steps = np.diff(column(rows[1:], "time"))
    assert steps[0] <= 1e-4 * (1 + 1e-12)
    assert steps.max() > 50 * steps[0]
    assert len(steps) < 60


def errors(accuracies: Sequence[float], history: Sequence[dict[str, Any]]) -> list[float]:
    """Of the last friction, against steps by hand of a 32nd of a cell and small ones at rest."""
    fine = [
        {
            **stage,
            **({"cells_per_step": 1 / 32} if "velocity" in stage else {"time_step": {"first": 1e-6, "growth": 1.05}}),
        }
        for stage in history
    ]
    numerics = {"tolerance": 1e-8, "branch_error": 0.0}
    exact = marched(data(*fine, numerics=numerics))[1][-1].measures.friction
    found = [
        marched(data(*history, numerics={**numerics, "accuracy": accuracy}))[1][-1].measures.friction
        for accuracy in accuracies
    ]
    return [abs(friction / exact - 1.0) for friction in found]


def test_error_falls_with_what_is_asked_for() -> None:
    """A ninth of the accuracy: the error falls to less than a third, and is below the accuracy throughout. Of the
    steps alone: the tolerance of the solver is far smaller."""
    asked = (9e-2, 1e-2, 1.1e-3)
    found = errors(asked, (PRESS, SLIDE))
    assert all(error < accuracy for error, accuracy in zip(found, asked, strict=True))
    assert found[2] < found[0] / 9


def test_an_elastic_body_needs_no_choice() -> None:
    """A cell per step in sliding, one step at rest, some on a ramp; nothing is remembered of it."""
    march, rows = marched(data(PRESS, SLIDE, LIFT, material={"model": "elastic", "shear_modulus": 1e6}))
    assert march.state.chosen is None
    assert [span.count for span in march.timeline().spans] == [1, 7, 3]
    assert not [name for name in march.entries() if name in ChosenSteps().numbers()]
    assert len(rows) == 1 + 1 + 11
    ramp = job({**PRESS, "pressure": {"from": 0.0, "to": 1e4}}, material={"model": "elastic", "shear_modulus": 1e6})
    assert Timeline.from_job(ramp).count == 16


def test_timeline_is_read_from_the_times_of_rows() -> None:
    march, rows = marched(data())
    times = {row.step: row.time for row in rows}
    found = Timeline.from_job(job()).follow(times)
    assert [span.last for span in found.spans] == [span.last for span in march.timeline().spans]
    partly = Timeline.from_job(job()).follow({n: t for n, t in times.items() if n < 8})
    ends = partly.spans[0].ends
    assert isinstance(ends, ChosenEnds)
    assert len(ends.made) == 6


def test_creep_after_a_jump_while_hardly_sliding() -> None:
    """A slide of a nanometre takes as many relaxation times as a stage at rest, and ends in the same contact: to 1 %,
    the accuracy asked for."""
    rest = {"pressure": 1e4, "duration": 5e-3}
    still, slow = (marched(data({**rest, **more}))[1] for more in ({}, {"velocity": 1e-9}))
    assert len(slow) > 6
    assert slow[-1].measures.contact_area_corrected == pytest.approx(
        still[-1].measures.contact_area_corrected, rel=1e-2
    )


def test_a_way_that_positions_do_not_resolve() -> None:
    """A slide so slow that its way is rounding of the way before ends within 60 steps."""
    fast = {"pressure": 1e4, "velocity": 1.0, "duration": 1e-3, "time_step": 1e-3}
    slow = {"pressure": 1e4, "velocity": 1e-20, "duration": 5e-3, "time_step": "auto"}
    march = begun(data(fast, slow))
    for step in islice(march.steps(), 60):
        march.advance(step)
    assert march.row.time == pytest.approx(6e-3)


# -- runs -------------------------------------------------------------------------------------------------------------


def run(where: Path, comm: MPI.Intracomm, name: str, until: float | None = None, **sections: Any) -> Rows:
    """The rows of a run without their seconds, on root."""
    output = {"fields": ["pressure"], "every": 7}
    assert Bench(comm, where).run(data(**{"output": output, **sections}), where / name, until=until) == 0
    return [] if comm.rank else measures(where / name)


@pytest.mark.mpi(3)
@pytest.mark.parametrize(
    ("sections", "stops"),
    [({}, (3e-4, 5.6e-3, 7.3e-3)), ({**STEADY, "numerics": {"accuracy": 2e-3}}, (3e-4, 5e-4, 1.3e-3))],
    ids=["press, slide and ramp", "steady slide"],
)
def test_a_run_in_pieces_has_the_same_steps(
    shared_path: Path, comm: MPI.Intracomm, sections: dict[str, Any], stops: tuple[float, ...]
) -> None:
    """To the last bit, wherever it was interrupted: in a press, in a slide, in a ramp; in parts of a cell, which start
    from pressures of some steps ago."""
    whole = run(shared_path, comm, "whole", **sections)
    for until in (*stops, None):
        pieces = run(shared_path, comm, "pieces", until, **sections)
    assert pieces == whole


@pytest.mark.mpi(4)
def test_steps_do_not_depend_on_the_number_of_ranks(shared_path: Path, communicators: list[MPI.Intracomm]) -> None:
    """The instants are the same to the last bit, friction to some roundings of search directions, 6e-8, of its largest:
    at rest it is noise."""
    found: list[Rows] = []
    for comm in communicators:
        found.append(run(shared_path, comm, f"on {comm.size}"))
        comm.Barrier()
    for other in found[1:] if communicators[0].rank == 0 and found[0] else ():
        assert [row["time"] for row in other] == [row["time"] for row in found[0]]
        mine, theirs = ([float(row["friction"]) for row in rows] for rows in (found[0], other))
        np.testing.assert_allclose(theirs, mine, rtol=0, atol=1e-7 * max(mine))


def test_going_on_beyond_the_end(tmp_path: Path) -> None:
    """The end of the history is hit, and then the instant asked for; the fields of both are there."""
    end = Timeline.from_job(job()).end
    rows = run(tmp_path, MPI.COMM_SELF, "beyond", 1.5 * end)
    times = [float(row["time"]) for row in rows]
    assert times[-1] == pytest.approx(1.5 * end, rel=1e-12)
    assert any(time == pytest.approx(end, rel=1e-12) for time in times)


# -- histories of more steps than anybody makes: they cost nothing until they are made --------------------------------

COUNT = 10**8


@pytest.mark.parametrize("way", ["", "velocity: 1, ", "velocity: [0.3, 0.2], "])
def test_a_timeline_of_so_many_steps(tmp_path: Path, way: str) -> None:
    """Its length, any of its steps, what a plan asks of it: in less than 10 s of CPU time;
    a list of all steps takes minutes."""
    text = with_stage(f"{{pressure: 1e5, {way}duration: {COUNT}.0, time_step: 1.0}}")
    job = job_of(tmp_path, text)
    began = time.process_time()
    timeline = Timeline.from_job(job)
    assert timeline.count == COUNT + 1
    assert timeline[timeline.count].time == float(COUNT)
    assert timeline[timeline.count // 2].time == pytest.approx(COUNT / 2, rel=2e-8)
    assert timeline[timeline.count].dt == 1.0
    assert choices.choices(job).decisions
    assert time.process_time() - began < 10.0


def test_more_steps_are_refused(tmp_path: Path) -> None:
    """In a job, and where a run is to go on so far."""
    with pytest.raises(JobError, match=r"leads to 2e\+08 steps; a history has at most 1e\+08"):
        job_of(tmp_path, with_stage("{pressure: 1e5, duration: 2e8, time_step: 1.0}"))
    job = job_of(tmp_path, with_stage("{pressure: 1e5, velocity: 1, duration: 1e-3, time_step: 1e-6}"))
    with pytest.raises(InputError, match=r"the history would have 1e\+09 steps; it has at most 1e\+08"):
        sanity.refuse_impossible(job, Timeline.from_job(job, 1e3))
