"""Operators on maps of a grid, given by a symbol or by coefficients in space, and operators on tiles of a grid.

The cost of operators on tiles, and of operators from tiles to the whole grid, is proportional to the number of
points of the tiles, not of the box.

The coefficients between two tiles depend on their offset only. With the distance r of two points and a length s,
they are split into two parts (P. P. Ewald, Ann. Phys. 369 (1921) 253):

    1/r = (1 - erf(r/s))/r + erf(r/s)/r.

The first part vanishes beyond `REACH s`: it is a cyclic convolution between near tiles, padded to twice their side.
The second part varies over lengths of s: loads of points are transferred to the nodes of a regular grid, at distances
of `s/FINENESS`, by the transposed interpolation of degree `ORDER - 1`; displacements of nodes are interpolated (A.
Brandt and A. A. Lubrecht, J. Comput. Phys. 90 (1990) 348). Love's coefficients of both parts are means over a cell. The
error is below 1e-6 of the displacement.

Maps of T tiles of SIDE x SIDE points are stacked to one map of `T SIDE` rows. The transform of the result on a tile
is the sum over near tiles of their transforms, each multiplied by the symbol for the offset of the two tiles.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..compiled import loop, pointwise
from ..parallel.fft import FFT, Cosines, pyfftw
from ..parallel.slab import Array, Slab, Tally, allocate, deal

Symbols = list[NDArray[Any]]  # one for each block of columns
Make = Callable[[], Symbols]
ALL = slice(None)
PARTS = 16  # tuning: parts of a spectrum that are computed one after the other, to save memory


class Convolution:
    """A linear operator given by its symbol on the wavenumbers of a transform.

    `part(rows)` returns the symbol on these rows of the spectrum. The symbol is multiplied by the scale of the
    transforms and stored in `symbols`, with the type `dtype`, as one array for each block of columns. If the symbol is
    `even` in q_y, only the rows of q_y >= 0 are stored. If `later` is True, the symbol is computed at the first use of
    the operator.
    """

    def __init__(
        self,
        fft: FFT,
        part: Callable[[slice], NDArray[np.inexact]],
        dtype: DTypeLike,
        even: bool = True,
        later: bool = False,
    ) -> None:
        self.fft, self.even, self.dtype = fft, even, dtype
        self._make: Make | None = partial(_in_blocks, fft, part, dtype, fft.my // 2 + 1 if even else fft.my)
        if not later:
            self.symbols = self._made()

    @cached_property
    def symbols(self) -> Symbols:
        return self._made()

    def _made(self) -> Symbols:
        """Make the symbols; called once."""
        assert self._make is not None
        symbols, self._make = self._make(), None
        return symbols

    def mapped(self, function: Callable[[NDArray[np.inexact]], NDArray[np.inexact]], dtype: DTypeLike) -> "Convolution":
        """Return the operator whose symbol is `function(symbol)` of this operator's symbol."""
        scale = self.fft.mx * self.fft.my

        def part(rows: slice) -> NDArray[np.inexact]:
            blocks = [symbol[rows] for symbol in self.symbols]
            return function(scale * np.concatenate(blocks, axis=1)) if blocks else np.empty((0, 0))

        return Convolution(self.fft, part, dtype, self.even)

    def apply(self, field: Array, out: Array) -> Array:
        """Put the convolution of `field` into `out`; collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbols, out)

    def mean(self) -> float:
        """Return the uniform value of the result for a field that is 1 everywhere; collective."""
        owns = self.fft.columns.start == 0 < self.fft.columns.stop
        own = float(self.symbols[0][0, 0].real) * self.fft.mx * self.fft.my if owns else 0.0
        return self.fft.slab.sum(own)[0]

    def loss(self, field: Array, size: tuple[float, float], direction: tuple[float, float]) -> float:
        """Return `-sum p du/ds` for a field p and its image u, where s is the coordinate along the unit vector
        `direction`; collective.

        In Fourier space this is `sum |p^|^2 (q s) Im A(q)/(mx my)` over all waves of a transform of mx x my points.
        `size` is the size of the box (lx, ly), which the transform may pad. For a pressure under a surface that slides
        along s at the speed v, the sum is the dissipated power divided by v. The sum is 0 for a real symbol, such as
        the symbol of an elastic body.
        """
        total, spectrum = 0.0, self.fft.forward(field)
        lengths = size[0] * self.fft.mx / self.fft.slab.nx, size[1] * self.fft.my / self.fft.slab.ny
        for rows in deal(self.fft.my, PARTS):
            qx, qy = travelling_wavenumbers(self.fft, lengths, rows)
            along = self.fft.multiplicity * (qx * direction[0] + qy * direction[1])
            places = np.abs(self.fft.modes[1][rows, 0]) if self.even else rows
            for columns, symbol in zip(self.fft.column_blocks, self.symbols, strict=True):
                waves = spectrum[rows, columns]
                power = (waves.real**2 + waves.imag**2) * symbol[places].imag
                total += float((power * along[:, columns]).sum(dtype=np.float64))
        return self.fft.slab.sum(total)[0]


class MirroredConvolution:
    """A linear operator on maps that are continued mirrored at their edges, given by a real symbol on the wavenumbers
    of the transform `cosines`.

    `part(rows)` returns two values of the symbol in each complex number: the real part is the symbol for the real part
    of the spectrum, and the imaginary part is the symbol for the imaginary part.
    """

    def __init__(self, cosines: Cosines, part: Callable[[slice], NDArray[np.complexfloating]]) -> None:
        self.fft, self._part = cosines, part

    @cached_property
    def symbols(self) -> Symbols:
        """The symbols for all blocks of columns, made at the first use."""
        return _in_blocks(self.fft, self._part, self.fft.fft.complex, self.fft.my)

    def apply(self, field: Array, out: Array) -> Array:
        """Put the result for `field` into `out`; collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbols, out)


