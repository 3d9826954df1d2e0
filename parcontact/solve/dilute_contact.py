"""A dilute contact in a free box, solved on the tiles that may touch: the cost follows the contact, not the box.

The contact on a coarser grid gives a pressure p on a grid of blocks, and p gives the displacement u there. A block
can touch only if

    u - max(h) - d < MARGIN L,

with L the length by which u varies within the contact (`certificate.Certificate`). Tiles with such blocks, with
blocks under pressure, or with neighbours of these are stacked to one map. There `contact.ContactSolver` solves the
same problem with operators on tiles (`physics.tile_operator`). These also give the displacement at all points of the
grid, so that `contact.ContactSolver.check` can check the pressure everywhere. For tolerances below FINEST, or if the
check fails, the operator of the whole grid checks the pressure, and the solve continues on the whole grid. Root
solves and sends the result to all ranks.
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

MARGIN = 0.1  # tuning: gap up to which a block may touch, over L
LARGEST_SHARE = 0.25  # tuning: largest share of the points of a grid that is solved on tiles
BLOCKS = 256  # largest number of blocks along the longer side, unless there are more tiles
LARGER_CELLS = Grids(2)  # tuning: grids of larger cells on tiles; larger cells would mix tiles far from each other
SHARE = 0.5  # tolerance of a solve on tiles over that of the solve on the whole grid
LEAST = 1e-7  # accuracy: least tolerance on tiles, set by the rounding of their operators
FINEST = 1e-5  # accuracy: least tolerance that operators on tiles can check; their error is 2e-7

# makes a solver, the operator and a preconditioner from tiles and a tolerance
SolverOnTiles = Callable[[Tiles, float], tuple[ContactSolver, TileOperator, TileConvolution]]


@dataclass(frozen=True)
class Found:
    """Contact on a grid: pressure on the rows of this rank, approach, and the length L of its certificate."""

    slab: Slab
    p: Array
    d: float
    length: float


def is_block_grid(slab: Slab, finest: Slab) -> bool:
    """Return whether a grid is coarse enough for blocks, each within one tile of the finest grid."""
    longest = max(slab.nx, slab.ny)
    return longest <= max(BLOCKS, max(finest.nx, finest.ny) // SIDE)


def choose_tiles(
    blocks: Slab, operators: Operators, below: Found, slab: Slab, heights: Array, constraint: Constraint
) -> Tiles | None:
    """Return the tiles of a grid that may touch, given the contact `below` on the next coarser grid; collective. Return
    None if there are none, or if they have more than LARGEST_SHARE of the points."""
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
    """Return the tiles of a grid that hold selected blocks or their neighbours; collective."""
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
    """A problem on tiles of a grid, and its solution. Only root has the operators."""

    def __init__(self, tiles: Tiles, solver_on: SolverOnTiles, problem: Problem, slab: Slab, height: float) -> None:
        self._tiles, self._solver_on, self._problem, self._slab = tiles, solver_on, problem, slab
        self._height = height
        self._operator: TileOperator | None = None
        self._stacked: Array = np.empty(0)

    def solve(self, tolerance: float, p: Array) -> Found:
        """Solve from the pressure p, which is overwritten by the solution; collective."""
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
        """Return the contact of the solution p if it satisfies the solver's tolerance at all points, else None;
        collective. Below the tolerance FINEST it is None, too: the operator of the whole grid is needed to check p."""
        if solver.tolerance < FINEST:
            return None
        self._displace(solver.workspace.displacement)
        contact = solver.check(replace(self._problem, operator=_Displaced()), p, "fails next to the tiles")
        return contact if contact.converged else None

    def _displace(self, u: Array) -> None:
        """Put the displacement of the solution into u; collective."""
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
    """Operator for a map that already holds the displacement."""

    def apply(self, _: Array, out: Array) -> Array:
        return out


def _on_part(control: Control, share: float) -> Control:
    """Return the control for the same load on a grid with `share` times the points."""
    return MeanPressure(control.value * share) if isinstance(control, MeanPressure) else control


def _bury(heights: Array, tiles: Tiles, deep: float) -> None:
    """Put points of tiles beyond the end of the grid at the height `deep`, so that they do not touch."""
    nx, ny = tiles.points
    places = np.arange(SIDE)
    beyond_x = tiles.columns[:, None] * SIDE + places >= nx
    beyond_y = tiles.rows[:, None] * SIDE + places >= ny
    heights.reshape(-1, SIDE, SIDE)[beyond_y[:, :, None] | beyond_x[:, None, :]] = deep


def _parts(slab: Slab, tiles: Tiles) -> list[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Return, for each tile, the slices of the rows of this rank in the stacked map and in the map of the slab."""
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
    """Return the stacked map of tiles on root, 0 beyond the end of the grid, and None on other ranks; collective."""
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
    """Copy the rows of this rank from a stacked map that all ranks have; 0 outside the tiles."""
    field.fill(0.0)
    for there, here in _parts(slab, tiles):
        field[here] = stacked[there]
