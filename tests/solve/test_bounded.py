"""Pressures up to a hardness: the conditions, an independent solver, and what the bound costs."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from parcontact.contact import starts
from parcontact.contact.problem import Approach, Box, Contact, MeanPressure

from .bodies import BODIES, TIGHT, Bench, Map, rough, solver, white

ROUNDING = 1e-12
LOADS = [0.1, 0.5, 3.0]


def bounded(h: Map, highest: float, **options: Any) -> Bench:
    body = solver(h, **options)
    body.constraint = Box(highest=highest)
    return body


def hardness(h: Map, mean: float, share: float, **options: Any) -> float:
    """A pressure that this share of the contact exceeds where nothing yields."""
    p = solver(h, **options).solve(h, MeanPressure(mean), np.zeros_like(h)).p
    return float(np.quantile(p[p > 0.0], 1.0 - share))


def sphere(points: int) -> Map:
    x = (np.arange(points) + 0.5) / points - 0.5
    return np.asarray(-(x[:, None] ** 2 + x**2) / 2.0)


@pytest.mark.parametrize(("boundary", "kernel"), BODIES)
@pytest.mark.parametrize("mean", LOADS)
def test_the_conditions_hold(boundary: str, kernel: str, mean: float) -> None:
    """To the tolerance, for the operator applied anew; where p = H the gap is closed or negative."""
    h = rough(64)
    options: Any = {"boundary": boundary, "kernel": kernel, "tolerance": 1e-9}
    highest = hardness(h, mean, 0.2, **options)
    body = bounded(h, highest, **options)
    found = body.solve(h, MeanPressure(mean), np.zeros_like(h))
    assert found.converged
    p, gap = found.p, body.operator.apply(found.p, np.empty_like(h)) - h - found.d
    yields = p == highest
    small = 1e-8 * np.ptp(h)
    assert p.min() >= 0.0
    assert p.max() == highest
    assert 0.1 < yields.sum() / np.count_nonzero(p) < 0.9
    assert gap[~yields].min() >= -small
    assert gap[yields].max() <= small
    assert gap[yields].min() < -100.0 * small
    assert np.abs(gap[(p > 0.0) & ~yields]).max() <= small
    assert_allclose(p.mean(), mean, rtol=1e-9)
    assert found.certificate.members >= np.count_nonzero(p) / p.size


@pytest.mark.parametrize("highest", [0.05, 0.3, 1.0, 100.0])
def test_agrees_with_a_bounded_least_squares_solver(highest: float) -> None:
    """16 x 16 points, a free body: `<p, A p>/2 - <p, h + d>` as a sum of squares, to 1e-8 of the highest pressure; and
    the load that comes out, prescribed, gives the same."""
    h, control = 0.02 * white((16, 16)), Approach(0.0)
    body = bounded(h, highest, boundary="free", kernel="love", tolerance=TIGHT)
    units = np.eye(h.size).reshape(-1, *h.shape)
    matrix = np.array([body.operator.apply(unit, np.empty_like(h)).ravel() for unit in units])
    factor = cholesky(0.5 * (matrix + matrix.T), lower=True)
    aim = solve_triangular(factor, (h + control.value).ravel(), lower=True)
    expected = lsq_linear(factor.T, aim, (0.0, highest), method="bvls", tol=1e-14).x.reshape(h.shape)
    found = body.solve(h, control, np.zeros_like(h))
    assert found.converged
    assert_allclose(found.p, expected, rtol=0, atol=1e-8 * expected.max())
    assert (expected.max() > 0.999 * highest) == (highest < 10.0)
    if np.any((expected > 0.0) & (expected < 0.999 * highest)):  # otherwise the load leaves the approach open
        loaded = body.solve(h, MeanPressure(float(expected.mean())), np.zeros_like(h))
        assert_allclose(loaded.p, expected, rtol=0, atol=1e-7 * expected.max())


@pytest.mark.parametrize("mean", LOADS)
def test_a_bound_that_is_far_away_changes_nothing(mean: float) -> None:
    h = rough(64)
    expected = solver(h).solve(h, MeanPressure(mean), np.zeros_like(h))
    found = bounded(h, 1e3).solve(h, MeanPressure(mean), np.zeros_like(h))
    assert found.iterations == expected.iterations
    assert_allclose(found.p, expected.p, rtol=0, atol=ROUNDING * expected.p.max())
    assert_allclose(found.d, expected.d, rtol=ROUNDING)


@pytest.mark.parametrize("highest", [0.03, 0.1])
def test_where_all_yields_the_area_is_load_over_hardness(highest: float) -> None:
    """But for the points at the rim that are between none and all."""
    h, mean = sphere(64), 0.01
    found = bounded(h, highest, boundary="free", kernel="love").solve(h, MeanPressure(mean), np.zeros_like(h))
    rim = np.count_nonzero((found.p > 0.0) & (found.p < highest))
    assert found.converged
    assert rim < 0.1 * np.count_nonzero(found.p)
    assert abs(np.count_nonzero(found.p) - mean * h.size / highest) <= rim


@pytest.mark.parametrize(("boundary", "kernel"), BODIES)
@pytest.mark.parametrize("points", [20, 64])
@pytest.mark.parametrize("ratio", [1.6, 2.0, 4.0, 8.0, 16.0])
def test_whole_numbers_of_points_that_yield(boundary: str, kernel: str, points: int, ratio: float) -> None:
    """A soft counterbody yields at the highest `N = nx ny p/H` points, and none is free: any approach between the
    heights, in addition to what the body gives way, of the last that touches and of the next one solves the problem;
    the middle is returned. The body gives way by some 1e-6 of the heights."""
    highest, h = 1e-6, rough(points, cells=4)
    body = bounded(h, highest, boundary=boundary, kernel=kernel, tolerance=1e-9)
    found = body.solve(h, MeanPressure(highest / ratio), np.zeros_like(h))
    count, falling = round(h.size / ratio), np.sort(h.ravel())[::-1]
    assert found.converged
    np.testing.assert_array_equal(found.p, np.where(h >= falling[count - 1], highest, 0.0))
    assert_allclose(found.d, -0.5 * (falling[count - 1] + falling[count]), rtol=0, atol=1e-5 * np.ptp(h))


@pytest.mark.parametrize("mean", LOADS)
def test_the_approach_that_comes_of_a_load(mean: float) -> None:
    """A periodic body, too, whose mean surface may now be below its undeformed level."""
    h = rough(64)
    body = bounded(h, 1.2 * mean, tolerance=1e-9)
    loaded = body.solve(h, MeanPressure(mean), np.zeros_like(h))
    p, d = loaded.p.copy(), loaded.d
    for moved in (body.solve(h, Approach(d), np.zeros_like(h)), by_sets(body, h, MeanPressure(mean))):
        assert moved.converged
        assert_allclose(moved.p, p, rtol=0, atol=1e-5 * mean)


def by_sets(body: Bench, h: Map, control: MeanPressure) -> Contact:
    return starts.solve_by_sets(body.solver, body.problem(h, control), np.zeros_like(h))


def test_bounds_in_other_units() -> None:
    assert Box(2.0, 6.0).in_units(pressure=4.0, length=3.0) == Box(0.5, 1.5)
