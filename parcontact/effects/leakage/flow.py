"""Flow of a fluid through the gap of a contact.

A fluid of viscosity eta flows between two bodies, which touch where the gap g is zero. Its pressure p satisfies the
Reynolds equation,

    div(g^3 grad p) = 0,      flow per width  Q = -(K / 12 eta) grad p,

where the second equation defines the conductivity K [m^3] of the whole gap. The first equation is solved by finite
volumes: each point of the map is a cell, and the conductance c of the face between two cells is the harmonic mean of
their g^3. The pressure is prescribed on two opposite ends of the map. The other two sides are periodic or closed.
Contact is impermeable, and only cells on a path from end to end are used. The flow follows from the dissipation, `sum c
(p - p_neighbour)^2` over all faces. The exact pressures make this sum smallest, so that errors of the pressures enter
the flow squared.

Each cell with fluid has the balance `sum c (p - p_neighbour) = given` over its faces, where the source `given` is 0
except at an end with prescribed pressure. If the cells are coloured like a checkerboard, a white cell has only black
neighbours, and its pressure is

    p_white = (given + sum c p_black)/sum c.

This eliminates all white cells, half of the unknowns, and leaves a symmetric matrix for the black cells, with up to
eight neighbours each. This matrix is factorized directly, since iterations would stall: g^3 spans many decades.

A fluid is a liquid or a gas. A gas expands, and slips at the walls. A pressure that falls from p1 to p2 over the length
L of a gap of conductivity K drives through a width W the flow

    liquid   Q = K/(12 eta) (p1 - p2) W/L,
    gas      Q = K/(12 eta) (p1^2 - p2^2)/(2 p2) W/L,    at the pressure p2,

for an ideal gas at constant temperature T. With the gas constant R and the molar mass M, the mean free path of a gas is
(J. C. Maxwell, Phil. Trans. R. Soc. 170 (1879) 231)

    lambda = (eta/p) sqrt(pi R T/(2 M)).

A gas slips at walls that reflect all molecules diffusely. Then `g^3 (1 + 6 lambda/g)` replaces g^3 in the Reynolds
equation. Here lambda is taken at the mean pressure (p1 + p2)/2, which is exact for a gap of constant height. The error
is about 10 % for gaps above ten mean free paths; in smaller gaps the true flow is larger.

These flows are viscous. The inertia of a gas also limits its mass flow through an open section A, by the isentropic law
of A. Barre de Saint-Venant and L. Wantzel, J. Ecole Polytechnique 16 (1839) 85. With the ratio kappa of heat capacities
the limit is

    A p1 sqrt(M/(R T)) sqrt(2 kappa/(kappa - 1) (r^(2/kappa) - r^((kappa + 1)/kappa))),

where r is the larger of p2/p1 and (2/(kappa + 1))^(kappa/(kappa - 1)). If p2/p1 is smaller than the second value, the
flow is choked: a lower p2 does not increase the flow.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ... import text_tables
from ...compiled import loop
from ...errors import InputError

Map = NDArray[np.floating]
DRY, WHITE = -1, -2  # numbers of cells that are not black
MOST_NEIGHBOURS = 17  # entries of a row of the matrix, at most, including the diagonal
PANEL = 1  # tuning: columns per panel of SuperLU


class Balance:
    """Balance of the flows into and out of each cell of a map, for a flow along y from the first to the last row.

    `resistances` are 1/g^3, shape (ny, nx), infinite in dry cells. `aspect` is the side of a cell across the flow
    divided by its side along the flow. The sides along the flow are `periodic` or closed. The pressure is prescribed on
    the two ends of the map, which are half a cell before the first row and half a cell behind the last row. `first` and
    `last` are the conductances between these rows and their ends, shape (nx,).
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
        """Return the map of pressures for the sources `given` in each cell; both have the shape (ny, nx). Pressures are
        0 in dry cells."""
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
        """Return the dissipation of the flow, `sum c (p - p_neighbour)^2`, for a map of pressures that are 1 at the
        first and 0 at the last end."""
        return float(_dissipate(*self._map, self.first, self.last, pressure))


