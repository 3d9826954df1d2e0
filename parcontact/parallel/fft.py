"""Distributed transforms, and products and files of their spectra.

The two-dimensional real FFT has a local pass along x, a transpose between ranks, and a local pass along y.

A map of this rank's rows `(ny_loc, nx)` becomes a spectrum of this rank's x-wavenumbers `(ny, nkx_loc)`, in which y
is local. With lengths larger than the map (zero padding) only the rows of the map are transformed along x and sent.

The pass along x works on blocks of rows that stay in cache: data of other ranks are copied from a block to messages,
own data directly to the spectrum. Maps that FFTW cannot transform in place (padded along x, of another precision,
not aligned) pass through a block, too. The pass along y works on blocks of columns if there are many; a convolution
transforms a block, multiplies it by the symbol and transforms it back while it is in cache. In addition to its
blocks a transform holds one map, and on several ranks its messages, which are less than a map. In single precision
rows of x-wavenumbers begin at cache lines.

By the transpose a rank gives away its rows of other ranks' x-wavenumbers, and gets all rows of its own x-wavenumbers.
It is made in legs, each with some rows of every rank, so that messages never take more than a part of a map. A leg is
sent before the next leg is packed, as doing both at the same time would need a second buffer.

Spectra are stored without loss as maps, so that files of maps hold them for any number of ranks. The half spectrum of a
map of ny x nx points has `nx // 2 + 1` complex columns, distributed over the ranks by columns. Its real parts fill as
many columns of a map, its imaginary parts the rest. The imaginary parts of the first column and, if nx is even, of the
last column do not fit: a second map holds these parts, for several spectra at once (`per_map`).

The cosine series of a map is that of the map mirrored at its edges; its product with a symbol is a convolution of the
mirrored map. The series `C(k, l) = 4 sum h(i, j) cos(pi (i + 1/2) k/nx) cos(pi (j + 1/2) l/ny)` takes a transform of
the size of the map along each direction (J. Makhoul, IEEE Trans. Acoust. Speech Signal Process. 28 (1980) 27). With the
even points first, followed by the odd points in reverse order, and V the transform of these n points,

    C(k) = exp(-i theta) V(k) + exp(i theta) V(n - k),        theta = pi k/(2 n),
    V(k) = (exp(i theta)/2) (C(k) - i C(n - k)),              C(n) = 0.

For a row, whose points are real, `C(k) - i C(n - k) = 2 exp(-i theta) V(k)`: the half spectrum has the wave k as its
real part and n - k as its imaginary part. So messages, blocks and memory are the same as those of the real FFT.

pyfftw is imported without its interfaces to scipy, which are imported on demand: they import half of scipy, which
takes a fifth of a second. FFTW's choices of algorithms are its wisdom.
"""

import importlib
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import groupby, pairwise
from types import ModuleType

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..compiled import loop
from .slab import MPI, Array, Slab, allocate, deal, dealt_to, reused, without_memory

INTERFACES = "pyfftw.interfaces"
SEPARATOR = b"\x1e"  # separates the wisdom of each precision


def _interfaces(name: str) -> ModuleType:
    """Import the interfaces on demand."""
    if name == "interfaces":
        return importlib.import_module(INTERFACES)
    raise AttributeError(f"module 'pyfftw' has no attribute {name!r}")


if "pyfftw" in sys.modules:
    import pyfftw as pyfftw  # for others, too
else:
    sys.modules[INTERFACES] = ModuleType(INTERFACES)  # a placeholder while pyfftw is imported
    try:
        import pyfftw as pyfftw
    finally:
        del sys.modules[INTERFACES]
    vars(pyfftw).pop("interfaces", None)
    vars(pyfftw)["__getattr__"] = _interfaces


Waves = NDArray[np.complexfloating]
LEGS = 4  # tuning: largest number of legs of an exchange
LEG_BYTES = 1 << 19  # tuning: bytes of the spectrum of a rank for each leg, if these are not too many


