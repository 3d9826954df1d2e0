"""Distributed two-dimensional real FFT: a local pass along x, a transpose between ranks, a local pass along y.

A map of this rank's rows `(ny_loc, nx)` becomes a spectrum of this rank's x-wavenumbers `(ny, nkx_loc)`, in which y
is local. With lengths larger than the map (zero padding) only the rows of the map are transformed along x and sent.

The pass along x works on blocks of rows that stay in cache: data of other ranks are copied from a block to messages,
own data directly to the spectrum. Maps that FFTW cannot transform in place (padded along x, of another precision,
not aligned) pass through a block, too. The pass along y works on blocks of columns if there are many; a convolution
transforms a block, multiplies it by the symbol and transforms it back while it is in cache. In addition to its
blocks a transform holds one map, and on several ranks its messages, which are less than a map. In single precision
rows of x-wavenumbers begin at cache lines.
"""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..compiled import loop
from .fftw import pyfftw
from .slab import Array, Slab, allocate, deal, dealt_to, reused, without_memory
from .transpose import Leg, count_legs, legs_of, wire_points

Spectrum = NDArray[np.complexfloating]
BLOCK_BYTES = 1 << 19  # tuning: largest block of transformed rows or columns, for a second-level cache
LINE = 8  # tuning: wavenumbers in single precision in a cache line
NARROWEST = 16  # tuning: least number of columns in a block
LEAST_BYTES = 4 << 20  # tuning: least spectrum with blocks of columns, for a last-level cache


def transform_name(lengths: tuple[int, int], dtype: DTypeLike) -> str:
    """Return the name under which transforms of this size are counted."""
    return f"fft {lengths[0]}x{lengths[1]} {np.dtype(dtype).name}"


