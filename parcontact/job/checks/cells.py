"""How many cells the shortest wave of a surface needs along and across the sliding.

Friction comes from slopes along the sliding: the mesh makes its error along it, and little across. The contact area
wants both directions alike. With c cells per shortest wave along the sliding and c' across it the relative errors are
about

    friction    hypot(ALONG (8/c)^2.5, ACROSS (4/c')^2.5),        area    AREA (4/c + 4/c')^1.3,

found by experiment: steady states of ten rough surfaces of 2 to 91 % contact on 16 meshes of 2 to 32 cells per shortest
wave, of cells up to eight times as long as wide. Along a direction (x, y) the cells of a grid are hypot(x dx, y dy).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..sections.calculation import Accuracy, Grid
from ..sections.stages import Initial, Stage, Steady

Vector = tuple[float, float]

ALONG, ACROSS, MESH_ORDER = 0.008, 0.003, 2.5  # accuracy: of friction, at 8 and at 4 cells
AREA, AREA_ORDER = 0.01, 1.3  # accuracy: of the corrected area, at 8 cells both ways
CELLS_PER_WAVE = 8  # accuracy: for an error of 1 %, of squares; fewer under-resolve the contact of the shortest waves
ASIDE = 0.25  # accuracy: of a unit vector along an axis, up to which it is across
LEAST_CELLS = 2.1  # accuracy: per shortest wave; the grid has no waves shorter than two
LONGEST = 8.0  # accuracy: the longer side of a cell over the shorter, in the experiments
RATIOS = 48  # tuning: ratios of the sides that are tried
MULTIPLE = 16  # of which points along a side are, so that there are coarser grids to start from
SAME = 1e-9  # relative: numbers this close are the same


def one_cell(stage: Stage, grid: Grid) -> float:
    """Return how long the surface takes to slide by one cell [s]."""
    return along(stage.velocity, stage.speed, grid) / stage.speed


def along(way: Vector, length: float, grid: Grid) -> float:
    """Return the cell [m] along a way of some length."""
    return math.hypot(way[0] / length * grid.dx, way[1] / length * grid.dy)


def friction_error(c: float, across: float) -> float:
    """Return the error of friction with so many cells per shortest wave along and across the sliding."""
    return math.hypot(ALONG * (8.0 / c) ** MESH_ORDER, ACROSS * (4.0 / across) ** MESH_ORDER)


def area_error(c: float, across: float) -> float:
    """Return the error of the corrected area with so many cells per shortest wave in two directions."""
    return AREA * (4.0 / c + 4.0 / across) ** AREA_ORDER


def cells_per_wave(accuracy: float) -> int:
    """Return how many cells the shortest wave of a rough surface needs along the sliding."""
    return max(2, math.ceil(CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / MESH_ORDER) * (1 - SAME)))


def cells_across(accuracy: float) -> float:
    """Return how many it needs across the sliding, for the friction."""
    return max(LEAST_CELLS, 4.0 * (ACROSS / accuracy) ** (1.0 / MESH_ORDER))


def cells_for_area(accuracy: float) -> float:
    """Return how many it needs in both directions, for the contact area."""
    return max(LEAST_CELLS, CELLS_PER_WAVE * (AREA / accuracy) ** (1.0 / AREA_ORDER))


def needed(axis: int, directions: Sequence[Vector], asked: Accuracy) -> tuple[float, float]:
    """Return how many cells the shortest wave needs along an axis, for friction and for the contact area, of a surface
    that slides along these directions (unit vectors); without any as many as along the sliding."""
    slides = not directions or any(abs(way[axis]) > ASIDE for way in directions)
    return cells_per_wave(asked.friction) if slides else cells_across(asked.friction), cells_for_area(asked.area)


def directions_of(history: Sequence[Stage | None], initial: Initial, steady: Steady | None) -> list[Vector]:
    """Return the directions (unit vectors) in which a job slides, each once, but for their signs."""
    ways = [stage.velocity for stage in history if stage is not None and stage.speed] + [initial.velocity]
    found = {_unit(way) for way in ways if any(way)} | ({_unit(steady.unit_direction)} if steady else set())
    return sorted(found)


def _unit(way: Vector) -> Vector:
    """Return the unit vector along a way that points to +x, or to +y, rounded."""
    sign = math.copysign(1.0, way[0] or way[1]) / math.hypot(*way)
    return round(sign * way[0], 9), round(sign * way[1], 9)


def fast_length(least: float) -> int:
    """Return the next multiple of MULTIPLE that transforms like: its other factors are 2, 3 and 5."""
    count = max(1, math.ceil(least / MULTIPLE * (1.0 - SAME)))
    while 60 ** count.bit_length() % count:  # 60 has all three
        count += 1
    return MULTIPLE * count


def choose(wave: float, size: Vector, directions: Sequence[Vector], asked: Accuracy) -> tuple[int, int]:
    """Return the fewest points along x and y on which a surface with this shortest wave [m] has the errors asked for,
    where it slides along these directions (unit vectors), or nowhere."""
    ratios = [LONGEST ** (k / RATIOS) for k in range(-RATIOS, RATIOS + 1)]
    cells = [_largest(wave, ratio, directions, asked) for ratio in ratios]
    dx, dy = max(cells, key=lambda cell: (round(math.log(cell[0] * cell[1]), 9), -abs(math.log(cell[0] / cell[1]))))
    return fast_length(size[0] / dx), fast_length(size[1] / dy)


def _largest(wave: float, ratio: float, directions: Sequence[Vector], asked: Accuracy) -> Vector:
    """Return the largest cell [m] with sides of this ratio that keeps what is asked."""
    fits = lambda dx: _fits(wave / dx, wave / (ratio * dx), directions, asked)  # noqa: E731
    low, high = wave / 1e4, wave / LEAST_CELLS
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low, ratio * low


def _fits(cx: float, cy: float, directions: Sequence[Vector], asked: Accuracy) -> bool:
    """Return whether cells per wave along x and y keep the errors asked for."""
    if min(cx, cy) < LEAST_CELLS or area_error(cx, cy) > asked.area:
        return False
    for x, y in directions:
        c, across = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
        if friction_error(c, across) > asked.friction:
            return False
    return True
