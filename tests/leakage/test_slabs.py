"""One map on several ranks against the same map on one, ranks without rows included."""

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.leakage.elimination import Balance
from parcontact.leakage.flow import Map, solve_flow
from parcontact.leakage.paths import connected_from_end_to_end


def narrow(shape: tuple[int, int], seed: int) -> Map:
    """Random gaps over six decades of conductivity, a third of them closed, with a way along one column and row."""
    random = np.random.default_rng(seed)
    gap = random.uniform(0.01, 1.0, shape) * (random.uniform(size=shape) > 1 / 3)
    gap[:, shape[1] // 2] += 0.01
    gap[shape[0] // 2] += 0.01
    return gap


@pytest.mark.mpi
@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("shape", [(40, 30), (9, 7), (1, 5), (5, 1), (2, 2), (3, 24)])
def test_ranks_agree(comm: MPI.Intracomm, shape: tuple[int, int], axis: str, periodic: bool) -> None:
    """All ranks have the flow of one rank, to 1e-10 and its constriction exactly; root has the map of pressure."""
    gap = narrow(shape, 1)
    alone = solve_flow(gap, (1.0, 0.7), axis, periodic)
    shared = solve_flow(gap if comm.rank == 0 else None, (1.0, 0.7), axis, periodic, comm)
    assert alone.percolates
    assert shared.conductivity == pytest.approx(alone.conductivity, rel=1e-10)
    assert (shared.constriction, shared.position) == (alone.constriction, alone.position)
    assert shared.imbalance < 1e-9
    if comm.rank == 0:
        np.testing.assert_allclose(shared.pressure, alone.pressure, rtol=0, atol=1e-9)


@pytest.mark.mpi
def test_all_ranks_learn_that_a_gap_is_closed(comm: MPI.Intracomm) -> None:
    gap = np.ones((6, 6))
    gap[3] = 0.0
    assert not solve_flow(gap if comm.rank == 0 else None, (1.0, 1.0), "y", True, comm).percolates
    assert solve_flow(gap if comm.rank == 0 else None, (1.0, 1.0), "x", True, comm).conductivity == pytest.approx(5 / 6)


def test_the_matrix_of_ports_is_that_of_solutions() -> None:
    """Column by column: what flows in where one port has the pressure 1 and the others 0, to rounding; no end is near,
    so that equal pressures drive nothing."""
    gap = narrow((12, 10), 2)
    wet = connected_from_end_to_end(gap > 0.0, True)
    with np.errstate(divide="ignore"):
        cells = np.where(wet, 1.0 / gap**3, np.inf)
    row = np.where(np.isfinite(cells[:1]), 0.0, np.inf), np.where(np.isfinite(cells[-1:]), 0.0, np.inf)
    balance = Balance(np.concatenate([row[0], cells, row[1]]), 0.7, True, (False, False))
    matrix, vector = balance.of_ports(np.zeros(balance.shape))
    assert not vector.any()
    scale = np.abs(matrix).max()
    assert np.abs(matrix.sum(axis=1)).max() < 1e-12 * scale
    for number, unit in enumerate(np.eye(len(matrix))):
        pressure = balance.solve(np.zeros(balance.shape), unit, matrix[number])
        ports = np.concatenate([pressure[0][np.isfinite(row[0][0])], pressure[-1][np.isfinite(row[1][0])]])
        assert np.abs(ports - unit).max() < 1e-11
        into = [
            2.0 * 0.7 / cells[k][np.isfinite(cells[k])] * (pressure[p] - pressure[q])[np.isfinite(cells[k])]
            for k, p, q in ((0, 0, 1), (-1, -1, -2))
        ]
        assert np.abs(np.concatenate(into) - matrix[number]).max() < 1e-11 * scale
