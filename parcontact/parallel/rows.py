"""Moving whole rows of a map, from one rank to another where they have to."""

from mpi4py.util import dtlib

from .slab import Array, Slab


def roll(slab: Slab, field: Array, count: int, out: Array) -> Array:
    """`out(j) = field(j - count)` along y, cyclic, for this rank's rows; not in place; collective."""
    ny, comm, mine = slab.ny, slab.comm, slab.rows
    count %= ny
    if comm.size == 1:
        out[count:] = field[: ny - count]
        out[:count] = field[ny - count :]
        return out
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


def _arriving(source: slice, target: slice, count: int, ny: int) -> slice:
    """Which rows of the part `target` come from the part `source`, one after the other.

    With two ranks or more no part is so large that its rows could come from another, or itself, in two pieces.
    """
    for start in (source.start + count, source.start + count - ny):
        first, last = max(start, target.start), min(start + source.stop - source.start, target.stop)
        if first < last:
            return slice(first, last)
    return slice(0, 0)
