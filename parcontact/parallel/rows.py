"""Exchange of whole rows of a map between ranks."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .regrid import fetch
from .slab import Array, Slab


def roll_rows(slab: Slab, field: Array, count: int, out: Array) -> Array:
    """Put `field(j - count)`, cyclic along y, into `out` for this rank's rows; not in place; collective."""
    count %= slab.ny
    for low, high, shift in ((0, count, slab.ny - count), (count, slab.ny, -count)):
        wanted = [slice(min(max(part.start, low), high), min(max(part.stop, low), high)) for part in slab.dealt]
        mine, first = wanted[slab.comm.rank], slab.rows.start
        moved = [slice(part.start + shift, part.stop + shift) for part in wanted]
        out[mine.start - first : mine.stop - first] = fetch(slab, field, moved)
    return out


def before_first(slab: Slab, field: Array, cyclic: bool) -> Array:
    """Return the row of a map before this rank's first one, shape (nx,); collective. The row before the first of the
    map is the last if the map is `cyclic`, otherwise the first itself. Ranks without rows get zeros."""
    return _adjacent_rows(slab, field, [-1], [], cyclic)[0]


def around(slab: Slab, field: Array, count: int, cyclic: bool) -> tuple[Array, Array]:
    """Return the rows of a map before this rank's first one and after its last, shape (count, nx), the nearest first;
    collective. A map that is not `cyclic` continues with its first and last row. Ranks without rows get zeros."""
    found = _adjacent_rows(slab, field, range(-1, -1 - count, -1), range(count), cyclic)
    return found[:count], found[count:]


def _adjacent_rows(slab: Slab, field: Array, above: Sequence[int], below: Sequence[int], cyclic: bool) -> Array:
    """Return rows counted from this rank's first one, and from the one after its last."""

    def wanted(part: slice) -> list[int]:
        numbers = [part.start + k for k in above] + [part.stop + k for k in below]
        return [number % slab.ny if cyclic else min(max(number, 0), slab.ny - 1) for number in numbers]

    everyone = [wanted(part) if part.start < part.stop else [] for part in slab.dealt]
    found = RowExchange(slab, everyone, slab.comm.rank).fetch(field)
    return found if everyone[slab.comm.rank] else np.zeros((len(above) + len(below), slab.nx), field.dtype)


class RowExchange:
    """Exchange of rows of a map between ranks, in one message; rows outside the map are zeros.

    `wanted` has the row numbers for each rank. A map that every rank has is on a slab of one rank.
    """

    def __init__(self, slab: Slab, wanted: list[list[int]], rank: int) -> None:
        self._slab, self._count = slab, len(wanted[rank])
        ranks = range(slab.comm.size)
        mine = wanted if slab.comm.size > 1 else [wanted[rank]]
        leaving = [[number for number in numbers if _has(slab.rows, number)] for numbers in mine]
        self._leaving = np.array([number - slab.rows.start for numbers in leaving for number in numbers], np.intp)
        self._sent = [len(numbers) for numbers in leaving]
        coming = [[k for k, number in enumerate(wanted[rank]) if _has(slab.dealt[other], number)] for other in ranks]
        self._places = np.array([k for places in coming for k in places], np.intp)
        self._got = [len(places) for places in coming]

    def fetch(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the wanted rows of this rank; collective."""
        slab, leaving = self._slab, values[self._leaving]
        out = np.zeros((self._count, slab.nx), values.dtype)
        if slab.comm.size == 1:
            out[self._places] = leaving
            return out
        width = slab.nx * values.itemsize
        arriving = np.empty((len(self._places), slab.nx), values.dtype)
        sent, got = ([count * width for count in counts] for counts in (self._sent, self._got))
        slab.comm.Alltoallv([leaving.view(np.uint8), sent, "B"], [arriving.view(np.uint8), got, "B"])
        slab.tally["bytes sent"] += sum(sent) - sent[slab.comm.rank]
        out[self._places] = arriving
        return out


def _has(rows: slice, number: int) -> bool:
    return rows.start <= number < rows.stop
