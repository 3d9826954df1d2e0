"""From which pressure the solve of a step starts."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from marching import SLS, begun, column, marched

import parcontact.march.step_errors
from parcontact.accuracy.budget import estimate
from parcontact.history.timeline import Step, Timeline
from parcontact.job import Job
from parcontact.march.loop import March
from parcontact.march.starts import make_start
from parcontact.parallel.slab import Array

CELL = 1e-3 / 32
WAVES = {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]}
SCENE = {"grid": {"points": 32, "size": 1e-3}, "surface": WAVES, "material": SLS}


def start_of(march: March, step: Step) -> Array:
    """The start of the next step for a modulus of 2."""
    contact = march.state.contact
    make_start(march.scene, contact.pressures, step, 2.0, contact.spare)
    return contact.spare.copy()


SLIDE = {"pressure": 1e4, "velocity": 0.1, "distance": 6 * CELL}


def test_half_cells_start_from_a_whole_cell_earlier() -> None:
    """A slide that is steady at its beginning: the pressure of one cell earlier, moved, is nearly that of now, and no
    half step but the first takes more operator calls than one of a cell (from half a cell earlier, twice as many).
    The start itself, along both axes and to the last bit."""
    before = {"state": "steady", "velocity": 0.1, "pressure": 1e4}

    def calls(cells: float) -> list[int]:
        _, rows = marched({**SCENE, "initial": before, "history": [{**SLIDE, "cells_per_step": cells}]})
        return [row.operator_calls for row in rows[1:]]

    assert max(calls(0.5)[1:]) <= max(calls(1.0))
    halves = {"pressure": 1e4, "velocity": [0.1, 0.1], "distance": 3 * 2**0.5 * CELL, "time_step": 5 * CELL}
    march = begun(Job.model_validate({**SCENE, "history": [halves]}))
    for step in itertools.islice(march.steps(), 5):
        if step.number > 3:
            start = start_of(march, step)
            earlier = march.state.contact.pressures[1]
            moved = np.roll(earlier.pressure, (1, 1), (0, 1)) * (earlier.alpha / 2.0)
            np.testing.assert_array_equal(start, moved)
        march.advance(step)


@pytest.mark.parametrize(("parts", "ago"), [(3, 3), (4, 4), (2, 2)])
def test_parts_of_a_cell_start_from_a_whole_cell_ago(parts: int, ago: int) -> None:
    """Of steps that a stage has chosen, once there are so many: the pressure of then, moved, to the last bit; its
    modulus is that of the step before."""
    chosen = {"pressure": 1e4, "velocity": 0.1, "distance": 3 * CELL}
    march = begun(Job.model_validate({**SCENE, "history": [chosen]}))
    given = Timeline.from_job(Job.model_validate({**SCENE, "history": [{**chosen, "cells_per_step": 1 / parts}]}))
    pressures = list[Array]()
    for step in itertools.islice(given, 8):
        start = start_of(march, step)
        if step.number > ago + 2:
            past = march.state.contact.pressures[ago - 1]
            np.testing.assert_array_equal(past.pressure, pressures[-ago])
            np.testing.assert_array_equal(start, np.roll(pressures[-ago], 1, 1) * (past.alpha / 2.0))
        march.advance(step)
        pressures.append(march.state.contact.last.pressure.copy())


# -- steps tell the estimate of the error of rising friction by how much it changed, and how uneven pressures ---------

INF, ONE, AMPLITUDE, SIDE = 1e6, 2e6, 1e-6, 1e-3
RUBBER = {"model": "zener", "modulus_inf": INF, "branches": [{"modulus": ONE, "relaxation_time": 1e-3}]}
FULL, PARTIAL = 1e5, 5e3  # pressures [Pa] above and below the amplitude of the wave of pressure at once, 38 kPa


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """The change of friction and the unevenness of every step."""
    made: list[tuple[float, float]] = []

    def note(run: Any, observed: Any) -> Any:
        if observed.change or not made or observed.uneven != made[-1][1]:  # not that without a change
            made.append((observed.change, observed.uneven))
        return estimate(run, observed)

    monkeypatch.setattr(parcontact.march.step_errors, "estimate", note)
    return made


def job(pressure: float, **sections: Any) -> dict[str, Any]:
    slide = {"pressure": pressure, "velocity": 0.1, "distance": 4 * SIDE / 32, "cells_per_step": 1}
    return {
        "grid": {"points": 32, "size": SIDE},
        "surface": {"shape": "wave", "amplitude": AMPLITUDE, "waves": [1, 0]},
        "material": RUBBER,
        "interface": {"shear_stress": 1e3},
        "history": [slide],
        "numerics": {"tolerance": 1e-6},
        **sections,
    }


def test_friction_of_the_body_changes_from_step_to_step(told: list[tuple[float, float]]) -> None:
    """Without the interface, to rounding. In the jump of the load and right after it the change is not known."""
    rows = marched(job(PARTIAL))[1][1:]
    own = column(rows, "friction") - column(rows, "friction_interface")
    changes = [change for change, _ in told]
    assert len(changes) == len(rows) == 5
    assert all(map(math.isinf, changes[:2]))
    np.testing.assert_allclose(changes[2:], np.diff(own)[1:], rtol=1e-12)


def test_a_steady_start_hands_on_its_friction(told: list[tuple[float, float]]) -> None:
    """The first step starts from the steady friction of the body, and so hardly changes it: by less than 2 % here."""
    start = {"state": "steady", "velocity": 0.1, "pressure": PARTIAL}
    steady = begun(job(PARTIAL, initial=start)).row.measures
    _, row, *_ = marched(job(PARTIAL, initial=start))[1]
    own = [found.friction - found.friction_interface for found in (steady, row.measures)]
    assert told[0][0] == pytest.approx(own[1] - own[0], rel=1e-9)
    assert abs(told[0][0]) < 0.02 * own[0]


@pytest.mark.parametrize(
    ("pressure", "uneven"), [(FULL, 4.0 * np.pi / SIDE * AMPLITUDE * (INF + ONE) / FULL), (PARTIAL, 1.0)]
)
def test_pressures_are_as_uneven_as_the_wave(told: list[tuple[float, float]], pressure: float, uneven: float) -> None:
    """At the jump of the load: in full contact by the amplitude 2 k h G over the pressure, to the tolerance; in partial
    contact by more than the pressure, which counts as 1."""
    marched(job(pressure))
    assert told[0][1] == pytest.approx(uneven, rel=1e-5)
