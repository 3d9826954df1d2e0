"""Cells along and across the sliding: the mesh of fewest points, found as well by trying all."""

import math

import pytest

from parcontact.job.checks import cells
from parcontact.job.sections.calculation import Accuracy, Grid

SIZE = (1e-3, 1e-3)
WAVE = 6.25e-5
BOTH = Accuracy(friction=0.01, area=0.01)
FRICTION = Accuracy(friction=0.003, area=0.1)


@pytest.mark.parametrize("count", [1, 16, 17, 100, 416, 1000])
def test_fast_lengths(count: int) -> None:
    found = cells.fast_length(count)
    assert found >= count
    assert found % cells.MULTIPLE == 0
    assert max(p for p in range(1, found + 1) if found % p == 0 and all(p % q for q in range(2, p))) <= 5


def errors(points: tuple[int, int], way: tuple[float, float]) -> tuple[float, float]:
    """Return the errors of friction and area by the laws of the module, in a slide along a unit vector at 5 % of
    contact of a body with a phase of 0.8 at edges, in a box of 24 waves."""
    (nx, ny), (x, y) = points, way
    cx, cy = nx * WAVE / SIZE[0], ny * WAVE / SIZE[1]
    c, across = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
    friction = math.hypot(0.035 * (4.0 / c) ** 1.9, 0.003 * (4.0 / across) ** 2.5)
    area = math.hypot(0.055 * (4.0 / c) ** 1.3, 0.018 * (4.0 / across) ** 1.1)
    spots = 0.95**1.5 * 2**0.4
    return friction * spots * math.hypot(0.9 * 0.5**0.5, 0.32), area * spots * math.hypot(1.15 * 0.5**0.5, 0.24)


@pytest.mark.parametrize("asked", [BOTH, FRICTION, Accuracy(friction=0.05, area=0.3)])
@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 90.0])
def test_the_mesh_of_fewest_points(asked: Accuracy, angle: float) -> None:
    """It keeps both errors, with no more points than the best of all meshes that transform fast."""
    way = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    found = cells.choose(WAVE, SIZE, [way], asked, cells.Guess(share=0.05, phase=0.8, waves=24.0))
    lengths = [n for n in range(16, 800, 16) if cells.fast_length(n) == n]

    def keeps(points: tuple[int, int]) -> bool:
        """The grid has the shortest wave, too, and cells that are no longer than tried."""
        resolved = min(points) * WAVE / SIZE[0] >= cells.LEAST_CELLS and max(points) <= cells.LONGEST * min(points)
        return resolved and all(a <= b for a, b in zip(errors(points, way), asked.both, strict=True))

    least = min(nx * ny for nx in lengths for ny in lengths if keeps((nx, ny)))
    assert keeps(found)
    assert found[0] * found[1] == least


def test_slow_sliding_needs_cells_in_the_first_order() -> None:
    """As many as the term of slow sliding asks for, where others are small; half as many for twice the error."""
    guess = cells.Guess(share=0.2, phase=0.0, waves=36.0, slow=1.0)
    for asked in (0.02, 0.01):
        nx, _ = cells.choose(WAVE, SIZE, [(1.0, 0.0)], Accuracy(friction=asked, area=0.9), guess)
        least = 0.22 * 4.0 * 0.8**1.5 / asked * SIZE[0] / WAVE
        assert least <= nx < 1.15 * least


def test_long_cells_lie_across_the_sliding() -> None:
    along_x, along_y = (cells.choose(WAVE, SIZE, [way], FRICTION) for way in ((1.0, 0.0), (0.0, 1.0)))
    assert along_x == along_y[::-1]
    assert along_x[0] >= 2 * along_x[1]
    both = cells.choose(WAVE, SIZE, [(1.0, 0.0), (0.0, 1.0)], FRICTION)
    assert both[0] == both[1] > 2 * along_x[1]
    still = cells.choose(WAVE, SIZE, [], FRICTION)
    assert max(still) < along_x[0]
    assert max(still) < 1.5 * min(still)  # squares, but for lengths that transform fast


def test_where_more_points_pay() -> None:
    """Along the longer sides of cells; on squares and lines of points nothing is said."""
    found = [
        cells.more_points(Grid(points=points, size=SIZE))
        for points in ((64, 64), (64, 60), (64, 16), (16, 64), (64, 1))
    ]
    more = "more grid.points"
    assert found == [more, more, f"{more} along y", f"{more} along x", more]
