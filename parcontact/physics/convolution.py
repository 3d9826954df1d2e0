"""Convolutions on a grid, by a symbol on the wavenumbers of a transform or by coefficients in space."""

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
PARTS = 16  # tuning: parts of a spectrum that are computed one after the other, to save memory


class Convolution:
    """A linear operator given by its symbol on the wavenumbers of a transform.

    `part(rows)` returns the symbol on these rows of the spectrum. It is stored as `dtype`, times the scale of the
    transforms, in `symbols` for each block of columns. If it is `even` in q_y, only rows of q_y >= 0 are made; with
    `later` they are made at the first use.
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
        """Return the operator whose symbol is `function` of this one's."""
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
        """Return the image of a uniform field 1; collective."""
        owns = self.fft.columns.start == 0 < self.fft.columns.stop
        own = float(self.symbols[0][0, 0].real) * self.fft.mx * self.fft.my if owns else 0.0
        return self.fft.slab.sum(own)[0]

    def loss(self, field: Array, size: tuple[float, float], direction: tuple[float, float]) -> float:
        """Return `-sum p du/ds` for a field p and its image u, with the slope along a unit `direction`; collective.

        In Fourier space this is `sum |p^|^2 (q s) Im A(q)/(mx my)` over all waves of a box of `size`, or of the
        padded box. For a pressure under a surface that slides along s at the speed v, it is the dissipated power
        over v. It is 0 for a real symbol, as that of an elastic body.
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
    """A linear operator on maps that continue mirrored at their edges, by its real symbol on `cosines`.

    `part(rows)` returns the symbol of the real parts of the spectrum as its real part, and the symbol of the
    imaginary parts as its imaginary part.
    """

    def __init__(self, cosines: Cosines, part: Callable[[slice], NDArray[np.complexfloating]]) -> None:
        self.fft, self._part = cosines, part

    @cached_property
    def symbols(self) -> Symbols:
        """The symbols, made at the first use."""
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
    """Return the angular wavenumbers `(qx, qy)` of a spectrum of a box of `size = (lx, ly)`; they broadcast to the
    shape of its `rows`."""
    along_x, along_y = fft.modes
    return 2 * np.pi / size[0] * along_x, 2 * np.pi / size[1] * along_y[rows]


def travelling_wavenumbers(fft: FFT, size: tuple[float, float], rows: slice = ALL) -> tuple[Array, Array]:
    """Return `wavenumbers` with 0 for those of Nyquist, which have two signs: the slope of such a wave is 0 on the
    grid."""
    qx, qy = wavenumbers(fft, size, rows)
    along_x, along_y = fft.modes
    return np.where(2 * np.abs(along_x) == fft.mx, 0.0, qx), np.where(2 * np.abs(along_y[rows]) == fft.my, 0.0, qy)


def padded_lengths(nx: int, ny: int) -> tuple[int, int]:
    """Return lengths of fast transforms of a free half space, at least twice those of the box."""
    return pyfftw.next_fast_len(2 * nx), pyfftw.next_fast_len(2 * ny)


def tabulate(
    fft: FFT,
    size: tuple[float, float],
    coefficient: Callable[..., Array],
    even: bool = False,
    inside: bool = False,
    symmetric: bool = True,
) -> NDArray[np.complexfloating]:
    """Return the symbol on the padded transform `fft` of `coefficient(x, y, dx, dy)`, the displacement at the distance
    (x, y) [length] from a cell under unit pressure; collective. No rank holds the whole table.

    A coefficient that is `even` in x and y is computed once per distance, and for half of these if it is `symmetric` in
    x and y on square cells. With `inside`, the symbol uses the memory of the transform and is lost at its next call.
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
    """Return the transform of a table of coefficients with the lengths of `fft`; collective."""
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
