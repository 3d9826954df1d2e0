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
    contact of a body with a phase of 0.4, in a box of 24 waves."""
    (nx, ny), (x, y) = points, way
    cx, cy = nx * WAVE / SIZE[0], ny * WAVE / SIZE[1]
    c, across = 0.25 / math.hypot(x / cx, y / cy), 0.25 / math.hypot(y / cx, x / cy)
    place = math.sqrt(0.95 / 0.05)  # the standard deviation of one place over its mean, 0.05
    chance = 0.5 * 0.0034 * (1.0 + 4.6 * 0.4) * math.hypot(c**-2.15, 0.13 * across**-2.7)
    friction = (0.016 * (1.0 - math.exp(-0.4 / 1.5)) - 0.0004) * c**-1.5 + 1.2 * math.hypot(chance, 0.0028 * c**-1.5)
    friction += 0.008 * c**-4
    known = abs(0.067 * 0.4 / c - 0.005 * (1.0 / c + 1.0 / across))
    chance = 0.5 * 0.0078 * math.hypot(c**-1.2, 0.7 * across**-1.6)
    area = place**0.8 * known + 1.2 * place * chance
    return place * friction, area


@pytest.mark.parametrize("asked", [BOTH, FRICTION, Accuracy(friction=0.05, area=0.3)])
@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 90.0])
def test_the_mesh_of_fewest_points(asked: Accuracy, angle: float) -> None:
    """It keeps both errors, with no more points than the best of all meshes that transform fast."""
    way = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    found = cells.choose(WAVE, SIZE, [way], asked, [cells.Guess(0.05, 0.4, 24.0)])
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
    guess = cells.Guess(share=0.2, phase=0.0, waves=100.0, slow=1.0)
    for asked in (0.02, 0.01):
        nx, _ = cells.choose(WAVE, SIZE, [(1.0, 0.0)], Accuracy(friction=asked, area=0.9), [guess])
        least = 0.09 * 4.0 * 2.0 / asked * SIZE[0] / WAVE  # 2 = (0.8/0.2)^0.5
        assert least <= nx < 1.15 * least


def test_long_cells_lie_across_the_sliding() -> None:
    asked, guess = Accuracy(friction=0.001, area=0.1), [cells.Guess(0.2, 0.4, 12.0)]
    along_x, along_y, both, still = (
        cells.choose(WAVE, SIZE, ways, asked, guess)
        for ways in ([(1.0, 0.0)], [(0.0, 1.0)], [(1.0, 0.0), (0.0, 1.0)], [])
    )
    assert along_x == along_y[::-1]
    assert along_x[0] >= 2 * along_x[1]
    assert both[0] == both[1] > 2 * along_x[1]
    assert max(still) < along_x[0]
    assert max(still) < 1.5 * min(still)  # squares, but for lengths that transform fast


def test_the_worst_of_all_loads_decides() -> None:
    """An elastic body, whose error is by cells across the sliding as by those along it, and one that loses energy,
    whose error is by those along it: neither mesh does for both."""
    still, lossy = cells.Guess(0.2, 0.0, 24.0), cells.Guess(0.2, 0.5, 24.0)
    one, other, both = (
        cells.choose(WAVE, SIZE, [(1.0, 0.0)], BOTH, found) for found in ([still], [lossy], [still, lossy])
    )
    assert one[0] < both[0]
    assert other[1] < both[1]


def test_where_more_points_pay() -> None:
    """Along the longer sides of cells; on squares and lines of points nothing is said."""
    found = [
        cells.more_points(Grid(points=points, size=SIZE))
        for points in ((64, 64), (64, 60), (64, 16), (16, 64), (64, 1))
    ]
    more = "more grid.points"
    assert found == [more, more, f"{more} along y", f"{more} along x", more]
