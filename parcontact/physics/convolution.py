"""Convolutions on a grid: a symbol on the wavenumbers of a transform, given as such or by coefficients in space."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..parallel.fft import FFT
from ..parallel.fftw import pyfftw
from ..parallel.slab import Array


class Convolution:
    """A linear operator given by its symbol on the wavenumbers of a transform, shape `fft.shape`."""

    def __init__(self, fft: FFT, symbol: NDArray[np.inexact]) -> None:
        self.fft = fft
        scale = 1.0 / (fft.mx * fft.my)
        self.symbol = np.multiply(symbol, scale).astype(fft.dtype if np.isrealobj(symbol) else fft.complex)
        fft.slab.tally.hold(self.symbol)

    @staticmethod
    def footprint(spectrum: int) -> int:
        """Bytes of a real symbol beside a transform whose spectrum has so many."""
        return spectrum // 2

    def apply(self, field: Array, out: Array) -> Array:
        """Collective."""
        self.fft.slab.tally["operator"] += 1
        return self.fft.convolve(field, self.symbol, out)


def wavenumbers(fft: FFT, size: tuple[float, float]) -> tuple[Array, Array]:
    """Angular wavenumbers `(qx, qy)` of a spectrum of a box of `size = (lx, ly)`; they broadcast to its shape."""
    along_x, along_y = fft.modes
    return 2 * np.pi / size[0] * along_x, 2 * np.pi / size[1] * along_y


def padded_lengths(nx: int, ny: int) -> tuple[int, int]:
    """Lengths of the transforms of a free half space: fast ones of at least twice the box."""
    return pyfftw.next_fast_len(2 * nx), pyfftw.next_fast_len(2 * ny)


def tabulate(fft: FFT, size: tuple[float, float], coefficient: Callable[..., Array]) -> NDArray[np.complexfloating]:
    """Symbol on the padded transform `fft` of `coefficient(x, y, dx, dy)`, the displacement at distance (x, y) [length]
    that a unit pressure on one cell causes; collective, and no rank holds the whole table.
    """
    slab = fft.slab
    dx, dy = size[0] / slab.nx, size[1] / slab.ny
    padded = slab.resized(fft.mx, fft.my)
    x, y = (step * _distances(count) for step, count in ((dx, fft.mx), (dy, fft.my)))
    table = np.ascontiguousarray(coefficient(x[None, :], y[padded.rows, None], dx, dy))
    return FFT(padded, measured=fft.measured).forward(table)


def _distances(count: int) -> NDArray[np.int64]:
    index = np.arange(count)
    return np.where(2 * index <= count, index, index - count)
