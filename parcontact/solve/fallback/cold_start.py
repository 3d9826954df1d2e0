"""A start from nothing: the contact is found loosely on coarser grids first.

Their pressure is the same in all fine cells of a coarse one, so that no point far from contact gets any. On the finest
grid that saves a third of the iterations to a gap of 1e-4 of the height, and all coarser grids together cost less than
three applications of the operator there.
"""

from collections.abc import Callable

from ...parallel.slab import Array, Slab
from .. import nested
from ..contact import Approach, ContactSolver, MeanPressure

LOOSE = 0.03  # tolerance on the coarse grids, whose pressure is only a start
WORTHWHILE = 256 * 256  # points: on fewer, making coarser grids takes longer than what they save

Control = MeanPressure | Approach
SolverOn = Callable[[Slab, float], ContactSolver]


def prepare(solver: ContactSolver, h: Array, control: Control, start: Array, solver_on: SolverOn) -> None:
    """On a large grid put a start into `start`, which is 0, for a body that nothing has been pressed into; collective.

    `solver_on(slab, tolerance)` makes a solver of the same body on another grid, whose operator calls are counted by
    its share of the points.
    """
    if solver.slab.points >= WORTHWHILE:
        start_on_coarse_grids(solver, h, control, start, solver_on)


def start_on_coarse_grids(solver: ContactSolver, h: Array, control: Control, start: Array, solver_on: SolverOn) -> int:
    """Solve loosely on coarser grids and put the start that follows into `start`, 0 if there is none; returns how many
    grids there are; collective."""
    levels, tally, cost = nested.levels_of(solver.slab, h), solver.slab.tally, 0.0
    before = tally["operator"]

    def solve(level: nested.Level, below: Array) -> Array:
        nonlocal cost
        calls = tally["operator"]
        p = solver_on(level.slab, max(LOOSE, solver.tolerance)).solve(level.heights, control, below).p
        cost += (tally["operator"] - calls) * level.slab.points / solver.slab.points
        return p

    nested.descend(levels, solve, start)
    tally["operator"] = before + round(cost)
    return len(levels)
