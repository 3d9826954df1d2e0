"""The distributed transform against SciPy's, on any grid and any number of ranks.

Tolerances: 1e-12 of the largest value in double precision, 1e-6 in single; rounding errors are some 1e-16 and 1e-7
times the logarithm of the number of points.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyfftw
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.typing import DTypeLike, NDArray

from parcontact.parallel import fft as transforms
from parcontact.parallel import regrid
from parcontact.parallel.fft import FFT, NARROWEST, Cosines, export_wisdom, import_wisdom
from parcontact.parallel.slab import Slab

pytestmark = pytest.mark.mpi


TOLERANCES: dict[DTypeLike, float] = {np.float64: 1e-12, np.float32: 1e-6}
SIZES = [(64, 48), (63, 45), (31, 37), (48, 61), (1, 24), (24, 1), (1, 1), (2, 2), (5, 3), (2, 3), (97, 2)]  # nx, ny


def random_map(nx: int, ny: int) -> NDArray[np.float64]:
    """The same on every rank."""
    return np.random.default_rng([nx, ny]).standard_normal((ny, nx))


def close(mine: NDArray[Any], reference: NDArray[Any], dtype: DTypeLike = np.float64, scale: float = 0.0) -> None:
    """Equal to within rounding of the largest value of the whole reference."""
    assert mine.shape == reference.shape
    largest = scale or np.abs(reference).max(initial=0.0)
    assert np.abs(mine - reference).max(initial=0.0) <= TOLERANCES[dtype] * largest


def check(slab: Slab, lengths: tuple[int, int], dtype: DTypeLike) -> None:
    """Forward equals SciPy's zero-padded transform, and backward after forward is the identity."""
    fft = FFT(slab, lengths, dtype, measured=False)  # to find the fastest takes a second for lengths that are primes
    whole = random_map(slab.nx, slab.ny)
    field, out = slab.empty(dtype), slab.empty(dtype)
    field[...] = whole[slab.rows]
    reference = scipy.fft.rfft2(whole, s=lengths[::-1])
    spectrum = fft.forward(field)
    assert spectrum.shape == fft.shape
    assert spectrum.dtype == fft.complex
    close(spectrum, reference[:, fft.columns], dtype, np.abs(reference).max())
    assert fft.backward(spectrum, out) is out
    close(out, whole[slab.rows], dtype, np.abs(whole).max())


def in_blocks(fft: FFT, symbol: NDArray[Any]) -> list[NDArray[Any]]:
    """A symbol as `convolve` takes it."""
    return [np.ascontiguousarray(symbol[:, columns]) for columns in fft.column_blocks]


@pytest.mark.parametrize("dtype", TOLERANCES)
@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_equals_scipy(communicators: list[MPI.Intracomm], nx: int, ny: int, dtype: DTypeLike) -> None:
    for comm in communicators:
        check(Slab(comm, nx, ny), (nx, ny), dtype)


@pytest.mark.parametrize("dtype", TOLERANCES)
@pytest.mark.parametrize(("nx", "ny", "mx", "my"), [(16, 9, 32, 18), (7, 8, 10, 8), (8, 7, 8, 11), (1, 5, 2, 10)])
def test_zero_padding(communicators: list[MPI.Intracomm], nx: int, ny: int, mx: int, my: int, dtype: DTypeLike) -> None:
    for comm in communicators:
        check(Slab(comm, nx, ny), (mx, my), dtype)


@settings(max_examples=15)
@given(nx=st.integers(1, 50), ny=st.integers(1, 50), more_x=st.integers(0, 9), more_y=st.integers(0, 9))
def test_any_size(comm: MPI.Intracomm, nx: int, ny: int, more_x: int, more_y: int) -> None:
    check(Slab(comm, nx, ny), (nx + more_x, ny + more_y), np.float64)


def test_shorter_than_the_map(comm: MPI.Intracomm) -> None:
    with pytest.raises(ValueError, match="shorter than the map"):
        FFT(Slab(comm, 8, 8), (8, 7))


