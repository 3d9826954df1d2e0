"""Dwells that have relaxed end in one step: when, with what error, and the same after a restart."""

import re
from itertools import pairwise
from typing import Any

import h5py
import numpy as np
import pytest
from marching import begun, column, marched
from restarting import ELASTIC, ROUGH, SLIDE, SPHERE, ZENER, Bench, cut, rows, same

from parcontact.history.timeline import Timeline
from parcontact.march import rest
from parcontact.march.loop import March, run
from parcontact.march.rest import SHARE, remaining
from parcontact.physics.body import ZenerBody, surface_of
from parcontact.storage.row import Row

GRID: dict[str, Any] = {"points": 32, "size": 1e-3}
DWELL = {"name": "dwell", "pressure": 1e4, "duration": 0.1, "time_step": {"first": 1e-4, "growth": 1.2}}
TIGHT = 1e-9
FLUID = {"model": "zener", "modulus_inf": 0.0, "branches": [{"modulus": 2e6, "relaxation_time": 1e-3}]}
WIDE = {  # a branch of each decade from 1e-6 to 1e3 s; the slow ones go on relaxing after the dwell
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 3e5, "relaxation_time": 10.0**decade} for decade in range(-6, 4)],
}


def job(*history: dict[str, Any], material: Any = ZENER, **changes: Any) -> dict[str, Any]:
    return {"grid": GRID, "surface": ROUGH, "material": material, "history": [*history], **changes}


def all_steps(data: dict[str, Any]) -> tuple[March, list[Row]]:
    """Without passing any over."""
    march, found = begun(data), list[Row]()
    run(march, [lambda now: found.append(now.row)], Timeline.of(march.scene.job))
    return march, found


# -- when -------------------------------------------------------------------------------------------------------------