class Leg:
    """One of the parts (legs) in which ranks exchange data: from blocks of rows to the `spectrum`, which has all rows
    of this rank's x-wavenumbers, or back.

    Parameters: `dealt` has the x-wavenumbers of each rank, and `rows` the rows of each rank in this leg, counted in the
    whole map; `wire` is the buffer of messages to other ranks.
    """

    def __init__(self, slab: Slab, dealt: list[slice], rows: list[slice], spectrum: Waves, wire: Waves) -> None:
        self._comm, self._dealt = slab.comm, dealt
        own, mine = slab.comm.rank, spectrum.shape[1]
        self._first, height = rows[own].start - slab.rows.start, rows[own].stop - rows[own].start
        counts = [0 if rank == own else height * (part.stop - part.start) for rank, part in enumerate(dealt)]
        starts = [sum(counts[:rank]) for rank in range(slab.comm.size)]
        self._parcels: list[tuple[Waves, slice]] = []
        for ranks in _runs(dealt, own):
            columns = slice(dealt[ranks[0]].start, dealt[ranks[-1]].stop)
            shape = len(ranks), height, (columns.stop - columns.start) // len(ranks)
            first, count = starts[ranks[0]], shape[0] * shape[1] * shape[2]
            parcel = spectrum[None, rows[own]] if own in ranks else wire[first : first + count].reshape(shape)
            self._parcels.append((parcel, columns))
        column_counts = [0 if rank == own else mine * (part.stop - part.start) for rank, part in enumerate(rows)]
        column_starts = [mine * part.start for part in rows]
        kind = MPI.C_DOUBLE_COMPLEX if spectrum.dtype == np.complex128 else MPI.C_FLOAT_COMPLEX
        self._in_rows = [wire, (counts, starts), kind]
        self._in_columns = [spectrum, (column_counts, column_starts), kind]
        self.sent = sum(counts) * spectrum.itemsize

    def post(self, rows: slice, waves: Waves) -> None:
        """Copy a block of this rank's rows into the spectrum and the messages."""
        for parcel, part in self._parts(rows, waves):
            parcel[...] = part

    def to_columns(self) -> None:
        """Send the messages, and put the messages of other ranks into the spectrum; collective."""
        self._comm.Alltoallv(self._in_rows, self._in_columns)

    def to_rows(self) -> None:
        """Reverse `to_columns`; collective."""
        self._comm.Alltoallv(self._in_columns, self._in_rows)

    def collect(self, rows: slice, waves: Waves) -> None:
        """Reverse `post`."""
        for parcel, part in self._parts(rows, waves):
            part[...] = parcel

    def _parts(self, rows: slice, waves: Waves) -> Iterator[tuple[Waves, Waves]]:
        """Yield the places of a block of rows in the messages to each run of ranks, and its waves, shape (ranks, rows,
        wavenumbers) each."""
        place = slice(rows.start - self._first, rows.stop - self._first)
        for parcel, columns in self._parcels:
            part = waves[:, columns].reshape(len(waves), len(parcel), parcel.shape[2])  # a view
            yield parcel[:, place], part.transpose(1, 0, 2)


