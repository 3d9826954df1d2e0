"""Further attempts when a contact solve has failed: an operator in double precision, if it was not, a cold start on
nested grids, and guesses of where contact is.

Nothing here is made or called for a solve that succeeds. What is tried depends on the failed solve alone, so that all
ranks try the same, and a run that is repeated tries it again.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from ..contact import Contact, ContactSolver
from ..problem import Operators, Problem
from . import active_set
from .cold_start import SolverOn, start_on_coarse_grids


def retry_solve(
    solver: ContactSolver,
    problem: Problem,
    failed: Contact,
    solver_on: SolverOn,
    in_double: Callable[[], tuple[ContactSolver, Operators]] | None = None,
    most: int | None = None,
) -> tuple[Contact, list[str]]:
    """Try a failed solve again until it succeeds or nothing is left to try; the last contact, and what was tried.

    `solver_on(slab, tolerance)` makes a solver of the same body on another grid, and its operators; `in_double()` those
    in double precision, where those of the problem are not; there are at most so many attempts. Every attempt is
    counted as `retry`; iterations are those of all attempts. Collective.
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
    """One attempt after the other, each made when it is asked for, all in the map of the failed one."""
    p, contact = failed.p, failed
    if in_double is not None:
        if not np.isfinite(failed.certificate.worst):
            p.fill(0.0)
        solver, (operator, preconditioner) = in_double()
        problem = replace(problem, operator=operator, preconditioner=preconditioner)
        contact = solver.solve(problem, p)
        yield "an operator in double precision", contact
    grids, _ = start_on_coarse_grids(solver, problem, p, solver_on)
    contact = solver.solve(problem, p)
    yield "a cold start" if grids == 1 else f"a cold start on {grids} nested grids", contact
    if np.isfinite(contact.certificate.worst):
        yield "sets of points", active_set.solve(solver, problem, p)
