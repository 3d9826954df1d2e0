"""Connected cells and critical constrictions against a search that grows from the first row."""

import heapq

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.leakage.paths import connected_from_end_to_end, critical_constriction


def widest_path(gap: NDArray[np.float64], periodic: bool) -> float:
    """The smallest gap on the widest path, by Dijkstra's algorithm."""
    rows, columns = gap.shape
    best = np.zeros_like(gap)
    queue = [(-float(g), 0, j) for j, g in enumerate(gap[0]) if g > 0.0]
    heapq.heapify(queue)
    while queue:
        width, i, j = heapq.heappop(queue)
        if best[i, j] >= -width:
            continue
        best[i, j] = -width
        for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if periodic:
                b %= columns
            if 0 <= a < rows and 0 <= b < columns:
                heapq.heappush(queue, (max(width, -float(gap[a, b])), a, b))
    return float(best[-1].max())


@pytest.mark.parametrize("periodic", [True, False])
def test_the_constriction_is_that_of_the_widest_path(periodic: bool) -> None:
    generator, closed = np.random.default_rng(5), 0
    for share in np.linspace(0.2, 0.6, 40):
        gap = np.where(generator.uniform(size=(9, 11)) < share, 0.0, generator.uniform(size=(9, 11)))
        found, position = critical_constriction(gap, periodic)
        assert found == widest_path(gap, periodic)
        closed += position is None
        assert position is None or gap[position] == found
    assert 0 < closed < 40  # both happen


def test_what_leads_nowhere_is_left_out() -> None:
    gap = np.zeros((4, 5), dtype=bool)
    gap[:, 1] = gap[0, 3] = gap[2, 2] = True
    gap[3, 4] = True
    kept = connected_from_end_to_end(gap, periodic_sides=False)
    gap[0, 3] = gap[3, 4] = False
    assert (kept == gap).all()
