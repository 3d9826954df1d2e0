"""Loops between points and cells of `wide` by `tall` points, each 2, or None for 1: a loop is compiled without the
branches that a shape does not need.

They take sums over cells, interpolate between cells, and apply the transposes of both. Interpolation takes 3/4 of
the own cell of a point and 1/4 of the nearest other one.
"""

import numpy as np

from ...compiled import loop


@loop
def row_of(own, neighbours, j):
    """Return row j, counted from the first of `own`; `neighbours` holds rows below `own` first and rows
    above it last."""
    if j < 0:
        return neighbours[neighbours.shape[0] + j]
    return own[j] if j < own.shape[0] else neighbours[j - own.shape[0]]


@loop
def add_up(points, neighbours, above, wide, tall, cells):
    """Put the sums over cells into `cells`."""
    height = 1 if tall is None else 2
    second = np.float32(height - 1)
    pairs = points.shape[1] // 2
    for j in range(cells.shape[0]):
        a, b = (
            row_of(points, neighbours, height * j - above),
            row_of(points, neighbours, height * j - above + height - 1),
        )
        out = cells[j]
        if wide is None:
            for i in range(out.size):
                out[i] = a[i] + second * b[i]
            continue
        for i in range(pairs):
            out[i] = (a[2 * i] + second * b[2 * i]) + (a[2 * i + 1] + second * b[2 * i + 1])
        for i in range(pairs, out.size):
            out[i] = a[2 * i] + second * b[2 * i]


@loop
def add_up_back(cells, neighbours, above, wide, tall, points):
    """Add the value of each cell to its points."""
    pairs, height = points.shape[1] // 2, 1 if tall is None else 2
    for j in range(points.shape[0]):
        cell, out = row_of(cells, neighbours, (j + above) // height), points[j]
        if wide is None:
            for i in range(out.size):
                out[i] += cell[i]
            continue
        for i in range(pairs):
            out[2 * i] += cell[i]
            out[2 * i + 1] += cell[i]
        for i in range(2 * pairs, out.size):
            out[i] += cell[i // 2]


@loop
def interpolate_cells(cells, neighbours, above, wide, tall, known, points):
    """Add to each point `1 - known` times the interpolation between cells."""
    pairs, columns = points.shape[1] // 2, cells.shape[1]
    line = np.empty(columns + 2, np.float32)
    for j in range(points.shape[0]):
        if tall is None:
            a = cells[j + above]
            for i in range(columns):
                line[i + 1] = a[i]
        else:
            near = (j + above) // 2
            a = row_of(cells, neighbours, near)
            b = row_of(cells, neighbours, near + 1 if (j + above) % 2 else near - 1)
            for i in range(columns):
                line[i + 1] = np.float32(0.75) * a[i] + np.float32(0.25) * b[i]
        out, weight = points[j], known[j]
        if wide is None:
            for i in range(columns):
                out[i] += (1.0 - weight[i]) * line[i + 1]
            continue
        line[0], line[columns + 1] = line[columns], line[1]
        for i in range(pairs):
            middle = np.float32(0.75) * line[i + 1]
            out[2 * i] += (1.0 - weight[2 * i]) * (middle + np.float32(0.25) * line[i])
            out[2 * i + 1] += (1.0 - weight[2 * i + 1]) * (middle + np.float32(0.25) * line[i + 2])
        for i in range(2 * pairs, out.size):
            out[i] += (1.0 - weight[i]) * (np.float32(0.75) * line[i // 2 + 1] + np.float32(0.25) * line[i // 2])


@loop
def gather_cells(known, known_neighbours, points, neighbours, above, wide, tall, cells):
    """Add up `1 - known` times the values of points in cells, by the weights of the interpolation."""
    count, columns = points.shape[1], cells.shape[1]
    width, height = columns if wide is None else 2 * columns, 1 if tall is None else 2
    line = np.empty(width + 2, np.float32)
    line[width] = 0.0  # beyond an odd number of points
    for j in range(cells.shape[0]):
        first = height * j - above
        a, w_a = row_of(points, neighbours, first), row_of(known, known_neighbours, first)
        if tall is None:
            for i in range(count):
                line[i + 1] = (1.0 - w_a[i]) * a[i]
        else:
            b, w_b = row_of(points, neighbours, first + 1), row_of(known, known_neighbours, first + 1)
            over, w_over = row_of(points, neighbours, first - 1), row_of(known, known_neighbours, first - 1)
            under, w_under = row_of(points, neighbours, first + 2), row_of(known, known_neighbours, first + 2)
            for i in range(count):
                outer = (1.0 - w_over[i]) * over[i] + (1.0 - w_under[i]) * under[i]
                inner = (1.0 - w_a[i]) * a[i] + (1.0 - w_b[i]) * b[i]
                line[i + 1] = 0.25 * outer + 0.75 * inner
        out = cells[j]
        if wide is None:
            for i in range(columns):
                out[i] = line[i + 1]
            continue
        line[0], line[2 * columns + 1] = line[2 * columns], line[1]
        for i in range(columns):
            outer, inner = line[2 * i] + line[2 * i + 3], line[2 * i + 1] + line[2 * i + 2]
            out[i] = np.float32(0.25) * outer + np.float32(0.75) * inner
