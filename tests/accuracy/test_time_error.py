"""Errors by the length of a step: what passes in it, what turns, and friction that rises."""

import math
from dataclasses import replace

import numpy as np
import pytest

from parcontact.march.budget import estimate
from parcontact.march.time_error import RunProperties, StepObservation, error_of_rise, radius_of, time_error
from parcontact.physics.prony import Prony

KNOWN = RunProperties(10_000, cells_per_wave=8.0)
SEEN = StepObservation(1e-3, 0.02, 0.1, 0.095, slope=0.02, difference=4e-4)


@pytest.mark.parametrize("exponential", [True, False])
def test_area_has_no_error_of_time_in_full_contact(exponential: bool) -> None:
    """And less where less is open; friction has one. An area is not known to less than a cell."""
    known, seen = replace(KNOWN, exponential=exponential), replace(SEEN, area=1.0, corrected=1.0)
    full, nearly, open_ = (estimate(known, replace(seen, area=area, corrected=area)) for area in (1.0, 0.9, 0.2))
    assert (full.area.time, full.area.mesh) == (0.0, pytest.approx(1e-4))
    assert full.friction is not None
    assert full.friction.time > 0.0
    assert 0.0 < nearly.area.time < open_.area.time


def test_backward_euler_is_of_the_first_order() -> None:
    """The pair differs in the second order: a quarter of the difference is half the error, of friction and of area."""
    known = replace(KNOWN, exponential=False)
    one, half = (estimate(known, replace(SEEN, difference=each)) for each in (4e-4, 1e-4))
    assert one.friction is not None
    assert half.friction is not None
    assert half.friction.time == pytest.approx(0.5 * one.friction.time)
    assert half.area.time == pytest.approx(0.5 * one.area.time)


def late(z: float) -> float:
    """L of the module of `time_error`."""
    return 1.0 / math.tanh(z / 2.0) - 2.0 / z


def test_spots_that_pass_within_a_step() -> None:
    """Branches that are faster than the step are the more wrong, in proportion to how far spots pass in it; several
    branches are as wrong as those between them."""

    def error(*times: float, slid: float = 1.0) -> float:
        known = replace(KNOWN, prony=Prony(1e5, np.full(len(times), 1e6), np.array(times)))
        return time_error(known, replace(SEEN, difference=0.0, slid=slid, seconds=1e-3))

    slow, equal, fast = (error(tau) for tau in (1e3, 1e-3, 1e-9))
    assert 0.0 < slow < equal < fast
    assert error(1e-9, slid=0.5) == pytest.approx(0.5 * fast, rel=0.05)  # and a little of the second order
    assert equal < error(1e-3, 1e-4) < error(1e-4)


@pytest.mark.parametrize(("order", "power"), [(1.0, 1.7), (1.2, 1.7 / 1.2), (2.0, 1.25)])
def test_order_of_the_pair(order: float, power: float) -> None:
    """The error goes with the power 1.7 of the step, the difference with its order: with that of the difference by
    which these agree, 1.25 at least."""
    one, other = (time_error(KNOWN, replace(SEEN, difference=e, order=order)) for e in (1e-4, 2e-4))
    assert other / one == pytest.approx(2.0**power, rel=1e-12)


@pytest.mark.parametrize("z", [1e-9, 0.9e-3, 1.1e-3, 2.0, 1e3])
def test_waves_that_turn_within_a_step(z: float) -> None:
    """In full contact, of one branch: L, a sixth of z where that has no digits left. The true error of a harmonic wave
    is two thirds of the estimate: short waves weigh more in friction than in what is seen of them."""
    dt, angle = 1e-3, 0.01
    known = replace(KNOWN, prony=Prony(1e5, np.array([1e6]), np.array([dt / z])))
    seen = StepObservation(0.0, 0.1, 1.0, 1.0, slid=1.0, seconds=dt, angle=angle)
    share = late(z) if z > 0.1 else z / 6.0
    found = time_error(known, seen)
    assert found == pytest.approx(angle**2 / 8.0 * (1.0 + share), rel=1e-6)
    decay, half = math.exp(-z), 2.0 * math.sin(angle / 2.0)
    lost = (1.0 - decay) ** 2 / z * math.sin(angle) / ((1.0 - decay) ** 2 + decay * half**2)
    exact = angle * z / (z**2 + angle**2)
    if z > 0.1:
        assert abs(lost / exact - 1.0) == pytest.approx(found / 1.5, rel=0.15)


# -- friction that rises ----------------------------------------------------------------------------------------------

STEPS, TAU = 10.0, 1e-3  # relaxation times in a step
LATE = 1.0 / math.tanh(0.5 * STEPS) - 2.0 / STEPS  # L of the module
RISING = RunProperties(10_000, prony=Prony(1e5, np.array([1e6]), np.array([TAU])))
RISEN = StepObservation(0.0, 0.1, 0.1, 0.08, slope=0.3, slid=1.0, seconds=STEPS * TAU)


def test_friction_that_rises_within_a_step_is_late() -> None:
    """By L of the step: friction of which nine tenths came in it is wrong by 0.9 L, and as much where it falls."""
    for change in (0.09, -0.09):
        assert error_of_rise(RISING, replace(RISEN, change=change)) == pytest.approx(0.9 * LATE, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_after_a_jump_friction_may_rise_by_what_the_body_loses(angle: float) -> None:
    """The change is slope times sine of the loss angle, of one branch with r = G/G_inf: r z/sqrt((1 + z^2) (1 + (1 +
    r)^2 z^2)), at the frequency z/tau with which spots pass by their radius, or waves by an angle."""
    z = max(1.0 / radius_of(RISING, RISEN), angle) / STEPS
    loss = 10.0 * z / math.sqrt((1.0 + z**2) * (1.0 + (11.0 * z) ** 2))
    found = error_of_rise(RISING, replace(RISEN, angle=angle, change=math.inf, uneven=0.2))
    assert found == pytest.approx(LATE * 0.2 * 0.3 * loss / 0.1, rel=1e-9)


@pytest.mark.parametrize("change", [0.09, math.inf])
@pytest.mark.parametrize(
    ("known", "seen"),
    [
        (RISING, replace(RISEN, slid=0.0)),  # at rest
        (RISING, replace(RISEN, friction=0.0)),
        (replace(RISING, prony=None), RISEN),  # elastic
        (replace(RISING, exponential=False), RISEN),
    ],
)
def test_where_no_friction_rises(known: RunProperties, seen: StepObservation, change: float) -> None:
    assert error_of_rise(known, replace(seen, change=change)) == 0.0


def test_the_error_of_a_rise_can_be_taken_from_a_budget() -> None:
    """The budget is then that without a change of friction."""
    risen = replace(RISEN, change=0.09)
    more = error_of_rise(RISING, risen) - time_error(RISING, risen)
    found, exact = estimate(RISING, risen).take_from_time(more), estimate(RISING, replace(risen, change=0.0))
    assert more > 0.3
    assert found.friction is not None
    assert exact.friction is not None
    assert found.friction.plain() == pytest.approx(exact.friction.plain(), rel=1e-12)
    assert found.area == exact.area
