"""Loads beyond the digits of single precision: one solve stalls, the next steps are solved in double precision."""

from pathlib import Path
from typing import Any

import pytest
from marching import marched
from mpi4py import MPI
from restarting import ROUGH, ZENER

import parcontact as pc
from parcontact.march.rounding import NAME
from parcontact.march.state import entries

HUGE, USUAL = 3e10, 1e4  # Pa: the first moves the body by 3e3 times the height of the surface, and more
HELD, CALLS = 6, 3  # steps under the huge load, and operator calls of one in full contact


def job(precision: str) -> dict[str, Any]:
    """A slide under a huge load, and then under a usual one."""
    slide = {"velocity": 0.2, "distance": HELD / 64 * 1e-3, "cells_per_step": 1}
    history = [{"name": "press", "pressure": HUGE, **slide}, {"name": "go on", "pressure": USUAL, **slide}]
    grid, numerics = {"points": 64, "size": 1e-3}, {"precision": precision, "tolerance": 1e-3}
    return {"grid": grid, "surface": ROUGH, "material": ZENER, "history": history, "numerics": numerics}


@pytest.mark.mpi(2)
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


@pytest.mark.filterwarnings(
    "ignore:surface.0. only 2 of the longest waves", "ignore:history.0.pressure. a mean pressure"
)
def test_it_is_remembered(tmp_path: Path) -> None:
    """A run that goes on knows that single precision does not do; a job in double precision has no such number."""
    run = pc.Simulation(job("mixed"), comm=MPI.COMM_SELF)
    steps = run.steps()
    for _ in range(3):
        next(steps)
    run.save(tmp_path / "state.h5")
    again = pc.Simulation.restore(tmp_path / "state.h5", comm=MPI.COMM_SELF)
    assert next(iter(again.steps())).operator_calls == CALLS
    march, _ = marched({**job("double"), "history": job("double")["history"][:1]})
    assert NAME not in entries(march.scene, march.state)
