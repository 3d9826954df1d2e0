"""Cells that the shortest wave of a surface needs along and across the sliding.

The mesh makes errors of friction and of the contact area at edges of contact, of two kinds. A body that loses energy
has a pressure that rises more steeply at one edge of a spot than at the other, the more so the larger the phase of its
modulus is. The other kind is chance, as edges lie among the points. It is that of a share counted at random: where a
share A is in contact, ((1 - A)/A)^0.5 is the standard deviation over the mean for one place, and a box with N of the
shortest waves along a side has N^2 places. `friction_error` and `area_error` have the sums. Of chance, and of that by
which surfaces differ in the first kind, SURE standard deviations count.

Their numbers were found by experiment, with the share and the phase as they are guessed before (`mesh.contact_guess`):
steady states of rough surfaces of 1 to 100 % contact with 12 or 24 of their shortest waves along a side. Those of
friction are from 36 states on some 110 meshes each, those of the area by maximum likelihood from 24 states on some 40
meshes, with references of 160 cells per shortest wave. Fewer waves count as 12. `scripts/chosen_mesh.py` tells how the
meshes that follow do on others. Along a direction (x, y) the cells of a grid are hypot(x dx, y dy). Where nothing
slides, either direction counts as the one along the sliding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

from ..sections.calculation import Accuracy, Grid
from ..sections.stages import Initial, Stage, Steady

Vector = tuple[float, float]

SURE = 1.2  # accuracy: standard deviations, with which nine of ten surfaces keep what is asked for
FEW = 12.0  # accuracy: waves along a side; fewer were not tried
CELLS_PER_WAVE = 8  # accuracy: for an error of 1 %, of squares; fewer under-resolve the contact of the shortest waves
FRICTION_ORDER, AREA_ORDER = 2.5, 1.6  # accuracy: with which more of them are advised for less
FRICTION_ASIDE, FRICTION_ASIDE_ORDER = 3e-3, 2.5  # accuracy: of four cells across the sliding, and with more
AREA_ASIDE, AREA_ASIDE_ORDER = 0.0148, 1.1  # accuracy
ASIDE = 0.25  # accuracy: of a unit vector along an axis, up to which it is across
LEAST_CELLS = 2.1  # accuracy: per shortest wave; the grid has no waves shorter than two
LONG = 1.2  # accuracy: cells with such sides are no squares
LONGEST = 4.0  # accuracy: the longer side of a cell over the shorter, in the experiments
MOST_CELLS = 400.0  # tuning: per shortest wave
MULTIPLE = 16  # tuning: of which points along a side are, so that there are coarser grids to start from
SAME = 1e-9  # accuracy: relative: numbers this close are the same


class Guess(NamedTuple):
    """A guess made before anything is solved: the share in contact, the phase of the body's modulus at the frequency of
    edges, in right angles, how many of the shortest waves a side of the box has, and how `slow` the sliding is, from 0
    to 1."""

    share: float
    phase: float
    waves: float
    slow: float = 0.0

    @property
    def spread(self) -> float:
        """Return the standard deviation over the mean of one place, in contact or not."""
        return math.sqrt((1.0 - self.share) / self.share)

    @property
    def few(self) -> float:
        """Return by how much errors by chance are larger than in a box of FEW waves."""
        return FEW / max(self.waves, FEW)


def friction_error(c: float, across: float, guess: Guess) -> float:
    """Return the relative error of friction that nine of ten surfaces keep with so many cells along the sliding and
    across it. Where sliding is slow edges lose power in waves shorter than the cells. The last part is that of the
    fewest cells."""
    along = (4.0 / c) ** 1.5
    steep = 0.016 * (1.0 - math.exp(-guess.phase / 1.5)) - 0.0004
    counted = math.hypot((4.0 / c) ** 2.15, 0.13 * (4.0 / across) ** 2.7)
    chance = guess.few * 0.0034 * (1.0 + 4.6 * guess.phase) * counted
    unknown = SURE * math.hypot(chance, 0.007 * guess.phase * along)
    return guess.spread * (abs(steep) * along + unknown + 0.09 * guess.slow * 4.0 / c + 0.008 * (4.0 / c) ** 4)


def area_error(c: float, across: float, guess: Guess) -> float:
    """Return the same of the corrected contact area. The correction takes off too much along the edges of an elastic
    body, and too little at those across the sliding of a body that loses energy."""
    along, aside = 4.0 / c, 4.0 / across
    known = 0.067 * guess.phase * along - 0.005 * (along + aside)
    chance = guess.few * 0.0078 * math.hypot(along**1.2, 0.7 * aside**1.6)
    return guess.spread**0.8 * abs(known) + SURE * guess.spread * chance


def one_cell(stage: Stage, grid: Grid) -> float:
    """Return how long the surface takes to slide by one cell [s]."""
    return along(stage.velocity, stage.speed, grid) / stage.speed


def along(way: Vector, length: float, grid: Grid) -> float:
    """Return the cell [m] along a way of some length."""
    return math.hypot(way[0] / length * grid.dx, way[1] / length * grid.dy)


def has_wave(grid: Grid, shortest: float, longest: float) -> bool:
    """Return whether a grid has a wave below the `longest` length and above the `shortest` [m]."""
    least, most = (1 - SAME) / longest, (1 - SAME) / shortest
    rows = (grid.ny - 1) // 2
    for column in range(min(grid.nx // 2, int(most * grid.lx)) + 1):
        rest = math.sqrt(max(least**2 - (column / grid.lx) ** 2, 0.0))
        row = max(math.ceil(rest * grid.ly), 0 if column else 1)
        if row <= rows and math.hypot(column / grid.lx, row / grid.ly) < most:
            return True
    return False


def cells_per_wave(accuracy: float) -> int:
    """Return how many cells the shortest wave of a rough surface needs along the sliding."""
    return max(2, math.ceil(CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / FRICTION_ORDER) * (1 - SAME)))


def cells_across(accuracy: float) -> float:
    """Return how many it needs across the sliding, for the friction."""
    return max(LEAST_CELLS, 4.0 * (FRICTION_ASIDE / accuracy) ** (1.0 / FRICTION_ASIDE_ORDER))


def cells_for_area(accuracy: float) -> float:
    """Return how many it needs along the sliding, for the contact area."""
    return max(LEAST_CELLS, CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / AREA_ORDER))


def needed(axis: int, directions: Sequence[Vector], asked: Accuracy) -> tuple[float, float]:
    """Return how many cells the shortest wave needs along an axis, for friction and for the contact area, of a surface
    that slides along these directions (unit vectors); without any as many for the area."""
    if not directions:
        return cells_for_area(asked.area), cells_for_area(asked.area)
    if any(abs(way[axis]) > ASIDE for way in directions):
        return cells_per_wave(asked.friction), cells_for_area(asked.area)
    for_area = max(LEAST_CELLS, 4.0 * (AREA_ASIDE / asked.area) ** (1.0 / AREA_ASIDE_ORDER))
    return cells_across(asked.friction), for_area


def directions_of(history: Sequence[Stage | None], initial: Initial, steady: Steady | None) -> list[Vector]:
    """Return the directions (unit vectors) in which a job slides, each once, but for their signs."""
    ways = [stage.velocity for stage in history if stage is not None and stage.speed] + [initial.velocity]
    found = {_unit(way) for way in ways if any(way)} | ({_unit(steady.unit_direction)} if steady else set())
    return sorted(found)


def _unit(way: Vector) -> Vector:
    """Return the unit vector along a way that points to +x, or to +y, rounded."""
    sign = math.copysign(1.0, way[0] or way[1]) / math.hypot(*way)
    return round(sign * way[0], 9) + 0.0, round(sign * way[1], 9) + 0.0  # no -0


def more_points(grid: Grid) -> str:
    """Return where more points pay for edges of contact: along the longer sides of cells."""
    if 1 in grid.points or max(grid.dx, grid.dy) < LONG * min(grid.dx, grid.dy):
        return "more grid.points"
    return f"more grid.points along {'x' if grid.dx > grid.dy else 'y'}"


def fast_length(least: float) -> int:
    """Return the next multiple of MULTIPLE that transforms like: its other factors are 2, 3 and 5."""
    count = max(1, math.ceil(least / MULTIPLE * (1.0 - SAME)))
    while 60 ** count.bit_length() % count:  # 60 has all three
        count += 1
    return MULTIPLE * count


def choose_points(
    wave: float, size: Vector, directions: Sequence[Vector], asked: Accuracy, guesses: Sequence[Guess]
) -> tuple[int, int]:
    """Return the fewest points along x and y on which a surface with this shortest wave [m] has the errors asked for,
    where it slides along these directions (unit vectors), or nowhere, and touches as is guessed. Of meshes with as many
    points it is the one with the fewest along a side."""
    along_x, along_y = (_fast_lengths(MOST_CELLS * length / wave) for length in size)
    meshes = sorted(product(along_x, along_y), key=lambda points: (math.prod(points), max(points)))
    x, y = (wave / length for length in size)
    return next((mesh for mesh in meshes if _fits(mesh[0] * x, mesh[1] * y, directions, asked, guesses)), meshes[-1])


def _fast_lengths(most: float) -> list[int]:
    """Return all lengths that transform fast, up to the first that is no shorter."""
    found = [fast_length(1)]
    while found[-1] < most:
        found.append(fast_length(found[-1] + 1))
    return found


def _fits(cx: float, cy: float, directions: Sequence[Vector], asked: Accuracy, guesses: Sequence[Guess]) -> bool:
    """Return whether cells per wave along x and y keep the errors asked for."""
    if min(cx, cy) < LEAST_CELLS or max(cx, cy) > LONGEST * min(cx, cy):
        return False
    for (x, y), guess in product(directions or ((1.0, 0.0), (0.0, 1.0)), guesses):
        c, across = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
        if area_error(c, across, guess) > asked.area:
            return False
        if directions and friction_error(c, across, guess) > asked.friction:
            return False
    return True
