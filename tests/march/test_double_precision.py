"""Loads beyond the digits of single precision: a solve that stalls is tried again in double precision."""

import numpy as np
import pytest
from marching import marched
from mpi4py import MPI
from restarting import ELASTIC, ROUGH


@pytest.mark.mpi(2)
def test_an_operator_in_single_precision_is_made_double(comm: MPI.Intracomm) -> None:
    """Under a million times the pressure of full contact, which moves the body by roundings of single
    precision: found as with double precision, to the tolerance; without a load like that nothing is tried again."""
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
