"""Convolutions on a grid: a symbol on the wavenumbers of a transform, given as such or by coefficients in space."""

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..parallel.cosines import Cosines
from ..parallel.fft import FFT
from ..parallel.fftw import pyfftw
from ..parallel.slab import Array, allocate, deal

Symbols = list[NDArray[Any]]  # one for each block of columns
Make = Callable[[], Symbols]
ALL = slice(None)
PARTS = 16  # tuning: of a spectrum, for which something is calculated at once: what it takes is small beside the whole


class Convolution:
    """A linear operator given by its symbol on the wavenumbers of a transform.

    `part(rows)` is the symbol on these rows of the spectrum, `dtype` what it is kept in, times the scale of the
    transforms, in `symbols` for each block of columns. Of one that is `even` in q_y only the rows of q_y >= 0 are made
    and kept; one made `later` has them from when it is first applied.
    """

    def __init__(
        self,
        fft: FFT,
        part: Callable[[slice], NDArray[np.inexact]],
        dtype: DTypeLike,
        even: bool = True,
        later: bool = False,
    ) -> None:
        self.fft, self.even = fft, even
        self._make: Make | None = partial(_in_blocks, fft, part, dtype, fft.my // 2 + 1 if even else fft.my)
        if not later:
            self.symbols = self._made()

    @cached_property
    def symbols(self) -> Symbols:
        return self._made()

    def _made(self) -> Symbols:
        """Make the symbols, once."""
        assert self._make is not None
        symbols, self._make = self._make(), None
        return symbols

    def mapped(self, function: Callable[[NDArray[np.inexact]], NDArray[np.inexact]], dtype: DTypeLike) -> "Convolution":
        """The operator whose symbol is a function of this one's."""
        scale = self.fft.mx * self.fft.my

        def part(rows: slice) -> NDArray[np.inexact]:
            blocks = [symbol[rows] for symbol in self.symbols]
            return function(scale * np.concatenate(blocks, axis=1)) if blocks else np.empty((0, 0))

        return Convolution(self.fft, part, dtype, self.even)

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbols, out)

    def loss(self, field: Array, size: tuple[float, float], direction: tuple[float, float]) -> float:
        """Return `-sum p du/ds`, with the slope along a unit `direction` of what a field p makes, u; collective.

        In Fourier space that is `sum |p^|^2 (q s) Im A(q)/(mx my)` over all waves of a box of `size` (padded, where the
        transform is): for a pressure under a surface that slides along s at the speed v, the power that the body
        dissipates over v. It is 0 for an operator with a real symbol, as that of an elastic body is.
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
    """A linear operator on maps as they go on mirrored at their edges, by its real symbol on `cosines`.

    `part(rows)` is that of the real parts of the spectrum, as its real part, and of the imaginary ones.
    """

    def __init__(self, cosines: Cosines, part: Callable[[slice], NDArray[np.complexfloating]]) -> None:
        self.fft, self._part = cosines, part

    @cached_property
    def symbols(self) -> Symbols:
        """They are made when it is first applied."""
        return _in_blocks(self.fft, self._part, self.fft.fft.complex, self.fft.my)

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbols, out)


def _in_blocks(
    fft: FFT | Cosines, part: Callable[[slice], NDArray[np.inexact]], dtype: DTypeLike, count: int
) -> Symbols:
    """The first `count` rows of a symbol, times the scale of the transforms, for each block of columns."""
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
    """Angular wavenumbers `(qx, qy)` of a spectrum of a box of `size = (lx, ly)`; they broadcast to the shape of these
    rows of it."""
    along_x, along_y = fft.modes
    return 2 * np.pi / size[0] * along_x, 2 * np.pi / size[1] * along_y[rows]


def travelling_wavenumbers(fft: FFT, size: tuple[float, float], rows: slice = ALL) -> tuple[Array, Array]:
    """Return `wavenumbers`, but 0 for that of Nyquist, whose wave has two signs: its slope vanishes on the grid."""
    qx, qy = wavenumbers(fft, size, rows)
    along_x, along_y = fft.modes
    return np.where(2 * np.abs(along_x) == fft.mx, 0.0, qx), np.where(2 * np.abs(along_y[rows]) == fft.my, 0.0, qy)


def padded_lengths(nx: int, ny: int) -> tuple[int, int]:
    """Lengths of the transforms of a free half space: fast ones of at least twice the box."""
    return pyfftw.next_fast_len(2 * nx), pyfftw.next_fast_len(2 * ny)


def tabulate(
    fft: FFT,
    size: tuple[float, float],
    coefficient: Callable[..., Array],
    even: bool = False,
    inside: bool = False,
    symmetric: bool = True,
) -> NDArray[np.complexfloating]:
    """Symbol on the padded transform `fft` of `coefficient(x, y, dx, dy)`, the displacement at distance (x, y) [length]
    that a unit pressure on one cell causes; collective, and no rank holds the whole table. One that is `even` in x and
    in y is calculated for each distance once, for half of them if it is `symmetric` in both on square cells. One made
    `inside` the memory of the transform is lost at its next call.
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
    """The transform of a table of coefficients on the lengths of another one; collective."""
    sharing = fft if inside and fft.dtype == np.float64 else None
    return FFT(fft.slab.resized(fft.mx, fft.my), measured=fft.measured, sharing=sharing)


def _symmetric(coefficient: Callable[..., Array], distances: NDArray[np.int64], step: float) -> Array:
    """Coefficients of square cells, which do not tell x from y: those of x >= y, and what they are for the others."""
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
