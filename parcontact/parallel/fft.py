"""Distributed two-dimensional real FFT: a local pass along x, a transpose between ranks, a local pass along y.

A map of this rank's rows `(ny_loc, nx)` becomes a spectrum of this rank's x-wavenumbers `(ny, nkx_loc)`: all of y is
local there, so the second pass needs no further message. With lengths larger than the map (zero padding) only the rows
of the map are transformed along x, and only they are sent.

The pass along x works through blocks of rows that stay in cache: what belongs to another rank is copied out of a block
while it is hot, what stays goes straight to its place in the spectrum.
"""

import numpy as np
import pyfftw
from mpi4py import MPI
from numpy.typing import DTypeLike, NDArray

from .slab import Array, Slab, allocate, deal

Spectrum = NDArray[np.complexfloating]
BLOCK_BYTES = 1 << 19  # of one block of transformed rows: fits a usual second-level cache


class FFT:
    """Plans and buffers of one transform size, made once.

    Parameters: the `slab` of the maps; `lengths = (mx, my)` of the transforms, at least `(nx, ny)` (default: equal to
    it); `dtype` float64 or float32. Making and calling one are collective.
    """

    def __init__(self, slab: Slab, lengths: tuple[int, int] | None = None, dtype: DTypeLike = np.float64) -> None:
        self.slab = slab
        self.mx, self.my = lengths or (slab.nx, slab.ny)
        if self.mx < slab.nx or self.my < slab.ny:
            raise ValueError(f"transform lengths {self.mx, self.my} are shorter than the map {slab.nx, slab.ny}")
        self.dtype = np.dtype(dtype)
        self.complex = np.dtype(np.complex128 if self.dtype == np.float64 else np.complex64)
        self._dealt = deal(self.mx // 2 + 1, slab.comm.size)
        self.columns = self._dealt[slab.comm.rank]
        self.shape = (self.my, self.columns.stop - self.columns.start)
        self._name = f"fft {self.mx}x{self.my} {self.dtype.name}"
        self._make_buffers()
        self._make_plans()

    @property
    def modes(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Signed wave numbers along x and y, shapes (1, nkx_loc) and (my, 1), which broadcast to a spectrum."""
        along_y = np.arange(self.my)
        signed_y = np.where(2 * along_y <= self.my, along_y, along_y - self.my)
        return np.arange(self.columns.start, self.columns.stop)[None, :], signed_y[:, None]

    @property
    def multiplicity(self) -> Array:
        """How often each x-wavenumber of this half spectrum stands in the full one (1 or 2), shape (1, nkx_loc)."""
        along_x = self.modes[0]
        return np.where((along_x == 0) | (2 * along_x == self.mx), 1.0, 2.0)

    def forward(self, field: Array) -> Spectrum:
        """Spectrum `sum h exp(-i q x)` of a map; collective. It is this object's buffer: use it before the next call."""
        self._along_x(field)
        if self.spectrum.size:
            self._y_forward.execute()
        return self.spectrum

    def backward(self, spectrum: Spectrum, out: Array) -> Array:
        """Map of a spectrum, so that `backward(forward(h), out)` equals h; collective."""
        if spectrum is not self.spectrum:
            self.spectrum[:] = spectrum
        if self.spectrum.size:
            self._y_backward.execute()
        self._back_along_x(out, 1.0 / (self.mx * self.my))
        return out

    def convolve(self, field: Array, symbol: NDArray[np.inexact], out: Array) -> Array:
        """`out = (mx my) backward(symbol * forward(field))`: the symbol carries the scaling; collective."""
        spectrum = self.forward(field)
        np.multiply(spectrum, symbol, out=spectrum)
        if self.spectrum.size:
            self._y_backward.execute()
        self._back_along_x(out, 1.0)
        return out

    # -- the pass along x and the transpose ---------------------------------------------------------------------------

    def _along_x(self, field: Array) -> None:
        self._count()
        for rows in self._blocks:
            height = rows.stop - rows.start
            plan = self._x_forward[height]
            block = self._block(rows)
            source = field[rows]
            if source.shape[1] != self.mx or not pyfftw.is_byte_aligned(source, plan.input_alignment):
                source = self._row_block[:height]
                source[:, : self.slab.nx] = field[rows]
            plan.update_arrays(source, block)
            plan.execute()
            self._post(rows, block)
        if self.slab.comm.size > 1:
            self.slab.comm.Alltoallv(self._rows_message, self._columns_message)
        self.spectrum[self.slab.ny :] = 0.0

    def _back_along_x(self, out: Array, scale: float) -> None:
        self._count()
        if self.slab.comm.size > 1:
            self.slab.comm.Alltoallv(self._columns_message, self._rows_message)
        for rows in self._blocks:
            height = rows.stop - rows.start
            plan = self._x_backward[height]
            block = self._collect(rows)
            if scale != 1.0:
                block *= self.dtype.type(scale)
            target = out[rows]
            direct = target.shape[1] == self.mx and pyfftw.is_byte_aligned(target, plan.output_alignment)
            real = target if direct else self._row_back_block[:height]
            plan.update_arrays(block, real)
            plan.execute()
            if not direct:
                target[...] = real[:, : self.slab.nx]

    def _block(self, rows: slice) -> Spectrum:
        """Where the transform along x of these rows is put: on one rank at once in its place."""
        return self.spectrum[rows] if self.slab.comm.size == 1 else self._wave_block[: rows.stop - rows.start]

    def _post(self, rows: slice, block: Spectrum) -> None:
        """Copy a block of transformed rows to this rank's part of the spectrum and to the parcels for the others."""
        if self.slab.comm.size > 1:
            for parcel, columns in zip(self._parcels, self._dealt, strict=True):
                parcel[rows] = block[:, columns]

    def _collect(self, rows: slice) -> Spectrum:
        """The reverse of `_post`."""
        block = self._block(rows)
        if self.slab.comm.size > 1:
            for parcel, columns in zip(self._parcels, self._dealt, strict=True):
                block[:, columns] = parcel[rows]
        return block

    def _count(self) -> None:
        tally = self.slab.tally
        tally["fft"] += 1
        tally[self._name] += 1
        tally["bytes sent"] += self._sent

    # -- buffers and plans --------------------------------------------------------------------------------------------

    def _make_buffers(self) -> None:
        comm, tally = self.slab.comm, self.slab.tally
        ny_loc, waves, mine = self.slab.shape[0], self.mx // 2 + 1, self.shape[1]
        self.spectrum = allocate(self.shape, self.complex, tally)
        height = min(ny_loc, max(8, BLOCK_BYTES // (waves * self.complex.itemsize) // 8 * 8))
        self._blocks = [slice(start, min(start + height, ny_loc)) for start in range(0, ny_loc, max(height, 1))]
        self._row_block = pyfftw.zeros_aligned((height, self.mx), self.dtype, n=64)
        self._row_back_block = pyfftw.zeros_aligned((height, self.mx), self.dtype, n=64)
        self._wave_block = pyfftw.zeros_aligned((height, waves), self.complex, n=64)
        widths = [0 if rank == comm.rank else part.stop - part.start for rank, part in enumerate(self._dealt)]
        row_counts = [ny_loc * width for width in widths]
        row_starts = [sum(row_counts[:rank]) for rank in range(comm.size)]
        wire = allocate((sum(row_counts),), self.complex, tally)
        self._parcels = [
            wire[start : start + count].reshape(ny_loc, width) if rank != comm.rank else self.spectrum[self.slab.rows]
            for rank, (start, count, width) in enumerate(zip(row_starts, row_counts, widths, strict=True))
        ]
        heights = [0 if rank == comm.rank else part.stop - part.start for rank, part in enumerate(self.slab.dealt)]
        column_counts = [height * mine for height in heights]
        column_starts = [part.start * mine for part in self.slab.dealt]
        kind = MPI.C_DOUBLE_COMPLEX if self.dtype == np.float64 else MPI.C_FLOAT_COMPLEX
        self._rows_message = [wire, (row_counts, row_starts), kind]
        self._columns_message = [self.spectrum, (column_counts, column_starts), kind]
        self._sent = sum(row_counts) * self.complex.itemsize

    def _make_plans(self) -> None:
        heights = {rows.stop - rows.start for rows in self._blocks}
        blocks = {height: self._block(slice(0, height)) for height in heights}
        self._x_forward = {
            height: self._plan(self._row_block[:height], block, axis=1) for height, block in blocks.items()
        }
        self._x_backward = {
            height: self._plan(block, self._row_back_block[:height], axis=1) for height, block in blocks.items()
        }
        if self.spectrum.size:
            self._y_forward = self._plan(self.spectrum, self.spectrum, axis=0)
            self._y_backward = self._plan(self.spectrum, self.spectrum, axis=0, backward=True)

    def _plan(self, source: NDArray, target: NDArray, axis: int, backward: bool = False) -> pyfftw.FFTW:
        backward = backward or target.dtype == self.dtype
        flags = ("FFTW_MEASURE", "FFTW_DESTROY_INPUT") if backward else ("FFTW_MEASURE",)
        return pyfftw.FFTW(source, target, (axis,), "FFTW_BACKWARD" if backward else "FFTW_FORWARD", flags)
