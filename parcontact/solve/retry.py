"""What is tried when a contact solve has failed: shorter steps from where it stands, a cold start on nested grids, and
guesses of where contact is.

Nothing here is made or called for a solve that succeeds. What is tried depends on the failed solve alone, so that all
ranks try the same, and a run that is repeated tries it again.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..parallel import regrid
from ..parallel.slab import Array, Slab
from . import active_set
from .contact import Approach, Contact, ContactSolver, MeanPressure

SHORT = 0.5  # length of a safeguarded step over the exact one
LOOSE = 1e-3  # tolerance on the coarse grids, whose pressure is only a start

Control = MeanPressure | Approach
SolverOn = Callable[[Slab, float], ContactSolver]


def again(
    solver: ContactSolver, h: Array, control: Control, failed: Contact, solver_on: SolverOn
) -> tuple[Contact, list[str]]:
    """Try a failed solve again until it succeeds or nothing is left to try; the last contact, and what was tried.

    `solver_on(slab, tolerance)` makes a solver of the same body on another grid. Every attempt is counted as `retry`;
    iterations are those of all attempts. Collective.
    """
    contact, tried, iterations = failed, list[str](), failed.iterations
    for name, contact in _attempts(solver, h, control, failed, solver_on):
        solver.slab.tally["retry"] += 1
        tried.append(name)
        iterations += contact.iterations
        if contact.converged:
            break
    return replace(contact, iterations=iterations), tried


def _attempts(
    solver: ContactSolver, h: Array, control: Control, failed: Contact, solver_on: SolverOn
) -> Iterator[tuple[str, Contact]]:
    """One attempt after the other, each made when it is asked for."""
    if np.isfinite(failed.certificate.worst):
        yield "shorter steps", solver.solve(h, control, SHORT)
    name = _nest(solver, h, control, solver_on)
    contact = solver.solve(h, control)
    yield name, contact
    if np.isfinite(contact.certificate.worst):
        yield "sets of points", active_set.solve(solver, h, control)


def _nest(solver: ContactSolver, h: Array, control: Control, solver_on: SolverOn) -> str:
    """Solve loosely on coarser grids, the coarsest first, and start from there; from nothing if there is none."""
    grids = [(solver.slab, h)]
    while (coarse := regrid.coarser(grids[-1][0])) is not None:
        fine, heights = grids[-1]
        grids.append((coarse, regrid.restrict(fine, coarse, heights)))
    below: ContactSolver | None = None
    for slab, heights in reversed(grids[1:]):
        here = solver_on(slab, max(LOOSE, solver.tolerance))
        _begin(here, below)
        here.solve(heights, control)
        below = here
    _begin(solver, below)
    return "a cold start" if below is None else f"a cold start on {len(grids)} nested grids"


def _begin(solver: ContactSolver, below: ContactSolver | None) -> None:
    """Start from the pressure on the next coarser grid if it is a number everywhere, else from none."""
    solver.p.fill(0.0)
    if below is not None and below.slab.sum(float(not np.all(np.isfinite(below.p))))[0] == 0.0:
        regrid.prolong(below.slab, solver.slab, below.p, solver.p)
