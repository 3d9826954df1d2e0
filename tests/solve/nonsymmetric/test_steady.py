"""The maps of the steady solver: as many as it says, made when they are needed for the first time."""

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.nonsymmetric import steady
from parcontact.solve.nonsymmetric.steady import SteadySolver

NX, NY = 24, 20
SIZE = (1.2, 1.0)


class Identity:
    """So poor a preconditioner that the linear steps on a set use all directions."""

    def apply(self, field: Array, out: Array) -> Array:
        out[...] = field
        return out


@pytest.mark.mpi
@pytest.mark.parametrize(("tolerance", "pairs"), [(1e-8, 0), (1e-5, 0), (1e-5, 2), (1e-5, -2)])
def test_maps_are_made_when_they_are_needed(
    comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, tolerance: float, pairs: int
) -> None:
    """Projected steps need few; with none of those allowed, an active set that uses all of its directions follows."""
    slab = Slab(comm, NX, NY)
    operator = HalfSpace(SIZE).operator(FFT(slab))
    before = slab.tally["map bytes"]
    solver = SteadySolver(slab, operator, Identity(), 1.0, tolerance, 1000, pairs=pairs)
    numbers = NX, NY, tolerance, comm.size, comm.rank
    few, most = (SteadySolver.footprint(*numbers, sets, pairs) for sets in (False, True))

    def held() -> int:
        return slab.tally["map bytes"] - before

    assert held() == few
    h, start = np.random.default_rng(3).normal(size=(NY, NX))[slab.rows], slab.zeros()
    before += start.nbytes
    assert solver.solve(h, 1.0, start).sets == 0
    assert held() == few
    solver.steps_to_halve = 0
    monkeypatch.setattr(steady, "REDUCTION", 1e-9)
    start.fill(0.0)
    contact = solver.solve(h, 1.0, start)
    assert contact.steps >= steady.MAX_DIRECTIONS
    assert held() == most
