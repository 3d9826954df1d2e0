"""The steady crack, against printed numbers and their limits."""

import numpy as np
import pytest
from closed_forms import viscoelastic_adhesion
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES

RATIO = 10.0
SOLID = (1.0, [RATIO - 1], [1.0])  # creeps with tau_c = k tau = 10 s


@pytest.mark.parametrize(("velocity", "opening", "closing"), [(0.1, 1.1981, 0.8175), (10.0, 4.5272, 0.2001)])
def test_steady_crack(velocity: float, opening: float, closing: float) -> None:
    """V tau_c/c0 = `velocity`; to the digits printed."""
    assert_allclose(viscoelastic_adhesion.opening_crack(velocity / RATIO, *SOLID), opening, rtol=2e-5)
    assert_allclose(viscoelastic_adhesion.closing_crack(velocity / RATIO, *SOLID), closing, rtol=3e-4)


@pytest.mark.parametrize("crack", [viscoelastic_adhesion.opening_crack, viscoelastic_adhesion.closing_crack])
def test_crack_at_its_limits(crack: object) -> None:
    """Slow: 1, and away from it like V ln V; fast: k or 1/k; no relaxation: 1 at any velocity."""
    assert callable(crack)
    slow = crack(1e-6, *SOLID) - 1
    assert 1e-6 < abs(slow) < 1e-4
    limit = RATIO if slow > 0 else 1 / RATIO
    assert_allclose(crack(1e9, *SOLID), limit, rtol=1e-6)
    assert_allclose(crack(1.0, 1.0, [1e-9], [1.0]), 1, rtol=2e-9)


def test_first_loss_is_the_same_opening_and_closing() -> None:
    """A slow cycle loses as much when it opens as when it closes: both depart from 1 by int (1 - e) F' dx."""
    opening = viscoelastic_adhesion.opening_crack(1e-6, *SOLID) - 1
    closing = viscoelastic_adhesion.closing_crack(1e-6, *SOLID) - 1
    assert_allclose(opening, -closing, rtol=1e-4)


def test_strength_rises_with_velocity() -> None:
    """Also of twelve branches, from 1 to k, between that of the slowest branch alone and the body's ratio."""
    velocities = np.geomspace(1e-8, 1e10, 10)
    opening = [viscoelastic_adhesion.opening_crack(velocity, *TWELVE_DECADES) for velocity in velocities]
    closing = [viscoelastic_adhesion.closing_crack(velocity, *TWELVE_DECADES) for velocity in velocities]
    assert np.all(np.diff(opening) > 0)
    assert np.all(np.diff(closing) < 0)
    assert 1 <= opening[0] < opening[-1] <= 1 + TWELVE_DECADES.moduli.sum() / TWELVE_DECADES.modulus_inf


def test_a_liquid_has_no_crack_at_rest() -> None:
    with pytest.raises(ValueError, match="must be positive"):
        viscoelastic_adhesion.opening_crack(1.0, 0.0, [1.0], [1.0])
