"""Products of a symbol with the cosine series of a map: a convolution of the map continued mirrored at its edges.

The series `C(k, l) = 4 sum h(i, j) cos(pi (i + 1/2) k/nx) cos(pi (j + 1/2) l/ny)` takes a transform of the size of
the map along each direction (J. Makhoul, IEEE Trans. Acoust. Speech Signal Process. 28 (1980) 27). With the even
points first, followed by the odd ones backwards, and V the transform of these n points,

    C(k) = exp(-i theta) V(k) + exp(i theta) V(n - k),        theta = pi k/(2 n),
    V(k) = (exp(i theta)/2) (C(k) - i C(n - k)),              C(n) = 0.

For a row, whose points are real, `C(k) - i C(n - k) = 2 exp(-i theta) V(k)`: the half spectrum has the wave k as its
real part and n - k as its imaginary part. So messages, blocks and memory are as for the transform.
"""

import numpy as np
from numpy.typing import NDArray

from ..compiled import loop
from .fft import FFT, NARROWEST, Spectrum
from .slab import Array, allocate

Waves = tuple[NDArray[np.int64], NDArray[np.int64]]


class Cosines:
    """Series of maps of the size of a transform `fft`, in its precision and in the memory of its spectrum, plus a
    narrow block of columns. The constructor and the methods are collective."""

    def __init__(self, fft: FFT) -> None:
        self.fft, self.slab, self.mx, self.my = fft, fft.slab, fft.mx, fft.my
        count = fft.shape[1]
        self.column_blocks = [slice(k, min(k + NARROWEST, count)) for k in range(0, count, NARROWEST)]
        self._block = allocate((self.my, NARROWEST), fft.complex, self.slab.tally)
        if self.slab.only_counts:
            return
        self._block.fill(0.0)
        self._forward, self._backward = (fft.plan(self._block, self._block, 0, backward) for backward in (False, True))
        self._turn_x, self._turn_y = (
            np.exp(-0.5j * np.pi * np.arange(n) / length).astype(fft.complex)
            for n, length in ((self.mx // 2 + 1, self.mx), (self.my, self.my))
        )

    @property
    def modes(self) -> tuple[Waves, Waves]:
        """Half waves along x and y of the real parts of a spectrum, and of the imaginary parts."""
        columns, along_y = self.fft.columns, np.arange(self.my)[:, None]
        along_x = np.arange(columns.start, columns.stop)[None, :]
        return (along_x, along_y), (self.mx - along_x, along_y)

    def convolve(self, field: Array, symbols: list[NDArray[np.complexfloating]], out: Array) -> Array:
        """Put `(nx ny) series^-1(symbol * series(field))` into `out`; collective.

        Each of the `column_blocks` has its part of the symbol: its real part multiplies real parts of the spectrum,
        its imaginary part multiplies imaginary parts.
        """
        self.fft.along_x(field, self._transform_rows)
        for columns, symbol in zip(self.column_blocks, symbols, strict=True):
            part = self.fft.spectrum[:, columns]
            _fold(part.T, self._block.T[: part.shape[1]])
            self._forward.execute()
            _weigh(self._block, self._turn_y, symbol)
            self._backward.execute()
            _unfold(self._block.T[: part.shape[1]], part.T)
        return self.fft.back_along_x(out, 1.0, self._transform_waves)

    def _transform_rows(self, source: Array, waves: Spectrum) -> None:
        block = self.fft.row_block[: len(waves)]
        _fold(source, block)
        self.fft.execute_rows(block, waves)
        _turn(waves, 2.0 * self._turn_x)

    def _transform_waves(self, waves: Spectrum, target: Array) -> None:
        block = self.fft.row_block[: len(waves)]
        _turn(waves, 0.5 * self._turn_x.conj())
        self.fft.execute_waves(waves, block)
        _unfold(block, target)


def _fold(points: NDArray[np.inexact], folded: NDArray[np.inexact]) -> None:
    """Put the even points of each row first, followed by the odd ones backwards."""
    half = (points.shape[1] + 1) // 2
    folded[:, :half] = points[:, ::2]
    folded[:, half:] = points[:, 1::2][:, ::-1]


def _unfold(folded: NDArray[np.inexact], points: NDArray[np.inexact]) -> None:
    """Undo `_fold`."""
    half = (points.shape[1] + 1) // 2
    points[:, ::2] = folded[:, :half]
    points[:, 1::2] = folded[:, half:][:, ::-1]


@loop
def _turn(waves: NDArray[np.complexfloating], factors: NDArray[np.complexfloating]) -> None:
    for j in range(waves.shape[0]):
        for k in range(waves.shape[1]):
            waves[j, k] *= factors[k]


@loop
def _weigh(
    block: NDArray[np.complexfloating], turn: NDArray[np.complexfloating], symbol: NDArray[np.complexfloating]
) -> None:
    """Convert transforms along y to series, multiply these by the symbol, and convert back; waves l and my - l are
    coupled."""
    count, half = block.shape[0], block.dtype.type(0.5)
    for low in range(count // 2 + 1):
        high = (count - low) % count
        for k in range(symbol.shape[1]):
            v, w = turn[low] * block[low, k], np.conj(turn[low]) * block[high, k]
            c = v + w
            a = symbol[low, k].real * c.real + 1j * (symbol[low, k].imag * c.imag)
            if high == 0:
                block[low, k] = half * a
                continue
            c = 1j * (v - w)  # of my - low
            b = symbol[high, k].real * c.real + 1j * (symbol[high, k].imag * c.imag)
            block[low, k] = half * np.conj(turn[low]) * (a - 1j * b)
            if high != low:
                block[high, k] = half * np.conj(turn[high]) * (b - 1j * a)
