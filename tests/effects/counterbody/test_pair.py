"""Two bodies in contact: the Prony series of the pair."""

import numpy as np
import pytest

from parcontact.effects.counterbody.effect import pair
from parcontact.physics.prony import Prony, complex_modulus

FREQUENCIES = np.logspace(-9, 9, 200)  # [rad/s], beyond the twelve decades of relaxation times on both sides
RUBBER = Prony(1e6, np.array([9e6]), np.array([1.0]))


def steel(modulus: float) -> Prony:
    return Prony(modulus, np.zeros(0), np.zeros(0))


def random_body(draw: np.random.Generator, times: np.ndarray) -> Prony:
    spring = 10 ** draw.uniform(-6, 6) if draw.random() < 0.8 or not times.size else 0.0
    return Prony(spring, 10 ** draw.uniform(-4, 6, times.size), times)


@pytest.mark.parametrize("seed", range(50))
def test_compliances_of_both_bodies_add_up(seed: int) -> None:
    """1/M = 1/G1 + 1/G2, also for fluids, equal times and times that differ by rounding; to 1e-10, which leaves room
    for sums of sixteen digits."""
    draw = np.random.default_rng(seed)
    first, second = (10 ** draw.uniform(-6, 6, count) for count in draw.integers(0, 12, 2))
    if first.size and second.size:
        second[0] = first[0] * (1 + draw.choice([0.0, 10 ** draw.uniform(-15, -1)]))
    bodies = random_body(draw, first), random_body(draw, second)
    expected = 1 / sum(1 / complex_modulus(FREQUENCIES, *body) for body in bodies)
    np.testing.assert_allclose(complex_modulus(FREQUENCIES, *pair(*bodies)), expected, rtol=1e-10)


def test_loss_of_rubber_on_an_elastic_body() -> None:
    """M'' = Im 1/(1/G* + 1/5) for G* = 1 + 9 i x/(1 + i x) MPa on 5 MPa, by hand."""
    x = np.array([0.1, 1.0, 3.0, 10.0])
    soft = 1 + 9j * x / (1 + 1j * x)
    found = complex_modulus(x, *pair(RUBBER, steel(5e6))).imag
    np.testing.assert_allclose(found / 1e6, (soft * 5 / (soft + 5)).imag, rtol=1e-12)
    np.testing.assert_allclose(found / 1e6, [0.58824, 0.86207, 0.32751, 0.09984], atol=6e-6)


def test_rigid_and_equal_counterbodies() -> None:
    np.testing.assert_allclose(
        complex_modulus(FREQUENCIES, *pair(RUBBER, steel(1e30))), complex_modulus(FREQUENCIES, *RUBBER)
    )
    twice = complex_modulus(FREQUENCIES, *pair(RUBBER, RUBBER))
    np.testing.assert_allclose(2 * twice, complex_modulus(FREQUENCIES, *RUBBER), rtol=1e-12)
