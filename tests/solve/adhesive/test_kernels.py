"""Compiled loops of contacts that stick against the same in numpy; sums of some hundred numbers, so rounding only."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.solve.adhesive import kernels, law

S, RHO = 2.0, 0.3
LAWS = [law.Law(law.EXPONENTIAL, S, RHO), law.Law(law.DUGDALE, S, RHO, 0.4), law.Law(law.DUGDALE, S, RHO, 2 * RHO)]
SHAPES = [(5, 7), (1, 1), (0, 4)]


def maps(shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """A gap that is closed at some points, and four other maps."""
    gap, *others = np.random.default_rng(3).normal(size=(5, *shape))
    return np.maximum(gap, 0.0), *others


def attraction(one: law.Law, gap: np.ndarray) -> np.ndarray:
    if one.kind == law.EXPONENTIAL:
        return S * np.exp(-gap / RHO)
    return np.interp(gap, RHO + 0.5 * one.ramp * np.array([-1.0, 1.0]), [S, 0.0])


def gamma(one: law.Law, gap: np.ndarray) -> np.ndarray:
    """Return the energy at a gap. With a ramp that of Dugdale's law is the mean over it of `S (rho - g)` without: a
    quadrature of a kinked line, exact on either side of the kink."""
    if one.kind == law.EXPONENTIAL:
        return S * RHO * np.exp(-gap / RHO)
    low, high = (np.clip(RHO + 0.5 * sign * one.ramp - gap, 0.0, None) for sign in (-1.0, 1.0))
    return S * 0.5 * (high**2 - low**2) / one.ramp


def test_decay() -> None:
    """The exponential function of the C library, to what rounding x does to it; 0 beyond 1e-304."""
    found = [law.decay(x) for x in np.linspace(0.0, 699.0, 2001)]
    assert_allclose(found, np.exp(-np.linspace(0.0, 699.0, 2001)), rtol=700 * np.finfo(float).eps)
    assert [law.decay(x) for x in (0.0, 700.0, 1e300, np.inf)] == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("one", LAWS)
def test_energy_and_slope_of_the_attraction(one: law.Law) -> None:
    """`d gamma/dg = -sigma` by central differences (second order, 1e-4 of the range), `gamma(0) = s rho`, and sigma's
    slope is the softening; between the corners of the laws."""
    step = 1e-4 * RHO

    def energy(gap: float) -> float:
        return law.energy(one, gap, law.attraction(one, gap))

    assert_allclose(energy(0.0), S * RHO, rtol=1e-15)
    for gap in (0.1 * RHO, 0.7 * RHO, 1.2 * RHO, 2.1 * RHO):
        low, high = gap - step, gap + step
        here = law.attraction(one, gap)
        assert_allclose((energy(low) - energy(high)) / (2 * step), here, rtol=1e-7)
        slope = (law.attraction(one, low) - law.attraction(one, high)) / (2 * step)
        assert_allclose(slope, law.softening(one, here), rtol=1e-7)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("one", LAWS)
def test_residual(one: law.Law, shape: tuple[int, int]) -> None:
    gap, q, c, image, _ = maps(shape)
    working, sigma, pressed = np.zeros(shape, bool), np.empty(shape), q.copy()
    kernels.attract(one, gap, sigma)
    assert_allclose(sigma, attraction(one, gap), rtol=1e-14)
    count, total = kernels.press(gap, pressed, sigma, 0.3, image)
    assert_allclose(pressed, q + 0.3 * image, rtol=1e-14, atol=1e-14)
    assert count == (gap > 0.0).sum()
    assert_allclose(total, (pressed + sigma)[gap > 0.0].sum(), rtol=1e-12)
    count, total, attracted, least = kernels.residual(gap, q, sigma, -1.9, working, c)
    pushed = q - 1.9 + sigma
    inside = (gap > 0.0) | (pushed < 0.0)
    assert_array_equal(working, inside)
    assert_allclose(c, np.where(inside, pushed, 0.0), rtol=1e-14, atol=1e-14)
    assert count == inside.sum()
    assert_allclose((total, attracted), (pushed[inside].sum(), sigma.sum()), rtol=1e-12)
    assert least == (-gap).max(initial=-np.inf)


@pytest.mark.parametrize("size", [1.0, 1e-4])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("one", LAWS)
def test_change_of_energy(one: law.Law, shape: tuple[int, int], size: float) -> None:
    """Along a way that closes gaps; along a short one of the exponential law to 1e-7 of what surfaces gain."""
    gap, q, image, t, _ = maps(shape)
    way, new, sigma, sigma_new = (np.empty(shape) for _ in range(4))
    total, cut = kernels.lead(gap, t, 0.4 * size, way)
    assert_allclose(way, np.maximum(gap - 0.4 * size * t, 0.0) - gap, atol=1e-15)
    assert_allclose((total, cut), ((gap + way).sum(), (way + 0.4 * size * t).sum()), rtol=1e-12, atol=1e-12)
    kernels.attract(one, gap, sigma)
    rise, magnitude = kernels.move(one, gap, q, 0.2, sigma, 0.5, way, image, new, sigma_new)
    assert_allclose(new, gap + 0.5 * way, rtol=1e-14, atol=1e-15)
    assert_allclose(sigma_new, attraction(one, new), rtol=1e-14)
    surface = gamma(one, gap) - gamma(one, new)
    exact = (0.5 * way * (q + 0.2 + 0.25 * image) + surface).sum()
    assert_allclose(rise, exact, rtol=1e-12, atol=1e-13 + 1e-7 * np.abs(surface).sum() * (size < 1.0))
    assert magnitude >= abs(rise) * (1.0 - 1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_counts(shape: tuple[int, int]) -> None:
    _, p, other, *_ = maps(shape)
    other = np.maximum(other, 0.0)
    count, pull = kernels.tension(p, 0.5)
    assert count == (p < -0.5).sum()
    assert_allclose(pull, np.maximum(-p, 0.0).sum(), rtol=1e-13)
    assert_allclose(kernels.weigh(p, other), (np.abs(p).sum(), (np.abs(p) * other).sum()), rtol=1e-13)
    assert_allclose(kernels.weigh_off(p, other, 0.2), np.abs(p * (other - 0.2)).sum(), rtol=1e-13)
