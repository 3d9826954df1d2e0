"""Loads beyond the digits of single precision: steps are solved in double precision, which is decided before; where a
solve stalls all the same, the next ones are, too."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marching import marched
from mpi4py import MPI
from restarting import ELASTIC, ROUGH, ZENER

import parcontact as pc
from parcontact.march.rounding import NAME
from parcontact.march.state import entries

HUGE, USUAL = 3e10, 1e4  # Pa: the first moves the body by 3e3 times the height of the surface, and more
MORE = 4  # calls of a step, by the rounding of the transforms that FFTW chooses; a solve that stalls takes 60 more
HELD, CALLS = 6, 3  # steps under the huge load, and operator calls of one in full contact


def job(precision: str, load: float = HUGE, tolerance: float = 1e-3) -> dict[str, Any]:
    """A slide under a huge load, and then under a usual one."""
    slide = {"velocity": 0.2, "distance": HELD / 64 * 1e-3, "cells_per_step": 1}
    history = [{"name": "press", "pressure": load, **slide}, {"name": "go on", "pressure": USUAL, **slide}]
    grid, numerics = {"points": 64, "size": 1e-3}, {"precision": precision, "tolerance": tolerance}
    return {"grid": grid, "surface": ROUGH, "material": ZENER, "history": history, "numerics": numerics}


@pytest.fixture
def unforeseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rounding that is not known before a step is solved, as of a surface with spikes."""
    monkeypatch.setattr("parcontact.march.step.rounds_too_much", lambda *_: False)


@pytest.mark.mpi(2)
@pytest.mark.parametrize("tolerance", [1e-3, 5e-3])
def test_no_solve_stalls(comm: MPI.Intracomm, tolerance: float) -> None:
    """Each step takes about the calls of double precision, from below the rounding that is allowed to far beyond it."""
    for load in (1e8, 1e9, 3e9, 1e11, 1e13):
        given = job("mixed", load, tolerance)
        march, rows = marched({**given, "history": given["history"][:1]}, comm=comm)
        _, exact = marched({**given, "history": given["history"][:1], "numerics": {"tolerance": tolerance}}, comm=comm)
        assert march.scene.slab.tally["retry"] == 0
        for row, wanted in zip(rows, exact, strict=True):
            assert row.operator_calls <= wanted.operator_calls + MORE


@pytest.mark.mpi(2)
@pytest.mark.usefixtures("unforeseen")
def test_one_solve_stalls(comm: MPI.Intracomm) -> None:
    """Later steps take the calls of double precision, in one solve each; under the usual load single precision does."""
    march, rows = marched(job("mixed"), comm=comm)
    _, exact = marched(job("double"), comm=comm)
    assert march.scene.slab.tally["retry"] == 1
    assert "with an operator in double precision" in rows[1].remark
    calls, wanted = ([row.operator_calls for row in each[2:]] for each in (rows, exact))
    assert calls[: HELD - 1] == wanted[: HELD - 1] == [CALLS] * (HELD - 1)
    assert march.state.rounding == 0.0
    assert rows[-1].measures.friction == pytest.approx(exact[-1].measures.friction, rel=1e-3)


@pytest.mark.usefixtures("unforeseen")
@pytest.mark.filterwarnings(
    "ignore:surface.0. only 2 of the longest waves", "ignore:history.0.pressure. a mean pressure"
)
def test_it_is_remembered(tmp_path: Path) -> None:
    """A run that goes on knows that single precision does not do; a job in double precision has no such number."""
    run = pc.Simulation(job("mixed"), comm=MPI.COMM_SELF)
    rows = run.steps()
    for _ in range(3):
        next(rows)
    run.save(tmp_path / "state.h5")
    again = pc.Simulation.restore(tmp_path / "state.h5", comm=MPI.COMM_SELF)
    assert next(iter(again.steps())).operator_calls == CALLS
    march, _ = marched({**job("double"), "history": job("double")["history"][:1]})
    assert NAME not in entries(march.scene, march.state)


@pytest.mark.mpi(2)
@pytest.mark.usefixtures("unforeseen")
def test_an_operator_in_single_precision_is_made_double(comm: MPI.Intracomm) -> None:
    """Under a million times the pressure of full contact, which moves the body by roundings of single
    precision, if that is not seen before: found as with double precision, to the tolerance; without a load like that
    nothing is tried again."""
    series = []
    for load, precision in ((1e11, "mixed"), (1e11, "double"), (1e4, "mixed")):
        numerics = {"precision": precision, "tolerance": 1e-3}
        data = {
            "grid": {"points": 64, "size": 1e-3},
            "surface": ROUGH,
            "material": ELASTIC,
            "history": [{"pressure": load}],
        }
        march, found = marched({**data, "numerics": numerics}, comm=comm)
        assert found[-1].certificate.worst <= 1e-3
        series.append((found[-1], march.scene.slab.tally["retry"], march.field("pressure") - load))
    (mixed, tried, p), (double, none, exact), (_, also_none, _) = series
    assert (tried, none, also_none) == (1, 0, 0)
    assert mixed.remark.endswith("solved when retried with an operator in double precision")
    assert not double.remark
    largest = comm.allreduce(np.abs(exact).max(initial=0.0), MPI.MAX)
    np.testing.assert_allclose(p, exact, rtol=0, atol=2e-3 * largest)


@pytest.mark.mpi(2)
@pytest.mark.usefixtures("unforeseen")
@pytest.mark.parametrize(("limit", "solved"), [(500, True), (1, False)])
def test_what_would_do_is_solved_in_double_precision(comm: MPI.Intracomm, limit: int, solved: bool) -> None:
    """A job that takes solves as they end has those of double precision, the operator's rounding is not what ends them;
    what that does not solve is taken, and nothing else is tried."""
    numerics = {"precision": "mixed", "tolerance": 1e-3, "accept_unconverged": True, "max_iterations": limit}
    load = 1e11 if solved else 1e4
    data = {
        "grid": {"points": 64, "size": 1e-3},
        "surface": ROUGH,
        "material": ELASTIC,
        "history": [{"pressure": load}],
        "numerics": numerics,
    }
    march, found = marched(data, comm=comm)
    assert march.scene.slab.tally["retry"] == 1
    assert (found[-1].certificate.worst <= 1e-3) == solved
    assert found[-1].remark.endswith("with an operator in double precision") == solved
