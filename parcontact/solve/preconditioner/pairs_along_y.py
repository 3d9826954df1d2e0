"""Loops of `levels.Stepped` for cells of two points along y, as those of `squares`."""

import numpy as np

from ...compiled import loop
from .squares import row_of, rows_from


@loop
def add_up(points, beside, above, cells):
    """The sums over cells."""
    for j in range(cells.shape[0]):
        a, b = row_of(points, beside, 2 * j - above), row_of(points, beside, 2 * j - above + 1)
        for i in range(cells.shape[1]):
            cells[j, i] = a[i] + b[i]


@loop
def add_up_back(cells, beside, above, points):
    """Add the value of each cell to its points."""
    for j in range(points.shape[0]):
        cell = row_of(cells, beside, (j + above) // 2)
        for i in range(points.shape[1]):
            points[j, i] += cell[i]


@loop
def interpolate(cells, beside, above, known, points):
    """Add `1 - known` times what is interpolated between cells."""
    for j in range(points.shape[0]):
        near = (j + above) // 2
        other = near + 1 if (j + above) % 2 else near - 1
        a, b = row_of(cells, beside, near), row_of(cells, beside, other)
        for i in range(points.shape[1]):
            told = np.float32(0.75) * a[i] + np.float32(0.25) * b[i]
            points[j, i] += (1.0 - known[j, i]) * told


@loop
def interpolate_back(known, known_beside, points, beside, above, cells):
    """Add points to cells: `1 - known` times their values, by the weights of the interpolation."""
    for j in range(cells.shape[0]):
        a, b, c, d = rows_from(points, beside, 2 * j - above - 1)
        w_a, w_b, w_c, w_d = rows_from(known, known_beside, 2 * j - above - 1)
        for i in range(cells.shape[1]):
            outer = (1.0 - w_a[i]) * a[i] + (1.0 - w_d[i]) * d[i]
            inner = (1.0 - w_b[i]) * b[i] + (1.0 - w_c[i]) * c[i]
            cells[j, i] = 0.25 * outer + 0.75 * inner
