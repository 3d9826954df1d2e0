"""Paths of a fluid through a map of gaps, from the first row to the last."""

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from ...compiled import loop

Mask = NDArray[np.bool_]


def connected_from_end_to_end(open_cells: Mask, periodic_sides: bool) -> Mask:
    """Return the cells that are connected by faces to both the first and the last row."""
    labels, count = scipy.ndimage.label(open_cells)
    if periodic_sides and count:
        both = (labels[:, 0] > 0) & (labels[:, -1] > 0)
        pairs = (np.ones(np.count_nonzero(both)), (labels[both, 0], labels[both, -1]))
        graph = scipy.sparse.coo_matrix(pairs, shape=(count + 1, count + 1))
        _, groups = scipy.sparse.csgraph.connected_components(graph, False)
        labels = np.where(labels > 0, groups[labels] + 1, 0)
    spanning = np.intersect1d(labels[0], labels[-1])
    return np.isin(labels, spanning[spanning > 0])


def critical_constriction(gap: NDArray[np.float64], periodic_sides: bool) -> tuple[float, tuple[int, int] | None]:
    """Return the smallest gap on the widest path from end to end, and its row and column; the widest path is that with
    the largest smallest gap.

    Returns 0 and None if contact closes all paths. Cells are opened in the order of falling gaps until both ends are
    connected: the last one is the constriction.
    """
    open_, (ny, nx) = np.flatnonzero(gap > 0.0), gap.shape
    cell = int(_open_until_connected(open_[np.argsort(-gap.ravel()[open_])], ny, nx, periodic_sides))
    if cell < 0:
        return 0.0, None
    row, column = divmod(cell, nx)
    return float(gap[row, column]), (row, column)


@loop
def _open_until_connected(order, ny, nx, periodic):
    """Open cells in an order until a path leads from the first row to the last. Return the last one, or -1. Open cells
    that touch form a tree, `parent` leads to its root; both ends are additional cells."""
    first, last = nx * ny, nx * ny + 1
    parent = np.full(nx * ny + 2, -1, np.int64)
    parent[first], parent[last] = first, last
    for cell in order:
        parent[cell] = cell
        row, column = cell // nx, cell % nx
        for side in range(4):
            if side == 0:
                other = cell - nx if row > 0 else first
            elif side == 1:
                other = cell + nx if row < ny - 1 else last
            elif side == 2:
                other = cell - 1 if column > 0 else (cell + nx - 1 if periodic else cell)
            else:
                other = cell + 1 if column < nx - 1 else (cell - nx + 1 if periodic else cell)
            if parent[other] >= 0:
                parent[_root(parent, other)] = _root(parent, cell)
        if _root(parent, first) == _root(parent, last):
            return cell
    return -1


@loop
def _root(parent, cell):
    """Return the root of a tree, and shorten the path to it."""
    while parent[cell] != cell:
        parent[cell] = parent[parent[cell]]
        cell = parent[cell]
    return cell