def _number_black_cells(resistances: Map) -> NDArray[np.int32]:
    """Return the numbers of black wet cells, WHITE for white wet cells and DRY for dry ones. If the number of columns
    is odd, the last column has no white cells, since they would touch white cells of the first column across periodic
    sides."""
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
    """Add flows from neighbours to `out`: for black cells the share of the values `field` of white neighbours that
    elimination leaves, for white cells `c` times the values of black neighbours."""
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
    """Return the critical constriction [m] of a map of gaps [m], and its row and column.

    Each path from end to end has a narrowest place. The widest path is the one whose narrowest place has the largest
    gap, and this place is the critical constriction. The function opens cells in the order of falling gaps until both
    ends are connected: the last cell opened is the constriction. It returns 0 and None if contact closes all paths.
    """
    open_, (ny, nx) = np.flatnonzero(gap > 0.0), gap.shape
    cell = int(_open_until_connected(open_[np.argsort(-gap.ravel()[open_])], ny, nx, periodic_sides))
    if cell < 0:
        return 0.0, None
    row, column = divmod(cell, nx)
    return float(gap[row, column]), (row, column)


@loop
def _open_until_connected(order, ny, nx, periodic):
    """Open cells in an order until a path leads from the first row to the last one, and return the cell opened last, or
    -1 if there is no path.

    Open cells that are connected form a tree, in which `parent` leads from each cell to the root. Both ends of the map
    are further cells.
    """
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


FloatMap = NDArray[np.float64]
LEAST_GAP = 1e-3  # accuracy: least open gap over the largest; this changes the flow by about 1e-5
LEAST_OF_CONSTRICTION = 0.1  # accuracy: least open gap over the critical constriction
MOST_OF_CONSTRICTION = 1e3  # accuracy: largest gap over the critical constriction; wider cells resist 1e-9 of the whole


@dataclass(frozen=True)
class Flow:
    """Flow along one direction.

    `conductivity` is K [m^3], 0 if no path leads from end to end. `constriction` [m] is the critical constriction, the
    smallest gap on the widest path, and `position` its row and column. `imbalance` is the relative difference between
    the outflow and the flow that follows from the dissipation, a rounding error. `pressure` is the map of the fluid's
    pressure, which falls from 1 at the first end to 0 at the last end and is NaN where no fluid flows.
    """

    conductivity: float
    constriction: float
    position: tuple[int, int] | None
    imbalance: float
    pressure: FloatMap = field(repr=False)

    @property
    def percolates(self) -> bool:
        return self.constriction > 0.0


def solve_flow(gap: FloatMap, size: tuple[float, float], axis: str = "x", periodic_sides: bool = True) -> Flow:
    """Return the flow along `axis` through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m]. The
    sides along the flow are periodic if `periodic_sides`, else closed."""
    if axis == "x":
        turned = solve_flow(gap.T, size[::-1], "y", periodic_sides)
        place = None if turned.position is None else (turned.position[1], turned.position[0])
        return replace(turned, position=place, pressure=turned.pressure.T)
    constriction, position = critical_constriction(gap, periodic_sides)
    if position is None:
        return Flow(0.0, 0.0, None, 0.0, np.full(gap.shape, np.nan))
    resistances, (ny, nx) = _resistances(gap, constriction, periodic_sides), gap.shape
    balance, given = Balance(resistances, size[0] / size[1] * ny / nx, periodic_sides), np.zeros(gap.shape)
    given[0] = balance.first
    pressure = balance.solve(given)
    power, leaving = balance.power(pressure), float(balance.last @ pressure[-1])
    conductivity = constriction**3 * power * size[1] / size[0]
    wet = np.where(np.isfinite(resistances), pressure, np.nan)
    return Flow(conductivity, constriction, position, abs(leaving / power - 1.0), wet)