def _runs(dealt: list[slice], own: int) -> list[list[int]]:
    """Return runs of ranks with wavenumbers, the same number each, so that one copy serves all ranks of a run; `own` is
    alone."""
    having = [rank for rank, part in enumerate(dealt) if part.stop > part.start]
    runs = groupby(having, lambda rank: (rank < own, rank > own, dealt[rank].stop - dealt[rank].start))
    return [list(run) for _, run in runs]


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
    """Transforms of one size and their buffers. The constructor and the methods are collective.

    * `slab`: the slab of the maps;
    * `lengths`: the lengths (mx, my) of the transforms, at least (nx, ny), which is the default;
    * `dtype`: float64 or float32, the precision of calculations and messages; maps may have either precision;
    * `measured`: True if FFTW measures which algorithm is fastest, False if it estimates this, reproducibly;
    * `sharing`: a transform of the same lengths in double precision, whose memory this transform in single precision
      uses.
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
        """Multiplicity (1 or 2) of each x-wavenumber of the half spectrum in the full spectrum, shape (1, nkx_loc)."""
        along_x = self.modes[0]
        return np.where((along_x == 0) | (2 * along_x == self.mx), 1.0, 2.0)

    def forward(self, field: Array) -> Spectrum:
        """Return the spectrum `sum h exp(-i q x)` of a map, in a buffer that is valid until the next transform;
        collective."""
        self.along_x(field)
        for columns in self.column_blocks:
            self._along_y(self._y_forward, columns)
        return self.spectrum

    def backward(self, spectrum: Spectrum, out: Array) -> Array:
        """Put the map of a spectrum into `out`, the inverse of `forward`; collective."""
        if spectrum is not self.spectrum:
            self.spectrum[...] = spectrum
        for columns in self.column_blocks:
            self._along_y(self._y_backward, columns)
        return self.back_along_x(out, 1.0 / (self.mx * self.my))

    def convolve(self, field: Array, symbols: Sequence[NDArray[np.inexact]], out: Array) -> Array:
        """Put `(mx my) backward(symbol * forward(field))` into `out`; the symbol includes the scaling. Collective.

        `symbols` has the symbol for each of the `column_blocks`, contiguous in memory. A symbol that is even in q_y may
        have only the first `my // 2 + 1` rows, q_y >= 0.
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
        """Transform the rows of all ranks along x, and exchange them, so that this rank has its columns of the
        spectrum; collective. `transform` replaces FFTW along x."""
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
        count = max(1, min(LEGS, self.my * row_bytes // ranks // LEG_BYTES)) if ranks > 1 else 1
        blocks = -(-rows // max(height, 1))
        bounds = [min(rows, height * (blocks * leg // count)) for leg in range(count + 1)]
        return height, [slice(start, stop) for start, stop in pairwise(bounds)]

    def _make_blocks(self) -> Spectrum:
        """Make blocks of rows and of columns. Return the buffer of messages in one leg of the exchange."""
        slab, waves, (height, legs) = self.slab, self.mx // 2 + 1, self._legs_of(self.slab.rows)
        self.row_block = allocate((height, self.mx), self.dtype, slab.tally)
        block = (height if slab.comm.size > 1 else 0, _pitch(waves, self.complex.itemsize))
        self._wave_block = allocate(block, self.complex, slab.tally)[:, :waves]
        self.column_blocks = _column_blocks(self.shape[1], self.my * self.complex.itemsize)
        longest = max(leg.stop - leg.start for leg in legs)
        return allocate((longest * (waves - self.shape[1]),), self.complex, slab.tally)

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


def edges(nx: int) -> int:
    """Return the number of columns of a spectrum whose imaginary parts have no place in a map of nx columns: the first
    column and the Nyquist column."""
    return 1 + (nx % 2 == 0)


def per_map(nx: int) -> int:
    """Return the number of spectra for which one map holds the columns counted by `edges`."""
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
    """Return this rank's rows of a spectrum, with all columns; the spectrum has the size of maps. Collective."""
    slab = fft.slab
    parts = slab.comm.alltoall([np.ascontiguousarray(spectrum[rows]) for rows in slab.dealt])
    return np.concatenate(parts, axis=1)


def to_columns(fft: FFT, rows: NDArray[np.complexfloating], out: Spectrum) -> None:
    """Reverse `to_rows`, into the spectrum `out`; collective."""
    slab = fft.slab
    columns = slab.comm.allgather(fft.columns)
    parts = slab.comm.alltoall([np.ascontiguousarray(rows[:, each]) for each in columns])
    out[...] = np.concatenate(parts, axis=0)


CosineWaves = tuple[NDArray[np.int64], NDArray[np.int64]]


class Cosines:
    """Cosine series of maps of the size of a transform `fft`, in its precision. The series use the memory of the
    spectrum of `fft`, and need a further narrow block of columns. The constructor and the methods are collective."""

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
    def modes(self) -> tuple[CosineWaves, CosineWaves]:
        """Numbers of half waves along x, shape (1, nkx_loc), and y, shape (my, 1), for the real parts of a spectrum,
        and the same for the imaginary parts."""
        columns, along_y = self.fft.columns, np.arange(self.my)[:, None]
        along_x = np.arange(columns.start, columns.stop)[None, :]
        return (along_x, along_y), (self.mx - along_x, along_y)

    def convolve(self, field: Array, symbols: list[NDArray[np.complexfloating]], out: Array) -> Array:
        """Put `(nx ny) series^-1(symbol * series(field))` into `out`; collective.

        `symbols` has the symbol for each of the `column_blocks`: its real part multiplies real parts of the spectrum,
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


def export_wisdom() -> bytes:
    """Return the algorithms that FFTW has chosen in this process; other algorithms would round differently."""
    return SEPARATOR.join(pyfftw.export_wisdom())


def import_wisdom(wisdom: bytes) -> bool:
    """Use the algorithms of the process that exported this wisdom. Return False if FFTW does not accept it."""
    pyfftw.forget_wisdom()
    precisions = tuple(wisdom.split(SEPARATOR))
    return len(precisions) == 3 and all(pyfftw.import_wisdom(precisions))
