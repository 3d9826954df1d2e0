"""The way out for solves that crawl: against the projected method, and where that fails."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.contact import starts
from parcontact.contact.problem import Approach, Contact, MeanPressure, Operators, Workspace
from parcontact.contact.solver import ContactSolver
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace

from ..bodies import TIGHT, Bench, Map, keep, rough, solver


def found_by_sets(body: Bench, h: Any, control: MeanPressure | Approach, start: float = 0.0) -> Contact:
    return starts.solve_by_sets(body.solver, body.problem(h, control), np.full_like(h, start))


@pytest.mark.parametrize(("boundary", "kernel"), [("periodic", "spectral"), ("periodic", "love"), ("free", "love")])
@pytest.mark.parametrize("mean", [0.1, 0.5, 20.0])
def test_agrees_with_the_projected_method(boundary: str, kernel: str, mean: float) -> None:
    """Under a load, and at the approach that comes with it."""
    h = rough(64)
    options: Any = {"boundary": boundary, "kernel": kernel, "tolerance": TIGHT}
    expected = keep(solver(h, **options).solve(h, MeanPressure(mean), np.zeros_like(h)))
    controls: list[MeanPressure | Approach] = [MeanPressure(mean)]
    if np.count_nonzero(expected.p) < h.size or boundary == "free":
        controls.append(Approach(expected.d))
    for control in controls:
        found = found_by_sets(solver(h, **options), h, control)
        assert found.converged
        assert found.certificate.worst <= TIGHT
        assert_allclose(found.p, expected.p, rtol=0, atol=1e-9 * expected.p.max())
        assert_allclose(found.d, expected.d, rtol=0, atol=1e-9 * np.ptp(h))


def test_on_a_set_the_load_is_kept_and_the_gap_is_closed() -> None:
    """From a start with half of the load on the set, and as much outside: the load to rounding, the gap to what was
    asked for, nothing outside; in some ten conjugate directions, of which each would change the load by itself."""
    h, load = rough(64), MeanPressure(0.5)
    body = solver(h)
    x = np.full_like(h, 0.5)
    search = starts._Search(body.solver, body.problem(h, load), x)
    search.working = h > 0.5 * h.max()
    u = np.empty_like(h)
    assert 5 < search.solve_on_set(u, 1e-9) < 50
    assert_allclose(x.sum(), 0.5 * h.size, rtol=1e-13)
    assert_allclose((u - h)[search.working], search.d, rtol=0, atol=1.001e-9)
    assert np.all(x[~search.working] == 0.0)


def test_it_says_when_it_has_found_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(starts, "MAX_SETS", 1)
    h = rough(64)
    found = found_by_sets(solver(h), h, MeanPressure(0.1))
    assert found.failure == "found no contact among 1 sets of points"
    assert found.certificate.worst > 1e-6


# -- a failed solve is tried again, and only then ---------------------------------------------------------------------

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
    return body, first, starts.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))


@pytest.mark.parametrize(("control", "bad"), [(LOAD, np.inf), (Approach(-0.02), np.inf), (Approach(-0.02), np.nan)])
def test_a_start_that_is_not_finite(control: MeanPressure | Approach, bad: float) -> None:
    """The nested start knows nothing of it: the contact is that of a good start, to the tolerance."""
    h = rough(128)
    body, good = solver(h, tolerance=1e-9), solver(h, tolerance=1e-9)
    start = np.zeros_like(h)
    start[3, 4] = bad
    with np.errstate(invalid="ignore"):
        first = body.solve(h, control, start)
        contact, tried = starts.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))
    expected = good.solve(h, control, np.zeros_like(h))
    assert "not finite" in first.failure
    assert tried == ["a cold start on 3 nested grids"]
    assert contact.converged
    assert_allclose(contact.p, expected.p, atol=1e-7 * expected.p.max())


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
        contact, tried = starts.retry_solve(
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
        contact, tried = starts.retry_solve(body.solver, body.problem(h, control), first, factory(np.ptp(h)))
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
        contact, _ = starts.retry_solve(body.solver, body.problem(h, LOAD), first, factory(np.ptp(whole)))
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
    contact, tried = starts.retry_solve(
        body.solver, body.problem(h, approach), first, factory(np.ptp(h)), lambda: (double.solver, double.operators)
    )
    assert not np.isfinite(first.certificate.worst)
    assert contact.converged
    assert tried == ["an operator in double precision", "a cold start on 3 nested grids"]
    assert contact.u is double.solve(h, approach, contact.p).u
    assert body.slab.tally["operator"] == before
