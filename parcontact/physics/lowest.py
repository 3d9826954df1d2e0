"""The lowest waves of a transform: all that a smooth surface has, kept without the zeros of the others.

Of the rows of a spectrum these are the first, q_y >= 0, and the last, q_y < 0; of its columns the first.
"""

import numpy as np
from numpy.typing import NDArray

from ..parallel.fft import FFT, Spectrum


def shape_of(waves: tuple[int, int], lengths: tuple[int, int], columns: slice) -> tuple[int, int]:
    """Return the shape of the lowest waves, at most `waves` in the box along x and y, among the columns of a rank."""
    count = min(waves[0], lengths[0] // 2) + 1
    return min(2 * waves[1] + 1, lengths[1]), max(0, min(count, columns.stop) - columns.start)


def rows_of(count: int, my: int) -> NDArray[np.int64]:
    """Return the rows of a spectrum of `my` that are the lowest `count`."""
    return np.concatenate([np.arange((count + 1) // 2), np.arange(my - count // 2, my)])


def lowest(spectrum: Spectrum, fft: FFT, waves: tuple[int, int]) -> Spectrum:
    """This rank's part of them, a copy in the precision of the transform."""
    rows, columns = shape_of(waves, (fft.mx, fft.my), fft.columns)
    return np.ascontiguousarray(spectrum[rows_of(rows, fft.my), :columns], fft.complex)
