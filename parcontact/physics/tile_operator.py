"""Operators on tiles, and from tiles to the whole grid: their cost follows the points of tiles, not of the box.

The coefficients between two tiles depend on their offset only, and are split (P. P. Ewald, Ann. Phys. 369 (1921)
253) with a length s and the distance r:

    1/r = (1 - erf(r/s))/r + erf(r/s)/r.

The first part vanishes beyond `REACH s`: it is a cyclic convolution between near tiles, of twice their side. The
second part varies over s: loads of points are transferred to the nodes of a regular grid, at distances of
`s/FINENESS`, by the transposed interpolation of degree `ORDER - 1`; displacements of nodes are interpolated (A.
Brandt and A. A. Lubrecht, J. Comput. Phys. 90 (1990) 348). Love's coefficients of both parts are means over a cell.
The error is below 1e-6 of the displacement.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..compiled import pointwise
from ..parallel.fft import FFT
from ..parallel.slab import Array, Slab, allocate
from ..parallel.tally import Tally
from .convolution import Convolution, padded_lengths, tabulate
from .tiles import SIDE, TileConvolution, Tiles, tiles_along

ORDER = 8  # accuracy: nodes per interpolation along each direction
FINENESS = 6.0  # accuracy: s over the distance of nodes
REACH = 4.0  # accuracy: distance over s beyond which the first part, then 1.5e-8, is left out
NODES = 256  # tuning: largest number of nodes along the longer side of a box
FEWEST_NODES = 2  # least number of nodes along a tile
FAR = 6.0  # r/s beyond which erf is 1 in double precision
GAUSS = 0.5 / math.sqrt(3.0)  # two-point Gauss rule over a cell


class TileOperator:
    """Operator from pressure to displacement on tiles.

    `near` has the coefficients of the first part at distances from 0 on along y and x; `nodes` computes the second
    part.
    """

    def __init__(self, tiles: Tiles, near: Array, nodes: "FreeNodes", tally: Tally) -> None:
        self._tiles, self._tally = tiles, tally
        self._near = TileConvolution(tiles, len(near) // SIDE - 1, near, tally)
        step = step_of_nodes(tiles)
        self._weights, self._per_tile = _interpolation(step), SIDE // step
        wide = self._per_tile + ORDER
        self._places = [
            (slice(row, row + wide), slice(column, column + wide))
            for row, column in zip(tiles.rows * self._per_tile, tiles.columns * self._per_tile, strict=True)
        ]
        self._nodes = nodes

    def apply(self, field: Array, out: Array) -> Array:
        """Put the displacement under a stacked map into `out`, another map."""
        self._near.apply(field, out)
        nodes, weights = self._displace_nodes(field), self._weights
        patches = np.stack([nodes[place] for place in self._places])
        out += np.matmul(np.matmul(weights, patches), weights.T).reshape(out.shape)
        return out

    def _displace_nodes(self, field: Array) -> Array:
        """Return the second part of the displacement of all nodes under a stacked map."""
        nodes, weights = self._nodes.map, self._weights
        nodes.fill(0.0)
        patches = np.matmul(np.matmul(weights.T, field.reshape(-1, SIDE, SIDE)), weights)
        for place, patch in zip(self._places, patches, strict=True):
            nodes[place] += patch
        self._nodes.displace()
        return nodes

    def displace(self, field: Array, parts: list[slice], take: Callable[[int, Array], None]) -> None:
        """Compute the displacement of the whole grid under a stacked map, and call `take(number, map)` for each part of
        its rows, in their order."""
        nodes = self._displace_nodes(field)
        self._near.transform(field)
        nx, _ = self._tiles.points
        across, down = tiles_along(self._tiles.points)
        reached = self._near.reached()
        for number, rows in enumerate(parts):
            whole = allocate((max(rows.stop - rows.start, 0), nx), np.float64, self._tally)
            first, last = rows.start // SIDE, min(-(-rows.stop // SIDE), down)
            for row in range(first, last if whole.size else first):
                strip = self._interpolate_row(nodes, row, across)
                columns = np.nonzero(reached[row])[0]
                for column, block in zip(columns, self._near.at(row, columns), strict=True):
                    strip[:, column * SIDE : (column + 1) * SIDE] += block
                top = row * SIDE
                start, stop = max(top, rows.start), min(top + SIDE, rows.stop)
                whole[start - rows.start : stop - rows.start] = strip[start - top : stop - top, :nx]
            take(number, whole)

    def _interpolate_row(self, nodes: Array, row: int, across: int) -> Array:
        """Return the displacement of nodes at the points of a row of tiles."""
        wide = self._per_tile + ORDER
        along_y = self._weights @ nodes[row * self._per_tile : row * self._per_tile + wide]
        windows = np.lib.stride_tricks.sliding_window_view(along_y, wide, axis=1)[:, :: self._per_tile]
        return np.matmul(windows[:, :across], self._weights.T).reshape(SIDE, across * SIDE)


class FreeNodes:
    """Nodes of tiles of a free box; `smooth(x, y)` is the influence coefficient of a node."""

    def __init__(
        self, tiles: Tiles, size: tuple[float, float], smooth: Callable[[Array, Array], Array], tally: Tally
    ) -> None:
        step = step_of_nodes(tiles)
        shape = [SIDE // step * count + ORDER for count in tiles_along(tiles.points)]
        slab = Slab.alone(shape[0], shape[1], tally)
        self.map = slab.zeros()
        padded = FFT(slab, padded_lengths(shape[0], shape[1]), measured=False)
        nx, ny = tiles.points
        box = step * size[0] / nx * shape[0], step * size[1] / ny * shape[1]
        table = tabulate(padded, box, lambda x, y, *_: smooth(x, y), even=True)
        self._far = Convolution(padded, lambda rows: table[rows].real, np.float64)

    def displace(self) -> None:
        """Replace the loads in `map` by displacements."""
        self._far.apply(self.map, self.map)


def free_operator(
    tiles: Tiles,
    size: tuple[float, float],
    poisson: float,
    coefficient: Callable[[Array, Array, float, float], Array],
    tally: Tally,
) -> TileOperator:
    """Return the operator from pressure to displacement on tiles of a free box of `size`. `coefficient(x, y, dx, dy)`
    is the displacement at a distance from a cell under unit pressure."""
    dx, dy, length, count = _lengths(tiles, size)
    factor = (1.0 - poisson) / (2.0 * np.pi) * dx * dy

    def smooth(x: Array, y: Array) -> Array:
        return factor * np.asarray(_mean_smooth(x, y, GAUSS * dx, GAUSS * dy, length))

    x, y = dx * np.arange(count)[None, :], dy * np.arange(count)[:, None]
    return TileOperator(tiles, coefficient(x, y, dx, dy) - smooth(x, y), FreeNodes(tiles, size, smooth, tally), tally)


def _lengths(tiles: Tiles, size: tuple[float, float]) -> tuple[float, float, float, int]:
    """Return the sides of a cell, the length s, and the points of the first part, in whole tiles."""
    dx, dy = size[0] / tiles.points[0], size[1] / tiles.points[1]
    length = FINENESS * step_of_nodes(tiles) * max(dx, dy)
    return dx, dy, length, SIDE * (math.ceil(REACH * length / min(dx, dy) / SIDE) + 1)


def step_of_nodes(tiles: Tiles) -> int:
    """Return the distance of nodes in points, a divisor of SIDE."""
    step = 4
    while step * NODES < max(tiles.points) and step < SIDE // FEWEST_NODES:
        step *= 2
    return step


def _interpolation(step: int) -> NDArray[np.float64]:
    """Return the weights of nodes for the points of a tile, shape (SIDE, nodes); ORDER/2 nodes precede the tile."""
    weights = np.zeros((SIDE, SIDE // step + ORDER))
    places = (np.arange(SIDE) + 0.5) / step - 0.5 + ORDER // 2
    for point, place in enumerate(places):
        first = math.floor(place) - ORDER // 2 + 1
        nodes = np.arange(first, first + ORDER)
        for node in nodes:
            others = nodes[nodes != node]
            weights[point, node] = np.prod((place - others) / (node - others))
    return weights


@pointwise
def _mean_smooth(x, y, a, b, length):  # type: ignore[no-untyped-def]  # numba finds the types itself
    """Return the mean of erf(r/length)/r over a cell."""
    total, beyond = 0.0, FAR * length
    for i in (-1.0, 1.0):
        for j in (-1.0, 1.0):
            r = math.sqrt((x + i * a) ** 2 + (y + j * b) ** 2)
            total += (math.erf(r / length) if r < beyond else 1.0) / r
    return 0.25 * total
