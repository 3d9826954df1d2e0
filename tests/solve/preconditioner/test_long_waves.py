"""Long waves on a thin layer: one V-cycle against a direct solve, its symmetry, any ranks, its memory."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from parcontact.parallel.slab import Array, Slab
from parcontact.physics.layer import LongWaves
from parcontact.solve.preconditioner.extension import ExtendedPreconditioner
from parcontact.solve.preconditioner.long_waves import DECAY, LongWavePreconditioner

Map = NDArray[np.float64]
SINGLE = 1e-5  # relative, of sums in single precision: some hundred roundings of 6e-8
SIZE = (1.0, 1.5)


class Nothing:
    """A preconditioner that gives nothing, so that what long waves add is seen alone."""

    def apply(self, field: Array, out: Array) -> Array:
        out.fill(0.0)
        return out


def waves(thickness: float) -> LongWaves:
    return LongWaves(0.0, thickness**3 / 3, thickness, SIZE)


def added(comm: MPI.Intracomm, r: Map, contact: NDArray[np.bool_], thickness: float) -> Map:
    """What is added on this rank's rows, 0 outside contact."""
    slab = Slab(comm, r.shape[1], r.shape[0])
    made = LongWavePreconditioner(slab, waves(thickness), ExtendedPreconditioner(slab))
    z = slab.empty()
    z[...] = r[slab.rows]
    made.apply(Nothing(), contact[slab.rows].copy(), z)
    return np.where(contact[slab.rows], z, 0.0)


def solved(r: Map, contact: NDArray[np.bool_], thickness: float) -> Map:
    """The solution of its equation by finite differences, with `1/L^2` for the longest wave."""
    (ny, nx), (lx, ly) = r.shape, SIZE
    number = np.arange(nx * ny).reshape(ny, nx)
    matrix = sparse.diags(np.where(contact, 0.0, 1.0 / (DECAY * thickness) ** 2).ravel() + 1.0 / max(SIZE) ** 2)
    for axis, step in ((0, ly / ny), (1, lx / nx)):
        for shift in (1, -1):
            there = (np.ones(r.size), (number.ravel(), np.roll(number, shift, axis).ravel()))
            matrix = matrix + (sparse.identity(r.size) - sparse.csr_matrix(there)) / step**2
    z = spsolve(matrix.tocsc(), r.ravel()).reshape(r.shape) * 3 / thickness**3
    return np.where(contact, z, 0.0)


def patches(ny: int, nx: int, seed: int = 1) -> tuple[NDArray[np.bool_], Map]:
    """Contact in a few patches, and a smooth residual in them."""
    random = np.random.default_rng(seed)
    spectrum = np.fft.rfft2(random.normal(size=(ny, nx)))
    q = np.hypot(*np.meshgrid(np.fft.rfftfreq(nx) * nx, np.fft.fftfreq(ny) * ny))
    smooth = np.fft.irfft2(spectrum * np.exp(-((q / 3) ** 2)), (ny, nx))
    contact = smooth > np.quantile(smooth, 0.6)
    return contact, np.where(contact, random.normal() + smooth / smooth.std(), 0.0)


@pytest.mark.parametrize("thickness", [0.03, 0.15])  # cells are smoothed from the finest grid on, and from twice that
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_is_near_the_solution(thickness: float, seed: int) -> None:
    """Its energy `<r, z>` is that of the solution within a factor 2, as preconditioners of this kind are."""
    contact, r = patches(48, 64, seed)
    ratio = np.sum(r * added(MPI.COMM_SELF, r, contact, thickness)) / np.sum(r * solved(r, contact, thickness))
    assert 0.5 < ratio < 2.0


@pytest.mark.parametrize("shape", [(48, 64), (33, 18), (50, 7)])
def test_is_symmetric_and_positive(shape: tuple[int, int]) -> None:
    """`<r, M s> = <M r, s>`, to single precision."""
    contact, _ = patches(*shape)
    random = np.random.default_rng(2)
    r, s = (np.where(contact, random.normal(size=shape), 0.0) for _ in range(2))
    m_r, m_s = (added(MPI.COMM_SELF, one, contact, 0.1) for one in (r, s))
    assert abs(np.sum(r * m_s) - np.sum(m_r * s)) < SINGLE * np.sum(np.abs(m_r * s))
    assert np.sum(r * m_r) > 0.0


@pytest.mark.mpi
@pytest.mark.parametrize(("shape", "thickness"), [((48, 64), 0.03), ((48, 64), 0.15), ((33, 18), 0.3), ((2, 40), 0.1)])
def test_ranks_agree(comm: MPI.Intracomm, shape: tuple[int, int], thickness: float) -> None:
    contact, r = patches(*shape)
    alone = added(MPI.COMM_SELF, r, contact, thickness)
    mine = added(comm, r, contact, thickness)
    np.testing.assert_allclose(mine, alone[Slab(comm, *shape[::-1]).rows], rtol=0, atol=SINGLE * np.abs(alone).max())


@pytest.mark.mpi
@pytest.mark.parametrize("thickness", [0.03, 0.4])
@pytest.mark.parametrize("shape", [(64, 64), (33, 18)])
def test_holds_what_it_says(comm: MPI.Intracomm, shape: tuple[int, int], thickness: float) -> None:
    """To the byte, on every rank."""
    slab = Slab(comm, shape[1], shape[0])
    extended = ExtendedPreconditioner(slab)
    before = slab.tally["map bytes"]
    _held = LongWavePreconditioner(slab, waves(thickness), extended)
    told = LongWavePreconditioner.footprint(shape[1], shape[0], comm.size, comm.rank, waves(thickness))
    assert slab.tally["map bytes"] - before == told
