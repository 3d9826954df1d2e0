"""Moving whole rows of a map, from one rank to another where they have to."""

import numpy as np

from .slab import Array, Slab


def roll(slab: Slab, field: Array, count: int, out: Array) -> Array:
    """`out(j) = field(j - count)` along y, cyclic, for this rank's rows; not in place; collective."""
    ny, comm, mine = slab.ny, slab.comm, slab.rows
    count %= ny
    if comm.size == 1:
        out[count:] = field[: ny - count]
        out[:count] = field[ny - count :]
        return out
    from mpi4py.util import dtlib

    kind = dtlib.from_numpy_dtype(field.dtype).Create_contiguous(slab.nx).Commit()
    to = [_arriving(mine, theirs, count, ny) for theirs in slab.dealt]
    come = [_arriving(theirs, mine, count, ny) for theirs in slab.dealt]
    sent = [part.stop - part.start for part in to]
    leave_at = [(part.start - count) % ny - mine.start if size else 0 for part, size in zip(to, sent, strict=True)]
    got = [part.stop - part.start for part in come]
    arrive_at = [part.start - mine.start if size else 0 for part, size in zip(come, got, strict=True)]
    slab.tally["bytes sent"] += (sum(sent) - sent[comm.rank]) * slab.nx * field.itemsize
    comm.Alltoallv([field, (sent, leave_at), kind], [out, (got, arrive_at), kind])
    kind.Free()
    return out


def before_first(slab: Slab, field: Array, cyclic: bool) -> Array:
    """The row of a map that comes before this rank's first one, shape (nx,); collective.

    The first row of a map has the last one before it if the map is `cyclic`, otherwise itself. A rank without rows gets
    zeros.
    """
    ranks = [rank for rank, part in enumerate(slab.dealt) if part.start < part.stop]
    if slab.comm.rank not in ranks:
        return np.zeros(slab.nx, field.dtype)
    place = ranks.index(slab.comm.rank)
    first, last = place == 0, place == len(ranks) - 1
    if len(ranks) == 1:
        return field[-1] if cyclic else field[0]
    row = field[0].copy()
    target = slab.comm.Isend(field[-1], ranks[(place + 1) % len(ranks)]) if cyclic or not last else None
    if cyclic or not first:
        slab.comm.Recv(row, ranks[place - 1])
    if target is not None:
        target.Wait()
        slab.tally["bytes sent"] += row.nbytes
    return row


def _arriving(source: slice, target: slice, count: int, ny: int) -> slice:
    """Which rows of the part `target` come from the part `source`, one after the other.

    With two ranks or more no part is so large that its rows could come from another, or itself, in two pieces.
    """
    for start in (source.start + count, source.start + count - ny):
        first, last = max(start, target.start), min(start + source.stop - source.start, target.stop)
        if first < last:
            return slice(first, last)
    return slice(0, 0)