def _in_blocks(
    fft: FFT | Cosines, part: Callable[[slice], NDArray[np.inexact]], dtype: DTypeLike, count: int
) -> Symbols:
    """Return the first `count` rows of a symbol, times the scale of the transforms, for each block of columns."""
    widths = [columns.stop - columns.start for columns in fft.column_blocks]
    symbols: Symbols = [allocate((count, width), dtype, fft.slab.tally) for width in widths]
    if fft.slab.only_counts:
        return symbols
    for rows in deal(count, PARTS):
        values = part(rows)
        for columns, symbol in zip(fft.column_blocks, symbols, strict=True):
            np.multiply(values[:, columns], 1.0 / (fft.mx * fft.my), out=symbol[rows], casting="same_kind")
    return symbols


def wavenumbers(fft: FFT, size: tuple[float, float], rows: slice = ALL) -> tuple[Array, Array]:
    """Return the angular wavenumbers `(qx, qy)` of a spectrum on a box of `size = (lx, ly)`; they broadcast to the
    shape of its `rows`."""
    along_x, along_y = fft.modes
    return 2 * np.pi / size[0] * along_x, 2 * np.pi / size[1] * along_y[rows]


def travelling_wavenumbers(fft: FFT, size: tuple[float, float], rows: slice = ALL) -> tuple[Array, Array]:
    """Return `wavenumbers`, with 0 in place of the Nyquist wavenumbers: their sign is not defined, and the slope of
    these waves is 0 at all points of the grid."""
    qx, qy = wavenumbers(fft, size, rows)
    along_x, along_y = fft.modes
    return np.where(2 * np.abs(along_x) == fft.mx, 0.0, qx), np.where(2 * np.abs(along_y[rows]) == fft.my, 0.0, qy)


def padded_lengths(nx: int, ny: int) -> tuple[int, int]:
    """Return the lengths of fast transforms for a free half space, at least twice the lengths nx and ny of the box."""
    return pyfftw.next_fast_len(2 * nx), pyfftw.next_fast_len(2 * ny)


def tabulate(
    fft: FFT,
    size: tuple[float, float],
    coefficient: Callable[..., Array],
    even: bool = False,
    inside: bool = False,
    symmetric: bool = True,
) -> NDArray[np.complexfloating]:
    """Return the symbol, on the padded transform `fft`, of a table of influence coefficients; collective. No rank holds
    the whole table.

    `coefficient(x, y, dx, dy)` is the displacement at the distance (x, y) [length] from a cell under unit pressure. A
    coefficient is `even` if it does not change with the signs of x and y: each distance is then computed once. A
    coefficient is `symmetric` if it does not change when x and y are exchanged: on square cells, half of these
    distances are then computed. With `inside`, the symbol is stored in the memory of the transform and is lost at the
    next call of the transform.
    """
    transform = table_transform(fft, inside)
    if fft.slab.only_counts:
        return transform.spectrum
    dx, dy = size[0] / fft.slab.nx, size[1] / fft.slab.ny
    x, y = _distances(fft.mx), _distances(fft.my)[transform.slab.rows]
    if not even:
        table = coefficient(dx * x[None, :], dy * y[:, None], dx, dy)
        return transform.forward(np.ascontiguousarray(table))
    (near_x, from_x), (near_y, from_y) = (np.unique(np.abs(each), return_inverse=True) for each in (x, y))
    if symmetric and dx == dy and np.array_equal(near_x, near_y):
        quadrant = _symmetric(coefficient, near_x, dx)
    else:
        quadrant = coefficient(dx * near_x[None, :], dy * near_y[:, None], dx, dy)
    return transform.forward(quadrant.take(from_x, axis=1).take(from_y, axis=0))


