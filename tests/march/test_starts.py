"""From which pressure the solve of a step starts."""

import itertools
from typing import Any

import numpy as np
import pytest
from marched_jobs import SLS, begun, marched

import parcontact.march.state
from parcontact.job import Job
from parcontact.job.history import Step
from parcontact.march.budget import estimate
from parcontact.march.laws import make_start
from parcontact.march.loop import March
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


def test_an_elastic_body_that_stands_starts_from_its_last_pressure() -> None:
    history = [{"pressure": 1e4}, {"pressure": 2e4}]
    march = begun({**SCENE, "material": {"model": "elastic", "shear_modulus": 1e6}, "history": history})
    march.advance(next(march.steps()))
    (last,) = march.state.contact.pressures
    march.state.contact.spare.fill(np.nan)
    assert np.array_equal(start_of(march, next(march.steps())), last.pressure)


# -- steps tell the estimate of the error of rising friction by how much it changed, and how uneven pressures ---------

INF, ONE, AMPLITUDE, SIDE = 1e6, 2e6, 1e-6, 1e-3
RUBBER = {"model": "zener", "modulus_inf": INF, "branches": [{"modulus": ONE, "relaxation_time": 1e-3}]}
FULL, PARTIAL = 1e5, 5e3  # pressures [Pa] above and below the amplitude of the wave of pressure at once, 38 kPa


@pytest.fixture
def stated(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """The change of friction and the unevenness of every step."""
    made: list[tuple[float, float]] = []

    def note(run: Any, observed: Any) -> Any:
        if observed.change or not made or observed.uneven != made[-1][1]:  # not that without a change
            made.append((observed.change, observed.uneven))
        return estimate(run, observed)

    monkeypatch.setattr(parcontact.march.state, "estimate", note)
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


def test_a_steady_start_hands_on_its_friction(stated: list[tuple[float, float]]) -> None:
    """The first step starts from the steady friction of the body, and so hardly changes it: by less than 2 % here. At
    the tolerance of 1e-6 no point penetrates without pressure, so that the solver's error of the area is as small."""
    start = {"state": "steady", "velocity": 0.1, "pressure": PARTIAL}
    steady = begun(job(PARTIAL, initial=start)).row.measures
    _, row, *_ = marched(job(PARTIAL, initial=start))[1]
    own = [found.friction - found.friction_interface for found in (steady, row.measures)]
    assert stated[0][0] == pytest.approx(own[1] - own[0], rel=1e-9)
    assert abs(stated[0][0]) < 0.02 * own[0]
    assert row.errors is not None
    assert row.errors.area.solver < 1e-4
