"""Operators of the half space against closed forms, tables, quadrature and direct sums.

Sums and transforms in double precision are good to 1e-13 of the largest value, unless another tolerance is given.
"""

from collections.abc import Callable

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import DTypeLike

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.convolution import Convolution, MirroredConvolution
from parcontact.physics.halfspace import UNIFORM, HalfSpace, Response, love

from .maps import coordinates, gathered, product, random_map

pytestmark = pytest.mark.mpi

Either = Convolution | MirroredConvolution
OPERATORS: dict[str, Callable[[Slab, tuple[float, float], float], Either]] = {
    "spectral": lambda slab, size, poisson: HalfSpace(size, poisson).operator(FFT(slab)),
    "love": lambda slab, size, poisson: HalfSpace(size, poisson, "love").operator(FFT(slab)),
    "free": lambda slab, size, poisson: free(slab, size, poisson),
    "inverse": lambda slab, size, poisson: HalfSpace(size, poisson).inverse(FFT(slab)),
    "free inverse": lambda slab, size, poisson: HalfSpace(size, poisson, "love", free=True).inverse(FFT(slab)),
}


def free(slab: Slab, size: tuple[float, float], poisson: float = 0.5, dtype: DTypeLike = np.float64) -> Convolution:
    return HalfSpace(size, poisson, "love", free=True).operator(FFT(slab, dtype=dtype))


def applied(operator: Either, whole: Array) -> Array:
    """The operator on a whole map, the same on every rank."""
    slab = operator.fft.slab
    return gathered(operator.apply(np.ascontiguousarray(whole[slab.rows]), slab.empty()), slab)


def matrix(operator: Either) -> Array:
    """All of it, a column for each point."""
    slab = operator.fft.slab
    units = np.eye(slab.points).reshape(slab.points, slab.ny, slab.nx)
    return np.array([applied(operator, unit).ravel() for unit in units]).T


# -- periodic ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("poisson", [0.5, 0.3, 0.0])
@pytest.mark.parametrize(("wx", "wy"), [(1, 0), (0, 1), (3, 2), (2, -5), (0, 6), (8, 0)])
def test_cosine(comm: MPI.Intracomm, wx: int, wy: int, poisson: float) -> None:
    """u = (1 - nu)/(G |q|) p; for nu = 1/2 this is p/(2 G |q|)."""
    slab, size = Slab(comm, 18, 14), (2e-3, 5e-4)
    x, y = coordinates(slab, size)
    qx, qy = 2 * np.pi * wx / size[0], 2 * np.pi * wy / size[1]
    pressure = 1e5 * np.cos(qx * x + qy * y + 0.3)
    half_space = HalfSpace(size, poisson)
    u = half_space.operator(FFT(slab)).apply(pressure, slab.empty())
    expected = (1 - poisson) / np.hypot(qx, qy) * pressure
    assert_allclose(u, expected, rtol=0, atol=1e-13 * 1e5 * (1 - poisson) / np.hypot(qx, qy))
    assert_allclose(half_space.largest_compliance, (1 - poisson) / (2 * np.pi / max(size)), rtol=1e-14)


@pytest.mark.parametrize(
    ("cells", "axis", "diagonal"),
    [
        (64, 0.999612, 0.999236),
        (32, 0.998504, 0.997102),
        (16, 0.994469, 0.989692),
        (8, 0.981596, 0.969138),
        (4, 0.958598, 0.956255),
        (2, 1.16624, 1.28998),
    ],
)
def test_love_against_spectral(comm: MPI.Intracomm, cells: int, axis: float, diagonal: float) -> None:
    """Compliance of a wave of a given number of cells along x and y, and along both; table to 6 digits."""
    slab, size = Slab(comm, 128, 64), (2.0, 1.0)
    x, y = (2 * np.pi * 64 / cells * values for values in coordinates(slab, size))
    for wave, expected in ((x + 0 * y, axis), (0 * x + y, axis), (x + y, diagonal)):
        pressure = np.cos(wave)
        soft = OPERATORS["love"](slab, size, 0.5).apply(pressure, slab.empty())
        stiff = OPERATORS["spectral"](slab, size, 0.5).apply(pressure, slab.empty())
        assert_allclose(product(soft, pressure, slab) / product(stiff, pressure, slab), expected, rtol=5e-6)


def test_inverse(communicators: list[MPI.Intracomm]) -> None:
    """Of the spectral operator but for the mean, which it keeps positive."""
    whole = random_map(15, 12)
    for comm in communicators:
        slab, size = Slab(comm, 15, 12), (1.0, 3.0)
        half_space = HalfSpace(size, 0.3)
        inverse = half_space.inverse(FFT(slab))
        back = applied(inverse, applied(half_space.operator(FFT(slab)), whole))
        assert_allclose(back, whole - whole.mean(), atol=1e-13)
        assert_allclose(applied(inverse, np.ones((12, 15))), 2 * np.pi / 3 / 0.7, rtol=1e-13)


