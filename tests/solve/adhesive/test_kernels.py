"""Compiled loops of contacts that stick against the same in numpy; sums of some hundred numbers, so rounding only."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.solve.adhesive import kernels

KINDS = [kernels.EXPONENTIAL, kernels.DUGDALE]
S, RHO = 2.0, 0.3
SHAPES = [(5, 7), (1, 1), (0, 4)]


def maps(shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """A gap that is closed at some points, and four other maps."""
    gap, *others = np.random.default_rng(3).normal(size=(5, *shape))
    return np.maximum(gap, 0.0), *others


@pytest.mark.parametrize("kind", KINDS)
def test_the_attraction_is_the_slope_of_the_energy(kind: int) -> None:
    """`d gamma/dg = -sigma` by central differences (second order, 1e-4 of the range), `gamma(0) = s rho`, and sigma's
    slope is the softening; between the corners of the law."""
    step = 1e-4 * RHO
    assert_allclose(kernels.energy(kind, S, RHO, 0.0), S * RHO, rtol=1e-15)
    for gap in (0.1 * RHO, 0.7 * RHO, 2.0 * RHO):
        low, high = gap - step, gap + step
        slope = (kernels.energy(kind, S, RHO, high) - kernels.energy(kind, S, RHO, low)) / (2 * step)
        assert_allclose(-slope, kernels.traction(kind, S, RHO, gap), rtol=1e-7)
        slope = (kernels.traction(kind, S, RHO, high) - kernels.traction(kind, S, RHO, low)) / (2 * step)
        assert_allclose(-slope, kernels.softening(kind, S, RHO, gap), rtol=1e-7)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", KINDS)
def test_residual(kind: int, shape: tuple[int, int]) -> None:
    gap, q, c, old, _ = maps(shape)
    before, working = c.copy(), np.zeros(shape, bool)
    sigma = S * np.exp(-gap / RHO) if kind == kernels.EXPONENTIAL else np.where(gap < RHO, S, 0.0)
    count, total, attraction, least = kernels.residual(kind, S, RHO, gap, q, -1.9, working, c, old)
    pushed = q - 1.9 + sigma
    inside = (gap > 0.0) | (pushed < 0.0)
    assert_array_equal(working, inside)
    assert_allclose(c, np.where(inside, pushed, 0.0), rtol=1e-14, atol=1e-14)
    assert_array_equal(old, before)
    assert count == inside.sum()
    assert_allclose((total, attraction), (pushed[inside].sum(), sigma.sum()), rtol=1e-12)
    assert least == (-gap).max(initial=-np.inf)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", KINDS)
def test_change_of_energy(kind: int, shape: tuple[int, int]) -> None:
    gap, q, q_new, t, _ = maps(shape)
    new = np.empty(shape)
    total, cut = kernels.advance(gap, t, 0.4, new)
    assert_allclose(new, np.maximum(gap - 0.4 * t, 0.0), rtol=1e-14, atol=1e-15)
    assert_allclose((total, cut), (new.sum(), (new - (gap - 0.4 * t)).sum()), rtol=1e-12, atol=1e-12)
    rise, size, moved = kernels.change(kind, S, RHO, gap, q, new, q_new)
    gamma = [sum(kernels.energy(kind, S, RHO, g) for g in each.ravel()) for each in (gap, new)]
    assert_allclose(rise, (0.5 * (new - gap) * (q + q_new)).sum() - gamma[1] + gamma[0], rtol=1e-12, atol=1e-13)
    assert_allclose(moved, (new - gap).sum(), rtol=1e-12, atol=1e-13)
    assert size >= abs(rise) * (1.0 - 1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_counts(shape: tuple[int, int]) -> None:
    gap, p, other, *_ = maps(shape)
    other = np.maximum(other, 0.0)
    assert kernels.count_flips(gap, other) == ((gap == 0.0) != (other == 0.0)).sum()
    count, pull = kernels.tension(p, 0.5)
    assert count == (p < -0.5).sum()
    assert_allclose(pull, np.maximum(-p, 0.0).sum(), rtol=1e-13)
    assert_allclose(kernels.weigh(p, other), (np.abs(p).sum(), (np.abs(p) * other).sum()), rtol=1e-13)
    assert_allclose(kernels.weigh_off(p, other, 0.2), np.abs(p * (other - 0.2)).sum(), rtol=1e-13)
