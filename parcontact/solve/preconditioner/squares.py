"""Loops of `levels.Squares`: sums over cells of two by two points, interpolation between them, their transposes."""

import numpy as np

from ...compiled import loop


@loop
def row_of(own, beside, j):
    """Row j, counted from the first of `own`; of those beside, the ones above are the last."""
    if j < 0:
        return beside[beside.shape[0] + j]
    return own[j] if j < own.shape[0] else beside[j - own.shape[0]]


@loop
def rows_from(own, beside, j):
    """Row j and the three after it."""
    first, second = row_of(own, beside, j), row_of(own, beside, j + 1)
    return first, second, row_of(own, beside, j + 2), row_of(own, beside, j + 3)


@loop
def add_up(points, beside, above, cells):
    """The sums over cells."""
    pairs = points.shape[1] // 2
    for j in range(cells.shape[0]):
        a, b = row_of(points, beside, 2 * j - above), row_of(points, beside, 2 * j - above + 1)
        out = cells[j]
        for i in range(pairs):
            out[i] = (a[2 * i] + b[2 * i]) + (a[2 * i + 1] + b[2 * i + 1])
        for i in range(pairs, out.size):
            out[i] = a[2 * i] + b[2 * i]


@loop
def add_up_back(cells, beside, above, points):
    """Add the value of each cell to its points."""
    pairs = points.shape[1] // 2
    for j in range(points.shape[0]):
        cell, out = row_of(cells, beside, (j + above) // 2), points[j]
        for i in range(pairs):
            out[2 * i] += cell[i]
            out[2 * i + 1] += cell[i]
        for i in range(2 * pairs, out.size):
            out[i] += cell[i // 2]


@loop
def interpolate(cells, beside, above, known, points):
    """Add `1 - known` times what is interpolated between cells."""
    pairs, columns = points.shape[1] // 2, cells.shape[1]
    line = np.empty(columns + 2, cells.dtype)
    for j in range(points.shape[0]):
        near = (j + above) // 2
        other = near + 1 if (j + above) % 2 else near - 1
        a, b = row_of(cells, beside, near), row_of(cells, beside, other)
        for i in range(columns):
            line[i + 1] = np.float32(0.75) * a[i] + np.float32(0.25) * b[i]
        line[0], line[columns + 1] = line[columns], line[1]
        out, weight = points[j], known[j]
        for i in range(pairs):
            middle = np.float32(0.75) * line[i + 1]
            out[2 * i] += (1.0 - weight[2 * i]) * (middle + np.float32(0.25) * line[i])
            out[2 * i + 1] += (1.0 - weight[2 * i + 1]) * (middle + np.float32(0.25) * line[i + 2])
        for i in range(2 * pairs, out.size):
            out[i] += (1.0 - weight[i]) * (np.float32(0.75) * line[i // 2 + 1] + np.float32(0.25) * line[i // 2])


@loop
def interpolate_back(known, known_beside, points, beside, above, cells):
    """Add points to cells: `1 - known` times their values, by the weights of the interpolation."""
    count, columns = points.shape[1], cells.shape[1]
    line = np.zeros(2 * columns + 2, cells.dtype)
    for j in range(cells.shape[0]):
        a, b, c, d = rows_from(points, beside, 2 * j - above - 1)
        w_a, w_b, w_c, w_d = rows_from(known, known_beside, 2 * j - above - 1)
        for i in range(count):
            outer = (1.0 - w_a[i]) * a[i] + (1.0 - w_d[i]) * d[i]
            inner = (1.0 - w_b[i]) * b[i] + (1.0 - w_c[i]) * c[i]
            line[i + 1] = 0.25 * outer + 0.75 * inner
        line[0], line[2 * columns + 1] = line[2 * columns], line[1]
        out = cells[j]
        for i in range(columns):
            outer, inner = line[2 * i] + line[2 * i + 3], line[2 * i + 1] + line[2 * i + 2]
            out[i] = np.float32(0.25) * outer + np.float32(0.75) * inner
