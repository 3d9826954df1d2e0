"""Direct solution of the flow between cells: half of the cells are eliminated at once, the rest by sparse factors.

The flows that leave each wet cell balance: with the conductances c of its faces, `sum c (p - p_neighbour) = given`.
Cells on the white fields of a checkerboard touch black ones only, so that each of them is eliminated on its own:

    p_white = (given + sum c p_black)/sum c,

which leaves a symmetric matrix of the black cells, with up to eight neighbours each. It is factorized directly.

The map may be a slab of a larger one (`slabs`). The faces to the next slab are its ports, cells without resistance,
half a cell away. They are black, and neighbours of each other, so that the ordering of few neighbours first leaves them
to the end. The last rows of the factors then give the matrix of the ports, in which all cells are eliminated.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from ..compiled import loop

Map = NDArray[np.floating]
DRY, WHITE = -1, -2  # numbers of cells that are no black ones
MOST_NEIGHBOURS = 17  # of a black cell, itself included: three beyond each of four white ones, and four black ones
PANEL, PANEL_WITH_PORTS = 1, 4  # tuning: columns that SuperLU takes at once; those of cells are short, of ports long


class Balance:
    """Balance of the flows in a map: `resistances` 1/g^3, infinite in dry cells and 0 in ports, which are in the first
    and the last row; `aspect`, across over along the flow, of a cell.

    Flow is along y, from the first to the last row; the other sides are `periodic` or closed. Half a cell from the rows
    that are `ends` the pressure is given: `first` and `last` are the conductances from there, shape (nx,).
    """

    def __init__(self, resistances: Map, aspect: float, periodic: bool, ends: tuple[bool, bool] = (True, True)) -> None:
        self._map = np.ascontiguousarray(resistances), aspect, periodic
        self.first, self.last = (
            2.0 * aspect / resistances[row] if end else np.zeros(resistances.shape[1])
            for row, end in zip((0, -1), ends, strict=True)
        )
        self._number = _number_black_cells(resistances)
        self._ports = self._number[resistances == 0.0]
        self._sum = np.zeros_like(self._map[0])
        _add_faces(*self._map, self.first, self.last, self._sum)
        self._own = self._sum[resistances == 0.0]  # twice in the matrix: once would be singular where no end is near
        self._factors = self._factorize()

    def _factorize(self) -> Any:
        """Return the factors of the matrix of the black cells; None if there are none."""
        count, ports = int(self._number.max(initial=DRY)) + 1, self._ports
        if not count:
            return None
        starts = np.zeros(count + 1, dtype=np.int32)
        columns = np.empty(MOST_NEIGHBOURS * count + ports.size**2, dtype=np.int32)
        values = np.empty(columns.size)
        _eliminate(*self._map, self._number, self._sum, ports, starts, columns, values)
        matrix = sparse.csc_matrix((values[: starts[-1]], columns[: starts[-1]], starts), shape=(count, count))
        del columns, values
        panel, options = PANEL_WITH_PORTS if ports.size else PANEL, {"SymmetricMode": True, "Equil": False}
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, panel_size=panel, options=options)

    def solve(self, given: Map, pressures: Map | None = None, inflow: Map | None = None) -> Map:
        """Return the pressures for what is `given` to each cell, both of the shape of the map; 0 in dry cells. Ports
        have these `pressures`, with which this is their `inflow`."""
        black, pressure = self._number >= 0, np.zeros_like(self._sum)
        if self._factors is not None:
            total = self._given_to_black(given)
            if pressures is not None:
                total[self._ports] += inflow + self._own * pressures
            pressure[black] = self._factors.solve(total)
        total = given.copy()
        _gather(*self._map, self._number, self._sum, pressure, False, total)
        white = self._number == WHITE
        pressure[white] = total[white] / self._sum[white]
        return pressure

    def _given_to_black(self, given: Map) -> Map:
        total = given.copy()
        _gather(*self._map, self._number, self._sum, given, True, total)
        return total[self._number >= 0]

    def of_ports(self, given: Map) -> tuple[Map, Map]:
        """Return matrix and vector of `inflow = matrix @ pressures - vector` in ports, for what is `given` to cells."""
        if not self._ports.size:
            return np.zeros((0, 0)), np.zeros(0)
        order = self._factors.perm_c
        begin = order[self._ports].min()
        left = self._factors.L[begin:, begin:].toarray() @ self._factors.U[begin:, begin:].toarray()
        ports = order[self._ports] - begin
        cells = np.setdiff1d(np.arange(len(left)), ports)  # those few that come after a port
        through = np.linalg.solve(left[np.ix_(cells, cells)], left[np.ix_(cells, ports)])
        matrix = left[np.ix_(ports, ports)] - left[np.ix_(ports, cells)] @ through
        vector = matrix @ self._factors.solve(self._given_to_black(given))[self._ports]
        matrix[np.diag_indices_from(matrix)] -= self._own
        return matrix, vector

    @property
    def shape(self) -> tuple[int, ...]:
        return self._sum.shape

    def power(self, pressure: Map) -> float:
        """Return what the flow dissipates, sum c (p - p_neighbour)^2, with the pressures 1 and 0 at the ends."""
        return float(_dissipate(*self._map, self.first, self.last, pressure))


def _number_black_cells(resistances: Map) -> NDArray[np.int32]:
    """Return the numbers of black wet cells, WHITE and DRY elsewhere; ports are black.

    Two white cells would touch across periodic sides where the number of columns is odd: its last column has none.
    """
    ny, nx = resistances.shape
    white = np.add.outer(np.arange(ny), np.arange(nx)) % 2 == 0
    white[:, -1] &= nx % 2 == 0
    number = np.where(resistances < np.inf, np.int32(WHITE), np.int32(DRY))
    black = (resistances < np.inf) & (~white | (resistances == 0.0))
    number[black] = np.arange(np.count_nonzero(black), dtype=np.int32)
    return number


@loop
def _neighbour(resistances, aspect, periodic, row, column, side):
    """Row, column and conductance of the face of a neighbour, 0 where there is none."""
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
    if resistance in (0.0, np.inf):  # ports do not touch each other
        return row, column, 0.0
    return i, j, 2.0 / resistance * (aspect if side < 2 else 1.0 / aspect)


@loop
def _add_faces(resistances, aspect, periodic, first, last, out):
    """Sum the conductances of the faces of each cell, those of the ends included."""
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
def _eliminate(resistances, aspect, periodic, number, total, ports, starts, columns, values):
    """Write the matrix of the black cells, row by row; ports have their own conductance once more, and each other."""
    end = 0
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            own = number[row, column]
            if own < 0:
                continue
            begin = end
            if resistances[row, column] == 0.0:
                for other in ports:
                    columns[end], values[end] = other, 2.0 * total[row, column] if other == own else 0.0
                    end += 1
            else:
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
    """Add a value to an entry of the row that began there; returns where the row ends."""
    for k in range(begin, end):
        if columns[k] == other:
            values[k] += value
            return end
    columns[end], values[end] = other, value
    return end + 1


@loop
def _gather(resistances, aspect, periodic, number, total, field, black, out):
    """Add to black cells what their white neighbours pass on of a field, or to white cells `c` times that of black
    ones."""
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
    """Sum the dissipation of all faces, each seen from one of its cells, and of the ends."""
    total = 0.0
    for row in range(resistances.shape[0]):
        for column in range(resistances.shape[1]):
            for side in (1, 3):
                i, j, c = _neighbour(resistances, aspect, periodic, row, column, side)
                total += c * (pressure[row, column] - pressure[i, j]) ** 2
    for column in range(resistances.shape[1]):
        total += first[column] * (1.0 - pressure[0, column]) ** 2 + last[column] * pressure[-1, column] ** 2
    return total