# -- free -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("wx", "wy"), [(0, 0), (1, 0), (0, 5), (3, 2), (17, 13)])
def test_inverse_of_half_waves(communicators: list[MPI.Intracomm], wx: int, wy: int) -> None:
    """The preconditioner continues displacements mirrored at the edges."""
    size, poisson = (2.0, 1.0), 0.3
    wave = np.cos(np.pi * wy * (np.arange(14) + 0.5) / 14)[:, None] * np.cos(np.pi * wx * (np.arange(18) + 0.5) / 18)
    q = np.pi * np.hypot(wx / size[0], wy / size[1]) + UNIFORM / 2.0
    for comm in communicators:
        inverse = HalfSpace(size, poisson, "love", free=True).inverse(FFT(Slab(comm, 18, 14)))
        assert_allclose(applied(inverse, wave), q / (1.0 - poisson) * wave, rtol=0, atol=1e-12 * q)


@pytest.mark.parametrize("poisson", [0.5, 0.3])
@pytest.mark.parametrize(("nx", "ny"), [(7, 5), (6, 8), (9, 1), (1, 4)])
def test_direct_sum(communicators: list[MPI.Intracomm], nx: int, ny: int, poisson: float) -> None:
    size, whole = (2.0, 3.0), random_map(nx, ny)
    dx, dy = size[0] / nx, size[1] / ny
    j, i = np.mgrid[:ny, :nx]
    expected = np.zeros((ny, nx))
    for row, column in np.ndindex(ny, nx):
        expected += whole[row, column] * love(dx * (i - column), dy * (j - row), dx, dy, poisson)
    for comm in communicators:
        u = applied(free(Slab(comm, nx, ny), size, poisson), whole)
        assert_allclose(u, expected, atol=1e-13 * np.abs(expected).max())


def test_uniform_pressure_on_a_square(comm: MPI.Intracomm) -> None:
    """The preconditioner is the inverse in the mean; cells add their edges' share, 0.2 % of 32 x 32."""
    slab, half_space = Slab(comm, 32, 32), HalfSpace((3.0, 3.0), 0.3, "love", free=True)
    pressure = applied(half_space.inverse(FFT(slab)), applied(half_space.operator(FFT(slab)), np.ones((32, 32))))
    assert_allclose(pressure.mean(), 1.0, rtol=2e-3)


# -- all operators ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", OPERATORS)
@pytest.mark.parametrize(("nx", "ny"), [(9, 8), (8, 9), (12, 1)])
def test_symmetric_and_positive(communicators: list[MPI.Intracomm], name: str, nx: int, ny: int) -> None:
    """<a, A b> = <b, A a>; no negative eigenvalue, and 0 only for the mean pressure on a periodic half space."""
    for comm in (comm for comm in communicators if comm.size < 3):
        whole = matrix(OPERATORS[name](Slab(comm, nx, ny), (1.0, 2.0), 0.4))
        largest = np.abs(whole).max()
        assert_allclose(whole, whole.T, atol=1e-14 * largest)
        values = np.linalg.eigvalsh(whole)
        free_of_mean = values[1:] if name in ("spectral", "love") else values
        assert values[0] > -1e-14 * largest
        assert free_of_mean[0] > 1e-3 * largest


def test_single_precision(comm: MPI.Intracomm) -> None:
    """Six digits, also for maps of double precision; half the bytes."""
    slab, size, whole = Slab(comm, 24, 20), (1.0, 1.0), random_map(24, 20)
    reference = applied(HalfSpace(size).operator(FFT(slab)), whole)
    single = HalfSpace(size).operator(FFT(slab, dtype=np.float32))
    tolerance = 1e-6 * np.abs(reference).max()
    assert single.symbols[0].dtype == np.float32
    assert_allclose(applied(single, whole.astype(np.float32)), reference, atol=tolerance)
    assert_allclose(applied(single, whole), reference, atol=tolerance)
    mine = whole[slab.rows].copy()
    assert_allclose(single.apply(mine, slab.empty()), reference[slab.rows], atol=tolerance)
    reference = applied(free(slab, size), whole)
    assert_allclose(applied(free(slab, size, dtype=np.float32), whole), reference, atol=1e-6 * np.abs(reference).max())


def test_compliance_of_another_body() -> None:
    """(1 - nu)/q times its ratio to a half space, here 3 q; 0 for q = 0."""

    class Foundation(Response):
        def compliance_ratio(self, q: Array) -> Array:
            return 3.0 * q

    assert_allclose(Foundation(poisson=0.25).compliance(np.array([0.0, 0.5, 8.0])), [0.0, 2.25, 2.25], rtol=1e-15)
