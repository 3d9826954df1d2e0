"""Maps between a grid and a coarser one whose cells consist of whole fine cells; collective."""

from collections.abc import Iterator

import numpy as np

from ..compiled import loop
from .slab import Array, Slab

COARSEST = 32  # tuning: least points of a coarser grid along a direction


def coarser(slab: Slab) -> Slab | None:
    """Return the grid with cells of twice the side, along each direction with an even and sufficient number of points;
    None if there is none."""
    points = next(coarser_points(slab.nx, slab.ny), None)
    return slab.resized(*points) if points else None


def coarser_points(nx: int, ny: int) -> Iterator[tuple[int, int]]:
    """Yield the points along x and y of all coarser grids."""
    while True:
        before = nx, ny
        nx, ny = (n // 2 if n % 2 == 0 and n >= 2 * COARSEST else n for n in before)
        if (nx, ny) == before:
            return
        yield nx, ny


def factors(fine: Slab, coarse: Slab) -> tuple[int, int]:
    """Return the number of fine cells per coarse cell, along y and x."""
    return fine.ny // coarse.ny, fine.nx // coarse.nx


def restrict(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the means over the cells of the coarse grid."""
    if fine.only_counts:
        return coarse.empty(field.dtype)
    fy, fx = factors(fine, coarse)
    rows, out = _rows_of_cells(fine, coarse, field), coarse.empty(field.dtype)
    if fy == fx == 2:
        _average(rows, out)
    else:
        out[...] = rows.reshape(-1, fy, fine.nx).mean(axis=1).reshape(*coarse.shape, fx).mean(axis=2)
    return out


def highest(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the largest values within the cells of the coarse grid."""
    fy, fx = factors(fine, coarse)
    rows = _rows_of_cells(fine, coarse, field)
    return np.asarray(rows.reshape(-1, fy, fine.nx).max(axis=1).reshape(*coarse.shape, fx).max(axis=2))


def _rows_of_cells(fine: Slab, coarse: Slab, field: Array) -> Array:
    """Return the rows of a map within the rows of cells of this rank."""
    fy, _ = factors(fine, coarse)
    return fetch(fine, field, [slice(fy * part.start, fy * part.stop) for part in coarse.dealt])


@loop
def _average(rows: Array, out: Array) -> None:
    """Put means over two by two points into `out`."""
    quarter = out.dtype.type(0.25)
    for j in range(out.shape[0]):
        a, b = rows[2 * j], rows[2 * j + 1]
        for i in range(out.shape[1]):
            out[j, i] = ((a[2 * i] + a[2 * i + 1]) + (b[2 * i] + b[2 * i + 1])) * quarter


@loop
def _spread(cells: Array, above: int, fy: int, fx: int, out: Array) -> None:
    """Put the value of each cell at all its points; `above` rows of the first cell are missing."""
    for j in range(out.shape[0]):
        row, points = cells[(j + above) // fy], out[j]
        for i in range(row.size):
            for k in range(fx):
                points[fx * i + k] = row[i]


def prolong(coarse: Slab, fine: Slab, field: Array, out: Array) -> Array:
    """Put the value of each coarse cell into all its fine cells, so that points far from contact get no pressure."""
    fy, fx = factors(fine, coarse)
    wanted = [slice(part.start // fy, (part.stop + fy - 1) // fy) for part in fine.dealt]
    _spread(fetch(coarse, field, wanted), fine.rows.start % fy, fy, fx, out)
    return out


def fetch(slab: Slab, field: Array, wanted: list[slice]) -> Array:
    """Return rows of a map for this rank; `wanted` has the rows for every rank."""
    comm, mine = slab.comm, wanted[slab.comm.rank]
    if comm.size == 1:
        return field[mine]
    out = np.empty((mine.stop - mine.start, slab.nx), field.dtype)
    sent = [_overlap(slab.rows, theirs) for theirs in wanted]
    got = [_overlap(mine, theirs) for theirs in slab.dealt]
    width = slab.nx * field.itemsize
    leaving, arriving = _message(sent, slab.rows.start, width), _message(got, mine.start, width)
    comm.Alltoallv([np.ascontiguousarray(field).view(np.uint8), leaving, "B"], [out.view(np.uint8), arriving, "B"])
    slab.tally["bytes sent"] += sum(leaving[0]) - leaving[0][comm.rank]
    return out


def _overlap(a: slice, b: slice) -> slice:
    start = max(a.start, b.start)
    return slice(start, max(start, min(a.stop, b.stop)))


def _message(parts: list[slice], origin: int, width: int) -> tuple[list[int], list[int]]:
    """Return counts and displacements in bytes."""
    counts = [(part.stop - part.start) * width for part in parts]
    return counts, [(part.start - origin) * width if count else 0 for part, count in zip(parts, counts, strict=True)]
