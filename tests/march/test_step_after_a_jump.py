"""Steps that choose themselves after a jump of the velocity: short ones at first, which grow to whole cells."""

import itertools
from typing import Any

import numpy as np
import pytest
from marching import begun, column, example, marched

from parcontact.history.chosen import MadeStep
from parcontact.history.timeline import Step
from parcontact.job import Job
from parcontact.march.choosing import LEAST_WAY, cells_per_step

POINTS = 32
CELL = 1e-3 / POINTS
SUDDEN = {
    "grid": {"points": POINTS, "size": 1e-3},
    "surface": {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]},
    "material": {"model": "zener", "modulus_inf": 1e5, "branches": [{"modulus": 2e6, "relaxation_time": 3e-5}]},
    "initial": {"state": "steady", "velocity": 0.01, "pressure": 1e4},
    "history": [{"pressure": 1e4, "velocity": 1.0, "distance": 6.5 * CELL}],
}


def data(accuracy: float) -> dict[str, Any]:
    return {**SUDDEN, "numerics": {"accuracy": accuracy}}


def test_a_step_that_is_made_anew_leaves_nothing() -> None:
    """The state after it is that of a march to which the shorter step was proposed at once: to the last bit."""
    sudden = Job.model_validate(data(1e-3))
    tried, told = begun(sudden), begun(sudden)
    made: list[Step] = []
    rejected = 0
    for step in itertools.islice(tried.steps(), 12):
        attempts = [step]

        def judge(error: float, front: float, begins: bool) -> Step | MadeStep:
            verdict = attempts[-1].judge(error)  # type: ignore[misc]  # noqa: B023  # it is called in this turn only
            if not isinstance(verdict, Step):
                return verdict
            attempts.append(verdict)  # noqa: B023
            return verdict._replace(judge=judge)

        tried.advance(step._replace(judge=judge) if step.judge else step)
        made.append(attempts[-1]._replace(judge=None))
        rejected += len(attempts) - 1
    for step in made:
        told.advance(step)
    assert rejected > 0
    for name, entry in told.entries().items():
        if not (name.startswith(("steps/", "row/")) or "position" in name):
            np.testing.assert_array_equal(np.asarray(entry.value), np.asarray(tried.entries()[name].value), name)


def test_steps_double_at_most() -> None:
    """After a jump, until they are whole cells: but for the part that leads to a multiple of a new length."""
    for accuracy in (3e-3, 1e-2, 2e-2):
        march, _ = marched(data(accuracy))
        assert march.state.chosen is not None
        ends = np.array([0.0, *march.state.chosen.ends[0]]) / CELL
        steps = np.diff(ends)
        assert (steps[1:] <= (1.0 + LEAST_WAY) * 2.0 * steps[:-1]).all()
        for end in range(1, 7):
            assert min(abs(ends - end)) < 1e-9


def test_lengths_of_steps() -> None:
    """Whole cells in powers of two; then every part of one, and four to each factor of two below an eighth."""
    parts = sorted({round(1.0 / cells_per_step(1.0 / most), 9) for most in np.arange(1.0, 40.0, 0.25)})
    assert parts == [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40]
    assert [cells_per_step(most) for most in (1.0, 1.9, 2.0, 3.9, 4.0)] == [1, 1, 2, 2, 4]
    assert all(cells_per_step(1.0 / most) <= (1.0 + 1e-5) / most for most in np.arange(1.0, 100.0, 0.3))


def test_a_jump_of_velocity_needs_one_stage() -> None:
    """`jobs/velocity_step.yaml` on a coarse grid: the highest friction at 2 % is within 1 % of that at 0.3 %; the first
    steps after the jump are far shorter than a cell."""
    small = ("grid.points=64", "surface.0.short_wavelength=1.25e-4", "history.1.distance=3.0e-5", "output.fields=[]")
    peaks = []
    for accuracy in (0.02, 0.003):
        march, rows = marched(example("velocity_step", *small, f"numerics.accuracy={accuracy}"))
        peaks.append(column(rows[1:], "friction").max())
        jump = march.timeline().spans[1].before
        assert rows[jump + 1].distance - rows[jump].distance < 0.05 * 1e-3 / 64
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-2)
