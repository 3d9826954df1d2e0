"""Part of a preconditioner for pressure waves that are long compared with the thickness of a layer, within the contact.

Such waves displace a layer by `u = c0 p - c2 laplace p`; a bonded incompressible layer, which flows along its base
like a viscous film, has c0 = 0. There long waves are far stiffer than the softest wave. A preconditioner K of the
whole box must limit their stiffness to that of the softest wave, because p vanishes outside contact, and patches of
contact further from each other than the thickness do not interact. The missing part is the inverse of the equation
above on the contact,

    c0 z - c2 laplace z + c2 (1 - c)/l^2 z = r,

with c = 1 in contact and 0 outside, where z decays over the length l, twice the thickness. One V-cycle over cells of
two by two cells approximates it. It starts with cells of half the thickness, as K inverts shorter waves, and makes a
damped Jacobi step on the way to larger cells and another one on the way back, so that it is symmetric. Maps are in
single precision.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop
from ...parallel.slab import Array, Slab
from ...physics.layer import LongWaves
from ..problem import Operator
from .extension import ExtendedPreconditioner, lengths
from .levels import cell_levels

DAMPING = np.float32(0.8)  # tuning: factor on the Jacobi steps
DECAY = 2.0  # tuning: decay length of z outside contact, over the thickness
FINEST = 0.5  # tuning: least length of cells that are smoothed, over the thickness
MAPS = 4  # maps on each grid
SAME = 1e-9  # accuracy: relative difference below which two lengths are equal


class LongWavePreconditioner:
    """An extended preconditioner plus the part for long waves. It holds four maps in single precision on each grid of
    cells."""

    def __init__(self, slab: Slab, waves: LongWaves, extended: ExtendedPreconditioner) -> None:
        self._extended, self._levels = extended, cell_levels(slab)
        self._first = _first_grid(slab.nx, slab.ny, waves)
        grids = [slab, *(level.coarse for level in self._levels)]
        kept = [grid if level or not self._first else None for level, grid in enumerate(grids)]
        none = np.empty((0, 0), np.float32)
        self._given, self._z, self._left, self._diagonal = (
            [none if grid is None else grid.empty(np.float32) for grid in kept] for _ in range(MAPS)
        )
        dx, dy = waves.size[0] / slab.nx, waves.size[1] / slab.ny
        self._faces = np.float32(dy / dx), np.float32(dx / dy)
        self._scale = dx * dy / waves.c2
        stiffness = waves.c0 / waves.c2 + 1.0 / max(waves.size) ** 2  # 2nd term: no wave is longer than the box
        self._inside, self._outside = dx * dy * stiffness, dx * dy / (DECAY * waves.thickness) ** 2
        self._cell_lengths = [
            (lengths(slab.ny, level)[grid.rows], lengths(slab.nx, level)) for level, grid in enumerate(grids)
        ]

    def apply(self, preconditioner: Operator, working: NDArray[Any], r: Array) -> None:
        """Replace the residual r, which is 0 outside the set, by z; z is valid on the set only. Collective."""
        self._weigh(working)
        if not self._first:
            self._given[0][...] = r
        self._cycle(0, r)
        self._extended.apply(preconditioner, working, r)
        level = 1 if self._first else 0
        self._z[level] *= np.float32(self._scale)
        if level:
            self._add_up_back(0, r)
        else:
            r += self._z[0]

    def _weigh(self, working: NDArray[Any]) -> None:
        """Compute the diagonals on all grids from the number of points of each cell in the set."""
        counts = [working, *self._diagonal[1:]]
        for k, cells in enumerate(self._levels):
            cells.add_up(*counts[k : k + 2])
        for level, (diagonal, lines) in enumerate(zip(self._diagonal, self._cell_lengths, strict=True)):
            if level or not self._first:
                faces = 2.0 * sum(self._faces)
                _find_diagonal(counts[level], *lines, self._inside, self._outside, faces, diagonal)

    def _cycle(self, level: int, r: Array) -> None:
        """Solve for z on a grid with the right side stored there."""
        given, z, left, diagonal = (maps[level] for maps in (self._given, self._z, self._left, self._diagonal))
        if level == len(self._levels):  # a single cell, its own neighbour
            z[...] = given / (diagonal - 2.0 * sum(self._faces))
        elif level < self._first:
            self._add_up(level, given if level else r)
            self._cycle(level + 1, r)
            if level:
                z.fill(0.0)
                self._add_up_back(level, z)
        else:
            np.multiply(given, DAMPING, out=z)
            z /= diagonal
            self._find_rest(level)
            self._add_up(level, left)
            self._cycle(level + 1, r)
            self._add_up_back(level, z)
            self._find_rest(level)
            _correct(left, diagonal, z)

    def _find_rest(self, level: int) -> None:
        z = self._z[level]
        neighbours = self._levels[level].step.adjacent_points(z, 0, -1)
        _rest(z, neighbours, self._given[level], self._diagonal[level], *self._faces, self._left[level])

    def _add_up(self, level: int, points: NDArray[Any]) -> None:
        """Put the sums over the cells of the next grid into its right side."""
        self._levels[level].add_up(points, self._given[level + 1])

    def _add_up_back(self, level: int, points: NDArray[Any]) -> None:
        """Add z of the next grid to points."""
        self._levels[level].add_up_back(self._z[level + 1], points)


def _first_grid(nx: int, ny: int, waves: LongWaves) -> int:
    """Return how many times cells are doubled before the first smoothing."""
    cell = max(waves.size[0] / nx, waves.size[1] / ny)
    return max(math.floor(math.log2(FINEST * waves.thickness / cell * (1.0 + SAME))), 0)


@loop
def _find_diagonal(count, rows, columns, inside, outside, faces, out):
    """Put `faces + inside points + outside (points - count)` into `out`, with the points of each cell."""
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            points = rows[j] * columns[i]
            out[j, i] = faces + inside * points + outside * (points - count[j, i])


@loop
def _rest(z, neighbours, given, diagonal, along_x, along_y, out):
    """Put the residual of the equation into `out`: `given - diagonal z` plus z of the neighbours times their faces."""
    rows, columns = z.shape
    for j in range(rows):
        below = z[j + 1] if j + 1 < rows else neighbours[0]
        above = z[j - 1] if j > 0 else neighbours[1]
        for i in range(columns):
            left = z[j, i - 1] if i > 0 else z[j, columns - 1]
            right = z[j, i + 1] if i + 1 < columns else z[j, 0]
            near = along_x * (left + right) + along_y * (below[i] + above[i])
            out[j, i] = given[j, i] - diagonal[j, i] * z[j, i] + near


@loop
def _correct(left, diagonal, z):
    for j in range(z.shape[0]):
        for i in range(z.shape[1]):
            z[j, i] += DAMPING * left[j, i] / diagonal[j, i]
