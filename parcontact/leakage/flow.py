"""Flow of a fluid through the gap of a contact.

The Reynolds equation for a fluid of viscosity eta between two bodies that touch where the gap g is zero,

    div(g^3 grad p) = 0,      flow per width  Q = -(K / 12 eta) grad p,

is solved by finite volumes: each point of the map is a cell, and the conductance of the face between two cells is the
harmonic mean of their g^3. The pressure is given on two opposite ends of the map. The other two sides are periodic, or
closed. Contact is impermeable. Only cells that lie on a path from end to end matter; the matrix of these is factorized
directly, since g^3 spans many decades and iterations stall.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from ..errors import InputError
from .paths import connected_from_end_to_end, critical_constriction

Map = NDArray[np.float64]
LEAST_GAP = 1e-3  # accuracy: of the largest gap; cells of a smaller one are closed, which costs some 1e-5 of the flow
LEAST_OF_CONSTRICTION = 0.1  # accuracy: of the critical constriction, for maps where all paths are that narrow
MOST_OF_CONSTRICTION = 1e3  # accuracy: wider cells are taken to be that wide; what they resist is 1e-9 of the whole


@dataclass(frozen=True)
class Flow:
    """Flow along one direction: `conductivity` is K [m^3], 0 where no path leads from end to end.

    `constriction` [m] is the smallest gap on the widest path and `position` its row and column; `imbalance` is the
    difference of the flows at both ends over the flow, which rounding makes; `pressure` is the map of the fluid's
    pressure, 1 at the first and 0 at the last end, NaN where no fluid flows.
    """

    conductivity: float
    constriction: float
    position: tuple[int, int] | None
    imbalance: float
    pressure: Map = field(repr=False)

    @property
    def percolates(self) -> bool:
        return self.constriction > 0.0


def solve_flow(gap: Map, size: tuple[float, float], axis: str = "x", periodic_sides: bool = True) -> Flow:
    """Return the flow through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m] along `axis`."""
    if axis == "x":
        turned = solve_flow(gap.T, size[::-1], "y", periodic_sides)
        place = None if turned.position is None else (turned.position[1], turned.position[0])
        return replace(turned, position=place, pressure=turned.pressure.T)
    pressure = np.full(gap.shape, np.nan)
    constriction, position = critical_constriction(gap, periodic_sides)
    if position is None:
        return Flow(0.0, 0.0, None, 0.0, pressure)
    least = min(LEAST_GAP * float(gap.max()), LEAST_OF_CONSTRICTION * constriction)
    wet = connected_from_end_to_end(gap >= least, periodic_sides)
    cubes = np.where(wet, np.minimum(gap, MOST_OF_CONSTRICTION * constriction) / constriction, 0.0) ** 3
    length, width = size[1], size[0]
    aspect = (width / gap.shape[1]) / (length / gap.shape[0])  # of a cell: across over along the flow
    matrix, first, last = _balance(cubes, wet, aspect, periodic_sides)
    # The drop from the first end and the pressure above the last end: each is exact where it is small.
    drop, above = _solve(matrix, _checkerboard(wet), np.stack([last, first], axis=1)).T
    inflow, outflow = float(first @ drop), float(last @ above)
    flow = 0.5 * (inflow + outflow)
    pressure[wet] = above
    conductivity = constriction**3 * flow * length / width
    return Flow(conductivity, constriction, position, abs(inflow - outflow) / flow, pressure)


@dataclass(frozen=True)
class Leak:
    """Flow through a gap along x and along y.

    `flow_x` and `flow_y` are the conductivities K [m^3]: a pressure that falls by `dp` over the length drives
    `K/(12 eta) dp/length` through each metre of width. `constriction` [m] is the smallest gap on the widest path in the
    direction that leaks more; 0 where contact closes the gap.
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


def leak(gap: ArrayLike, size: Sequence[float], periodic: bool = True) -> Leak:
    """Return the flow through a map of gaps [m], shape (ny, nx), on a box of `size` (lx, ly) [m], along x and along y.

    Contact is where the gap is 0 or less. Sides along the flow are `periodic`, or closed. Raises InputError for gaps
    that are no such map, or not finite, and for other sizes.
    """
    try:
        gaps = np.asarray(gap, dtype=float)
    except (TypeError, ValueError):
        raise InputError("gap must be a map of numbers [m], shape (ny, nx)") from None
    if gaps.ndim != 2 or not gaps.size:
        raise InputError(f"gap must be a map [m] of shape (ny, nx), got one of shape {gaps.shape}")
    if missing := int(np.count_nonzero(~np.isfinite(gaps))):
        raise InputError(f"gap must be finite, {missing} of {gaps.size} points are not: fill or close (0) them")
    lengths = _lengths(size)
    return Leak(*(solve_flow(np.maximum(gaps, 0.0), lengths, axis, periodic) for axis in ("x", "y")))


