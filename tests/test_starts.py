"""From which pressure the solve of a step starts."""

import itertools

import numpy as np
from marching import SLS, begun, marched

from parcontact.job import Job
from parcontact.march.rest import steps_to_make

CELL = 1e-3 / 32
WAVES = {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]}
SCENE = {"grid": {"points": 32, "size": 1e-3}, "surface": WAVES, "material": SLS}
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
    for step in itertools.islice(steps_to_make(march, march.timeline()), 5):
        if step.number > 3:
            start = march._start(step, 2.0).copy()
            assert march.state.earlier is not None
            moved = np.roll(march.state.earlier, (1, 1), (0, 1)) * (march.state.alpha_old / 2.0)
            np.testing.assert_array_equal(start, moved)
        march.advance(step)
