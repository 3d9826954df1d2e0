"""Operators on tiles of a box with nothing around: they cost what the tiles have of points, not what the box has.

Maps of T tiles of SIDE x SIDE points are stacked to one of `T SIDE` rows. The coefficients between two tiles depend on
their offset only, and are taken apart (P. P. Ewald, Ann. Phys. 369 (1921) 253) with s a length and r the distance:

    1/r = (1 - erf(r/s))/r + erf(r/s)/r.

The first part vanishes beyond `REACH s`: it is a cyclic convolution between tiles that are near each other, of twice
their side. The second one varies over s: loads of points are given to the nodes of a regular grid, at distances of
`s/FINENESS`, by the transposed interpolation of degree `ORDER - 1`; displacements of nodes are interpolated (A. Brandt
and A. A. Lubrecht, J. Comput. Phys. 90 (1990) 348). Love's coefficients of both parts are means over a cell. What the
two lengths leave out is below 1e-6 of the displacement.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop, pointwise
from ..parallel.fft import FFT
from ..parallel.fftw import pyfftw
from ..parallel.slab import Array, Slab, allocate
from ..parallel.tally import Tally
from .convolution import Convolution, padded_lengths, tabulate

SIDE = 32  # tuning: points of a tile; twice as many in its transforms
ORDER = 8  # accuracy: nodes of an interpolation along each direction
FINENESS = 6.0  # accuracy: distances of nodes in the length s
REACH = 4.0  # accuracy: lengths s beyond which the first part is left out, which is 1.5e-8 there
NODES = 256  # tuning: nodes along the longer side of a box, at most, where a tile has enough of them
FEWEST_NODES = 2  # along a tile
LONGEST_CELL = 2.0  # tuning: times its width: beyond it too many tiles are near each other
FAR = 6.0  # lengths s beyond which erf is 1 in double precision
GAUSS = 0.5 / math.sqrt(3.0)  # of a cell: places of two points whose mean is that over the cell, to third degree


@dataclass(frozen=True)
class Tiles:
    """Tiles of a grid of `points = (nx, ny)`: their rows and columns among all tiles; the last ones may be cut off by
    the end of the grid."""

    points: tuple[int, int]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    @property
    def count(self) -> int:
        return len(self.rows)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a stacked map."""
        return self.count * SIDE, SIDE

    @cached_property
    def numbers(self) -> NDArray[np.intp]:
        """The number of each tile of the grid, -1 for those that are not there."""
        across, down = tiles_along(self.points)
        numbers = np.full((down, across), -1)
        numbers[self.rows, self.columns] = np.arange(self.count)
        return numbers


