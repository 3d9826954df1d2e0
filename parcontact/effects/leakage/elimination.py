"""Direct solution of the flow between cells: half of the cells are eliminated at once, the rest by sparse factors.

The flows out of each wet cell balance: with the conductances c of its faces, `sum c (p - p_neighbour) = given`.
White cells of a checkerboard touch black ones only, so that each is eliminated on its own:

    p_white = (given + sum c p_black)/sum c,

which leaves a symmetric matrix of the black cells, with up to eight neighbours each. It is factorized directly.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compiled import loop

Map = NDArray[np.floating]
DRY, WHITE = -1, -2  # numbers of cells that are not black
MOST_NEIGHBOURS = 17  # entries of a row of the matrix, at most, including the diagonal
PANEL = 1  # tuning: columns per panel of SuperLU


class Balance:
    """Balance of the flows in a map.

    `resistances` are 1/g^3, infinite in dry cells; `aspect` is the side of a cell across the flow over that along
    it. Flow is along y, from the first to the last row; the other sides are `periodic` or closed. The pressure is
    prescribed half a cell from these rows: `first` and `last` are the conductances from there, shape (nx,).
    """

    def __init__(self, resistances: Map, aspect: float, periodic: bool) -> None:
        self._map = np.ascontiguousarray(resistances), aspect, periodic
        self.first, self.last = 2.0 * aspect / resistances[0], 2.0 * aspect / resistances[-1]
        self._number = _number_black_cells(resistances)
        self._sum = np.zeros_like(self._map[0])
        _add_faces(*self._map, self.first, self.last, self._sum)
        self._factors = self._factorize()

    def _factorize(self) -> Any:
        """Return the factors of the matrix of the black cells; None if there are none."""
        from scipy import sparse  # slow to import
        from scipy.sparse.linalg import splu

        count = int(self._number.max(initial=DRY)) + 1
        if not count:
            return None
        starts = np.zeros(count + 1, dtype=np.int32)
        columns = np.empty(MOST_NEIGHBOURS * count, dtype=np.int32)
        values = np.empty(columns.size)
        _eliminate(*self._map, self._number, self._sum, starts, columns, values)
        matrix = sparse.csc_matrix((values[: starts[-1]], columns[: starts[-1]], starts), shape=(count, count))
        del columns, values
        options = {"SymmetricMode": True, "Equil": False}
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, panel_size=PANEL, options=options)

    def solve(self, given: Map) -> Map:
        """Return the pressures for the sources `given` in each cell, both of the shape of the map; 0 in dry cells."""
        black, pressure = self._number >= 0, np.zeros_like(self._sum)
        if self._factors is not None:
            total = given.copy()
            _gather(*self._map, self._number, self._sum, given, True, total)
            pressure[black] = self._factors.solve(total[black])
        total = given.copy()
        _gather(*self._map, self._number, self._sum, pressure, False, total)
        white = self._number == WHITE
        pressure[white] = total[white] / self._sum[white]
        return pressure

    def power(self, pressure: Map) -> float:
        """Return the dissipation of the flow, sum c (p - p_neighbour)^2, with the pressures 1 and 0 at the ends."""
        return float(_dissipate(*self._map, self.first, self.last, pressure))


def _number_black_cells(resistances: Map) -> NDArray[np.int32]:
    """Return the numbers of black wet cells, WHITE and DRY elsewhere. If the number of columns is odd, two white cells
    would touch across periodic sides: the last column then has none."""
    ny, nx = resistances.shape
    white = np.add.outer(np.arange(ny), np.arange(nx)) % 2 == 0
    white[:, -1] &= nx % 2 == 0
    number = np.where(resistances < np.inf, np.int32(WHITE), np.int32(DRY))
    black = (resistances < np.inf) & ~white
    number[black] = np.arange(np.count_nonzero(black), dtype=np.int32)
    return number


@loop
def _neighbour(resistances, aspect, periodic, row, column, side):
    """Return row, column and conductance of the face of a neighbour; 0 if there is none."""
    i, j, width = row, column, resistances.shape[1]
    if side < 2:
        i = row - 1 if side == 0 else row + 1
        if i < 0 or i == resistances.shape[0]:
            return row, column, 0.0
    else:
        j = column - 1 if side == 2 else column + 1
        if periodic and (j < 0 or j == width):
            j = width - 1 if j < 0 else 0
        if j < 0 or j in (width, column):
            return row, column, 0.0
    resistance = resistances[row, column] + resistances[i, j]
    if resistance == np.inf:
        return row, column, 0.0
    return i, j, 2.0 / resistance * (aspect if side < 2 else 1.0 / aspect)


@loop
def _add_faces(resistances, aspect, periodic, first, last, out):
    """Put the sum of the conductances of the faces of each cell, including those of the ends, into `out`."""
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            total = 0.0
            for side in range(4):
                total += _neighbour(resistances, aspect, periodic, row, column, side)[2]
            if row == 0:
                total += first[column]
            if row == resistances.shape[0] - 1:
                total += last[column]
            out[row, column] = total


@loop
def _eliminate(resistances, aspect, periodic, number, total, starts, columns, values):
    """Write the matrix of the black cells, row by row."""
    end = 0
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            own = number[row, column]
            if own < 0:
                continue
            begin = end
            columns[end], values[end] = own, total[row, column]
            end += 1
            for side in range(4):
                i, j, c = _neighbour(resistances, aspect, periodic, row, column, side)
                if c == 0.0:
                    continue
                if number[i, j] >= 0:
                    end = _add(number[i, j], -c, begin, end, columns, values)
                    continue
                for further in range(4):
                    k, m, d = _neighbour(resistances, aspect, periodic, i, j, further)
                    if d > 0.0:
                        end = _add(number[k, m], -c * d / total[i, j], begin, end, columns, values)
            starts[own + 1] = end


@loop
def _add(other, value, begin, end, columns, values):
    """Add a value to an entry of a row that starts at `begin`. Return the end of the row."""
    for k in range(begin, end):
        if columns[k] == other:
            values[k] += value
            return end
    columns[end], values[end] = other, value
    return end + 1


@loop
def _gather(resistances, aspect, periodic, number, total, field, black, out):
    """Add the flow from white neighbours of a field to black cells, or `c` times that of black neighbours to white
    cells."""
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            own = number[row, column]
            if own == DRY or (own >= 0) != black:
                continue
            for side in range(4):
                i, j, c = _neighbour(resistances, aspect, periodic, row, column, side)
                if c > 0.0 and (number[i, j] < 0) == black:
                    out[row, column] += c * field[i, j] / (total[i, j] if black else 1.0)


@loop
def _dissipate(resistances, aspect, periodic, first, last, pressure):
    """Return the sum of the dissipation of all faces, each counted once, and of the ends."""
    total = 0.0
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            for side in (1, 3):
                i, j, c = _neighbour(resistances, aspect, periodic, row, column, side)
                total += c * (pressure[row, column] - pressure[i, j]) ** 2
    for column in range(resistances.shape[1]):
        total += first[column] * (1.0 - pressure[0, column]) ** 2 + last[column] * pressure[-1, column] ** 2
    return total
