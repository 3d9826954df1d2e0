"""A start without a guess: the contact is solved loosely on coarser grids first.

The coarse pressure is the same in all fine cells of a coarse one, so that no point far from contact gets pressure.
"""

from collections.abc import Callable
from dataclasses import replace

from ...parallel.slab import Array, Slab
from ...physics.tiles import SIDE, Tiles
from .. import dilute_contact, nested
from ..contact import Contact, ContactSolver
from ..dilute_contact import SolverOnTiles
from ..problem import Operators, Problem

LOOSE = 0.03  # tuning: tolerance on coarse grids, whose pressure is only a start
WORTHWHILE = 256 * 256  # tuning: least number of points for which coarser grids are worth their cost

SolverOn = Callable[[Slab, float], tuple[ContactSolver, Operators]]  # makes a solver on a slab with a tolerance


def prepare_start(
    solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn, on_tiles: SolverOnTiles | None = None
) -> Contact | None:
    """Put a start into `start`, which is 0, on a grid of at least WORTHWHILE points; collective.

    Operator calls on other grids and on tiles are counted by their share of the points. With operators `on_tiles` a
    dilute contact is solved on these, to the solver's tolerance on the finest grid, and returned if it satisfies the
    tolerance at all points. The constraint must then admit a pressure of 0.
    """
    if solver.slab.points < WORTHWHILE:
        return None
    return start_on_coarse_grids(solver, problem, start, solver_on, on_tiles)[1]


def start_on_coarse_grids(
    solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn, on_tiles: SolverOnTiles | None = None
) -> tuple[int, Contact | None]:
    """Solve loosely on coarser grids and put the resulting start into `start`, 0 if there is none; collective. Return
    the number of grids, and the contact if it was solved on tiles and satisfies the tolerance at all points."""
    levels = nested.coarser_levels(solver.slab, problem.heights)
    descent = _Descent(solver, problem, solver_on, on_tiles)
    nested.descend(levels, descent.solve, start)
    contact = descent.solve_finest(levels[0], start)
    descent.count()
    return len(levels), contact


class _Descent:
    """Descent from coarse grids to finer ones, on tiles of a grid as long as these are few."""

    def __init__(
        self, solver: ContactSolver, problem: Problem, solver_on: SolverOn, on_tiles: SolverOnTiles | None
    ) -> None:
        self._solver, self._problem, self._solver_on = solver, problem, solver_on
        self._on_tiles, self._tally = on_tiles if problem.constraint.bounds[0] == 0.0 else None, solver.slab.tally
        self._cost, self._before = 0.0, self._tally["operator"]
        self._blocks: tuple[Slab, Operators] | None = None
        self._below: dilute_contact.Found | None = None

    def solve(self, level: nested.Level, p: Array) -> Array:
        """Solve loosely on a coarse level, starting from p."""
        if (chosen := self._tiles_of(level)) is not None:
            self._solve_on(chosen, level, max(LOOSE, self._solver.tolerance), p)
            return p
        calls = self._tally["operator"]
        coarse, operators = self._solver_on(level.slab, max(LOOSE, self._solver.tolerance))
        contact = coarse.solve(replace(self._problem, **operators._asdict(), heights=level.heights), p)
        if self._on_tiles is not None:
            if dilute_contact.is_block_grid(level.slab, self._solver.slab):
                self._blocks = level.slab, operators
            self._below = dilute_contact.Found(level.slab, contact.p, contact.d, contact.certificate.length)
        self._add(calls, level.slab.points)
        return contact.p

    def solve_finest(self, level: nested.Level, p: Array) -> Contact | None:
        """Solve on tiles of the finest grid, starting from p, if these are few. Return the contact if it satisfies the
        tolerance at all points."""
        if (chosen := self._tiles_of(level)) is None:
            return None
        solved = self._solve_on(
            chosen, level, max(dilute_contact.SHARE * self._solver.tolerance, dilute_contact.LEAST), p
        )
        calls = self._tally["operator"]
        contact = solved.check(self._solver, p)
        self._add(calls, level.slab.points)
        return contact

    def count(self) -> None:
        """Count the operator calls of all levels by their share of the points."""
        self._tally["operator"] = self._before + round(self._cost)

    def _tiles_of(self, level: nested.Level) -> Tiles | None:
        """Return the tiles of a level that may touch, if they are few."""
        if self._below is None or self._blocks is None or dilute_contact.is_block_grid(level.slab, self._solver.slab):
            return None
        below, law = (*self._blocks, self._below), self._problem.constraint
        return dilute_contact.choose_tiles(*below, level.slab, level.heights, law)

    def _solve_on(self, chosen: Tiles, level: nested.Level, tolerance: float, p: Array) -> dilute_contact.OnTheseTiles:
        """Solve on tiles of a level, starting from p."""
        assert self._on_tiles is not None
        calls, there = self._tally["operator"], replace(self._problem, heights=level.heights)
        solved = dilute_contact.OnTheseTiles(chosen, self._on_tiles, there, level.slab, self._solver.height)
        self._below = solved.solve(tolerance, p)
        self._add(calls, chosen.count * SIDE**2)
        return solved

    def _add(self, calls: int, points: int) -> None:
        """Add the operator calls since the count `calls`, by their share of the points."""
        self._cost += (self._tally["operator"] - calls) * points / self._solver.slab.points
