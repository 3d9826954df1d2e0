"""Error of friction that rises within a step."""

import math
from dataclasses import replace

import numpy as np
import pytest

from parcontact.accuracy.time_error import RunProperties, StepObservation, error_of_rise, radius_of
from parcontact.physics.prony import Prony

STEPS, TAU = 10.0, 1e-3  # relaxation times in a step
LATE = 1.0 / math.tanh(0.5 * STEPS) - 2.0 / STEPS  # L of the module
KNOWN = RunProperties(8.0, False, 0.0, True, Prony(1e5, np.array([1e6]), np.array([TAU])))
SEEN = StepObservation(0.0, 0.0, 2.0, 0.3, 0.1, 0.1, 0.08, slid=1.0, seconds=STEPS * TAU)
AFTER_JUMP = math.inf


def test_friction_that_rises_within_a_step_is_late() -> None:
    """By L of the step: friction of which nine tenths came in it is wrong by 0.9 L, and as much where it falls."""
    for change in (0.09, -0.09):
        assert error_of_rise(KNOWN, SEEN, 10_000, change, 1.0) == pytest.approx(0.9 * LATE, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_after_a_jump_it_may_rise_by_what_the_body_loses(angle: float) -> None:
    """Slope times sine of the loss angle, of one branch with r = G/G_inf: r z/sqrt((1 + z^2) (1 + (1 + r)^2 z^2)), at
    the frequency z/tau with which spots pass by their radius, or waves by an angle."""
    z = max(1.0 / radius_of(KNOWN, SEEN, 10_000), angle) / STEPS
    loss = 10.0 * z / math.sqrt((1.0 + z**2) * (1.0 + (11.0 * z) ** 2))
    found = error_of_rise(KNOWN, replace(SEEN, angle=angle), 10_000, AFTER_JUMP, 0.2)
    assert found == pytest.approx(LATE * 0.2 * 0.3 * loss / 0.1, rel=1e-9)


@pytest.mark.parametrize("change", [0.09, AFTER_JUMP])
@pytest.mark.parametrize(
    ("known", "seen"),
    [
        (KNOWN, replace(SEEN, slid=0.0)),  # at rest
        (KNOWN, replace(SEEN, friction=0.0)),
        (replace(KNOWN, prony=None), SEEN),  # elastic
        (replace(KNOWN, exponential=False), SEEN),
    ],
)
def test_else_it_is_not(known: RunProperties, seen: StepObservation, change: float) -> None:
    assert error_of_rise(known, seen, 10_000, change, 1.0) == 0.0
