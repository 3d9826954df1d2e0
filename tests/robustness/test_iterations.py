"""Iterations do not grow out of hand at any load, and the last gap closes without coming and going."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from . import load_sweep

LIMIT = 60  # iterations to 1e-6


@pytest.mark.parametrize("surface", ["sixteen cells", "two cells", "paraboloid"])
def test_cold_starts_at_all_loads(surface: str) -> None:
    """From one point to 99.99 % of contact, which grows with the load."""
    heights = (
        load_sweep.paraboloid(128) if surface == "paraboloid" else load_sweep.rough(128, 16 if "six" in surface else 2)
    )
    areas = []
    for load, area, found in load_sweep.sweep(heights, 1e-6, per_decade=1):
        assert found.converged, (load, found.failure)
        assert found.iterations < LIMIT
        areas.append(area)
    assert areas[0] == 1 / heights.size
    assert areas[-1] >= load_sweep.ALMOST
    assert all(before <= after for before, after in pairwise(areas))


@pytest.mark.parametrize("two_ways", [False, True], ids=["Westergaard", "Johnson"])
@pytest.mark.parametrize("share", [0.99, 1.0, 1.01])
def test_last_gap(two_ways: bool, share: float) -> None:
    """Points open after each iteration to 1e-9, at shares of the load of full contact: they settle from one side."""
    count = load_sweep.last_gap(128, two_ways, share, 1e-9)
    assert load_sweep.reversals(count) == 0
    assert len(count) < 20
    assert (count[-1] == 0) == (share >= 1.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_last_gap_between_points(side: float) -> None:
    """On 37 x 31 points with the deepest point between them, at 1e-1 to 1e-16 from full contact: no pressure pulls,
    and above it is p + K h to 1e-9; the nearer, the fewer iterations."""
    x, y = (np.cos(2 * np.pi * (np.arange(points) + 0.3) / points) for points in (37, 31))
    heights = x[None, :] * y[:, None]
    solving = load_sweep.solver(heights, 1e-10)
    waves = solving[1].preconditioner.apply(heights - heights.mean(), np.empty_like(heights))
    counts = []
    for exponent in range(-1, -17, -1):
        mean = -waves.min() * (1.0 + side * 10.0**exponent)
        found = load_sweep.cold(solving, heights, mean)
        assert found.converged
        assert found.p.min() >= 0.0
        counts.append(found.iterations)
        if side > 0.0:
            assert_allclose(found.p, mean + waves, rtol=0, atol=1e-9 * float(waves.max()))
    assert max(counts) < 20
    assert all(before >= after for before, after in pairwise(counts))