def _lengths(size: Sequence[float]) -> tuple[float, float]:
    try:
        width, height = (float(length) for length in size)
    except (TypeError, ValueError):
        raise InputError(f"size must be two lengths (lx, ly) [m], got {size!r}") from None
    if not (0.0 < width < math.inf and 0.0 < height < math.inf):
        raise InputError(f"size must be two positive lengths (lx, ly) [m], got {size!r}")
    return width, height


def _balance(cubes: Map, wet: NDArray[np.bool_], aspect: float, periodic: bool) -> tuple[sparse.csc_matrix, Map, Map]:
    """Return the matrix of the flows between wet cells, and the conductances to the first and to the last end."""
    number = np.full(wet.shape, -1, dtype=np.int32)
    number[wet] = np.arange(np.count_nonzero(wet), dtype=np.int32)
    beside = slice(None) if periodic else slice(None, -1)
    pairs = [
        (number[:-1], number[1:], aspect * _harmonic(cubes[:-1], cubes[1:])),
        (
            number[:, beside],
            np.roll(number, -1, axis=1)[:, beside],
            _harmonic(cubes, np.roll(cubes, -1, axis=1))[:, beside] / aspect,
        ),
    ]
    faces = [_faces(*pair) for pair in pairs]
    a, b, c = (np.concatenate(parts) for parts in zip(*faces, strict=True))
    first, last = np.zeros_like(cubes), np.zeros_like(cubes)
    first[0], last[-1] = 2.0 * aspect * cubes[0], 2.0 * aspect * cubes[-1]  # half a cell to the end
    count = int(number.max()) + 1
    diagonal = first[wet] + last[wet] + np.bincount(a, c, count) + np.bincount(b, c, count)
    every = np.arange(count, dtype=np.int32)
    rows, columns = np.concatenate([a, b, every]), np.concatenate([b, a, every])
    matrix = sparse.csc_matrix((np.concatenate([-c, -c, diagonal]), (rows, columns)), shape=(count, count))
    return matrix, first[wet], last[wet]


def _checkerboard(wet: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which wet cells are on the white fields of a checkerboard, where none touches another.

    Across periodic sides two would touch where the number of columns is odd: its last column has none.
    """
    white = np.add.outer(np.arange(wet.shape[0]), np.arange(wet.shape[1])) % 2 == 0
    white[:, -1] &= wet.shape[1] % 2 == 0
    return np.asarray(white[wet])


def _solve(matrix: sparse.csc_matrix, white: NDArray[np.bool_], given: Map) -> Map:
    """Return the solution of a symmetric system, shape (cells, sides).

    White cells are eliminated at once, as they touch black ones only. That leaves half of the cells to the direct
    solver, in four fifths of its time.
    """
    white_cells, black_cells = np.flatnonzero(white), np.flatnonzero(~white)
    rows = matrix.tocsr()
    coupling, inverse = rows[black_cells][:, white_cells], 1.0 / matrix.diagonal()[white_cells]
    eliminated = coupling @ sparse.diags(inverse)
    reduced = (rows[black_cells][:, black_cells] - eliminated @ coupling.T).tocsc()
    solution = np.empty_like(given)
    if black_cells.size:
        factors = splu(reduced, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        solution[black_cells] = factors.solve(given[black_cells] - eliminated @ given[white_cells])
    solution[white_cells] = inverse[:, None] * (given[white_cells] - coupling.T @ solution[black_cells])
    return solution


def _faces(a: NDArray[np.int32], b: NDArray[np.int32], c: Map) -> tuple[NDArray[np.int32], NDArray[np.int32], Map]:
    """Return the faces between two wet cells: their numbers and the conductance."""
    open_ = (a >= 0) & (b >= 0)
    return a[open_], b[open_], c[open_]


def _harmonic(a: Map, b: Map) -> Map:
    return 2.0 * a * b / np.maximum(a + b, np.finfo(float).tiny)