def table_transform(fft: FFT, inside: bool) -> FFT:
    """Return a transform in double precision with the lengths of `fft`, for a table of coefficients; collective. With
    `inside`, this transform uses the memory of the spectrum of `fft` if the precision of `fft` is double, too."""
    sharing = fft if inside and fft.dtype == np.float64 else None
    return FFT(fft.slab.resized(fft.mx, fft.my), measured=fft.measured, sharing=sharing)


def _symmetric(coefficient: Callable[..., Array], distances: NDArray[np.int64], step: float) -> Array:
    """Return coefficients of square cells: only x >= y is computed and copied to the others."""
    count = len(distances)
    quadrant = np.empty((count, count))
    for rows in deal(count, PARTS):
        from_x = slice(rows.start, count)
        quadrant[rows, from_x] = coefficient(step * distances[None, from_x], step * distances[rows, None], step, step)
        quadrant[from_x, rows] = quadrant[rows, from_x].T
    return quadrant


def _distances(count: int) -> NDArray[np.int64]:
    index = np.arange(count)
    return np.where(2 * index <= count, index, index - count)


SIDE = 32  # tuning: side of a tile [points]; transforms have twice as many
REACH_OF_INVERSE = 1  # tuning: reach of `tile_inverse` [tiles]
LONGEST_CELL = 2.0  # tuning: largest ratio of sides of a cell for which tiles are used


@dataclass(frozen=True)
class Tiles:
    """Some of the squares of SIDE x SIDE points (tiles) into which a grid of `points = (nx, ny)` is divided. `rows` and
    `columns`, each of shape (number of tiles,), count tiles along y and x. The last tiles along x and y may be cut at
    the end of the grid."""

    points: tuple[int, int]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    @property
    def count(self) -> int:
        return len(self.rows)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a map in which all tiles are stacked."""
        return self.count * SIDE, SIDE

    @cached_property
    def numbers(self) -> NDArray[np.intp]:
        """Place of each tile of the grid in the stacked map, shape (tiles along y, tiles along x); -1 for tiles that
        are not among `rows` and `columns`."""
        across, down = tiles_along(self.points)
        numbers = np.full((down, across), -1)
        numbers[self.rows, self.columns] = np.arange(self.count)
        return numbers


def tiles_along(points: tuple[int, int]) -> tuple[int, int]:
    """Return the numbers of tiles along x and y for a grid of (nx, ny) points."""
    return -(-points[0] // SIDE), -(-points[1] // SIDE)


class TileConvolution:
    """A convolution between tiles with an offset of at most `reach` tiles along x and y.

    `quadrant` has the coefficients at distances from 0 to `SIDE (reach + 1) - 1` points along y and x. Coefficients are
    even in x and y.
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
        """Transform a stacked map; `at` then returns results."""
        self._padded[:, :SIDE, :SIDE] = field.reshape(-1, SIDE, SIDE)
        self._padded[:, SIDE:, :] = 0.0
        self._padded[:, :SIDE, SIDE:] = 0.0
        self._forward.execute()

    def at(self, row: int, columns: NDArray[np.intp]) -> Iterator[Array]:
        """Yield the result for the last map that was passed to `transform`, on the tiles of the grid at this `row`
        and these `columns`, in order. Each result has the shape (SIDE, SIDE) and is valid until the next result is
        yielded."""
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
        """Return a mask of the tiles of the grid that are within `reach` of a tile of the operator."""
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
    """Return a preconditioner on tiles, from displacement to pressure. Its symbol is `|q|/(1 - nu)`. The coefficients
    fall with the third power of the distance, and only coefficients between adjacent tiles are kept. `tally` counts the
    allocated memory and the operator calls."""
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


ORDER = 8  # accuracy: nodes per interpolation along each direction
FINENESS = 6.0  # accuracy: s over the distance of nodes
REACH = 4.0  # accuracy: distance over s beyond which the first part, then 1.5e-8, is left out
NODES = 256  # tuning: largest number of nodes along the longer side of a box
FEWEST_NODES = 2  # least number of nodes along a tile
FAR = 6.0  # r/s beyond which erf is 1 in double precision
GAUSS = 0.5 / math.sqrt(3.0)  # two-point Gauss rule over a cell


class TileOperator:
    """Operator from pressure to displacement on tiles.

    1/r is split into two parts, as in the module. `near` has the coefficients of the first part at distances along y
    and x from 0 up; `nodes` computes the displacement by the second part.
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
        """Compute the displacement of the whole grid under a stacked map. For each of the row ranges `parts`, in order,
        call `take(number, map)` with the index of the range and the displacement on its rows."""
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
    """Nodes of a regular grid for the tiles of a free box; `smooth(x, y)` is the influence coefficient of a node."""

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
        """Replace the loads in `map`, one for each node, by the displacements of the nodes."""
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
    """Return the spacing of the nodes of the smooth part in points of the grid, a divisor of SIDE."""
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
