"""What transforms hold, where rows of x-wavenumbers begin, and a spectrum whose memory two share."""

import numpy as np
import pytest
from mpi4py import MPI

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab

pytestmark = pytest.mark.mpi(3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    ("points", "lengths"), [((20, 14), (20, 14)), ((60, 40), (120, 80)), ((400, 5), (400, 5)), ((9, 30), (9, 30))]
)
def test_planned_memory(
    communicators: list[MPI.Intracomm], points: tuple[int, int], lengths: tuple[int, int], dtype: type
) -> None:
    """On a slab that only counts a transform counts what it holds, to the byte; ranks without rows too. What it sends
    are its rows of the wavenumbers of others."""
    for comm in communicators:
        slab = Slab(comm, *points)
        fft = FFT(slab, lengths, dtype)
        planned = Slab.planned(*points, comm.size, comm.rank)
        plan = FFT(planned, lengths, dtype)
        assert plan.spectrum.nbytes == fft.spectrum.nbytes
        assert planned.tally["map bytes"] == slab.tally["map bytes"]
        fft.forward(slab.zeros())
        others = lengths[0] // 2 + 1 - fft.shape[1]
        assert slab.tally["bytes sent"] == slab.shape[0] * others * fft.spectrum.itemsize


@pytest.mark.parametrize("nx", [8, 14, 16, 300])
def test_rows_of_waves_in_single_precision(nx: int) -> None:
    """On one rank they begin at cache lines of 64 bytes, unless they are shorter than one."""
    spectrum = FFT(Slab.alone(nx, 6), dtype=np.float32).spectrum
    assert spectrum.shape == (6, nx // 2 + 1)
    assert all(row.ctypes.data % 64 == 0 for row in spectrum) == (nx // 2 + 1 >= 8)


@pytest.mark.parametrize(("nx", "ny"), [(20, 14), (6, 40), (1, 7), (300, 2)])
def test_lent_spectrum(communicators: list[MPI.Intracomm], nx: int, ny: int) -> None:
    """Each makes its transforms in turns, to the precision that maps have here; the second one holds no spectrum."""
    for comm in communicators:
        slab = Slab(comm, nx, ny)
        double, alone = FFT(slab), FFT(slab, dtype=np.float32)
        before = slab.tally["map bytes"]
        single = FFT(slab, dtype=np.float32, sharing=double)
        planned = Slab.planned(nx, ny, comm.size, comm.rank)
        lender = FFT(planned)
        held = planned.tally["map bytes"]
        _borrower = FFT(planned, dtype=np.float32, sharing=lender)
        assert planned.tally["map bytes"] - held == slab.tally["map bytes"] - before
        assert np.shares_memory(single.spectrum, double.spectrum) or not single.spectrum.size
        field, out = np.random.default_rng(4).normal(size=(ny, nx))[slab.rows], slab.zeros(np.float32)
        for transform in (single, alone, double, single):
            spectrum = transform.forward(field.astype(transform.dtype)).copy()
            transform.backward(spectrum, out)
            assert np.abs(out - field).max(initial=0.0) <= 1e-6 * np.abs(field).max(initial=1.0)
        expected = alone.forward(field.astype(np.float32)).copy()
        assert np.abs(single.forward(field.astype(np.float32)) - expected).max(initial=0.0) <= 1e-6 * nx * ny
