"""Paths of a fluid through a map of gaps, from the first row to the last."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

Mask = NDArray[np.bool_]


def connected_from_end_to_end(open_cells: Mask, periodic_sides: bool) -> Mask:
    """Return the cells that are connected, by faces, to both the first and the last row."""
    labels, count = ndimage.label(open_cells)
    if periodic_sides and count:
        both = (labels[:, 0] > 0) & (labels[:, -1] > 0)
        pairs = (np.ones(np.count_nonzero(both)), (labels[both, 0], labels[both, -1]))
        _, groups = sparse.csgraph.connected_components(sparse.coo_matrix(pairs, shape=(count + 1, count + 1)), False)
        labels = np.where(labels > 0, groups[labels] + 1, 0)
    spanning = np.intersect1d(labels[0], labels[-1])
    return np.isin(labels, spanning[spanning > 0])


def critical_constriction(gap: NDArray[np.float64], periodic_sides: bool) -> tuple[float, tuple[int, int] | None]:
    """Return the smallest gap on the path from end to end whose smallest gap is the largest, and its row and column.

    Returns 0 and None where contact closes all paths. The gap is found by bisection over the gaps that occur.
    """
    values = np.unique(gap[gap > 0.0])
    closed, open_ = len(values), -1  # numbers of values at which the paths are closed, and open
    while closed - open_ > 1:
        middle = (closed + open_) // 2
        if connected_from_end_to_end(gap >= values[middle], periodic_sides).any():
            open_ = middle
        else:
            closed = middle
    if open_ < 0:
        return 0.0, None
    on_path = connected_from_end_to_end(gap >= values[open_], periodic_sides) & (gap == values[open_])
    row, column = np.argwhere(on_path)[0]
    return float(values[open_]), (int(row), int(column))
