"""The steadily sliding cylinder against tables from another solution of its equations, quadrature and limits."""

import numpy as np
import pytest
from closed_forms.cylinder_sliding import pressure, sliding_cylinder
from closed_forms.quadrature import graded_rule
from numpy.polynomial import chebyshev
from numpy.testing import assert_allclose


@pytest.mark.parametrize(
    ("velocity", "friction", "half_width", "leading", "trailing"),
    [
        (0.01, 0.00898434676, 3.15777767, 3.16227375, -3.15328158),
        (0.03, 0.0268591229, 3.14877783, 3.16224261, -3.13531305),
        (0.1, 0.088434963, 3.11728383, 3.16189243, -3.07267524),
        (0.3, 0.2559347, 3.02744108, 3.15891375, -2.89596842),
        (1, 0.745957834, 2.71801715, 3.12835561, -2.30767869),
        (3, 1.44522893, 1.95108297, 2.92506117, -0.977104771),
        (10, 1.15996359, 1.12282623, 2.15177458, -0.09387788),
        (30, 0.563231032, 1.01529096, 1.5401813, -0.490400628),
        (100, 0.223639407, 1.00162784, 1.21398939, -0.789266284),
    ],
)
def test_edges_and_friction(
    velocity: float, friction: float, half_width: float, leading: float, trailing: float
) -> None:
    """Printed to 9 digits, from a solution with an error of 1e-9."""
    expected = (friction, half_width, leading, trailing)
    assert_allclose(sliding_cylinder(10, velocity), expected, rtol=2e-9, atol=5e-9)


@pytest.mark.parametrize(
    ("ratio", "friction"),
    [
        (2, [0.00497348, 0.0473514, 0.126368, 0.262159, 0.246251, 0.133471, 0.0627871, 0.0248556]),
        (10, [0.00898435, 0.088435, 0.255935, 0.745958, 1.44523, 1.15996, 0.563231, 0.223639]),
        (100, [0.009895, 0.0985001, 0.292501, 0.940093, 2.52646, 5.48365, 5.28346, 2.43362]),
    ],
)
def test_friction_of_other_bodies(ratio: float, friction: list[float]) -> None:
    """Printed to 6 digits."""
    velocities = (0.01, 0.1, 0.3, 1, 3, 10, 30, 100)
    assert_allclose([sliding_cylinder(ratio, v).friction for v in velocities], friction, rtol=4e-6)


@pytest.mark.parametrize("ratio", [1.5, 10, 1e4])
@pytest.mark.parametrize("velocity", [0.03, 1, 10, 1e3])
def test_pressure(ratio: float, velocity: float) -> None:
    """It is nowhere negative, zero at both edges, carries the force and its moment is the friction."""
    friction, half_width, leading, trailing = sliding_cylinder(ratio, velocity)
    share, _, weights = graded_rule()
    angle = np.pi * share
    x = (leading + trailing) / 2 - half_width * np.cos(angle)
    force = np.pi * weights * half_width * np.sin(angle) * pressure(x, ratio, velocity)
    assert_allclose(force.sum(), np.pi / 2, rtol=1e-9)
    assert_allclose((x * force).sum() / force.sum(), friction, rtol=1e-8)
    assert np.min(force) > -1e-12
    margin = 1e-12 * max(abs(leading), abs(trailing))
    edges = pressure(np.array([leading - margin, trailing + margin]), ratio, velocity)
    assert_allclose(edges, 0, atol=1e-3)  # it rises with the square root of the distance, steeply on stiff edges
    outside = np.array([leading + margin, trailing - margin, leading + 1, trailing - 1])
    assert np.all(pressure(outside, ratio, velocity) == 0)


@pytest.mark.parametrize("ratio", [2, 10, 1000])
def test_slow_sliding(ratio: float) -> None:
    """The contact is that of the long-term modulus, friction (1 - G(inf)/G(0)) v."""
    friction, half_width, leading, _ = sliding_cylinder(ratio, 1e-5)
    assert_allclose(friction, (1 - 1 / ratio) * 1e-5, rtol=1e-5)
    assert_allclose([half_width, leading], np.sqrt(ratio), rtol=1e-5)


@pytest.mark.parametrize("ratio", [2, 10, 1000])
def test_fast_sliding(ratio: float) -> None:
    """The contact is that of the instantaneous modulus, and friction dies out about as 1/v (times a logarithm)."""
    fast, faster = sliding_cylinder(ratio, 1e4 * ratio), sliding_cylinder(ratio, 1e5 * ratio)
    assert_allclose(faster[1:], [1, 1, -1], rtol=0, atol=1e-3)
    assert 7 < fast.friction / faster.friction < 10


def test_elastic_body_has_no_friction() -> None:
    """Ratio 1: Hertz's sqrt(1 - x^2) at any velocity."""
    x = np.linspace(-1, 1, 21)
    for velocity in (0.1, 1, 10):
        assert_allclose(sliding_cylinder(1, velocity), (0, 1, 1, -1), rtol=0, atol=1e-14)
        # the tolerance is for rounding of 1 - |x| at the edges
        assert_allclose(pressure(x, 1, velocity), np.sqrt(1 - x**2), rtol=0, atol=1e-7)


def test_the_surface_follows_the_equation_of_the_body() -> None:
    """In the contact the creep of the elastic slope e(x) of the pressure is the slope of the parabola.

    u'(x) = e(x) + (r - 1) int_0^inf exp(-w/v) e(x + w) dw/v = -x, in units of a0 and a0/R, with the principal value
    e(x) = -(1/pi) int p(s)/(x - s) ds. Its Chebyshev rule is inexact within 1e-4 ahead of the leading edge.
    """
    ratio, velocity, points = 10.0, 3.0, 400
    _, half_width, leading, trailing = sliding_cylinder(ratio, velocity)
    centre, angle = (leading + trailing) / 2, np.pi * (np.arange(points) + 0.5) / points
    source = centre + half_width * np.cos(angle)
    strength = pressure(source, ratio, velocity) * half_width * np.sin(angle) / points

    def slope(x: np.ndarray) -> np.ndarray:
        return -np.sum(strength / (x[:, None] - source), axis=1)

    between = np.cos(np.pi * np.arange(1, points) / points)
    inside = chebyshev.chebfit(between, slope(centre + half_width * between), 60)
    share, _, weights = graded_rule()
    ahead = 40 * velocity * share
    memory = np.sum(40 * weights * np.exp(-ahead / velocity) * slope(leading + ahead))
    for x in np.linspace(0.99 * trailing, 0.99 * leading, 9):
        way = (leading - x) * share
        recent = chebyshev.chebval((x + way - centre) / half_width, inside)
        crept = (leading - x) / velocity * np.sum(weights * np.exp(-way / velocity) * recent)
        crept += np.exp(-(leading - x) / velocity) * memory
        now = chebyshev.chebval((x - centre) / half_width, inside)
        assert_allclose(now + (ratio - 1) * crept, -x, rtol=0, atol=1e-4)
