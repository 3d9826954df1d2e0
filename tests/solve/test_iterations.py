"""Iterations do not grow out of hand at any load, and the last gap closes without coming and going."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.solve.problem import MeanPressure

from .bodies import MODULUS, rough, solver

LIMIT = 60  # iterations to 1e-6
ALMOST = 0.9999  # of all points: there the loads end


@pytest.mark.parametrize("cells", [16, 2, None])
def test_cold_starts_at_all_loads(cells: int | None) -> None:
    """From one point to 99.99 % of contact, which grows with the load; roughness down to so many cells, or a sphere."""
    square = (np.arange(128) / 128 - 0.5) ** 2
    heights = -np.add.outer(square, square) if cells is None else rough(128, cells=cells)
    body, load, areas = solver(heights), 1e-3 / heights.size / heights.shape[0], [0.0]
    while areas[-1] < ALMOST:
        found = body.solve(heights, MeanPressure(load * MODULUS), np.zeros_like(heights))
        assert found.converged, (load, found.failure)
        assert found.iterations < LIMIT
        areas.append(np.count_nonzero(found.p) / heights.size)
        load *= 10.0 if areas[-1] < 0.5 else 10.0**0.25
    assert areas[1] == 1 / heights.size
    assert all(before <= after for before, after in pairwise(areas))


@pytest.mark.parametrize("two_ways", [False, True], ids=["Westergaard", "Johnson"])
@pytest.mark.parametrize("share", [0.99, 1.0, 1.01])
def test_last_gap(two_ways: bool, share: float) -> None:
    """Points open after each iteration to 1e-9, at shares of the load of full contact: they settle from one side."""
    x = np.cos(2 * np.pi * (np.arange(128) + 0.3) / 128)
    heights = x[:, None] * x[None, :] if two_ways else np.tile(x, (128, 1))
    full = np.pi * MODULUS * (np.sqrt(2.0) if two_ways else 1.0)
    count: list[int] = []
    for limit in range(1, 20):
        body = solver(heights, tolerance=1e-9, max_iterations=limit)
        found = body.solve(heights, MeanPressure(share * full), np.zeros_like(heights))
        count.append(heights.size - int(np.count_nonzero(found.p)))
        if found.converged:
            break
    assert found.converged
    assert reversals(count) == 0
    assert (count[-1] == 0) == (share >= 1.0)


def reversals(count: list[int]) -> int:
    """Return how often a count that has fallen rises, or the other way round."""
    steps = [after - before for before, after in pairwise(count) if after != before]
    return sum(first * second < 0 for first, second in pairwise(steps))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_last_gap_between_points(side: float) -> None:
    """On 37 x 31 points with the deepest point between them, at 1e-1 to 1e-16 from full contact: no pressure pulls,
    and above it is p + K h to 1e-9; the nearer, the fewer iterations."""
    x, y = (np.cos(2 * np.pi * (np.arange(points) + 0.3) / points) for points in (37, 31))
    heights = x[None, :] * y[:, None]
    body = solver(heights, tolerance=1e-10)
    waves = body.preconditioner.apply(heights - heights.mean(), np.empty_like(heights))
    counts = []
    for exponent in range(-1, -17, -1):
        mean = -waves.min() * (1.0 + side * 10.0**exponent)
        found = body.solve(heights, MeanPressure(mean), np.zeros_like(heights))
        assert found.converged
        assert found.p.min() >= 0.0
        counts.append(found.iterations)
        if side > 0.0:
            assert_allclose(found.p, mean + waves, rtol=0, atol=1e-9 * float(waves.max()))
    assert max(counts) < 20
    assert all(before >= after for before, after in pairwise(counts))
