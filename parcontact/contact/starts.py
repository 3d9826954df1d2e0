"""Starts of a contact solve, and further attempts after a failed one.

A solve without a guess starts from coarser grids: the contact is solved loosely on the coarsest grid first, and each
solution is the start on the next finer grid. The coarse pressure is the same in all fine cells of a coarse cell, so
that no point far from contact gets pressure.

A dilute contact in a free box is solved on the tiles that may touch, so that the cost follows the contact, not the box.
The contact on a coarser grid gives a pressure p on a grid of blocks, and p gives the displacement u there. A block can
touch only if

    u - max(h) - d < MARGIN L,

with L the standard deviation of u in the contact (`records.Certificate`). A tile of 32 x 32 points is chosen if it
contains a block that can touch or that is under pressure, or a neighbour of such a block. The chosen tiles are stacked
to one map. On this map `ContactSolver` solves the same problem with operators on tiles (`physics.convolution`). These
operators also give the displacement at all points of the grid, so that `ContactSolver.check` can check the pressure
everywhere. For tolerances below FINEST, the least that operators on tiles can check, or if the check fails, the
operator of the whole grid checks the pressure, and the solve continues on the whole grid. Root solves on the tiles and
sends the result to all ranks.

A failed solve is repeated with an operator in double precision, from a cold start on nested grids, and by an active set
(`solve_by_sets`). These attempts cost nothing while solves succeed. The attempts depend on the failed solve alone, so
that all ranks make the same attempts, and a repeated run repeats them.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..parallel import regrid
from ..parallel.root import on_root
from ..parallel.slab import Array, Slab, allocate
from ..physics import loops
from ..physics.convolution import SIDE, TileConvolution, TileOperator, Tiles, tiles_along
from . import kernels
from .preconditioner import Grids
from .problem import Box, Contact, Control, MeanPressure, Operators, Problem
from .solver import ContactSolver


@dataclass(frozen=True)
class Level:
    """One grid of a sequence from fine to coarse: the part of the grid on this rank (`slab`), and the heights there."""

    slab: Slab
    heights: Array


def coarser_levels(slab: Slab, heights: Array) -> list[Level]:
    """Return the levels of a solve: the grid itself, with `heights`, and all coarser grids, the finest first;
    collective."""
    levels = [Level(slab, heights)]
    while (coarse := regrid.coarser(levels[-1].slab)) is not None:
        levels.append(Level(coarse, regrid.restrict(levels[-1].slab, coarse, levels[-1].heights)))
    return levels


class OnGrid(Protocol):
    """An object with the part of a grid on this rank (`slab`), such as a level in `descend`."""

    @property
    def slab(self) -> Slab: ...


L = TypeVar("L", bound=OnGrid)


def descend(levels: Sequence[L], solve: Callable[[L, Array], Array], start: Array) -> None:
    """Solve all `levels` but the finest, the coarsest first, and put a start for the finest level into `start`;
    collective. `levels` begin with the finest.

    `solve(level, map)` returns the pressure on a level, solved from the start in `map`. The next finer level starts
    from this pressure. A level starts from 0 if there is no coarser level or if the coarser pressure is not finite.
    """
    below: tuple[L, Array] | None = None
    for level in reversed(levels):
        here = start if level is levels[0] else level.slab.empty(start.dtype)
        here.fill(0.0)
        if below is not None and _is_finite(below[0].slab, below[1]):
            regrid.prolong(below[0].slab, level.slab, below[1], here)
        if level is not levels[0]:
            below = level, solve(level, here)


def _is_finite(slab: Slab, p: Array) -> bool:
    return slab.sum(float(not np.all(np.isfinite(p))))[0] == 0.0


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
    """Contact found on a grid: pressure on the rows of this rank, approach, and the reference length of its gaps."""

    slab: Slab
    p: Array
    d: float
    length: float


def is_block_grid(slab: Slab, finest: Slab) -> bool:
    """Return True if a grid is so coarse that its points serve as blocks, which may touch or not: its longer side has
    at most BLOCKS points, or at most as many points as the longer side of the `finest` grid has tiles."""
    longest = max(slab.nx, slab.ny)
    return longest <= max(BLOCKS, max(finest.nx, finest.ny) // SIDE)


def choose_tiles(
    blocks: Slab, operators: Operators, below: Found, slab: Slab, heights: Array, box: Box
) -> Tiles | None:
    """Return the squares of a grid (tiles) that may touch; None if no tile may touch, or if the tiles hold more than
    LARGEST_SHARE of the points. Collective.

    `slab` is the part of the grid on this rank, with its `heights`, and `below` is the contact on the next coarser
    grid. `blocks` is the part on this rank of a still coarser grid, whose points are the blocks that may touch or not.
    The `operators` of the body belong to that grid. `box` bounds the pressure.
    """
    most = LARGEST_SHARE * slab.points / SIDE**2
    p = below.p if below.slab is blocks else regrid.restrict(below.slab, blocks, below.p)
    touching = box.touches(p) != 0.0
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
    """A contact problem on some squares of a grid, the tiles. Its methods solve the problem and check the solution.
    Only root has the operators on the tiles."""

    def __init__(self, tiles: Tiles, solver_on: SolverOnTiles, problem: Problem, slab: Slab, height: float) -> None:
        self._tiles, self._solver_on, self._problem, self._slab = tiles, solver_on, problem, slab
        self._height = height
        self._operator: TileOperator | None = None
        self._stacked: Array = np.empty(0)

    def solve(self, tolerance: float, p: Array) -> Found:
        """Solve the contact on the tiles from the pressure p, which is overwritten by the solution; collective."""
        slab, tiles, problem = self._slab, self._tiles, self._problem
        lowest = -slab.reduce((), [-float(problem.heights.min(initial=np.inf))])[0]
        heights, start = (_stacked(slab, tiles, each) for each in (problem.heights, p))

        def act() -> tuple[Array, float, float]:
            assert heights is not None
            assert start is not None
            _bury(heights, tiles, lowest - self._height)
            solver, self._operator, inverse = self._solver_on(tiles, tolerance)
            control = _on_part(problem.control, slab.points / solver.slab.points)
            there = Problem(self._operator, inverse, heights, problem.constraint, control)
            contact = solver.solve(there, start, cold=True)
            return contact.p, contact.d, contact.certificate.length

        self._stacked, d, length = on_root(slab.comm, act)
        _unstack(slab, tiles, self._stacked, p)
        return Found(slab, p, d, length)

    def check(self, solver: ContactSolver, p: Array) -> Contact | None:
        """Return the contact of the solution p if its errors over all points of the grid meet the tolerance of
        `solver`; else None. Collective.

        The displacement is computed by the operators on tiles. For tolerances below FINEST the result is therefore
        always None: p must be checked by the operator of the whole grid.
        """
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


LOOSE = 0.03  # tuning: tolerance on coarse grids, whose pressure is only a start
WORTHWHILE = 256 * 256  # tuning: least number of points for which coarser grids are worth their cost

SolverOn = Callable[[Slab, float], tuple[ContactSolver, Operators]]  # makes a solver on a slab with a tolerance


def prepare_start(
    solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn, on_tiles: SolverOnTiles | None = None
) -> Contact | None:
    """If the grid has at least WORTHWHILE points, replace `start`, a map of zeros, by a start from coarser grids;
    collective.

    `solver_on(slab, tolerance)` makes a solver and operators on a coarser grid. If `on_tiles` is given and the lower
    bound of p is 0, a dilute contact is solved on tiles to the tolerance of `solver`. This contact is returned if it
    meets the tolerance at all points; otherwise the result is None. An operator call on another grid or on tiles counts
    as the number of points there divided by the number of points of the grid of `solver`.
    """
    if solver.slab.points < WORTHWHILE:
        return None
    return start_on_coarse_grids(solver, problem, start, solver_on, on_tiles)[1]


def start_on_coarse_grids(
    solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn, on_tiles: SolverOnTiles | None = None
) -> tuple[int, Contact | None]:
    """Solve loosely on coarser grids and put the resulting start, or 0, into `start`; collective. Return the number of
    grids, and the contact if it was solved on tiles and meets the tolerance at all points, else None."""
    levels = coarser_levels(solver.slab, problem.heights)
    descent = _Descent(solver, problem, solver_on, on_tiles)
    descend(levels, descent.solve, start)
    contact = descent.solve_finest(levels[0], start)
    descent.count()
    return len(levels), contact


class _Descent:
    """Descent from coarse grids to finer ones, on tiles of a grid as long as these are few."""

    def __init__(
        self, solver: ContactSolver, problem: Problem, solver_on: SolverOn, on_tiles: SolverOnTiles | None
    ) -> None:
        self._solver, self._problem, self._solver_on = solver, problem, solver_on
        self._on_tiles, self._tally = on_tiles if problem.constraint.lowest == 0.0 else None, solver.slab.tally
        self._cost, self._before = 0.0, self._tally["operator"]
        self._blocks: tuple[Slab, Operators] | None = None
        self._below: Found | None = None

    def solve(self, level: Level, p: Array) -> Array:
        """Solve loosely on a coarse level, starting from p."""
        if (chosen := self._tiles_of(level)) is not None:
            self._solve_on(chosen, level, max(LOOSE, self._solver.tolerance), p)
            return p
        calls = self._tally["operator"]
        coarse, operators = self._solver_on(level.slab, max(LOOSE, self._solver.tolerance))
        there = replace(self._problem, **operators._asdict(), heights=level.heights)
        contact = coarse.solve(there, p, cold=True)
        if self._on_tiles is not None:
            if is_block_grid(level.slab, self._solver.slab):
                self._blocks = level.slab, operators
            self._below = Found(level.slab, contact.p, contact.d, contact.certificate.length)
        self._add(calls, level.slab.points)
        return contact.p

    def solve_finest(self, level: Level, p: Array) -> Contact | None:
        """Solve on tiles of the finest grid, starting from p, if there are few tiles. Return the contact if it meets
        the tolerance at all points, else None."""
        if (chosen := self._tiles_of(level)) is None:
            return None
        solved = self._solve_on(chosen, level, max(SHARE * self._solver.tolerance, LEAST), p)
        calls = self._tally["operator"]
        contact = solved.check(self._solver, p)
        self._add(calls, level.slab.points)
        return contact

    def count(self) -> None:
        """Put the operator calls of all levels into the count of the run. A call on a level counts as the number of its
        points divided by the number of points of the finest grid."""
        self._tally["operator"] = self._before + round(self._cost)

    def _tiles_of(self, level: Level) -> Tiles | None:
        """Return the tiles of a level that may touch, if they are few."""
        if self._below is None or self._blocks is None or is_block_grid(level.slab, self._solver.slab):
            return None
        below, law = (*self._blocks, self._below), self._problem.constraint
        return choose_tiles(*below, level.slab, level.heights, law)

    def _solve_on(self, chosen: Tiles, level: Level, tolerance: float, p: Array) -> OnTheseTiles:
        """Solve on tiles of a level, starting from p."""
        assert self._on_tiles is not None
        calls, there = self._tally["operator"], replace(self._problem, heights=level.heights)
        solved = OnTheseTiles(chosen, self._on_tiles, there, level.slab, self._solver.height)
        self._below = solved.solve(tolerance, p)
        self._add(calls, chosen.count * SIDE**2)
        return solved

    def _add(self, calls: int, points: int) -> None:
        """Add the operator calls since the count `calls`, by their share of the points."""
        self._cost += (self._tally["operator"] - calls) * points / self._solver.slab.points


MAX_SETS = 40  # tuning: limit on the number of sets
ITERATIONS_RATIO = 4  # tuning: limit on iterations of all sets, over max_iterations
GAP_SHARE = 0.1  # tuning: largest gap on a set to which its linear problem is solved, over the tolerance


def solve_by_sets(solver: ContactSolver, problem: Problem, start: Array) -> Contact:
    """Solve the same problem as `ContactSolver.solve`, by a primal-dual active set, for a load that is not 0;
    collective.

    On a known set of points the contact is the linear problem `A x = h + d`, where x is at one of its bounds at all
    other points. This problem is solved by preconditioned conjugate gradients. Then points where x is not admissible
    leave the set, and points whose gap violates its condition enter the set (M. Hintermueller, K. Ito and K. Kunisch,
    SIAM J. Optim. 13 (2003) 865). A few sets are usual, but sets may cycle. `ContactSolver.solve`, which changes its
    set in every step, is cheaper where it works, but slow where the preconditioner is far from an inverse, as on cells
    much longer than wide. `iterations` of the contact counts iterations of the linear problems.
    """
    search = _Search(solver, problem, start)
    contact, iterations = solver.check(problem, start, ""), 0
    search.begin(contact)
    for count in range(1, MAX_SETS + 1):
        iterations += search.solve_on_set(contact.u, GAP_SHARE * solver.tolerance * contact.certificate.length)
        chosen = search.next_set(contact.u)
        problem.constraint.project(start)
        limit = ITERATIONS_RATIO * solver.max_iterations
        spent = f" in {ITERATIONS_RATIO} times max_iterations = {limit}" if iterations >= limit else ""
        contact = solver.check(problem, start, f"found no contact among {count} sets of points{spent}")
        if contact.converged or spent or not np.isfinite(contact.certificate.worst):
            break
        search.working = chosen
    return replace(contact, iterations=iterations)


class _Search:
    """Pressure x on the set `working`. The direction, the residual and images are in maps of the workspace."""

    def __init__(self, solver: ContactSolver, problem: Problem, x: Array) -> None:
        self.solver, self.problem, self.h, self.slab, self.x = solver, problem, problem.heights, solver.slab, x
        self.load = None if problem.control.mean is None else problem.control.mean * self.slab.points
        self.d = 0.0 if self.load is not None else problem.control.value
        self.working = np.zeros(x.shape, np.bool_)
        self.members = 0.0

    def begin(self, contact: Contact) -> None:
        """Mark the first set: points in contact and points that penetrate. If these are all points under a given
        approach, for which there may be no solution, mark the points that would penetrate the undeformed body."""
        box = self.problem.constraint
        kernels.mark_working_set(self.x, contact.u, self.h, contact.d, box.lowest, box.highest, self.working)
        if self.load is None and self.slab.sum(float(np.count_nonzero(self.working)))[0] == self.slab.points:
            self.working[...] = self.h + self.d > 0.0

    def solve_on_set(self, u: Array, goal: float) -> int:
        """Make conjugate gradient steps on the set until no gap exceeds `goal`; update `u = A x`. Return the number of
        steps."""
        problem, maps, slab, x, working = self.problem, self.solver.workspace, self.slab, self.x, self.working
        w, r, t = maps.pressure, maps.other_displacement, maps.direction
        product = 0.0
        self._restrict(u)
        t.fill(0.0)
        iterations = 0
        while self._residual(u, r) > goal and iterations < self.solver.max_iterations:
            z = problem.preconditioner.apply(r, w)
            sum_z, sum_t, _, r_z, _, _ = slab.sum(*kernels.step_products(working, u, self.h, self.d, u, z, t))
            beta, product = r_z / product if product > 0.0 else 0.0, r_z
            mean = (sum_z + beta * sum_t) / self.members if self.load is not None else 0.0
            kernels.turn(working, z, beta, mean, t)
            change = problem.operator.apply(t, w)
            slope, curvature = slab.sum(loops.dot(r, t), loops.dot(t, change))
            if not (slope > 0.0 and curvature > 0.0):
                break
            step = np.float64(slope / curvature)  # a double, so that products with t are not rounded
            x -= step * t
            u -= step * change
            iterations += 1
        return iterations

    def next_set(self, u: Array) -> NDArray[np.bool_]:
        """Return the next set: free points of the set, and other points whose gap violates its condition."""
        x, gap, box = self.x, u - self.h - self.d, self.problem.constraint
        free, below = (x > box.lowest) & (x < box.highest), x < box.highest
        return np.where(self.working, free, np.where(below, gap < 0.0, gap > 0.0))

    # -- parts ---------------------------------------------------------------------------------------------------------

    def _restrict(self, u: Array) -> None:
        """Put x to a bound outside the set, and make up for a given load on the set; update `u = A x`."""
        x, working = self.x, self.working
        box = self.problem.constraint
        x[...] = np.where(working, x, np.where(x < box.highest, box.lowest, box.highest))
        self.members, total = self.slab.sum(float(np.count_nonzero(working)), kernels.sum_of(x))
        if self.load is not None and self.members:
            x += (self.load - total) / self.members * working
        self.problem.operator.apply(x, u)

    def _residual(self, u: Array, r: Array) -> float:
        """Put the gap on the set into r, with the d at which its mean is 0 unless d is given. Return its largest
        magnitude."""
        if self.load is not None and self.members:
            self.d = self.slab.sum(float(np.sum((u - self.h) * self.working)))[0] / self.members
        kernels.gap_residual(self.working, u, self.h, self.d, r)
        return self.slab.reduce((), [float(np.abs(r).max(initial=0.0))])[0]


def retry_solve(
    solver: ContactSolver,
    problem: Problem,
    failed: Contact,
    solver_on: SolverOn,
    in_double: Callable[[], tuple[ContactSolver, Operators]] | None = None,
    most: int | None = None,
) -> tuple[Contact, list[str]]:
    """Repeat a failed solve in other ways until one succeeds; collective. Return the last contact and the names of the
    attempts.

    `solver_on(slab, tolerance)` makes a solver and operators of the body on another grid. `in_double()` makes a solver
    and operators in double precision; `in_double` is None if the problem already has them. `most` limits the number of
    attempts. The tally counts each attempt as `retry`. `iterations` of the returned contact includes the failed solve
    and all attempts.
    """
    contact, tried, iterations = failed, list[str](), failed.iterations
    for name, contact in islice(_attempts(solver, problem, failed, solver_on, in_double), most):
        solver.slab.tally["retry"] += 1
        tried.append(name)
        iterations += contact.iterations
        if contact.converged:
            break
    return replace(contact, iterations=iterations), tried


def _attempts(
    solver: ContactSolver,
    problem: Problem,
    failed: Contact,
    solver_on: SolverOn,
    in_double: Callable[[], tuple[ContactSolver, Operators]] | None,
) -> Iterator[tuple[str, Contact]]:
    """Yield the name and the contact of each attempt, made on demand, in the map of the failed one."""
    p, contact = failed.p, failed
    if in_double is not None:
        if not np.isfinite(failed.certificate.worst):
            p.fill(0.0)
        solver, (operator, preconditioner) = in_double()
        problem = replace(problem, operator=operator, preconditioner=preconditioner)
        contact = solver.solve(problem, p)
        yield "an operator in double precision", contact
    grids, _ = start_on_coarse_grids(solver, problem, p, solver_on)
    contact = solver.solve(problem, p, cold=True)
    yield "a cold start" if grids == 1 else f"a cold start on {grids} nested grids", contact
    if np.isfinite(contact.certificate.worst):
        yield "sets of points", solve_by_sets(solver, problem, p)