def _resistances(gap: FloatMap, constriction: float, periodic_sides: bool) -> FloatMap:
    """Return 1/g^3 of each cell, divided by that of the constriction; infinite in cells that are not used."""
    least = min(LEAST_GAP * float(gap.max()), LEAST_OF_CONSTRICTION * constriction)
    wet = connected_from_end_to_end(gap >= least, periodic_sides)
    found = np.full(gap.shape, np.inf)
    found[wet] = (constriction / np.minimum(gap[wet], MOST_OF_CONSTRICTION * constriction)) ** 3
    return found


def least_section(gap: FloatMap, flow: Flow, size: tuple[float, float], axis: str = "x") -> float:
    """Return the smallest open section [m^2] across a flow along `axis`: of all sections normal to the axis, the
    smallest area between the surfaces in cells through which fluid flows. Return 0 if contact closes the gap. `gap` [m]
    has the shape (ny, nx), and `size` is (lx, ly) [m]."""
    across, width = (0, size[1]) if axis == "x" else (1, size[0])
    wet = np.where(np.isfinite(flow.pressure), gap, 0.0)
    return float(wet.mean(axis=across).min()) * width


def flow_mesh_error(
    gap: FloatMap, flow: Flow, size: tuple[float, float], axis: str = "x", periodic_sides: bool = True
) -> float:
    """Return the relative change of K if only every second point of the gap is used. These points start with the first
    or with the second point, whichever changes K more. Return NaN if contact closes the gap. `gap`, `size`, `axis` and
    `periodic_sides` are as in `solve_flow`."""
    if not flow.percolates:
        return math.nan
    found = []
    for start in (0, 1):
        half = gap[tuple(slice(start, None, 2) if n > 1 else slice(None) for n in gap.shape)]
        found.append(abs(solve_flow(half, size, axis, periodic_sides).conductivity / flow.conductivity - 1.0))
    return max(found)


@dataclass(frozen=True)
class Leak:
    """Flow through a gap along x and along y.

    `flow_x` and `flow_y` are the conductivities K [m^3]: a pressure that falls by `dp` over the length drives the flow
    `K/(12 eta) dp/length` through each metre of width. `constriction` [m] is the larger of the critical constrictions
    along x and along y; 0 if contact closes the gap.
    """

    along_x: Flow
    along_y: Flow

    @property
    def flow_x(self) -> float:
        return self.along_x.conductivity

    @property
    def flow_y(self) -> float:
        return self.along_y.conductivity

    @property
    def constriction(self) -> float:
        return max(self.along_x.constriction, self.along_y.constriction)


def leak(gap: ArrayLike, size: Sequence[float], periodic: bool | tuple[bool, bool] = True) -> Leak:
    """Return the flow through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m], along x and along y.

    Points with a gap of 0 or less are in contact. `periodic` is True if the box is periodic along x and y, or a pair of
    such values for x and y. The sides along a flow are closed if the box is not periodic across it. Raises InputError
    for other shapes or sizes, and for gaps that are not finite.
    """
    try:
        given = np.asanyarray(gap)
    except ValueError:
        raise InputError("gap must be a map of numbers [m], shape (ny, nx)") from None
    if given.dtype.kind not in "iuf":
        raise InputError(f"gap must be a map of real numbers [m], shape (ny, nx), got values of type {given.dtype}")
    if masked := int(np.count_nonzero(np.ma.getmaskarray(given))):
        raise InputError(
            f"gap must be known everywhere, {masked} of {given.size} points are masked: fill or close (0) them"
        )
    gaps = np.asarray(given, dtype=float)
    if gaps.ndim != 2 or not gaps.size:
        raise InputError(f"gap must be a map [m] of shape (ny, nx), got one of shape {gaps.shape}")
    if missing := int(np.count_nonzero(~np.isfinite(gaps))):
        raise InputError(f"gap must be finite, {missing} of {gaps.size} points are not: fill or close (0) them")
    gaps, lengths = np.maximum(gaps, 0.0), _lengths(size)
    text_tables.refuse_extreme("gap", float(gaps.max()))
    along_x, along_y = periodic if isinstance(periodic, tuple) else (periodic, periodic)
    return Leak(*(solve_flow(gaps, lengths, axis, sides) for axis, sides in (("x", along_y), ("y", along_x))))


