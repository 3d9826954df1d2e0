"""Further attempts after a failed contact solve: an operator in double precision, a cold start on nested grids, and an
active set.

A solve that succeeds neither calls nor allocates anything here. The attempts depend on the failed solve alone, so
that all ranks make the same ones, and a repeated run repeats them.
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
    """Repeat a failed solve in other ways until one succeeds; collective. Return the last contact and the names of the
    attempts.

    `solver_on(slab, tolerance)` makes a solver and operators of the body on another grid; `in_double()` makes those
    in double precision, and is None if the problem has them. `most` limits the number of attempts. Each is counted
    as `retry`; `iterations` includes all attempts.
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
    contact = solver.solve(problem, p)
    yield "a cold start" if grids == 1 else f"a cold start on {grids} nested grids", contact
    if np.isfinite(contact.certificate.worst):
        yield "sets of points", active_set.solve(solver, problem, p)
