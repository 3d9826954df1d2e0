"""Tiles of a grid, and convolutions between near tiles.

Maps of T tiles of SIDE x SIDE points are stacked to one of `T SIDE` rows. The coefficients between two tiles depend
on their offset only: the transforms of tiles, of twice their side, are multiplied and summed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from ..parallel.fftw import pyfftw
from ..parallel.slab import Array, allocate
from ..parallel.tally import Tally

SIDE = 32  # tuning: side of a tile [points]; transforms have twice as many
REACH_OF_INVERSE = 1  # tuning: reach of `tile_inverse` [tiles]
LONGEST_CELL = 2.0  # tuning: largest ratio of sides of a cell for which tiles are used


@dataclass(frozen=True)
class Tiles:
    """Tiles of a grid of `points = (nx, ny)`, given by their rows and columns among all tiles. The end of the grid may
    cut the last ones."""

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
        """Number of each tile of the grid, -1 for absent tiles."""
        across, down = tiles_along(self.points)
        numbers = np.full((down, across), -1)
        numbers[self.rows, self.columns] = np.arange(self.count)
        return numbers


def tiles_along(points: tuple[int, int]) -> tuple[int, int]:
    """Return the numbers of tiles along x and y."""
    return -(-points[0] // SIDE), -(-points[1] // SIDE)


class TileConvolution:
    """A convolution between tiles with an offset of at most `reach` tiles along x and y.

    `quadrant` has the coefficients at distances from 0 to `SIDE (reach + 1) - 1` points along y and x.
    """

    def __init__(self, tiles: Tiles, reach: int, quadrant: Array, tally: Tally) -> None:
        self.tiles, self.tally, self._reach = tiles, tally, reach
        length, count = 2 * SIDE, tiles.count
        self._padded = allocate((count, length, length), np.float64, tally)
        self._waves, self._sums = (allocate((count, length, SIDE + 1), np.complex128, tally) for _ in range(2))
        self._symbols = _symbols(quadrant, reach, tally)
        if tally.only_counts:
            return
        self._padded.fill(0.0)
        make = partial(pyfftw.FFTW, axes=(1, 2), flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"))
        self._forward = make(self._padded, self._waves)
        self._backward = make(self._sums, self._padded, direction="FFTW_BACKWARD")
        self._backward_of_one = make(self._sums[:1], self._padded[:1], direction="FFTW_BACKWARD")

    def apply(self, field: Array, out: Array) -> Array:
        """Put the convolution of a stacked map into `out`, which may be the same map."""
        self.tally["operator"] += 1
        self.transform(field)
        self._add_up(self.tiles.rows, self.tiles.columns, self._sums)
        self._backward.execute()
        out.reshape(-1, SIDE, SIDE)[...] = self._padded[:, :SIDE, :SIDE]
        return out

    def transform(self, field: Array) -> None:
        """Transform a stacked map, for `at`."""
        self._padded[:, :SIDE, :SIDE] = field.reshape(-1, SIDE, SIDE)
        self._padded[:, SIDE:, :] = 0.0
        self._padded[:, :SIDE, SIDE:] = 0.0
        self._forward.execute()

    def at(self, row: int, columns: NDArray[np.intp]) -> Iterator[Array]:
        """Yield the result of the transformed map on tiles of a row of tiles, each valid until the next one."""
        own, rows = self._sums[:1], np.array([row])
        for place in range(len(columns)):
            self._add_up(rows, columns[place : place + 1], own)
            self._backward_of_one.execute()
            yield self._padded[0, :SIDE, :SIDE]

    def _add_up(self, rows: NDArray[np.intp], columns: NDArray[np.intp], sums: NDArray[np.complex128]) -> None:
        """Sum products at given tiles of the grid."""
        tiles = self.tiles
        _add_products(tiles.numbers, rows, columns, self._symbols, self._waves, sums)

    def reached(self) -> NDArray[np.bool_]:
        """Return which tiles of the grid are near one of these."""
        reached = np.zeros(self.tiles.numbers.shape, np.bool_)
        for row, column in zip(self.tiles.rows.tolist(), self.tiles.columns.tolist(), strict=True):
            rows, columns = (slice(max(place - self._reach, 0), place + self._reach + 1) for place in (row, column))
            reached[rows, columns] = True
        return reached


def _symbols(quadrant: Array, reach: int, tally: Tally) -> NDArray[np.complex128]:
    """Return transforms of the coefficients for each offset of tiles, from -reach to reach along y and x."""
    count, length = 2 * reach + 1, 2 * SIDE
    steps = (np.arange(length) + SIDE) % length - SIDE
    places = np.abs(SIDE * np.arange(-reach, reach + 1)[:, None] + steps[None, :])
    symbols = allocate((count, count, length, SIDE + 1), np.complex128, tally)
    if tally.only_counts:
        return symbols
    places[places >= len(quadrant)] = 0  # half a period away: multiplies zeros only
    for row in range(count):
        kernels = quadrant[places[row][None, :, None], places[:, None, :]]
        symbols[row] = np.fft.rfft2(kernels) / length**2
    return symbols


def tile_inverse(tiles: Tiles, size: tuple[float, float], poisson: float, tally: Tally) -> TileConvolution:
    """Return an operator from displacement to pressure between adjacent tiles, a preconditioner: the symbol `|q|/(1 -
    nu)`, whose coefficients fall with the third power of the distance."""
    length = 8 * SIDE
    qx, qy = (
        2.0 * np.pi * np.fft.fftfreq(length, each / count) for each, count in zip(size, tiles.points, strict=True)
    )
    kernel = np.fft.ifft2(np.hypot(qx[None, :], qy[:, None]) / (1.0 - poisson)).real
    return TileConvolution(tiles, REACH_OF_INVERSE, kernel[: 2 * SIDE, : 2 * SIDE], tally)


@loop
def _add_products(
    numbers: NDArray[np.intp],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    symbols: NDArray[np.complex128],
    waves: NDArray[np.complex128],
    sums: NDArray[np.complex128],
) -> None:
    """Put the transform of the result on each tile into `sums`: the sum over near tiles of symbols times transforms."""
    reach = symbols.shape[0] // 2
    down, across = numbers.shape
    for own in range(sums.shape[0]):
        total = sums[own]
        total[:] = 0.0
        row, column = rows[own], columns[own]
        for j in range(row - reach, row + reach + 1):
            for i in range(column - reach, column + reach + 1):
                other = numbers[j, i] if 0 <= j < down and 0 <= i < across else -1
                if other >= 0:
                    symbol, wave = symbols[row - j + reach, column - i + reach], waves[other]
                    for k in range(total.shape[0]):
                        for m in range(total.shape[1]):
                            total[k, m] += symbol[k, m] * wave[k, m]