def test_convolution_is_linear(communicators: list[MPI.Intracomm]) -> None:
    """Padded to nx + kx - 1 it is the direct sum over all products."""
    nx, ny, kx, ky = 13, 10, 6, 9
    whole, kernel = random_map(nx, ny), random_map(kx, ky)
    reference = scipy.signal.convolve(whole, kernel, method="direct")[:ny, :nx]
    for comm in communicators:
        slab = Slab(comm, nx, ny)
        fft = FFT(slab, (nx + kx - 1, ny + ky - 1))
        symbol = scipy.fft.rfft2(kernel, s=(fft.my, fft.mx))[:, fft.columns] / (fft.mx * fft.my)
        out = fft.convolve(whole[slab.rows], in_blocks(fft, symbol), slab.empty())
        close(out, reference[slab.rows], scale=np.abs(reference).max())


@pytest.mark.parametrize("nx", [7, 230])
@pytest.mark.parametrize("ny", [1, 2, 9, 10])
def test_half_of_an_even_symbol(comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, nx: int, ny: int) -> None:
    """It stands for the whole, to the same digits, in blocks of columns; they are those of separate transforms."""
    monkeypatch.setattr(transforms, "LEAST_BYTES", 0)
    monkeypatch.setattr(transforms, "BLOCK_BYTES", 1)
    slab = Slab(comm, nx, ny)
    fft, field = FFT(slab), random_map(nx, ny)[slab.rows]
    half = np.random.default_rng(5).normal(size=(ny // 2 + 1, nx // 2 + 1))[:, fft.columns]
    whole = half[np.abs(fft.modes[1][:, 0])]
    found = fft.convolve(field, in_blocks(fft, half), slab.empty())
    assert found.tolist() == fft.convolve(field, in_blocks(fft, whole), slab.empty()).tolist()
    scale = np.abs(whole).max(initial=0.0) * nx * ny
    close(found, nx * ny * fft.backward(whole * fft.forward(field), slab.empty()), scale=3.0 * scale)


@pytest.mark.parametrize("dtype", TOLERANCES)
def test_maps_that_fftw_cannot_take(comm: MPI.Intracomm, dtype: DTypeLike) -> None:
    """Of another precision, not aligned, or not contiguous: the result is the same."""
    slab = Slab(comm, 18, 11)
    fft = FFT(slab, dtype=dtype)
    whole = random_map(18, 11)
    reference = fft.forward(whole[slab.rows].astype(dtype)).copy()
    scale = np.abs(whole).max()
    for other in TOLERANCES:
        coarser = np.float32 if np.float32 in (dtype, other) else np.float64
        wide = np.zeros((slab.shape[0], 40), dtype=other)
        shifted = np.zeros(slab.shape[0] * 18 + 1, dtype=other)[1:].reshape(slab.shape)
        for field in (wide[:, :18], wide[:, 1:37:2], shifted):
            field[...] = whole[slab.rows]
            close(fft.forward(field), reference, coarser, np.abs(reference).max(initial=1.0))
            field.fill(0.0)
            fft.backward(reference, field)
            close(field, whole[slab.rows], coarser, scale)


@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_parseval(comm: MPI.Intracomm, nx: int, ny: int) -> None:
    """Each wave of the half spectrum counts as often as in the full one; rounding."""
    slab = Slab(comm, nx, ny)
    fft, whole = FFT(slab), random_map(nx, ny)
    spectrum = fft.forward(whole[slab.rows])
    power = slab.sum(float(np.sum(fft.multiplicity * np.abs(spectrum) ** 2)))[0] / slab.points
    assert power == pytest.approx(float(np.sum(whole**2)), rel=1e-13)


@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_modes(comm: MPI.Intracomm, nx: int, ny: int) -> None:
    """Those of numpy, except that the shortest wave of an even count is positive."""
    fft = FFT(Slab(comm, nx, ny))
    along_x, along_y = fft.modes
    assert along_x.shape == (1, fft.shape[1])
    assert np.array_equal(along_x[0], np.rint(np.fft.rfftfreq(nx, 1 / nx))[fft.columns])
    expected = np.rint(np.fft.fftfreq(ny, 1 / ny))
    expected[2 * expected == -ny] = ny / 2
    assert np.array_equal(along_y[:, 0], expected)


@pytest.mark.parametrize(("dtype", "number"), [(np.float64, 16), (np.float32, 8)])
def test_only_rows_of_the_map_are_sent(communicators: list[MPI.Intracomm], dtype: DTypeLike, number: int) -> None:
    """Not those of the padding: one complex number for each wave of each row of the map that another rank owns."""
    for comm in communicators:
        slab = Slab(comm, 20, 14)
        fft = FFT(slab, (40, 64), dtype)
        fft.forward(slab.zeros())
        others = 21 - fft.shape[1]
        assert slab.tally["bytes sent"] == number * slab.shape[0] * others
        fft.backward(fft.spectrum, slab.empty())
        assert slab.tally["bytes sent"] == 2 * number * slab.shape[0] * others
        assert slab.tally["fft"] == slab.tally[f"fft 40x64 {fft.dtype}"] == 2


def test_memory(communicators: list[MPI.Intracomm]) -> None:
    """One map, blocks of an eighth of one, and on several ranks a quarter of what they send, but for whole blocks."""
    n = 1024
    for comm in communicators:
        slab = Slab(comm, n, n)
        fft = FFT(slab, measured=False)
        share = fft.slab.tally["map bytes at most"] / (8 * n * n / comm.size)
        parcels, blocks = (0.25 + 0.125) * (1.0 - 1.0 / comm.size), 0.125 if comm.size == 1 else 0.25
        assert share <= (1.0 + parcels) * (1 + 2 / n * comm.size) + blocks


@pytest.fixture
def forgetful() -> Iterator[None]:
    """A process that has not measured anything, before and after."""
    pyfftw.forget_wisdom()
    yield
    pyfftw.forget_wisdom()


class WisdomOnly(pyfftw.FFTW):
    """Refuses to measure."""

    def __new__(cls, source: Any, target: Any, axes: Any, direction: str, flags: tuple[str, ...]) -> "WisdomOnly":
        return super().__new__(cls, source, target, axes, direction, (*flags, "FFTW_WISDOM_ONLY"))

    def __init__(self, source: Any, target: Any, axes: Any, direction: str, flags: tuple[str, ...]) -> None:
        super().__init__(source, target, axes, direction, (*flags, "FFTW_WISDOM_ONLY"))


@pytest.mark.parametrize("dtype", TOLERANCES)
@pytest.mark.parametrize("lengths", [(96, 80), (192, 160)])
@pytest.mark.usefixtures("forgetful")
def test_wisdom_gives_the_same_bits(
    comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, lengths: tuple[int, int], dtype: DTypeLike
) -> None:
    """A restarted run imports what its ranks have measured: it measures nothing and repeats every bit."""

    def both_ways() -> tuple[NDArray[Any], NDArray[Any]]:
        slab = Slab(comm, 96, 80)
        fft = FFT(slab, lengths, dtype)
        spectrum = fft.forward(random_map(96, 80)[slab.rows]).copy()
        return spectrum, fft.backward(spectrum, slab.empty())

    first = both_ways()
    wisdom = export_wisdom()
    pyfftw.forget_wisdom()
    monkeypatch.setattr(pyfftw, "FFTW", WisdomOnly)
    if first[0].size:
        with pytest.raises(RuntimeError, match="plan"):
            both_ways()
    assert import_wisdom(wisdom)
    again = both_ways()
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))


