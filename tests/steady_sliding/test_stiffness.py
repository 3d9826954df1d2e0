"""Which way is taken to a steady state, by the moduli of a body of one branch."""

import numpy as np
import pytest

from parcontact import scene
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.scene import Setup
from parcontact.steady_sliding.stiffness import CONTRAST, LOSSY, SOFT, loses_most, soft_stripes

TIME, SIZE = 1e-3, 1e-3
FAST = 1e3 * SIZE / TIME  # all waves see the modulus at once


def body(ratio: float, points: tuple[int, int] = (32, 48), boundary: str = "periodic") -> Setup:
    """`ratio` times as stiff at once as in the end."""
    made = Job.model_validate(
        {
            "grid": {"points": points, "size": SIZE, "boundary": boundary},
            "surface": {"shape": "sphere", "radius": 1e-2},
            "material": {
                "model": "zener",
                "modulus_inf": 1e6,
                "branches": [{"modulus": (ratio - 1.0) * 1e6, "relaxation_time": TIME}],
            },
            "history": [{"pressure": 1e5}],
        }
    )
    return scene.set_up(made, Slab.alone(*points))


def test_soft_stripes() -> None:
    """At high speed, of more than `CONTRAST` times the modulus; along either axis, but in no other direction."""
    stiff = body(1.01 * CONTRAST)
    assert [soft_stripes(stiff, way) for way in ((FAST, 0.0), (-FAST, 0.0), (0.0, FAST))] == [1, 1, 0]
    assert [soft_stripes(stiff, way) for way in ((FAST, FAST), (1e-3 * FAST / 48, 0.0), (0.0, 0.0))] == [None] * 3
    assert soft_stripes(body(0.99 * CONTRAST), (FAST, 0.0)) is None
    assert soft_stripes(body(1.01 * CONTRAST, (32, 1)), (FAST, 0.0)) is None
    assert soft_stripes(body(1.01 * CONTRAST, boundary="free"), (FAST, 0.0)) is None


def test_loses_most() -> None:
    """The loss tangent of a body r times as stiff at once is (r - 1)/(2 sqrt(r)) at most, where `w tau = 1/sqrt(r)`.

    |G| is sqrt(r) G_inf there: more than `SOFT`, if this is the longest wave. Beside the second, the longest has half.
    """
    root = LOSSY + (LOSSY**2 + 1.0) ** 0.5  # of r, for a loss tangent of LOSSY
    second = SIZE / (2.0 * np.pi * TIME * root) / 2.0  # velocity at which the second wave loses most
    assert 0.5 * root < SOFT < root
    assert loses_most(body(1.05 * root**2), (second, 0.0))
    assert loses_most(body(1.05 * root**2), (0.0, -second))
    assert not loses_most(body(0.95 * root**2), (second, 0.0))
    assert not loses_most(body(1.05 * root**2), (2.0 * second, 0.0))


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (1e-9, 0.0)])
def test_a_body_at_rest_is_relaxed(velocity: tuple[float, float]) -> None:
    assert not loses_most(body(1000.0), velocity)
    assert soft_stripes(body(1000.0), velocity) is None
