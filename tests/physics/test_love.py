"""Love's influence coefficients against quadrature, a series far away, and themselves."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import dblquad

from parcontact.physics.love import love


@pytest.mark.parametrize("aspect", [1.0, 0.1, 30.0])
@pytest.mark.parametrize(("i", "j"), [(0, 0), (1, 0), (0, 1), (2, 3), (3.5, 0.0), (4.5, 2.25), (0.5, 9.0), (60, 7)])
def test_love_against_quadrature(i: float, j: float, aspect: float) -> None:
    """The integral of 1/r over the cell, in polar coordinates where the cell contains the origin."""
    x, y, dx, dy = i, j * aspect, 1.0, aspect
    if (i, j) == (0, 0):
        # Over the rectangle, int dphi r(phi): four triangles with legs dx/2, dy/2.
        expected = 2 * (dy / 2 * np.arcsinh(dx / dy) + dx / 2 * np.arcsinh(dy / dx)) * 2
    else:
        edges = x - dx / 2, x + dx / 2, y - dy / 2, y + dy / 2
        expected = dblquad(lambda b, a: 1 / math.hypot(a, b), *edges, epsabs=0, epsrel=1e-11)[0]
    assert_allclose(love(np.array(x), np.array(y), dx, dy), expected / (4 * np.pi), rtol=1e-10)


@pytest.mark.parametrize("aspect", [1.0, 3.0, 0.01])
def test_love_far_away(aspect: float) -> None:
    """No digits cancel: the series in the size of the cell over the distance to 1e-13, up to 8000 cells away."""
    dx, dy = 1.0, aspect
    i, j = np.meshgrid([0, 1, 500, 4096, 8000], [0, 3, 500, 4095, 8000])
    far = np.maximum(dx, dy) * 300 < np.hypot(i * dx, j * dy)
    x, y = (i * dx)[far], (j * dy)[far]
    r2 = x**2 + y**2
    second = (dx**2 * (3 * x**2 - r2) + dy**2 * (3 * y**2 - r2)) / (24 * r2**2)
    expected = dx * dy / (4 * np.pi * np.sqrt(r2)) * (1 + second)
    fourth = 0.1 * (max(dx, dy) / np.sqrt(r2)) ** 4
    assert np.all(np.abs(love(x, y, dx, dy) / expected - 1) <= 1e-13 + fourth)


@given(
    x=st.floats(-20, 20), y=st.floats(-20, 20), dx=st.floats(0.01, 10), dy=st.floats(0.01, 10), c=st.floats(1e-9, 1e9)
)
def test_love_is_symmetric_and_scales(x: float, y: float, dx: float, dy: float, c: float) -> None:
    def value(x: float, y: float, dx: float, dy: float, poisson: float = 0.5) -> float:
        return float(love(np.array(x), np.array(y), dx, dy, poisson))

    reference = value(x, y, dx, dy)
    for other in (
        value(-x, y, dx, dy),
        value(x, -y, dx, dy),
        value(y, x, dy, dx),
        value(c * x, c * y, c * dx, c * dy) / c,
    ):
        assert_allclose(other, reference, rtol=1e-12)
    assert_allclose(value(x, y, dx, dy, 0.2), 1.6 * reference, rtol=1e-14)


def test_cells_add_up() -> None:
    """A cell is the sum of its four quarters, near and far."""
    for i, j, aspect in product([0, 1, 4, 50], [0, 2, 5, 1000], [1.0, 20.0]):
        quarters = [(i + a, (j + b) * aspect) for a in (-0.25, 0.25) for b in (-0.25, 0.25)]
        x, y = np.array(quarters).T
        whole = love(np.array(float(i)), np.array(j * aspect), 1.0, aspect)
        assert_allclose(love(x, y, 0.5, aspect / 2).sum(), whole, rtol=2e-14)