@pytest.mark.usefixtures("forgetful")
def test_foreign_wisdom(comm: MPI.Intracomm) -> None:
    assert not import_wisdom(b"")
    assert not import_wisdom(b"(fftw-9.9 fftw_wisdom)\x1e\x1e")
    assert import_wisdom(export_wisdom())
    check(Slab(comm, 16, 16), (16, 16), np.float64)


# -- cosine series against SciPy's, on any grid and any number of ranks -----------------------------------------------


def symbols_of(cosines: Cosines, symbol: NDArray[Any]) -> list[NDArray[np.complexfloating]]:
    """A symbol on half waves, shape (ny, nx), as `convolve` takes it; there is no wave nx."""
    (own, _), (other, _) = cosines.modes
    parts = (symbol[:, own[0]] + 1j * symbol[:, other[0] % cosines.mx]) / (cosines.mx * cosines.my)
    return [np.ascontiguousarray(parts[:, columns].astype(cosines.fft.complex)) for columns in cosines.column_blocks]


def check_cosines(slab: Slab, dtype: DTypeLike) -> None:
    """The product with a symbol is SciPy's."""
    cosines = Cosines(FFT(slab, dtype=dtype, measured=False))
    whole = random_map(slab.nx, slab.ny)
    symbol = np.random.default_rng(3).uniform(0.5, 1.5, whole.shape)
    expected = scipy.fft.idctn(symbol * scipy.fft.dctn(whole))
    out = cosines.convolve(whole[slab.rows].astype(dtype), symbols_of(cosines, symbol), slab.empty())
    close(out, expected[slab.rows], dtype, np.abs(whole).max())