def _lengths(size: Sequence[float]) -> tuple[float, float]:
    try:
        width, height = (float(length) for length in size)
    except (TypeError, ValueError):
        raise InputError(f"size must be two lengths (lx, ly) [m], got {size!r}") from None
    if not (0.0 < width < math.inf and 0.0 < height < math.inf):
        raise InputError(f"size must be two positive lengths (lx, ly) [m], got {size!r}")
    return width, height


GAS_CONSTANT = 8.31446261815324  # physics: [J/(mol K)]
BAR = 1.0e5  # [Pa]
INERTIA = 0.2  # accuracy: viscous flow of a gas over its bound by inertia, above which viscous flow is 10 % too large
ROOM = 293.15  # physics: temperature of the table [K]


@dataclass(frozen=True)
class Fluid:
    """A fluid at 20 C with its `viscosity` [Pa s]. A liquid has a `density` [kg/m^3], NaN if it is unknown. A gas has a
    `molar_mass` [kg/mol] and the ratio `heat_ratio` of its heat capacities [-]; `molar_mass` is None for a liquid."""

    name: str
    viscosity: float
    molar_mass: float | None = None
    density: float = math.nan
    heat_ratio: float = math.nan

    def mean_free_path(self, pressure: float) -> float:
        """Return the mean free path [m] of a gas at a pressure [Pa]; 0 for a liquid."""
        if self.molar_mass is None:
            return 0.0
        return self.viscosity / pressure * math.sqrt(math.pi * GAS_CONSTANT * ROOM / (2.0 * self.molar_mass))

    @property
    def choking_ratio(self) -> float:
        """Ratio of the low to the high pressure [-] below which the flow of a gas is choked."""
        kappa = self.heat_ratio
        return float((2.0 / (kappa + 1.0)) ** (kappa / (kappa - 1.0)))

    def density_at(self, pressure: float) -> float:
        """Return the density [kg/m^3] at an absolute pressure [Pa]; NaN if it is unknown."""
        return self.density if self.molar_mass is None else pressure * self.molar_mass / (GAS_CONSTANT * ROOM)


FLUIDS = {  # at 20 C and 1 bar: CRC Handbook of Chemistry and Physics, 97th edition (2016), 6-1 and 6-231
    "water": Fluid("water", 1.0016e-3, density=998.2),
    "air": Fluid("air", 1.82e-5, 0.028964, heat_ratio=1.40),
    "nitrogen": Fluid("nitrogen", 1.76e-5, 0.028014, heat_ratio=1.40),
    "helium": Fluid("helium", 1.96e-5, 0.0040026, heat_ratio=1.67),
}


