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
    return _nearest(slab, field, 1, cyclic, 1)[0]


def around(slab: Slab, field: Array, count: int, cyclic: bool) -> tuple[Array, Array]:
    """The rows of a map before this rank's first one and after its last, shape (count, nx), the nearest first;
    collective.

    A map that is not `cyclic` goes on with rows like its first and its last. A rank without rows gets zeros.
    """
    return _nearest(slab, field, count, cyclic, 1), _nearest(slab, field[::-1], count, cyclic, -1)


def _nearest(slab: Slab, own: Array, count: int, cyclic: bool, way: int) -> Array:
    """The rows before the first of this rank's `own`; if `way` is -1, rows and ranks are in reverse order.

    They are passed on from rank to rank one by one, as a rank may have fewer rows than are asked for.
    """
    ranks = [rank for rank, part in enumerate(slab.dealt) if part.start < part.stop][::way]
    found = np.zeros((count, slab.nx), own.dtype)
    if slab.comm.rank not in ranks:
        return found
    place, alone = ranks.index(slab.comm.rank), len(ranks) == 1
    first, last = place == 0 and not cyclic, place == len(ranks) - 1 and not cyclic
    for k in range(count):
        leaving = own[-1 - k] if k < len(own) else found[k - len(own)]
        found[k] = own[0] if first or not alone else leaving
        if alone:
            continue
        target = None if last else slab.comm.Isend(np.ascontiguousarray(leaving), ranks[(place + 1) % len(ranks)])
        if not first:
            slab.comm.Recv(found[k], ranks[place - 1])
        if target is not None:
            target.Wait()
            slab.tally["bytes sent"] += found[k].nbytes
    return found


def _arriving(source: slice, target: slice, count: int, ny: int) -> slice:
    """Which rows of the part `target` come from the part `source`, one after the other.

    With two ranks or more no part is so large that its rows could come from another, or itself, in two pieces.
    """
    for start in (source.start + count, source.start + count - ny):
        first, last = max(start, target.start), min(start + source.stop - source.start, target.stop)
        if first < last:
            return slice(first, last)
    return slice(0, 0)