def test_an_elastic_body_is_solved_once() -> None:
    """Each further instant, at the end of a stage or asked for by its number, takes one look: one application."""
    push = {"name": "push", "pressure": 1e4}
    once, _ = marched(job(push, material=ELASTIC))
    calls = once.scene.slab.tally["operator"]
    march, found = marched(job(DWELL, {**DWELL, "pressure": 1e4}, material=ELASTIC))
    steps = len(Timeline.of(march.scene.job))
    assert [row.step for row in found] == [0, 1, 1 + (steps - 1) // 2, steps]
    assert march.scene.slab.tally["operator"] == calls + 2
    assert [row.iterations for row in found[2:]] == [0, 0]
    assert "takes the place of 29 steps more" in found[-1].remark
    every, found = marched(job({**DWELL, "time_step": 1e-2}, material=ELASTIC))
    assert [row.step for row in found] == list(range(12))
    assert every.scene.slab.tally["operator"] == calls + 10
    assert not any(row.remark for row in found)


def test_a_relaxed_body_jumps_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """When less than a share is left of its creep, of a creep time of some ms; later for less: by that time for each
    factor e, in steps of 20 %. The solver is far more exact than the shares, here 1e-2 and 1e-4, so that its error,
    which is far larger on the edge of contact than its certificate, has no part in it."""
    ends = []
    for share in (1e-2, 1e-4):
        monkeypatch.setattr(rest, "SHARE", share / TIGHT)
        march, found = marched(job(DWELL, numerics={"tolerance": TIGHT}))
        total = len(Timeline.of(march.scene.job))
        assert [row.step for row in found[:-1]] == list(range(len(found) - 1))
        assert found[-1].step == total
        assert found[-1].time == pytest.approx(0.1, rel=1e-12)
        passed = f"step {total} at t = 0.1 s (stage 'dwell') takes the place of {total - len(found) + 1} steps more: "
        assert found[-1].remark == passed + "at rest, under a constant load, nothing changes by more than the tolerance"
        ends.append(found[-2].time)
    assert 5e-3 < ends[0] < 0.03
    assert 2e-3 < (ends[1] - ends[0]) / np.log(1e2) < 5e-3


NEVER: list[tuple[str, dict[str, Any]]] = [
    ("one time step", job({**DWELL, "time_step": 5e-3})),
    ("a ramp", job({**DWELL, "pressure": {"from": 1e4, "to": 1.01e4}})),
    ("sliding", job({**DWELL, "velocity": 1e-6})),
    ("a fluid", job(DWELL, material=FLUID)),
    ("slow branches", job(DWELL, material=WIDE, numerics={"branch_error": 0})),
    ("fields of every step", job(DWELL, material=ELASTIC, output={"fields": ["pressure"]})),
]


@pytest.mark.parametrize(("why", "data"), NEVER, ids=[why for why, _ in NEVER])
def test_all_steps_are_made(why: str, data: dict[str, Any]) -> None:
    march, found = marched(data)
    assert [row.step for row in found] == list(range(len(found)))
    assert len(found) == len(Timeline.of(march.scene.job)) + 1


def test_nothing_is_asked_where_nothing_can_be_passed_over() -> None:
    """Not one reduction more in sliding or dwelling at given instants."""
    data = job({**DWELL, "time_step": 5e-3}, {**SLIDE, "pressure": 1e4})
    march, _ = marched(data)
    plain, _ = all_steps(data)
    assert march.scene.slab.tally == plain.scene.slab.tally


# -- with what error --------------------------------------------------------------------------------------------------

BODIES = [("periodic", ROUGH, ZENER), ("free", SPHERE, ZENER), ("periodic", ROUGH, WIDE)]


@pytest.mark.parametrize("integrator", ["exponential", "backward-euler"])
@pytest.mark.parametrize("control", ["pressure", "approach"])
@pytest.mark.parametrize(("boundary", "surface", "material"), BODIES)
def test_what_remains_is_bounded(boundary: str, surface: Any, material: Any, control: str, integrator: str) -> None:
    """From every instant on, displacements change by no more than predicted: in the largest for a given approach, twice
    that where the load is given and the approach follows; 1e-7 of the largest is for the solves."""
    deep, light = {"pressure": (4e4, 1e4), "approach": (2e-6, 1e-6) if boundary == "free" else (-1e-7, -2e-7)}[control]
    press = {"name": "press", control: deep, "duration": 1e-3, "time_step": 2e-4}
    dwell = {"name": "dwell", control: light, "duration": 0.05, "time_step": {"first": 1e-4, "growth": 1.5}}
    data = job(press, dwell, material=material, surface=surface, grid={**GRID, "boundary": boundary})
    data["numerics"] = {"tolerance": TIGHT, "integrator": integrator, "branch_error": 0}
    march, predicted, seen = begun(data), list[float](), list[Any]()
    height = march.scene.solver.height

    def look(now: March) -> None:
        body = now.scene.material
        assert isinstance(body, ZenerBody)
        if now.row.time > 1e-3:
            u = surface_of(now.state.body)
            scale = min(float(np.abs(u).max()), height) if now.state.pressure.any() else height
            predicted.append(scale * remaining(now.scene, now.state, body, 0.051 - now.row.time))
            seen.append(u.copy())

    run(march, [look], Timeline.of(march.scene.job))
    largest = np.abs(seen[-1]).max()
    factor = 2.0 if control == "pressure" else 1.0
    for instant in range(len(seen)):
        changes = [np.abs(later - seen[instant]).max() for later in seen[instant:]]
        assert max(changes) <= factor * predicted[instant] + 1e-7 * largest
    assert max(np.abs(later - seen[0]).max() for later in seen) > 1e-3 * largest  # something did change


@pytest.mark.parametrize("precision", ["double", "mixed"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_the_end_of_a_dwell_is_that_of_all_its_steps(tolerance: float, precision: str) -> None:
    """Displacements to the tolerance of the jump and of both solves; then sliding goes on from there."""
    data = job(
        DWELL, {**SLIDE, "pressure": 1e4, "distance": 1e-4}, numerics={"tolerance": tolerance, "precision": precision}
    )
    (march, found), (plain, expected) = marched(data), all_steps(data)
    assert len(found) < len(expected)
    end, whole = (next(row for row in series if row.step == found[-5].step) for series in (found, expected))
    assert end.time == pytest.approx(0.1, rel=1e-12)
    height = march.scene.setup.height
    assert abs(end.measures.approach - whole.measures.approach) <= 3 * tolerance * height
    change = march.field("displacement") - plain.field("displacement")
    assert np.abs(change).max() <= 4 * tolerance * height
    assert end.measures.contact_area == pytest.approx(whole.measures.contact_area, rel=20 * tolerance + 2e-3)


def test_energies_are_those_of_all_steps() -> None:
    """The last of the creep dissipates next to nothing: to 1e-5 of all that was."""
    data = job(DWELL, numerics={"tolerance": 1e-5}, output={"energy": True})
    (_, found), (_, expected) = marched(data), all_steps(data)
    assert len(found) < len(expected)
    for name in ("work", "stored", "dissipated"):
        assert column(found, name)[-1] == pytest.approx(column(expected, name)[-1], rel=1e-5)


# -- runs -------------------------------------------------------------------------------------------------------------


def dwelling(bench: Bench, **changes: Any) -> dict[str, Any]:
    history = [{**DWELL, "time_step": {"first": 1e-4, "growth": 2.0}}, {**SLIDE, "pressure": 1e4, "distance": 1e-4}]
    return bench.job("viscoelastic", history=history, numerics={"tolerance": 1e-2 / SHARE}, **changes)


@pytest.mark.mpi
def test_restarts_bit_for_bit(bench: Bench) -> None:
    """After any step, the one that jumps among them: whether to jump is seen from what a checkpoint holds."""
    data, whole = dwelling(bench, output={"every": 5}), bench.where / "whole"
    assert bench.run(data, whole) == 0
    made = bench.comm.bcast([int(row["step"]) for row in rows(whole)] if bench.comm.rank == 0 else None)
    leaps = [(a, b) for a, b in pairwise(made) if b > a + 1]
    assert leaps
    assert {*range(5, made[-1], 5)} <= {*made}
    [(before, after)] = leaps
    for step in (before - 1, before, after) if bench.comm.size == 1 else (before,):
        part = cut(bench, whole, step)
        assert bench.run(data, part) == 0
        if bench.comm.rank == 0:
            same(whole, part, made[-1])
    if bench.comm.rank == 0:
        assert re.search(
            rf"step {after} at .* takes the place of {after - before - 1} steps more", (whole / "run.log").read_text()
        )
        with h5py.File(whole / "fields.h5") as file:
            assert not np.isnan(file["t"][...]).any()
    bench.comm.Barrier()


def test_until_stops_within_a_dwell(bench: Bench) -> None:
    """At the step that reaches it, as without passing over; then it goes on to the end."""
    data, out = dwelling(bench, output={"fields": []}), bench.where / "out"
    timeline = Timeline.of(begun(data).scene.job)
    assert bench.run(data, out, until=0.06) == 0
    assert int(rows(out)[-1]["step"]) == timeline.first_reaching(0.06)
    assert bench.run(data, out) == 0
    assert int(rows(out)[-1]["step"]) == len(timeline)
    assert not [line for line in (out / "run.log").read_text().splitlines() if "warning" in line and "lost" in line]


def test_a_checkpoint_is_not_passed_over(bench: Bench) -> None:
    """That of a step which was not made is written after the one that stands for it."""
    data, out = dwelling(bench, output={"fields": []}) | {"checkpoint": {"every": 3, "keep": 100}}, bench.where / "out"
    assert bench.run(data, out) == 0
    made = [int(row["step"]) for row in rows(out)]
    kept = {int(path.stem[5:]) for path in (out / "checkpoint").iterdir()}
    assert kept == {b for a, b in pairwise(made) if b // 3 > a // 3} | {made[-1]}


def test_steps_are_decided_on_one_by_one() -> None:
    """When the last one was made. One that stands for others takes all their time; nothing is extrapolated to it."""
    march = begun(job(DWELL, material=ELASTIC))
    timeline = Timeline.of(march.scene.job)
    steps = march.steps(timeline)
    first = next(steps)
    assert first == timeline[1]
    march.advance(first)
    last = next(steps)
    assert last == timeline[len(timeline)]._replace(dt=0.1, growth=0.0, passed=len(timeline) - 2)
    march.advance(last)
    assert not list(steps)


def test_branches_without_a_map_relax_first() -> None:
    """They bear the jump of a load, though nothing remembers them: the step after it is made."""
    fast = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 2e6, "relaxation_time": 1e-12}]}
    march, found = marched(job(DWELL, material=fast))
    assert isinstance(march.scene.material, ZenerBody)
    assert not march.scene.material.kept
    assert [row.step for row in found] == [0, 1, 2, len(Timeline.of(march.scene.job))]
    assert found[1].measures.contact_area < 0.9 * found[2].measures.contact_area
    assert found[2].measures.contact_area == found[3].measures.contact_area


def test_what_remains_is_the_same_whether_a_checkpoint_was_written() -> None:
    """To the last bit, though writing one advances the branches."""
    march, _ = marched(job({**DWELL, "duration": 3e-3, "time_step": 1e-3}))
    body = march.scene.material
    assert isinstance(body, ZenerBody)
    before = remaining(march.scene, march.state, body, 1e-3)
    march.entries()
    assert remaining(march.scene, march.state, body, 1e-3) == before
    assert begun_again(march) == before


def begun_again(march: March) -> float:
    """What remains to a march that begins with the maps of another."""
    other = begun(march.scene.job)
    assert isinstance(march.scene.material, ZenerBody)
    assert isinstance(other.scene.material, ZenerBody)
    units = march.scene.units
    entries = march.scene.material.entries(march.state.body, units)
    for name, entry in other.scene.material.entries(other.state.body, units).items():
        np.asarray(entry.value)[...] = entries[name].value
    other.state.pressure[...] = march.state.pressure
    return remaining(other.scene, other.state, other.scene.material, 1e-3)
