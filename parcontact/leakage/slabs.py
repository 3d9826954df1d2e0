"""Flow through one map on several ranks: each eliminates the cells of its rows, which leaves the faces between slabs.

The first rank gives the second one the matrix of their common ports (`elimination`), in which all its own cells are
eliminated. The second one adds this to its own matrix and eliminates these ports, and so on. The last rank is the first
to know the pressures of its ports; they go back the same way. Each rank then finds those of its cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .elimination import Balance, Map

if TYPE_CHECKING:
    from ..parallel.mpi import MPI


def solve(
    resistances: Map | None, shape: float, periodic: bool, comm: MPI.Intracomm | None
) -> tuple[Map | None, float, float]:
    """Return, on root, the pressures in a map that root has, else None; what the flow dissipates, and what leaves
    through the last row; collective.

    Resistances are those of `Balance`, and `shape` that of the box, across over along the flow. The pressure is 1 at
    the first end and 0 at the last.
    """
    if comm is None or comm.size == 1:
        assert resistances is not None
        ny, nx = resistances.shape
        return _solve_balance(Balance(resistances, shape * ny / nx, periodic))
    from ..parallel.rows import around  # which needs MPI
    from ..parallel.slab import Slab, deal

    ny, nx = comm.bcast(None if resistances is None else resistances.shape)
    working = min(comm.size, ny)
    slab = Slab(comm, nx, ny, dealt=deal(ny, working) + [slice(ny, ny)] * (comm.size - working))
    own = slab.from_root(resistances)
    before, after = around(slab, own, 1, cyclic=False)
    pressure, power, leaving = own, 0.0, 0.0
    if comm.rank < working:
        ends = comm.rank == 0, comm.rank == working - 1
        low, high = _ports(own[:1], before, ends[0]), _ports(own[-1:], after, ends[1])
        balance = Balance(np.concatenate([low, own, high]), shape * ny / nx, periodic, ends)
        whole, power, leaving = _solve_balance(balance, comm, int(np.count_nonzero(low == 0.0)))
        pressure = whole[len(low) : len(low) + len(own)]
    power, leaving = slab.sum(power, leaving)
    return slab.to_root(pressure), power, leaving


def _ports(row: Map, beside: Map, end: bool) -> Map:
    """Return the resistances of the ports between two rows that are wet; without a row at an end of the map."""
    return np.where(np.isfinite(row + beside), 0.0, np.inf)[end:]


def _solve_balance(balance: Balance, comm: MPI.Intracomm | None = None, low: int = 0) -> tuple[Map, float, float]:
    """Return pressures, dissipation and what leaves of one slab, of whose ports the first `low` lead to the rank
    before."""
    given = np.zeros(balance.shape)
    given[0] = balance.first
    ports = () if comm is None else _solve_ports(*balance.of_ports(given), low, comm)
    pressure = balance.solve(given, *ports)
    return pressure, balance.power(pressure), float(balance.last @ pressure[-1])


def _solve_ports(matrix: Map, vector: Map, low: int, comm: MPI.Intracomm) -> tuple[Map, Map]:
    """Return pressures and inflow of the ports of this rank; collective along the ranks that have rows."""
    before, after = slice(None, low), slice(low, None)
    own, driven, beyond = matrix[before, before], vector[before], np.zeros(0)
    if low:
        coupled, pushed = comm.recv(source=comm.rank - 1)
        own, driven = own + coupled, driven + pushed
    known = np.linalg.solve(own, np.column_stack([matrix[before, after], driven]))
    through, at_rest = known[:, :-1], known[:, -1]
    if vector[after].size:
        rest = matrix[after, before] @ known
        comm.send((matrix[after, after] - rest[:, :-1], vector[after] - rest[:, -1]), comm.rank + 1)
        beyond = comm.recv(source=comm.rank + 1)
    pressures = np.concatenate([at_rest - through @ beyond, beyond])
    if low:
        comm.send(pressures[before], comm.rank - 1)
    return pressures, matrix @ pressures - vector
