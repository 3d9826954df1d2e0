"""The lowest waves of a transform. A smooth surface has no others, so that only these are stored.

They are the first rows of a spectrum, q_y >= 0, the last rows, q_y < 0, and the first columns.
"""

import numpy as np
from numpy.typing import NDArray

from ..parallel.fft import FFT, Spectrum


def shape_of(waves: tuple[int, int], lengths: tuple[int, int], columns: slice) -> tuple[int, int]:
    """Return the shape of the lowest waves on a rank: at most `waves` in the box along x and y, in its columns."""
    count = min(waves[0], lengths[0] // 2) + 1
    return min(2 * waves[1] + 1, lengths[1]), max(0, min(count, columns.stop) - columns.start)


def rows_of(count: int, my: int) -> NDArray[np.int64]:
    """Return the numbers of the lowest `count` rows of a spectrum of `my` rows."""
    return np.concatenate([np.arange((count + 1) // 2), np.arange(my - count // 2, my)])


def lowest(spectrum: Spectrum, fft: FFT, waves: tuple[int, int]) -> Spectrum:
    """Return this rank's part of the lowest waves, a copy in the precision of the transform."""
    rows, columns = shape_of(waves, (fft.mx, fft.my), fft.columns)
    return np.ascontiguousarray(spectrum[rows_of(rows, fft.my), :columns], fft.complex)
