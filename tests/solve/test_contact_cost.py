"""What a contact costs: starts, messages and operator calls of an iteration, single precision."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.constraint import Constraint
from parcontact.solve.contact import ContactSolver
from parcontact.solve.fallback import cold_start
from parcontact.solve.local_load import LocalLoad
from parcontact.solve.problem import MeanPressure, Operators

from .bodies import Map, keep, rough, solve, solver


def test_warm_start_from_the_solution() -> None:
    """Nothing is left to do but to see that it is one."""
    h = rough(64)
    solving = solver(h)
    p = np.zeros_like(h)
    first = keep(solving.solve(h, MeanPressure(0.4), p))
    operators = solving.slab.tally["operator"]
    again = keep(solving.solve(h, MeanPressure(0.4), p))
    assert again.iterations == 0
    assert solving.slab.tally["operator"] == operators + 1
    assert_allclose(again.p, first.p, rtol=1e-14)


def test_cost_of_an_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    """At most three operators and five messages, however many numbers they carry; one message more where so much is
    cut off that it is taken back near by, which is so in the first iterations only."""
    h, taken = rough(64), list[float]()
    solving = solver(h)
    before, restore = solving.slab.tally.copy(), LocalLoad.restore

    def note(local: LocalLoad, constraint: Constraint, p: Map, load: float, total: float, near_by: bool) -> None:
        taken.extend([load] * near_by)
        restore(local, constraint, p, load, total, near_by)

    monkeypatch.setattr(LocalLoad, "restore", note)
    found = solving.solve(h, MeanPressure(0.4), np.zeros_like(h))
    spent = solving.slab.tally.since(before)
    assert spent["operator"] <= 1 + 3 * found.iterations
    assert spent["allreduce"] <= 3 + 5 * found.iterations + len(taken)
    assert 0 < len(taken) <= 6 < found.iterations
    assert "map bytes" not in spent


def test_preconditioner_in_single_precision() -> None:
    """It need not be exact: as many iterations, the same pressures in double precision."""
    h = rough(128)
    double = solve(h, 0.4, tolerance=1e-9)
    solving = solver(h, tolerance=1e-9)
    narrow = FFT(Slab.alone(128, 128), dtype=np.float32)
    solving.preconditioner = HalfSpace((1.0, 1.0)).inverse(narrow)
    mixed = keep(solving.solve(h, MeanPressure(0.4), np.zeros_like(h)))
    assert abs(mixed.iterations - double.iterations) <= 2
    assert_allclose(mixed.p, double.p, atol=1e-7 * double.p.max())


@pytest.mark.parametrize("load", [0.02, 0.4, 4.0])
def test_calls_in_a_box_with_nothing_around(load: float) -> None:
    """At 1, 20 and 90 % of contact at most 25 calls give pressures to 1e-5 (of their L2 norm), from nested grids as
    programs start. With residuals that jump at the edges, as of a box that repeats, they
    are 25 to 50."""
    h = rough(256)
    free: dict[str, Any] = {"boundary": "free", "kernel": "love"}
    exact = solve(h, load, tolerance=1e-9, **free)

    def on(slab: Slab, tolerance: float) -> tuple[ContactSolver, Operators]:
        coarse = solver(np.zeros((slab.ny, slab.nx)), tolerance=tolerance, **free)
        coarse.solver.height = float(np.ptp(h))
        return coarse.solver, coarse.operators

    solving, p = solver(h, tolerance=1e-5, **free), np.zeros_like(h)
    before = solving.slab.tally["operator"]
    cold_start.prepare(solving.solver, solving.problem(h, MeanPressure(load)), p, on)
    found = keep(solving.solve(h, MeanPressure(load), p))
    assert np.linalg.norm(found.p - exact.p) <= 1e-5 * np.linalg.norm(exact.p)
    assert solving.slab.tally["operator"] - before <= 25
