"""Dwells of a body without memory end in one step: when, and the same after a restart."""

import re
from itertools import pairwise
from typing import Any

import h5py
import numpy as np
import pytest
from marched_jobs import begun, marched
from restarting import ELASTIC, ROUGH, SLIDE, ZENER, Bench, cut, rows, same

from parcontact.files.recorder import StepRow
from parcontact.job.history import Timeline
from parcontact.march.loop import March, run_steps

GRID: dict[str, Any] = {"points": 32, "size": 1e-3}
DWELL = {"name": "dwell", "pressure": 1e4, "duration": 0.1, "time_step": {"first": 1e-4, "growth": 1.2}}


def job(*history: dict[str, Any], material: Any = ZENER, **changes: Any) -> dict[str, Any]:
    return {"grid": GRID, "surface": ROUGH, "material": material, "history": [*history], **changes}


def all_steps(data: dict[str, Any]) -> tuple[March, list[StepRow]]:
    """Without passing any over."""
    march, found = begun(data), list[StepRow]()
    run_steps(march, [lambda now: found.append(now.row)], Timeline.from_job(march.scene.job))
    return march, found


# -- when -------------------------------------------------------------------------------------------------------------


def test_an_elastic_body_is_solved_once() -> None:
    """Each further instant, at the end of a stage or asked for by its number, takes one look: one application."""
    push = {"name": "push", "pressure": 1e4}
    once, _ = marched(job(push, material=ELASTIC))
    calls = once.scene.slab.tally["operator"]
    march, found = marched(job(DWELL, {**DWELL, "pressure": 1e4}, material=ELASTIC))
    steps = len(Timeline.from_job(march.scene.job))
    assert [row.step for row in found] == [0, 1, 1 + (steps - 1) // 2, steps]
    assert march.scene.slab.tally["operator"] == calls + 2
    assert [row.iterations for row in found[2:]] == [0, 0]
    assert "replaces 29 further steps" in found[-1].remark
    every, found = marched(job({**DWELL, "time_step": 1e-2}, material=ELASTIC))
    assert [row.step for row in found] == list(range(12))
    assert every.scene.slab.tally["operator"] == calls + 10
    assert not any(row.remark for row in found)


NEVER: list[tuple[str, dict[str, Any]]] = [
    ("one time step", job({**DWELL, "time_step": 5e-3}, material=ELASTIC)),
    ("a ramp", job({**DWELL, "pressure": {"from": 1e4, "to": 1.01e4}}, material=ELASTIC)),
    ("sliding", job({**DWELL, "velocity": 1e-6}, material=ELASTIC)),
    ("a body that relaxes", job(DWELL, material=ZENER)),
    ("fields of every step", job(DWELL, material=ELASTIC, output={"fields": ["pressure"]})),
]


@pytest.mark.parametrize(("why", "data"), NEVER, ids=[why for why, _ in NEVER])
def test_all_steps_are_made(why: str, data: dict[str, Any]) -> None:
    march, found = marched(data)
    assert [row.step for row in found] == list(range(len(found)))
    assert len(found) == len(Timeline.from_job(march.scene.job)) + 1


def test_nothing_is_asked_where_nothing_can_be_passed_over() -> None:
    """Not one reduction more in sliding or dwelling at given instants."""
    data = job({**DWELL, "time_step": 5e-3}, {**SLIDE, "pressure": 1e4})
    march, _ = marched(data)
    plain, _ = all_steps(data)
    assert march.scene.slab.tally == plain.scene.slab.tally


# -- runs -------------------------------------------------------------------------------------------------------------


def dwelling(bench: Bench, **changes: Any) -> dict[str, Any]:
    history = [{**DWELL, "time_step": {"first": 1e-4, "growth": 2.0}}, {**SLIDE, "pressure": 1e4, "distance": 1e-4}]
    return bench.job("elastic", history=history, **changes)


@pytest.mark.mpi
def test_restarts_bit_for_bit(bench: Bench) -> None:
    """After any step, those that take the place of others among them; none passes one after which fields are due."""
    data, whole = dwelling(bench, output={"every": 5}), bench.where / "whole"
    assert bench.run(data, whole) == 0
    made = bench.comm.bcast([int(row["step"]) for row in rows(whole)] if bench.comm.rank == 0 else None)
    leaps = [(a, b) for a, b in pairwise(made) if b > a + 1]
    assert leaps
    assert {*range(5, made[-1], 5)} <= {*made}
    before, after = leaps[0]
    for step in (before - 1, before, after) if bench.comm.size == 1 else (before,):
        part = cut(bench, whole, step)
        assert bench.run(data, part) == 0
        if bench.comm.rank == 0:
            same(whole, part, made[-1])
    if bench.comm.rank == 0:
        assert re.search(
            rf"step {after} at .* replaces {after - before - 1} further steps", (whole / "run.log").read_text()
        )
        with h5py.File(whole / "fields.h5") as file:
            assert not np.isnan(file["t"][...]).any()
    bench.comm.Barrier()


def test_until_stops_within_a_dwell(bench: Bench) -> None:
    """At the step that reaches it, as without passing over; then it goes on to the end."""
    data, out = dwelling(bench, output={"fields": []}), bench.where / "out"
    timeline = Timeline.from_job(begun(data).scene.job)
    assert bench.run(data, out, until=0.06) == 0
    assert int(rows(out)[-1]["step"]) == timeline.first_reaching(0.06)
    assert bench.run(data, out) == 0
    assert int(rows(out)[-1]["step"]) == len(timeline)
    assert not [line for line in (out / "run.log").read_text().splitlines() if "warning" in line and "lost" in line]
