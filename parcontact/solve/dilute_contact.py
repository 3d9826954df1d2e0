"""A dilute contact in a free box, solved on the tiles that may touch: its cost follows the contact, not the box.

A coarser grid has told where contact is, and about how deep: with its pressure p on a grid of blocks and the
displacement u that this causes there, a block can touch only if its highest point is near the rigid approach,

    u - max(h) - d < MARGIN L,

with L the length by which u varies within the contact (`certificate.Certificate`). Tiles with such blocks, or with
pressure, or beside one, are stacked to a map of their own, on which `contact.ContactSolver` solves the same problem
with operators on tiles (`physics.tile_operator`). These give the displacement at all points of the grid, too, by which
`contact.ContactSolver.check` sees whether the pressure holds everywhere. To less than FINEST, or if it does not, the
operator of the whole grid judges it, and the solve goes on from there. Root solves and tells the others.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..parallel import regrid
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab, allocate
from ..physics.tile_operator import TileOperator
from ..physics.tiles import SIDE, TileConvolution, Tiles, tiles_along
from .constraint import Constraint
from .contact import Contact, ContactSolver
from .preconditioner.extension import Grids
from .problem import Control, MeanPressure, Operators, Problem

MARGIN = 0.1  # tuning: of the length, by which a block may be off
LARGEST_SHARE = 0.25  # tuning: of the points of a grid: on more tiles, solving on all points is as fast
BLOCKS = 256  # points along the longer side of the grid of blocks, at most, unless tiles have fewer than one
LARGER_CELLS = Grids(2)  # tuning: of solvers on tiles; still larger cells would be those of tiles far apart
SHARE = 0.5  # of a tolerance, to which tiles are solved: the whole grid has to agree
LEAST = 1e-7  # accuracy: tolerance: beyond it operators on tiles have no more digits
FINEST = 1e-5  # accuracy: tolerance: to less the operator of the whole grid judges, of which tiles are off by 2e-7

# from tiles and a tolerance, with the body's operator and a preconditioner
SolverOnTiles = Callable[[Tiles, float], tuple[ContactSolver, TileOperator, TileConvolution]]


@dataclass(frozen=True)
class Found:
    """A contact on a grid: pressure on the rows of this rank, approach, and how much displacements vary in it."""

    slab: Slab
    p: Array
    d: float
    length: float


def is_block_grid(slab: Slab, finest: Slab) -> bool:
    """Return whether a grid is coarse enough to be one of blocks, but each in a single tile of the finest grid."""
    longest = max(slab.nx, slab.ny)
    return longest <= max(BLOCKS, max(finest.nx, finest.ny) // SIDE)


def choose_tiles(
    blocks: Slab, operators: Operators, below: Found, slab: Slab, heights: Array, constraint: Constraint
) -> Tiles | None:
    """Return the tiles of a grid that may touch, from the contact on the next coarser one; None where these are none,
    or more than LARGEST_SHARE of all; collective."""
    most = LARGEST_SHARE * slab.points / SIDE**2
    p = below.p if below.slab is blocks else regrid.restrict(below.slab, blocks, below.p)
    touching = constraint.touches(p) != 0.0
    if _tiles_with(blocks, touching, slab).count > most:
        return None
    u = operators.operator.apply(p, blocks.empty())
    gap = u - regrid.highest(slab, blocks, heights) - below.d
    tiles = _tiles_with(blocks, touching | (gap < MARGIN * below.length), slab)
    return tiles if 0 < tiles.count <= most else None


def _tiles_with(blocks: Slab, near: NDArray[np.bool_], slab: Slab) -> Tiles:
    """The tiles of a grid with blocks that are near contact, or beside such a block; collective."""
    whole = blocks.to_root(np.where(near, 1.0, 0.0))
    tiles = on_root(slab.comm, lambda: None if whole is None else _tiles_of(whole > 0.0, slab))
    assert tiles is not None
    return tiles


def _tiles_of(near: NDArray[np.bool_], slab: Slab) -> Tiles:
    down, across = near.shape
    edged = np.pad(near, 1)
    around = np.zeros_like(near)
    for j in range(3):
        for i in range(3):
            around |= edged[j : j + down, i : i + across]
    rows, columns = np.nonzero(around)
    across, down = tiles_along((slab.nx, slab.ny))
    marked = np.zeros((down, across), np.bool_)
    marked[rows * slab.ny // near.shape[0] // SIDE, columns * slab.nx // near.shape[1] // SIDE] = True
    rows, columns = np.nonzero(marked)
    return Tiles((slab.nx, slab.ny), rows, columns)


class OnTheseTiles:
    """A problem on tiles of a grid, and its solution; root has the operators."""

    def __init__(self, tiles: Tiles, solver_on: SolverOnTiles, problem: Problem, slab: Slab, height: float) -> None:
        self._tiles, self._solver_on, self._problem, self._slab = tiles, solver_on, problem, slab
        self._height = height
        self._operator: TileOperator | None = None
        self._stacked: Array = np.empty(0)

    def solve(self, tolerance: float, p: Array) -> Found:
        """Solve it from the pressure p, in whose place the solution will be; collective."""
        slab, tiles, problem = self._slab, self._tiles, self._problem
        lowest = -slab.reduce((), [-float(problem.heights.min(initial=np.inf))])[0]
        heights, start = (_stacked(slab, tiles, each) for each in (problem.heights, p))

        def act() -> tuple[Array, float, float]:
            assert heights is not None
            assert start is not None
            _bury(heights, tiles, lowest - self._height)
            solver, self._operator, inverse = self._solver_on(tiles, tolerance)
            control = _on_part(problem.control, slab.points / solver.slab.points)
            contact = solver.solve(Problem(self._operator, inverse, heights, problem.constraint, control), start)
            return contact.p, contact.d, contact.certificate.length

        self._stacked, d, length = on_root(slab.comm, act)
        _unstack(slab, tiles, self._stacked, p)
        return Found(slab, p, d, length)

    def check(self, solver: ContactSolver, p: Array) -> Contact | None:
        """The contact of the solution p, if it holds at all points to the solver's tolerance, None also where the
        operator of the whole grid is to judge; collective."""
        if solver.tolerance < FINEST:
            return None
        self._displace(solver.workspace.displacement)
        contact = solver.check(replace(self._problem, operator=_Displaced()), p, "does not hold beside the tiles")
        return contact if contact.converged else None

    def _displace(self, u: Array) -> None:
        """Put the displacement under the solution into the rows of a map; collective."""
        comm = self._slab.comm

        def take(rank: int, rows: Array) -> None:
            if rank == 0:
                u[...] = rows
            elif rows.size:
                comm.Send(rows, rank)

        if self._operator is not None:
            self._operator.displace(self._stacked, self._slab.dealt, take)
        elif u.size:
            rows = np.empty(self._slab.shape)
            comm.Recv(rows, 0)
            u[...] = rows


class _Displaced:
    """The operator where the map that it is to fill has the displacement already."""

    def apply(self, _: Array, out: Array) -> Array:
        return out


def _on_part(control: Control, share: float) -> Control:
    """The same load on so many times fewer points."""
    return MeanPressure(control.value * share) if isinstance(control, MeanPressure) else control


def _bury(heights: Array, tiles: Tiles, deep: float) -> None:
    """Put points of tiles beyond the end of the grid so deep that they do not touch."""
    nx, ny = tiles.points
    places = np.arange(SIDE)
    beyond_x = tiles.columns[:, None] * SIDE + places >= nx
    beyond_y = tiles.rows[:, None] * SIDE + places >= ny
    heights.reshape(-1, SIDE, SIDE)[beyond_y[:, :, None] | beyond_x[:, None, :]] = deep


def _parts(slab: Slab, tiles: Tiles) -> list[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """For each tile, where this rank's part of it is in the stacked map and in that of its rows."""
    parts = []
    for number, (row, column) in enumerate(zip(tiles.rows.tolist(), tiles.columns.tolist(), strict=True)):
        top, left = row * SIDE, column * SIDE
        start = max(top, slab.rows.start)
        stop = max(min(top + SIDE, slab.rows.stop), start)
        right = min(left + SIDE, slab.nx)
        first = number * SIDE - top
        there = slice(first + start, first + stop), slice(0, right - left)
        here = slice(start - slab.rows.start, stop - slab.rows.start), slice(left, right)
        parts.append((there, here))
    return parts


def _stacked(slab: Slab, tiles: Tiles, field: Array) -> Array | None:
    """The stacked map of tiles on root, 0 beyond the end of the grid; None on other ranks; collective."""
    own = allocate(tiles.shape, np.float64, slab.tally)
    own.fill(0.0)
    for there, here in _parts(slab, tiles):
        own[there] = field[here]
    if slab.comm.size == 1:
        return own
    whole = allocate(tiles.shape, np.float64, slab.tally) if slab.root else None
    slab.comm.Reduce(own, whole)
    return whole


def _unstack(slab: Slab, tiles: Tiles, stacked: Array, field: Array) -> None:
    """Put a stacked map that all ranks have into the rows of this one, 0 outside the tiles."""
    field.fill(0.0)
    for there, here in _parts(slab, tiles):
        field[here] = stacked[there]
