"""The instants of a history against sums over its steps, and how little a long one costs."""

import tracemalloc
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from parcontact.job import Grid, Stage
from parcontact.job.history import Timeline, divide, reached

GRID = Grid(points=(16, 12), size=(1e-3, 7.5e-4))
SLIDE = {"pressure": 1e4, "velocity": 0.1, "cells_per_step": 1}
MILLION: dict[str, Any] = {**SLIDE, "distance": 1e6 * GRID.dx}


def history(*stages: dict[str, Any]) -> tuple[Stage, ...]:
    return tuple(Stage.model_validate(stage) for stage in stages)


def timeline(*stages: dict[str, Any], **options: Any) -> Timeline:
    return Timeline(history(*stages), GRID, **options)


LOADS = st.sampled_from([0.0, 1e4, 2e4, {"from": 1e4, "to": 3e4}, {"from": 0.0, "to": 1e4}])
LENGTHS = st.floats(1e-4, 1e-2)
STEPS = st.one_of(
    st.floats(2e-4, 1e-2),
    st.builds(lambda first, growth: {"first": first, "growth": growth}, st.floats(1e-5, 1e-3), st.floats(1.05, 3.0)),
)
KEPT = {
    "velocity": st.sampled_from([0.0, 0.1, -0.3, [0.1, -0.2], [0.0, 0.05]]),
    "duration": LENGTHS,
    "time_step": STEPS,
}
STAGES = st.one_of(
    st.fixed_dictionaries({"pressure": st.sampled_from([0.0, 1e4])}),
    st.fixed_dictionaries({"pressure": LOADS, **KEPT}),
    st.fixed_dictionaries({"approach": st.sampled_from([-1e-6, 1e-6]), **KEPT}),
)


@given(st.lists(STAGES, min_size=1, max_size=4), st.sampled_from([0.0, 0.05]), st.sampled_from([None, 1e4]))
def test_steps_add_up(stages: list[dict[str, Any]], until: float, pressure: float | None) -> None:
    """Times are sums of dt, positions of velocity times dt, loads linear in time: to 1e-12 of the largest."""
    found = timeline(*stages, until=until, pressure=pressure)
    steps = list(found)
    assert [step.number for step in steps] == list(range(1, len(found) + 1))
    assert steps == [found[number] for number in range(1, len(found) + 1)]
    times = [step.time for step in steps]
    np.testing.assert_allclose(list(accumulate(step.dt for step in steps)), times, rtol=1e-12)
    moved = np.cumsum([np.array(step.velocity) * step.dt for step in steps], axis=0)
    np.testing.assert_allclose([step.position for step in steps], moved, atol=1e-12 * np.abs(moved).max(), rtol=0)
    for old, new in pairwise(steps):
        if new.growth:
            assert new.growth == pytest.approx(new.dt / old.dt, rel=1e-12)
        assert (new.growth == 0.0) == (old.stage != new.stage or old.jump)
    ends = np.cumsum([stage.seconds for stage in history(*stages)])
    for step in steps:
        stage = history(*stages)[step.stage]
        share = min((step.time - ends[step.stage]) / stage.seconds + 1.0, 1.0) if stage.seconds else 0.0
        assert step.load == pytest.approx((1 - share) * stage.load.start + share * stage.load.end, rel=1e-9, abs=1e-9)
    assert found.end == (times[-1] if times else 0.0)
    assert reached(found.end, until) or not found.spans[-1].count
    assert found.moves == bool(np.any(moved))
    assert found.lasts == any(step.dt for step in steps)
    for time in (0.0, 0.3 * found.end, found.end, 2.0 * found.end):
        first = next((step.number for step in steps if reached(step.time, time)), len(steps))
        assert found.first_reaching(time) == first


@pytest.mark.parametrize(
    ("stages", "number"),
    [
        ([{**SLIDE, "distance": 10 * GRID.dx}], None),
        (
            [{**SLIDE, "distance": 10 * GRID.dx, "cells_per_step": 2}, {**SLIDE, "velocity": -0.2, "distance": 1e-3}],
            None,
        ),
        ([{**SLIDE, "distance": 2.5 * GRID.dx}], 2),
        ([{**SLIDE, "distance": 10.5 * GRID.dx, "cells_per_step": 10.5}, {**SLIDE, "distance": 1e-3}], 2),
        ([{**SLIDE, "velocity": [0.1, 0.1], "distance": 1e-3}], 2),
        ([{**SLIDE, "distance": (1e4 + 9e-6) * GRID.dx}], 1113),  # 9e-10 of a cell more in each step
        ([{"pressure": 1e4, "duration": 1.0, "time_step": {"first": 0.1, "growth": 2.0}}], None),
    ],
)
def test_where_the_surface_first_is_between_cells(stages: list[dict[str, Any]], number: int | None) -> None:
    """Against a look at every step; `SAME_PLACE` is 1e-6 cells."""
    found = timeline(*stages)
    cells = np.array([np.array(step.position) / (GRID.dx, GRID.dy) for step in found])
    off = (np.abs(cells[:, 0] - np.round(cells[:, 0])) >= 1e-6) | (cells[:, 1] != 0.0)
    expected = int(np.argmax(off)) + 1 if off.any() else None
    step = found.first_between_cells()
    assert (step and step.number) == expected
    assert expected == number


def test_a_million_steps_cost_nothing_before_they_are_made() -> None:
    """Neither memory nor a look at each; a restart finds its step at once."""
    tracemalloc.start()
    found = timeline(MILLION, until=1.2 * MILLION["distance"] / 0.1)
    assert len(found) == 1_200_001
    assert found.first_between_cells() is None
    assert found.moves
    assert found.first_reaching(100.0) == pytest.approx(100.0 * 0.1 / GRID.dx, abs=2)
    assert found[1_000_000].position[0] == pytest.approx(999_999 * GRID.dx, rel=1e-12)
    assert found.shared(timeline(MILLION, {"pressure": 2e4}, until=found.end)) == 0
    assert found.shared(timeline(MILLION, until=found.end)) == len(found)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100_000


def test_only_stages_alike_are_shared() -> None:
    press = {"pressure": 1e4, "duration": 1.0, "time_step": 0.1}
    one = timeline(press, {**SLIDE, "distance": 1e-3})
    assert one.shared(timeline(press, {**SLIDE, "distance": 2e-3})) == 11
    assert one.shared(timeline({**press, "pressure": 2e4}, {**SLIDE, "distance": 1e-3})) == 0


def test_there_is_no_step_zero() -> None:
    found = timeline(SLIDE | {"distance": 1e-3})
    for number in (0, len(found) + 1):
        with pytest.raises(IndexError):
            found[number]


def test_steps_are_fitted_to_the_end_of_a_stage() -> None:
    """None is longer than asked for; a duration that is a whole number of steps but for rounding is one."""
    for duration, step, count in ((1.0, 0.1, 10), (1.0, 0.3, 4), (0.7, 0.1, 7), (1.0, 5.0, 1)):
        [stage] = history({"pressure": 1.0, "duration": duration, "time_step": step})
        assert divide(stage, GRID).count == count
    [stage] = history({"pressure": 1.0, "duration": 7.0, "time_step": {"first": 1.0, "growth": 2.0}})
    assert [divide(stage, GRID)[index] * 7.0 for index in range(4)] == pytest.approx([0.0, 1.0, 3.0, 7.0])
