"""Spectra stored as maps, exactly, so that files of maps can hold them on any number of ranks.

The half spectrum of a map of ny x nx points has `nx // 2 + 1` complex columns, distributed over the ranks by
columns. Its real parts fill as many columns of a map, imaginary parts the rest. The imaginary parts of the first
column and, if nx is even, of the last one do not fit: a second map holds those of `per_map` spectra.
"""

import numpy as np
from numpy.typing import NDArray

from .fft import FFT, Spectrum
from .slab import Array


def edges(nx: int) -> int:
    """Return the number of columns of imaginary parts that do not fit into the map of a spectrum."""
    return 1 + (nx % 2 == 0)


def per_map(nx: int) -> int:
    """Return for how many spectra one map holds these columns."""
    return max(1, nx // edges(nx))


def to_map(fft: FFT, spectrum: Spectrum, out: Array, rest: Array) -> None:
    """Put this rank's rows of a spectrum, distributed by columns, into `out`, and the columns that do not fit into
    `rest`, shape (ny_loc, edges); collective."""
    rows = to_rows(fft, spectrum)
    count, nx = rows.shape[1], fft.slab.nx
    out[:, :count] = rows.real
    out[:, count:] = rows.imag[:, 1 : nx - count + 1]
    rest[:, 0] = rows.imag[:, 0]
    if edges(nx) > 1:
        rest[:, 1] = rows.imag[:, -1]


def from_map(fft: FFT, field: Array, rest: Array, out: Spectrum) -> None:
    """Reverse `to_map`; collective."""
    nx = fft.slab.nx
    count = nx // 2 + 1
    rows = np.empty((len(field), count), fft.complex)
    rows.real = field[:, :count]
    rows.imag[:, 1 : nx - count + 1] = field[:, count:]
    rows.imag[:, 0] = rest[:, 0]
    if edges(nx) > 1:
        rows.imag[:, -1] = rest[:, 1]
    to_columns(fft, rows, out)


def to_rows(fft: FFT, spectrum: Spectrum) -> NDArray[np.complexfloating]:
    """Return all columns of this rank's rows of a spectrum of the size of maps; collective."""
    slab = fft.slab
    parts = slab.comm.alltoall([np.ascontiguousarray(spectrum[rows]) for rows in slab.dealt])
    return np.concatenate(parts, axis=1)


def to_columns(fft: FFT, rows: NDArray[np.complexfloating], out: Spectrum) -> None:
    """Reverse `to_rows`, into the spectrum `out`; collective."""
    slab = fft.slab
    columns = slab.comm.allgather(fft.columns)
    parts = slab.comm.alltoall([np.ascontiguousarray(rows[:, each]) for each in columns])
    out[...] = np.concatenate(parts, axis=0)
