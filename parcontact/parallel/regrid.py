"""Maps between a grid and a coarser one whose cells consist of whole fine cells; collective."""

from collections.abc import Iterator

import numpy as np

from ..compiled import loop
from .rows import fetch
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
    return fetch(fine, field, fy * coarse.bounds)


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
    _spread(fetch(coarse, field, (fine.bounds + np.array([0, fy - 1])) // fy), fine.rows.start % fy, fy, fx, out)
    return out