@dataclass(frozen=True)
class PressureDrop:
    """A fluid whose pressure falls from `high` to `low` [Pa] along the flow; for a gas both are absolute pressures.

    If `total` is True, the fluid carries a part of the load, and loads are measured above the pressure `ambient` [Pa],
    by default `low`.
    """

    fluid: Fluid
    high: float
    low: float
    total: bool = False
    ambient: float | None = None

    @property
    def mean_free_path(self) -> float:
        """Mean free path [m] of a gas at the mean of the high and the low pressure; 0 for a liquid."""
        return self.fluid.mean_free_path(0.5 * (self.high + self.low))

    @property
    def outside(self) -> float:
        """Pressure [Pa] above which the load is measured."""
        return self.low if self.ambient is None else self.ambient

    @property
    def pressures(self) -> tuple[float, ...]:
        """Pressures [Pa] of the fluid at which the conductivity is calculated: the mean of high and low pressure and,
        if a gas carries a part of the load, also the low and the high pressure."""
        ends = (self.low, self.high) if self.total and self.mean_free_path else ()
        return (0.5 * (self.low + self.high), *ends)

    def local_loads(self, load: float) -> tuple[float, float]:
        """Return the loads [Pa] that contact carries at the high-pressure end and at the low-pressure end of a seal
        under a `load` [Pa], if the fluid carries the rest."""
        return load + self.outside - self.high, load + self.outside - self.low

    def conducting_gap(self, gap: NDArray[np.float64], pressure: float) -> NDArray[np.float64]:
        """Return the equivalent gaps [m] of a gas at a `pressure` [Pa], in the shape of `gap`; for a liquid, return
        `gap`.

        A gas at this pressure slips in a gap. The same pressure gradient would drive the same mass flow through the
        equivalent gap if the gas had the mean pressure of the drop and did not slip.
        """
        if not (path := self.mean_free_path):
            return gap
        return np.cbrt(gap**2 * (pressure / self.pressures[0] * gap + 6.0 * path))

    def flow_rate(self, conductivity: float, length: float, width: float) -> float:
        """Return the volume flow [m^3/s], measured at the low pressure. The seal has a conductivity [m^3] and is
        `length` [m] long along the flow and `width` [m] wide. NaN for a gas that flows into a vacuum."""
        drive = self.high - self.low
        if self.fluid.molar_mass is not None:
            drive = drive * 0.5 * (self.high + self.low) / self.low if self.low else math.nan
        return conductivity / (12.0 * self.fluid.viscosity) * drive * width / length

    def mass_flow(self, conductivity: float, length: float, width: float) -> float:
        """Return the mass flow [kg/s]. The seal has a conductivity [m^3] and is `length` [m] long along the flow and
        `width` [m] wide. NaN if the density is unknown."""
        mean = self.fluid.density_at(0.5 * (self.high + self.low))
        return conductivity / (12.0 * self.fluid.viscosity) * (self.high - self.low) * mean * width / length

    def inertial_bound(self, section: float) -> float:
        """Return the largest mass flow [kg/s] that inertia lets pass through an open section [m^2]; infinite for a
        liquid."""
        if self.fluid.molar_mass is None:
            return math.inf
        kappa, ratio = self.fluid.heat_ratio, max(self.low / self.high, self.fluid.choking_ratio)
        square = 2.0 * kappa / (kappa - 1.0) * (ratio ** (2.0 / kappa) - ratio ** ((kappa + 1.0) / kappa))
        return section * self.high * math.sqrt(square * self.fluid.molar_mass / (GAS_CONSTANT * ROOM))

    def describe_inertia(self, axis: str, viscous: float, bound: float) -> str:
        """Return a warning if inertia limits the flow of a gas along an axis, else ''. Inertia matters if the `viscous`
        mass flow is more than the fraction INERTIA of the largest mass flow that inertia lets pass, `bound`; both are
        in kg/s."""
        if not viscous > INERTIA * bound:
            return ""
        both = 1.0 / (1.0 / viscous + 1.0 / bound)
        choked = ", choked," * (viscous > bound and self.low <= self.fluid.choking_ratio * self.high)
        return (
            f"along {axis} inertia limits the flow of {self.fluid.name}: at most {1e6 * bound:.3g} mg/s{choked} pass "
            f"the smallest open section, and viscous flow alone would be {1e6 * viscous:.3g} mg/s; expect some "
            f"{1e6 * both:.3g} mg/s, 1/(1/viscous + 1/bound), within 14 %"
        )

    def describe_rate(self, conductivity: float, length: float, width: float) -> str:
        """Return a text with the flow through a conductivity [m^3] over a `length` along and a `width` across the flow
        [m]. It gives the volume flow at the low pressure, the mass flow if the density is known, and for a gas the
        volume flow at 1 bar."""
        rate, mass = (flow(conductivity, length, width) for flow in (self.flow_rate, self.mass_flow))
        said = [] if math.isnan(rate) else [f"{rate:.3g} m³/s ({3.6e9 * rate:.3g} ml/h) at the low side"]
        said += [] if math.isnan(mass) else [f"{1e6 * mass:.3g} mg/s"]
        if self.fluid.molar_mass is not None and self.low != BAR:
            said.append(f"{3.6e9 * mass / self.fluid.density_at(BAR):.3g} ml/h of gas at 1 bar")
        return ", ".join(said)
