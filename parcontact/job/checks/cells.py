"""Cells that the shortest wave of a surface needs along and across the sliding.

Friction and the contact area come from slopes along the sliding: the mesh makes their errors along it, and little
across. With c cells per shortest wave along the sliding and c' across it the relative errors are at most about

    max(0.1/A, 1)^0.4 (1 - A)^1.5 hypot(few (12/N)^0.5, lossy phi) hypot(along (4/c)^p, across (4/c')^q),

with numbers of their own for friction and area, where a share A is in contact: what is wrong is wrong at edges, and
light contact is of small spots. Part of the errors is by chance, as edges lie among the points: the more spots there
are in a box with N of the shortest waves along a side, the better they average out. The rest is by the body that loses
energy: the phase phi of its modulus, in right angles, is that at the frequency of edges, and the pressure of such a
body rises more steeply at one edge of a spot than at the other. They were found by experiment, with A and phi as they
are guessed before (`job.contact_guess`): some 40 steady states of rough surfaces of 1 to 100 % contact with 12 or 24 of
their shortest waves along a side, on 60 meshes of 2.7 to 40 cells per shortest wave, so that nine of ten keep what is
asked for. Where sliding is slow (`Guess.slow` is 1, else less) friction has a further error of 0.22 (4/c), times the
first two factors: edges of contact lose power in waves shorter than the cells. `scripts/chosen_mesh.py` tells how the
meshes that follow do on others. Along a direction (x, y) the cells of a grid are hypot(x dx, y dy). Where nothing
slides, either direction counts as the one along the sliding.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

from ..sections.calculation import Accuracy, Grid
from ..sections.stages import Initial, Stage, Steady

Vector = tuple[float, float]

LIGHT, SMALL_SPOTS = 0.1, 0.4  # accuracy: the share in contact below which spots are small, and the power of it
OPEN = 1.5  # accuracy: power of the share that is open
FEW, MANY, AVERAGED = 12.0, 36.0, 0.5  # accuracy: waves along a side, within these (12 and 24 tried); their power
CELLS_PER_WAVE = 8  # accuracy: for an error of 1 %, of squares; fewer under-resolve the contact of the shortest waves
FRICTION_ORDER, AREA_ORDER = 2.5, 1.6  # accuracy: with which more of them are advised for less
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
    def edges(self) -> float:
        """Return by how much errors are larger than where little is open and spots are large."""
        return (1.0 - self.share) ** OPEN * max(LIGHT / self.share, 1.0) ** SMALL_SPOTS


class Law(NamedTuple):
    """Errors by the cells along the sliding and across it, with four of each per shortest wave, and their orders; by
    how much they are larger where waves are few, and in a body that loses energy; what slow sliding adds."""

    along: float
    order_along: float
    across: float
    order_across: float
    few: float
    lossy: float
    slow: float

    def error(self, c: float, across: float, guess: Guess) -> float:
        """Return the relative error with so many cells along the sliding and across it."""
        own = math.hypot(self.along * (4.0 / c) ** self.order_along, self.across * (4.0 / across) ** self.order_across)
        return math.hypot(self.factor(guess) * own, guess.edges * self.slow * guess.slow * 4.0 / c)

    def factor(self, guess: Guess) -> float:
        """Return by how much errors of fast sliding are larger for what is guessed."""
        chance = self.few * (FEW / min(max(guess.waves, FEW), MANY)) ** AVERAGED
        return guess.edges * math.hypot(chance, self.lossy * guess.phase)

    def cells_across(self, error: float) -> float:
        """Return how many cells across the sliding make this error."""
        return max(LEAST_CELLS, 4.0 * (self.across / error) ** (1.0 / self.order_across))


FRICTION = Law(0.035, 1.9, 0.003, 2.5, few=0.9, lossy=0.4, slow=0.22)  # accuracy
AREA = Law(0.055, 1.3, 0.018, 1.1, few=1.15, lossy=0.3, slow=0.0)  # accuracy: of the corrected area
USUAL_PHASE = 0.25  # accuracy
TYPICAL = Guess(0.2, USUAL_PHASE, FEW)  # accuracy: where none is known


def one_cell(stage: Stage, grid: Grid) -> float:
    """Return how long the surface takes to slide by one cell [s]."""
    return along(stage.velocity, stage.speed, grid) / stage.speed


def along(way: Vector, length: float, grid: Grid) -> float:
    """Return the cell [m] along a way of some length."""
    return math.hypot(way[0] / length * grid.dx, way[1] / length * grid.dy)


def cells_per_wave(accuracy: float) -> int:
    """Return how many cells the shortest wave of a rough surface needs along the sliding."""
    return max(2, math.ceil(CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / FRICTION_ORDER) * (1 - SAME)))


def cells_across(accuracy: float) -> float:
    """Return how many it needs across the sliding, for the friction."""
    return FRICTION.cells_across(accuracy)


def cells_for_area(accuracy: float) -> float:
    """Return how many it needs along the sliding, for the contact area."""
    return max(LEAST_CELLS, CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / AREA_ORDER))


def needed(axis: int, directions: Sequence[Vector], asked: Accuracy) -> tuple[float, float]:
    """Return how many cells the shortest wave needs along an axis, for friction and for the contact area, of a surface
    that slides along these directions (unit vectors); without any as many as along the sliding."""
    if not directions or any(abs(way[axis]) > ASIDE for way in directions):
        return cells_per_wave(asked.friction), cells_for_area(asked.area)
    return cells_across(asked.friction), AREA.cells_across(asked.area / AREA.factor(TYPICAL))


def directions_of(history: Sequence[Stage | None], initial: Initial, steady: Steady | None) -> list[Vector]:
    """Return the directions (unit vectors) in which a job slides, each once, but for their signs."""
    ways = [stage.velocity for stage in history if stage is not None and stage.speed] + [initial.velocity]
    found = {_unit(way) for way in ways if any(way)} | ({_unit(steady.unit_direction)} if steady else set())
    return sorted(found)


def _unit(way: Vector) -> Vector:
    """Return the unit vector along a way that points to +x, or to +y, rounded."""
    sign = math.copysign(1.0, way[0] or way[1]) / math.hypot(*way)
    return round(sign * way[0], 9), round(sign * way[1], 9)


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


def choose(
    wave: float, size: Vector, directions: Sequence[Vector], asked: Accuracy, guess: Guess = TYPICAL
) -> tuple[int, int]:
    """Return the fewest points along x and y on which a surface with this shortest wave [m] has the errors asked for,
    where it slides along these directions (unit vectors), or nowhere, and touches as is guessed. Of meshes with as many
    points it is the one with the fewest along a side."""
    along_x, along_y = (_fast_lengths(MOST_CELLS * length / wave) for length in size)
    best = along_x[-1], along_y[-1]
    for ny in along_y:
        cells = lambda nx, ny=ny: (wave * nx / size[0], wave * ny / size[1])  # noqa: E731
        place = bisect_left(along_x, True, key=lambda nx: _fits(*cells(nx), directions, asked, guess))
        if place < len(along_x):
            cx, cy = cells(along_x[place])
            if max(cx, cy) <= LONGEST * min(cx, cy):
                best = min(best, (along_x[place], ny), key=lambda points: (math.prod(points), max(points)))
    return best


def _fast_lengths(most: float) -> list[int]:
    """Return all lengths that transform fast, up to the first that is no shorter."""
    found = [fast_length(1)]
    while found[-1] < most:
        found.append(fast_length(found[-1] + 1))
    return found


def _fits(cx: float, cy: float, directions: Sequence[Vector], asked: Accuracy, guess: Guess) -> bool:
    """Return whether cells per wave along x and y keep the errors asked for."""
    if min(cx, cy) < LEAST_CELLS:
        return False
    for x, y in directions or ((1.0, 0.0), (0.0, 1.0)):
        c, across = 1.0 / math.hypot(x / cx, y / cy), 1.0 / math.hypot(y / cx, x / cy)
        if AREA.error(c, across, guess) > asked.area:
            return False
        if directions and FRICTION.error(c, across, guess) > asked.friction:
            return False
    return True
