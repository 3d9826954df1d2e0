"""From which pressure the solve of a step starts."""

import itertools

import numpy as np
import pytest
from marching import SLS, begun, marched

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
    given = Timeline.of(Job.model_validate({**SCENE, "history": [{**chosen, "cells_per_step": 1 / parts}]}))
    pressures = list[Array]()
    for step in itertools.islice(given, 8):
        start = start_of(march, step)
        if step.number > ago + 2:
            past = march.state.contact.pressures[ago - 1]
            np.testing.assert_array_equal(past.pressure, pressures[-ago])
            np.testing.assert_array_equal(start, np.roll(pressures[-ago], 1, 1) * (past.alpha / 2.0))
        march.advance(step)
        pressures.append(march.state.contact.last.pressure.copy())