def tiles_along(points: tuple[int, int]) -> tuple[int, int]:
    """Return the numbers of tiles along x and y."""
    return -(-points[0] // SIDE), -(-points[1] // SIDE)


class TileConvolution:
    """A convolution between tiles that are at most `reach` tiles apart along x and y.

    `quadrant` are its coefficients at distances from 0 to `SIDE (reach + 1) - 1` points along y and x.
    """

    def __init__(self, tiles: Tiles, reach: int, quadrant: Array, tally: Tally) -> None:
        self.tiles, self.tally, self._reach = tiles, tally, reach
        length, count = 2 * SIDE, tiles.count
        self._padded = allocate((count, length, length), np.float64, tally)
        self._waves, self._sums = (allocate((count, length, SIDE + 1), np.complex128, tally) for _ in range(2))
        self._padded.fill(0.0)
        make = partial(pyfftw.FFTW, axes=(1, 2), flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"))
        self._forward = make(self._padded, self._waves)
        self._backward = make(self._sums, self._padded, direction="FFTW_BACKWARD")
        self._symbols = _symbols(quadrant, reach, tally)

    def apply(self, field: Array, out: Array) -> Array:
        """Apply it to a stacked map; both may be the same."""
        self.tally["operator"] += 1
        self._padded[:, :SIDE, :SIDE] = field.reshape(-1, SIDE, SIDE)
        self._padded[:, SIDE:, :] = 0.0
        self._padded[:, :SIDE, SIDE:] = 0.0
        self._forward.execute()
        _add_products(self.tiles.numbers, self.tiles.rows, self.tiles.columns, self._symbols, self._waves, self._sums)
        self._backward.execute()
        out.reshape(-1, SIDE, SIDE)[...] = self._padded[:, :SIDE, :SIDE]
        return out


def _symbols(quadrant: Array, reach: int, tally: Tally) -> NDArray[np.complex128]:
    """Transforms of the coefficients for each offset of tiles, from -reach to reach along y and x."""
    count, length = 2 * reach + 1, 2 * SIDE
    steps = (np.arange(length) + SIDE) % length - SIDE
    places = np.abs(SIDE * np.arange(-reach, reach + 1)[:, None] + steps[None, :])
    symbols = allocate((count, count, length, SIDE + 1), np.complex128, tally)
    places[places >= len(quadrant)] = 0  # half a period off: multiplies zeros alone
    for row in range(count):
        kernels = quadrant[places[row][None, :, None], places[:, None, :]]
        symbols[row] = np.fft.rfft2(kernels) / length**2
    return symbols


class TileOperator:
    """Pressure -> displacement on tiles of a box of `size` with nothing around; `coefficient(x, y, dx, dy)` is the
    displacement at a distance from a cell under a unit pressure, `poisson` of the half space."""

    def __init__(
        self,
        tiles: Tiles,
        size: tuple[float, float],
        poisson: float,
        coefficient: Callable[[Array, Array, float, float], Array],
        tally: Tally,
    ) -> None:
        nx, ny = tiles.points
        dx, dy = size[0] / nx, size[1] / ny
        step = step_of_nodes(tiles.points)
        length = FINENESS * step * max(dx, dy)
        reach = math.ceil(REACH * length / min(dx, dy) / SIDE)
        x, y = (each * np.arange(SIDE * (reach + 1)) for each in (dx, dy))
        factor = (1.0 - poisson) / (2.0 * np.pi) * dx * dy

        def smooth(x: Array, y: Array) -> Array:
            return factor * np.asarray(_mean_smooth(x, y, GAUSS * dx, GAUSS * dy, length))

        near = coefficient(x[None, :], y[:, None], dx, dy) - smooth(x[None, :], y[:, None])
        self._near = TileConvolution(tiles, reach, near, tally)
        self._weights, wide = _interpolation(step), SIDE // step + ORDER
        self._places = [
            (slice(row, row + wide), slice(column, column + wide))
            for row, column in zip(tiles.rows * (wide - ORDER), tiles.columns * (wide - ORDER), strict=True)
        ]
        shape = [SIDE // step * count + ORDER for count in tiles_along(tiles.points)]
        slab = Slab.alone(shape[0], shape[1], tally)
        self._nodes = slab.zeros()
        padded = FFT(slab, padded_lengths(shape[0], shape[1]), measured=False)
        box = step * dx * shape[0], step * dy * shape[1]
        table = tabulate(padded, box, lambda x, y, *_: smooth(x, y), even=True)
        self._far = Convolution(padded, lambda rows: table[rows].real, np.float64)

    def apply(self, field: Array, out: Array) -> Array:
        """Apply it to a stacked map, not in its place."""
        self._near.apply(field, out)
        weights, nodes = self._weights, self._nodes
        nodes.fill(0.0)
        patches = np.matmul(np.matmul(weights.T, field.reshape(-1, SIDE, SIDE)), weights)
        for place, patch in zip(self._places, patches, strict=True):
            nodes[place] += patch
        self._far.apply(nodes, nodes)
        for place, patch in zip(self._places, patches, strict=True):
            patch[...] = nodes[place]
        out += np.matmul(np.matmul(weights, patches), weights.T).reshape(out.shape)
        return out


def step_of_nodes(points: tuple[int, int]) -> int:
    """Points from one node to the next, a divisor of SIDE."""
    step = 4
    while step * NODES < max(points) and step < SIDE // FEWEST_NODES:
        step *= 2
    return step


def _interpolation(step: int) -> Array:
    """Weights of nodes for the points of a tile, shape (SIDE, nodes); ORDER/2 nodes are before the tile."""
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
    """Mean of erf(r/length)/r over a cell."""
    total, beyond = 0.0, FAR * length
    for i in (-1.0, 1.0):
        for j in (-1.0, 1.0):
            r = math.sqrt((x + i * a) ** 2 + (y + j * b) ** 2)
            total += (math.erf(r / length) if r < beyond else 1.0) / r
    return 0.25 * total


def tile_inverse(tiles: Tiles, size: tuple[float, float], poisson: float, tally: Tally) -> TileConvolution:
    """Displacement -> pressure between tiles beside each other, a preconditioner: the symbol `|q|/(1 - nu)`, whose
    coefficients fall with the third power of the distance."""
    length = 8 * SIDE
    qx, qy = (
        2.0 * np.pi * np.fft.fftfreq(length, each / count) for each, count in zip(size, tiles.points, strict=True)
    )
    kernel = np.fft.ifft2(np.hypot(qx[None, :], qy[:, None]) / (1.0 - poisson)).real
    return TileConvolution(tiles, 1, kernel[: 2 * SIDE, : 2 * SIDE], tally)


@loop
def _add_products(
    numbers: NDArray[np.intp],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    symbols: NDArray[np.complex128],
    waves: NDArray[np.complex128],
    sums: NDArray[np.complex128],
) -> None:
    """The transform of each tile's result: the sum over those near it of symbols times transforms."""
    reach = symbols.shape[0] // 2
    down, across = numbers.shape
    for own in range(sums.shape[0]):
        total = sums[own]
        total[:] = 0.0
        row, column = rows[own], columns[own]
        for j in range(max(row - reach, 0), min(row + reach + 1, down)):
            for i in range(max(column - reach, 0), min(column + reach + 1, across)):
                other = numbers[j, i]
                if other >= 0:
                    symbol, wave = symbols[row - j + reach, column - i + reach], waves[other]
                    for k in range(total.shape[0]):
                        for m in range(total.shape[1]):
                            total[k, m] += symbol[k, m] * wave[k, m]
