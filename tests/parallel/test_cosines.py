"""Cosine series against SciPy's, on any grid and any number of ranks.

Tolerances are those of transforms, `test_fft`.
"""

from typing import Any

import numpy as np
import pytest
import scipy
from mpi4py import MPI
from numpy.typing import DTypeLike, NDArray

from parcontact.parallel import fft as transforms
from parcontact.parallel import transpose
from parcontact.parallel.cosines import Cosines
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab

from .test_fft import SIZES, TOLERANCES, close, random_map

pytestmark = pytest.mark.mpi


def symbols_of(cosines: Cosines, symbol: NDArray[Any]) -> list[NDArray[np.complexfloating]]:
    """A symbol on half waves, shape (ny, nx), as `convolve` takes it; there is no wave nx."""
    (own, _), (other, _) = cosines.modes
    parts = (symbol[:, own[0]] + 1j * symbol[:, other[0] % cosines.mx]) / (cosines.mx * cosines.my)
    return [np.ascontiguousarray(parts[:, columns].astype(cosines.fft.complex)) for columns in cosines.column_blocks]


def check(slab: Slab, dtype: DTypeLike) -> None:
    """The product with a symbol is SciPy's."""
    cosines = Cosines(FFT(slab, dtype=dtype))
    whole = random_map(slab.nx, slab.ny)
    symbol = np.random.default_rng(3).uniform(0.5, 1.5, whole.shape)
    expected = scipy.fft.idctn(symbol * scipy.fft.dctn(whole))
    out = cosines.convolve(whole[slab.rows].astype(dtype), symbols_of(cosines, symbol), slab.empty())
    close(out, expected[slab.rows], dtype, np.abs(whole).max())


@pytest.mark.parametrize("dtype", TOLERANCES)
@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_product_with_a_symbol(communicators: list[MPI.Intracomm], nx: int, ny: int, dtype: DTypeLike) -> None:
    for comm in communicators:
        check(Slab(comm, nx, ny), dtype)


@pytest.mark.parametrize("nx", [64, 33])
def test_many_blocks(comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, nx: int) -> None:
    """In blocks of eight rows, which are sent in four legs."""
    monkeypatch.setattr(transforms, "BLOCK_BYTES", 1)
    monkeypatch.setattr(transpose, "LEG_BYTES", 1)
    check(Slab(comm, nx, 75), np.float64)


@pytest.mark.parametrize("dtype", TOLERANCES)
def test_what_it_costs(comm: MPI.Intracomm, dtype: DTypeLike) -> None:
    """Two transforms of the map's own size, with their messages; in memory, a block of columns beside them."""
    slab = Slab(comm, 20, 14)
    fft = FFT(slab, dtype=dtype)
    before = slab.tally.copy()
    cosines = Cosines(fft)
    assert slab.tally.since(before)["map bytes"] == Cosines.footprint(14, np.dtype(dtype).itemsize)
    before = slab.tally.copy()
    fft.backward(fft.forward(slab.zeros()), slab.empty())
    plain, before = slab.tally.since(before), slab.tally.copy()
    cosines.convolve(slab.zeros(), symbols_of(cosines, np.ones((14, 20))), slab.empty())
    assert slab.tally.since(before) == plain
