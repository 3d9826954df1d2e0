"""A failed solve is tried again, and only then."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.contact import ContactSolver
from parcontact.solve.fallback import retry
from parcontact.solve.fallback.cold_start import start_on_coarse_grids
from parcontact.solve.problem import Approach, MeanPressure, Operators
from parcontact.solve.workspace import Workspace

from ..bodies import Bench, Map, rough, solver

LOAD = MeanPressure(0.4)


def factory(height: float, **options: Any) -> Callable[[Slab, float], tuple[ContactSolver, Operators]]:
    """Solvers of one body on any grid, and its operators."""

    def on(slab: Slab, tolerance: float) -> tuple[ContactSolver, Operators]:
        fft = FFT(slab, measured=False)
        half_space = HalfSpace((1.0, 1.0))
        operators = Operators(half_space.operator(fft), half_space.inverse(fft))
        return ContactSolver(Workspace(slab, tolerance), height, tolerance, 500, **options), operators

    return on


def failed_and_again(h: Map, control: MeanPressure | Approach = LOAD, **options: Any) -> tuple[Bench, Any, Any]:
    """A solver after a solve that failed and its retry: the solver, the first contact, what came of the second."""
    body = solver(h, **options)
    first = body.solve(h, control, np.zeros_like(h))
    assert first.failure
    return body, first, retry.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))


@pytest.mark.parametrize(("control", "bad"), [(LOAD, np.inf), (Approach(-0.02), np.inf), (Approach(-0.02), np.nan)])
def test_a_start_that_is_not_finite(control: MeanPressure | Approach, bad: float) -> None:
    """The nested start knows nothing of it: the contact is that of a good start, to the tolerance."""
    h = rough(128)
    body, good = solver(h, tolerance=1e-9), solver(h, tolerance=1e-9)
    start = np.zeros_like(h)
    start[3, 4] = bad
    with np.errstate(invalid="ignore"):
        first = body.solve(h, control, start)
        contact, tried = retry.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))
    expected = good.solve(h, control, np.zeros_like(h))
    assert "not finite" in first.failure
    assert tried == ["a cold start on 3 nested grids"]
    assert contact.converged
    assert_allclose(contact.p, expected.p, atol=1e-7 * expected.p.max())


def test_a_nested_start_saves_iterations() -> None:
    """On the finest grid; so it helps where a cold start runs out of them."""
    h = rough(256)
    cold = solver(h).solve(h, LOAD, np.zeros_like(h)).iterations
    body = solver(h)
    start = np.zeros_like(h)
    assert start_on_coarse_grids(body.solver, body.problem(h, LOAD), start, factory(np.ptp(h))) == (4, None)
    assert 0 < body.slab.tally["operator"] <= 10  # all coarse grids cost no more than so many calls on the finest one
    assert body.solve(h, LOAD, start).iterations <= 0.8 * cold


def test_everything_is_tried_before_giving_up() -> None:
    h = rough(64)
    _, _, (contact, tried) = failed_and_again(h, max_iterations=2, tolerance=1e-12)
    nested = "a cold start on 2 nested grids"
    assert tried == [nested, "sets of points"]
    assert contact.failure == "found no contact among 4 sets of points in 4 times max_iterations = 8"
    assert contact.iterations == (2 + 4) * 2


def test_heights_that_are_not_finite_cannot_be_helped() -> None:
    h = rough(64)
    body = solver(h)
    h[0, 0] = np.nan
    with np.errstate(invalid="ignore"):
        contact, tried = retry.retry_solve(
            body.solver, body.problem(h, LOAD), body.solve(h, LOAD, np.zeros_like(h)), factory(1.0)
        )
    assert "not finite" in contact.failure
    assert len(tried) == 1


@pytest.mark.parametrize("control", [LOAD, Approach(-0.02)])
@pytest.mark.parametrize("shape", [(1, 64), (37, 41), (6, 128)])
def test_grids_that_cannot_be_halved(shape: tuple[int, int], control: MeanPressure | Approach) -> None:
    """Along a direction of few or odd points they stay as they are."""
    h = np.random.default_rng(1).standard_normal(shape)
    body = solver(h, tolerance=1e-9)
    with np.errstate(invalid="ignore"):
        first = body.solve(h, control, np.full_like(h, np.inf))
        contact, tried = retry.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))
    assert contact.converged
    grids = {37: 1, 1: 2, 6: 3}[shape[0]]
    assert tried == ["a cold start" if grids == 1 else f"a cold start on {grids} nested grids"]


@pytest.mark.mpi
def test_all_ranks_agree(comm: MPI.Intracomm) -> None:
    """On any number of ranks the retry finds the contact of one rank; ranks without rows of a coarse grid take part."""
    whole = rough(64)
    slab = Slab(comm, 64, 64)
    h = whole[slab.rows].copy()
    solving, operators = factory(np.ptp(whole))(slab, 1e-9)
    body = Bench(solving, *operators)
    with np.errstate(invalid="ignore"):
        first = body.solve(h, LOAD, np.full_like(h, np.inf))
        contact, _ = retry.retry_solve(body.solver, body.problem(h, LOAD), first, factory(np.ptp(whole)))
    alone = solver(whole, tolerance=1e-9).solve(whole, LOAD, np.zeros_like(whole))
    assert contact.converged
    assert_allclose(contact.p, alone.p[slab.rows], atol=1e-7 * alone.p.max())
    assert comm.allgather(contact.iterations) == [contact.iterations] * comm.size


def test_an_operator_in_double_precision() -> None:
    """It starts from nothing where the failed solve has left no numbers, and what is tried after it goes on with it."""
    h, approach = rough(128), Approach(-0.02)
    body, enough = solver(h), solver(h).solve(h, approach, np.zeros_like(h)).iterations
    first = body.solve(h, approach, np.full_like(h, np.nan))
    double, before = solver(h, max_iterations=enough - 1), body.slab.tally["operator"]
    contact, tried = retry.retry_solve(
        body.solver, body.problem(h, approach), first, factory(np.ptp(h)), lambda: (double.solver, double.operators)
    )
    assert not np.isfinite(first.certificate.worst)
    assert contact.converged
    assert tried == ["an operator in double precision", "a cold start on 3 nested grids"]
    assert contact.u is double.solve(h, approach, contact.p).u
    assert body.slab.tally["operator"] == before
