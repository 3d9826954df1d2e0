"""Long histories: nothing drifts. `scripts/random_scenes.py --long` does the same for 1e5 steps."""

from typing import Any

import numba
import numpy as np
import pytest

from parcontact.physics.loops import begin, commit
from parcontact.physics.prony import Integrator, Prony, coefficients

from .histories import drift, drifts

EPS = float(np.finfo(float).eps)
STEPS, TURN = 1_000_000, 64  # steps, and those of one period of the sine
MODULI, TIMES = np.geomspace(300.0, 0.15, 12), np.geomspace(1e-4, 1e7, 12)


@pytest.mark.parametrize(("contact", "periods"), [("full", 100), ("partial", 75)])
def test_back_and_forth(contact: str, periods: int) -> None:
    """Some 1600 and 1200 steps: the state is the same after every period, to rounding that does not add up, the energy
    to rounding that does; in full contact it is the state of the closed form."""
    found = drift(periods, contact)
    print(found)
    assert drifts(found) == []


@numba.njit
def driven(u: Any, decay: Any, gain: Any, count: int) -> Any:
    """Branches of a point after `count` steps through the displacements u, again and again; u[0] is the start."""
    branches, work, last, heights = np.zeros((decay.size, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1))
    pending, added, none, moved = np.ones(decay.size), np.zeros(decay.size), np.zeros(decay.size), np.zeros((1, 1))
    for n in range(1, count + 2):
        heights[0, 0] = u[n % u.size]
        begin(branches, pending, added, none, moved, work, decay, 0.0, 0.0, last, heights, 0)
        if n <= count:
            commit(work.copy(), work, last, heights, 0, last)
            moved, work = work, moved
            pending, added = decay, gain
    return branches[:, 0, 0]


@pytest.mark.parametrize("integrator", ["exponential-linear", "backward-euler"])
@pytest.mark.parametrize("count", [1000, STEPS, STEPS + TURN // 4 + 3])
def test_a_million_steps_of_a_point(integrator: Integrator, count: int) -> None:
    """Twelve branches, from one that forgets within a step to one that remembers all of them, driven by a sine.

    From rest `h_n = sum_j decay^(n-j) gain (u_j - u_(j-1))`, for u = Im e^(iwn) a geometric series: in closed form
    `h_n = gain Im[(1 - e^(-iw)) (e^(iwn) - decay^n) e^(iw)/(e^(iw) - decay)]`. A step rounds h and u (of size 1, as
    felt by the gain) some times and forgets `1 - decay` of what was wrong before: in n steps errors add up to those of
    `min(n, 1/(1 - decay))` steps at most, here of two roundings of 1 each.
    """
    prony = Prony(1.0, MODULI, TIMES)
    decay, gain, _ = coefficients(prony, integrator, 1.0)
    sine = np.sin(2 * np.pi * np.arange(TURN) / TURN)
    found = driven(sine, decay, gain, count)
    turn = np.exp(2j * np.pi / TURN)
    fading = np.exp(count * np.log(decay, where=decay > 0.0, out=np.full_like(decay, -np.inf)))
    series = (1.0 - 1.0 / turn) * (turn ** (count % TURN) - fading) * turn / (turn - decay)
    forget = -np.expm1(-1.0 / TIMES) if integrator == "exponential-linear" else 1.0 / (1.0 + TIMES)
    bound = 2 * EPS * gain * np.minimum(count, 1.0 / forget)
    print(np.max(np.abs(found - gain * series.imag) / bound))
    assert np.all(np.abs(found - gain * series.imag) <= bound)
