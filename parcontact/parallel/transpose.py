"""Exchange between the passes of a distributed transform: rows with all x-wavenumbers become all rows of some.

It is made in legs, each of some rows of every rank, so that messages never take more than a part of a map. A leg is
sent before the next one is packed: to pack meanwhile takes a second buffer, and gained nothing on two ranks.
"""

from collections.abc import Iterator
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from .mpi import MPI
from .slab import Slab

Waves = NDArray[np.complexfloating]
LEGS = 4  # tuning: largest number of legs of an exchange
LEG_BYTES = 1 << 19


def count_legs(spectrum_bytes: int, ranks: int) -> int:
    """Return the number of legs for a spectrum of `spectrum_bytes` on all ranks: one per LEG_BYTES of a rank, at most
    LEGS."""
    return max(1, min(LEGS, spectrum_bytes // ranks // LEG_BYTES)) if ranks > 1 else 1


def legs_of(rows: int, height: int, count: int) -> list[slice]:
    """Return the rows of one rank in each leg, in blocks of `height` rows."""
    blocks = -(-rows // max(height, 1))
    bounds = [min(rows, height * (blocks * leg // count)) for leg in range(count + 1)]
    return [slice(start, stop) for start, stop in pairwise(bounds)]


def wire_points(legs: list[slice], columns: int) -> int:
    """Return the wavenumbers in the longest leg, with `columns` in each row for other ranks."""
    return max(leg.stop - leg.start for leg in legs) * columns


class Leg:
    """One leg, between blocks of rows and the `spectrum` with all rows of this rank's x-wavenumbers.

    Parameters: `dealt`, the x-wavenumbers of each rank; `rows` of each rank, counted in the whole map; `wire`, the
    buffer of messages to other ranks.
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
        """Exchange the messages; collective."""
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