@pytest.mark.parametrize("dtype", TOLERANCES)
@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_product_with_a_symbol(communicators: list[MPI.Intracomm], nx: int, ny: int, dtype: DTypeLike) -> None:
    for comm in communicators:
        check_cosines(Slab(comm, nx, ny), dtype)


@pytest.mark.parametrize("nx", [64, 33])
def test_many_blocks_cosines(comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, nx: int) -> None:
    """In blocks of eight rows, which are sent in four legs."""
    monkeypatch.setattr(transforms, "BLOCK_BYTES", 1)
    monkeypatch.setattr(transforms, "LEG_BYTES", 1)
    check_cosines(Slab(comm, nx, 75), np.float64)


@pytest.mark.parametrize("dtype", TOLERANCES)
def test_what_it_costs(comm: MPI.Intracomm, dtype: DTypeLike) -> None:
    """Two transforms of the map's own size, with their messages; in memory, a block of columns next to them."""
    slab = Slab(comm, 20, 14)
    fft = FFT(slab, dtype=dtype)
    before = slab.tally.copy()
    cosines = Cosines(fft)
    assert slab.tally.since(before)["map bytes"] == 2 * np.dtype(dtype).itemsize * 14 * NARROWEST
    before = slab.tally.copy()
    fft.backward(fft.forward(slab.zeros()), slab.empty())
    plain, before = slab.tally.since(before), slab.tally.copy()
    cosines.convolve(slab.zeros(), symbols_of(cosines, np.ones((14, 20))), slab.empty())
    assert slab.tally.since(before) == plain


# -- maps between grids, on any number of ranks; against numpy on the whole map ---------------------------------------

GRIDS = {"cells": st.integers(1, 9), "fx": st.integers(1, 3), "fy": st.integers(1, 3)}


def pair(cells: int, fx: int, fy: int) -> tuple[Slab, Slab]:
    """A fine and a coarse grid: fewer coarse rows than ranks, and rows cut apart by ranks, are among them."""
    coarse = Slab(MPI.COMM_WORLD, 4, cells)
    return coarse.resized(4 * fx, cells * fy), coarse


def field(slab: Slab, seed: int = 0, dtype: type = np.float64) -> tuple[NDArray, NDArray]:
    """A whole map, and this rank's rows of it."""
    whole: NDArray = np.random.default_rng(seed).normal(size=(slab.ny, slab.nx)).astype(dtype)
    own = slab.empty(dtype)
    own[...] = whole[slab.rows]
    return whole, own


@settings(max_examples=30)
@given(**GRIDS)
def test_prolongation_is_the_transpose(cells: int, fx: int, fy: int) -> None:
    """`<prolong c, f> = fx fy <c, restrict f>` and `restrict prolong c = c`, to rounding."""
    fine, coarse = pair(cells, fx, fy)
    (_, f), (_, c) = field(fine, 1), field(coarse, 2)
    up, down = regrid.prolong(coarse, fine, c, fine.empty()), regrid.restrict(fine, coarse, f)
    left, right = fine.sum(float((up * f).sum()), float((c * down).sum()))
    assert left == pytest.approx(fx * fy * right, rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(regrid.restrict(fine, coarse, up), c, rtol=1e-15)


@settings(max_examples=30)
@given(ny=st.integers(1, 9), seed=st.integers(0, 99))
def test_fetches_what_each_rank_wants(ny: int, seed: int) -> None:
    """Any rows, none too, also more than one rank has; copies, so equal."""
    slab = Slab(MPI.COMM_WORLD, 3, ny)
    wanted = np.sort(np.random.default_rng(seed).integers(0, ny + 1, (slab.comm.size, 2)))
    whole, own = field(slab)
    np.testing.assert_array_equal(regrid.fetch(slab, own, wanted), whole[slice(*wanted[slab.comm.rank])])