def _pitch(waves: int, itemsize: int) -> int:
    """Return the wavenumbers from one row to the next: in single precision whole cache lines, unless rows are short."""
    return waves if itemsize > 8 or waves < LINE else -(-waves // LINE) * LINE


def _block_height(rows: int, row_bytes: int, my: int, ranks: int) -> int:
    """Return the number of rows of a block, a multiple of eight for alignment. On several ranks blocks are limited to
    an eighth of a map, unless that is tiny."""
    most = BLOCK_BYTES
    if ranks > 1:
        most = min(max(my * row_bytes // ranks // 8, BLOCK_BYTES // 8), BLOCK_BYTES)
    return min(rows, max(8, most // row_bytes // 8 * 8))


def _column_blocks(count: int, column_bytes: int) -> list[slice]:
    """Return blocks of columns. Their widths are multiples of NARROWEST for alignment; the last one has the rest."""
    width = max(NARROWEST, BLOCK_BYTES // column_bytes // NARROWEST * NARROWEST)
    blocks = max(1, count // width) if count * column_bytes > LEAST_BYTES else 1
    starts = [width * number for number in range(blocks)]
    return [slice(start, stop) for start, stop in zip(starts, [*starts[1:], count], strict=True)] if count else []


class FFT:
    """Transforms of one size and their buffers.

    Parameters: the `slab` of the maps; `lengths = (mx, my)` of the transforms, at least `(nx, ny)`, the default;
    `dtype` float64 or float32 of calculations and messages, for maps of either type; `measured`: FFTW measures which
    algorithm is fastest, otherwise it estimates, reproducibly; `sharing`: another transform of these lengths in double
    precision, in whose spectrum one in single precision stores its own. The constructor and the methods are collective.
    """

    def __init__(
        self,
        slab: Slab,
        lengths: tuple[int, int] | None = None,
        dtype: DTypeLike = np.float64,
        measured: bool = True,
        sharing: "FFT | None" = None,
    ) -> None:
        self.slab, self.measured = slab, measured
        self.mx, self.my = lengths or (slab.nx, slab.ny)
        if self.mx < slab.nx or self.my < slab.ny:
            raise ValueError(f"transform lengths {self.mx, self.my} are shorter than the map {slab.nx, slab.ny}")
        self.dtype = np.dtype(dtype)
        self.complex = np.dtype(np.complex128 if self.dtype == np.float64 else np.complex64)
        self.columns = dealt_to(self.mx // 2 + 1, slab.comm.size, slab.comm.rank)
        self.shape = (self.my, self.columns.stop - self.columns.start)
        self.spectrum = self._make_spectrum(sharing)
        self._name = transform_name((self.mx, self.my), dtype)
        self._wire = self._make_blocks()
        if not slab.only_counts:
            self._make_legs()
            self._make_transforms()

    @cached_property
    def modes(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Signed wave numbers along x and y, shapes (1, nkx_loc) and (my, 1), which broadcast to a spectrum."""
        along_y = np.arange(self.my)
        signed_y = np.where(2 * along_y <= self.my, along_y, along_y - self.my)
        return np.arange(self.columns.start, self.columns.stop)[None, :], signed_y[:, None]

    @cached_property
    def multiplicity(self) -> Array:
        """Multiplicity (1 or 2) of each x-wavenumber of the half spectrum in the full one, shape (1, nkx_loc)."""
        along_x = self.modes[0]
        return np.where((along_x == 0) | (2 * along_x == self.mx), 1.0, 2.0)

    def forward(self, field: Array) -> Spectrum:
        """Return the spectrum `sum h exp(-i q x)` of a map; collective. It is a buffer, valid until the next call."""
        self.along_x(field)
        for columns in self.column_blocks:
            self._along_y(self._y_forward, columns)
        return self.spectrum

    def backward(self, spectrum: Spectrum, out: Array) -> Array:
        """Put the map of a spectrum into `out`, so that `backward(forward(h), out)` equals h; collective."""
        if spectrum is not self.spectrum:
            self.spectrum[...] = spectrum
        for columns in self.column_blocks:
            self._along_y(self._y_backward, columns)
        return self.back_along_x(out, 1.0 / (self.mx * self.my))

    def convolve(self, field: Array, symbols: Sequence[NDArray[np.inexact]], out: Array) -> Array:
        """Put `(mx my) backward(symbol * forward(field))` into `out`; the symbol includes the scaling. Collective.

        Each of the `column_blocks` has its part of the symbol, contiguous in memory. A symbol that is even in q_y
        may have only the rows of q_y >= 0, the first `my // 2 + 1`.
        """
        self.along_x(field)
        for columns, symbol in zip(self.column_blocks, symbols, strict=True):
            _multiply(self._along_y(self._y_forward, columns), symbol)
            self._along_y(self._y_backward, columns)
        return self.back_along_x(out, 1.0)

    def _along_y(self, transforms: dict[int, pyfftw.FFTW], columns: slice) -> Spectrum:
        """Transform a block of columns in place."""
        part = self.spectrum[:, columns]
        transform = transforms[part.shape[1]]
        transform.update_arrays(part, part)
        transform.execute()
        return part

    # -- the pass along x ---------------------------------------------------------------------------------------------

    def along_x(self, field: Array, transform: Callable[[Array, Spectrum], None] | None = None) -> None:
        """Transform from rows to columns of the spectrum; `transform` replaces the transform of blocks of rows;
        collective."""
        self._count()
        transform = transform or self._transform_rows
        for leg, blocks in self._legs:
            for rows in blocks:
                waves = self._waves(rows)
                transform(field[rows], waves)
                if leg:
                    leg.post(rows, waves)
            if leg:
                leg.to_columns()
        for height, plan in self._x_forward.items():
            plan.update_arrays(self.row_block[:height], self._waves(slice(0, height)))  # releases the map
        self.spectrum[self.slab.ny :] = 0.0

    def _transform_rows(self, source: Array, waves: Spectrum) -> None:
        if not self._direct(source, self._x_forward[len(waves)].input_alignment):
            block = self.row_block[: len(waves)]
            block[:, : self.slab.nx] = source
            block[:, self.slab.nx :] = 0.0
            source = block
        self.execute_rows(source, waves)

    def execute_rows(self, rows: Array, waves: Spectrum) -> None:
        """Transform rows in place, such as the rows of the `row_block`."""
        plan = self._x_forward[len(waves)]
        plan.update_arrays(rows, waves)
        plan.execute()

    def back_along_x(
        self, out: Array, scale: float, transform: Callable[[Spectrum, Array], None] | None = None
    ) -> Array:
        """Reverse `along_x`, and multiply by `scale`; collective."""
        self._count()
        transform = transform or self._transform_waves
        for leg, blocks in self._legs:
            if leg:
                leg.to_rows()
            for rows in blocks:
                waves = self._waves(rows)
                if leg:
                    leg.collect(rows, waves)
                if scale != 1.0:
                    np.multiply(waves, scale, out=waves)
                transform(waves, out[rows])
        for height, plan in self._x_backward.items():
            plan.update_arrays(self._waves(slice(0, height)), self.row_block[:height])
        return out

    def _transform_waves(self, waves: Spectrum, target: Array) -> None:
        direct = self._direct(target, self._x_backward[len(waves)].output_alignment)
        result = target if direct else self.row_block[: len(waves)]
        self.execute_waves(waves, result)
        if not direct:
            target[...] = result[:, : self.slab.nx]

    def execute_waves(self, waves: Spectrum, rows: Array) -> None:
        """Reverse `execute_rows`; the waves are overwritten."""
        plan = self._x_backward[len(waves)]
        plan.update_arrays(waves, rows)
        plan.execute()

    def _waves(self, rows: slice) -> Spectrum:
        """Return the place of the transform along x of these rows; on one rank it is in the spectrum."""
        return self._wave_block[: rows.stop - rows.start] if self._wave_block.size else self.spectrum[rows]

    def _direct(self, rows: Array, alignment: int) -> bool:
        """Return True if FFTW can transform these rows of a map in place."""
        fits = rows.shape[1] == self.mx and rows.dtype == self.dtype and rows.flags.c_contiguous
        return fits and pyfftw.is_byte_aligned(rows, alignment)

    def _count(self) -> None:
        tally = self.slab.tally
        tally["fft"] += 1
        tally[self._name] += 1
        tally["bytes sent"] += self._sent

    # -- blocks and transforms ----------------------------------------------------------------------------------------

    def _make_spectrum(self, sharing: "FFT | None") -> Spectrum:
        rows, columns = self.shape
        shape = (rows, _pitch(columns, self.complex.itemsize) if self.slab.comm.size == 1 else columns)
        if sharing is None:
            return allocate(shape, self.complex, self.slab.tally)[:, :columns]
        if self.slab.only_counts:
            return without_memory(shape, self.complex)[:, :columns]
        return reused(sharing.spectrum, shape, self.complex)[:, :columns]

    def _legs_of(self, part: slice) -> tuple[int, list[slice]]:
        """Return the height of the blocks of a rank with these rows, and its rows in each leg of the exchange."""
        ranks, row_bytes = self.slab.comm.size, (self.mx // 2 + 1) * self.complex.itemsize
        rows = part.stop - part.start
        height = _block_height(rows, row_bytes, self.my, ranks)
        return height, legs_of(rows, height, count_legs(self.my * row_bytes, ranks))

    def _make_blocks(self) -> Spectrum:
        """Make blocks of rows and of columns. Return the buffer of messages in one leg of the exchange."""
        slab, waves, (height, legs) = self.slab, self.mx // 2 + 1, self._legs_of(self.slab.rows)
        self.row_block = allocate((height, self.mx), self.dtype, slab.tally)
        block = (height if slab.comm.size > 1 else 0, _pitch(waves, self.complex.itemsize))
        self._wave_block = allocate(block, self.complex, slab.tally)[:, :waves]
        self.column_blocks = _column_blocks(self.shape[1], self.my * self.complex.itemsize)
        return allocate((wire_points(legs, waves - self.shape[1]),), self.complex, slab.tally)

    def _make_legs(self) -> None:
        """Make the legs of the exchange, each with this rank's blocks of rows."""
        slab, ranks, everyone = self.slab, self.slab.comm.size, [self._legs_of(part) for part in self.slab.dealt]
        dealt, (height, own) = deal(self.mx // 2 + 1, ranks), everyone[slab.comm.rank]
        self._legs: list[tuple[Leg | None, list[slice]]] = []
        for number, leg in enumerate(own):
            blocks = [slice(j, min(j + height, leg.stop)) for j in range(leg.start, leg.stop, max(height, 1))]
            rows = [
                slice(part.start + theirs[number].start, part.start + theirs[number].stop)
                for part, (_, theirs) in zip(slab.dealt, everyone, strict=True)
            ]
            self._legs.append((Leg(slab, dealt, rows, self.spectrum, self._wire) if ranks > 1 else None, blocks))
        self._sent = sum(leg.sent for leg, _ in self._legs if leg)

    def _make_transforms(self) -> None:
        heights = {rows.stop - rows.start for _, blocks in self._legs for rows in blocks}
        waves = {height: self._waves(slice(0, height)) for height in heights}
        self._x_forward = {height: self.plan(self.row_block[:height], waves[height], axis=1) for height in heights}
        self._x_backward = {height: self.plan(waves[height], self.row_block[:height], axis=1) for height in heights}
        blocks = {part.shape[1]: part for part in (self.spectrum[:, columns] for columns in self.column_blocks[::-1])}
        self._y_forward = {width: self.plan(part, part, axis=0) for width, part in blocks.items()}
        self._y_backward = {width: self.plan(part, part, axis=0, backward=True) for width, part in blocks.items()}

    def plan(
        self, source: NDArray[np.inexact], target: NDArray[np.inexact], axis: int, backward: bool = False
    ) -> pyfftw.FFTW:
        backward = backward or np.isrealobj(target)
        flags = ("FFTW_MEASURE" if self.measured else "FFTW_ESTIMATE", *("FFTW_DESTROY_INPUT",) * backward)
        return pyfftw.FFTW(source, target, (axis,), "FFTW_BACKWARD" if backward else "FFTW_FORWARD", flags)


@loop
def _multiply(spectrum: NDArray[np.complexfloating], symbol: NDArray[np.inexact]) -> None:
    """Multiply a spectrum by a symbol, faster than numpy, which would convert a real symbol to complex numbers. Rows
    that the symbol lacks are the rows of -q_y."""
    count = spectrum.shape[0]
    for j in range(count):
        factors = symbol[j] if j < symbol.shape[0] else symbol[count - j]
        for i in range(spectrum.shape[1]):
            spectrum[j, i] *= factors[i]
