"""A start from nothing: the contact is found loosely on coarser grids first.

Their pressure is the same in all fine cells of a coarse one, so that no point far from contact gets any. On the finest
grid that saves a third of the iterations to a gap of 1e-4 of the height, and all coarser grids together cost less than
three applications of the operator there.
"""

from collections.abc import Callable
from dataclasses import replace

from ...parallel.slab import Array, Slab
from .. import nested
from ..contact import ContactSolver
from ..problem import Operators, Problem

LOOSE = 0.03  # tuning: tolerance on the coarse grids, whose pressure is only a start
WORTHWHILE = 256 * 256  # tuning: points: on fewer, making coarser grids takes longer than what they save

SolverOn = Callable[[Slab, float], tuple[ContactSolver, Operators]]  # of the same body on a grid, with a tolerance


def prepare(solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn) -> None:
    """On a large grid put a start into `start`, which is 0, for a body that nothing has been pressed into; collective.

    Operator calls of solvers on other grids are counted by their share of the points.
    """
    if solver.slab.points >= WORTHWHILE:
        start_on_coarse_grids(solver, problem, start, solver_on)


def start_on_coarse_grids(solver: ContactSolver, problem: Problem, start: Array, solver_on: SolverOn) -> int:
    """Solve loosely on coarser grids and put the start that follows into `start`, 0 if there is none; returns how many
    grids there are; collective."""
    levels, tally, cost = nested.levels_of(solver.slab, problem.heights), solver.slab.tally, 0.0
    before = tally["operator"]

    def solve(level: nested.Level, below: Array) -> Array:
        nonlocal cost
        calls = tally["operator"]
        coarse, (operator, preconditioner) = solver_on(level.slab, max(LOOSE, solver.tolerance))
        there = replace(problem, operator=operator, preconditioner=preconditioner, heights=level.heights)
        p = coarse.solve(there, below).p
        cost += (tally["operator"] - calls) * level.slab.points / solver.slab.points
        return p

    nested.descend(levels, solve, start)
    tally["operator"] = before + round(cost)
    return len(levels)
