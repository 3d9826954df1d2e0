"""The response of a layer: closed forms and limits of its compliance, one operator by two ways, and its long waves."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from parcontact.contact.preconditioner import ExtendedPreconditioner
from parcontact.effects.layer.effect import DECAY, SMALL_CONTACT, Base, Layer, LongWavePreconditioner, LongWaves
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.halfspace import HalfSpace

Map = NDArray[np.float64]
SINGLE = 1e-5  # relative, of sums in single precision: some hundred roundings of 6e-8

BASES: list[Base] = ["bonded", "smooth"]


def test_incompressible_bonded_layer() -> None:
    """S(x) = (sinh 2x - 2x)/(cosh 2x + 1 + 2x^2); for small x it is 2/3 x^3 to x^2 of itself."""
    x = np.array([0.5, 2.0])
    exact = (np.sinh(2 * x) - 2 * x) / (np.cosh(2 * x) + 1 + 2 * x**2)
    np.testing.assert_allclose(Layer(1.0).compliance_ratio(x), exact, rtol=1e-13)
    np.testing.assert_allclose(exact, [0.05757363, 0.64145003], atol=5e-9)
    small = np.array([1e-8, 1e-4])
    np.testing.assert_allclose(Layer(1.0).compliance_ratio(small), 2 / 3 * small**3, rtol=2e-8)


def test_half_space_below_a_small_contact() -> None:
    """The refusal of stick on a layer states by how much a half space is too soft below a bonded disc, of a tenth of
    the thickness in radius. With the tractions `1/sqrt(1 - r^2/a^2)`, whose transform is sin(q a)/(q a), of first order
    in the difference. Waves of shear along them have the ratio (sinh 2x + 2x)/(cosh 2x + 1 + 2x^2), and across tanh x;
    the latter are twice as soft."""
    radius, x = 0.1, np.linspace(1e-3, 40.0, 40001)
    weight = np.sinc(radius * x / np.pi) ** 2 * 2.0 * radius / np.pi
    along = (np.sinh(2 * x) + 2 * x) / (np.cosh(2 * x) + 1 + 2 * x**2)
    shear = (along + 2 * np.tanh(x)) / 3
    found = [
        100 / (1 - float(np.trapezoid((1 - ratio) * weight, x))) - 100
        for ratio in (Layer(1.0).compliance_ratio(x), shear)
    ]
    assert "up to {:.0f} % too soft under pressure, {:.0f} % under shear".format(*found) in SMALL_CONTACT


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_long_waves_on_a_compressible_bonded_layer(poisson: float) -> None:
    """The layer is strained in one direction then, as under a uniform pressure; what is left is of order (q d)^2."""
    layer = Layer(2.0, "bonded", poisson=poisson)
    q = np.array([1e-6])
    assert (1 - poisson) / q * layer.compliance_ratio(q) == pytest.approx(layer.mean_compliance, rel=1e-9)


def test_long_waves_on_a_smooth_base() -> None:
    """A wave strains the layer in a plane: `(1 - nu) d/2`."""
    assert Layer(2.0, "smooth").compliance_ratio(np.array([1e-6])) / 1e-6 == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_thick_layer_is_a_half_space(base: Base, poisson: float) -> None:
    ratio = Layer(1.0, base, poisson=poisson).compliance_ratio(np.array([20.0, 1e3]))
    np.testing.assert_allclose(ratio, 1.0, atol=1e-12)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.2, 0.5])
def test_isolated_and_periodic_layers_agree_in_a_wide_box(base: Base, poisson: float) -> None:
    """The neighbours are 16 thicknesses away, where a pressure moves an incompressible layer by 6e-4, others less.

    Means differ on a smooth base: it lets an isolated layer spread, but not one that repeats for ever.
    """
    slab = Slab.alone(128, 128)
    fft, x = FFT(slab), (np.arange(128) - 63.5) / 8.0
    pressure = np.exp(-(x**2 + x[:, None] ** 2))
    layer = Layer(1.0, base, poisson=poisson)
    moved = [
        HalfSpace((16.0, 16.0), poisson, "love", free, layer).operator(fft).apply(pressure.copy(), slab.empty()).copy()
        for free in (True, False)
    ]
    difference = moved[0] - moved[1]
    difference -= difference.mean() * (base == "smooth")
    assert np.abs(difference).max() < 1e-3 * np.abs(moved[1]).max()


def test_isolated_layer_against_the_integral_over_waves() -> None:
    """A point far from a small cell: `(1 - nu)/(2 pi) int S(q d) J0(q r) dq` by another quadrature, in the far field of
    which a sign changes: an incompressible layer bulges next to a force."""
    from scipy.integrate import quad
    from scipy.special import j0

    layer, cell = Layer(1.0), 1e-3
    for r in (0.5, 1.0, 2.0):
        beyond = quad(
            lambda q, r=r: (float(layer.compliance_ratio(np.array(q))) - 1.0) * j0(q * r), 0.0, 40.0, limit=400
        )[0]
        exact = 0.5 / (2 * np.pi) * (1.0 / r + beyond)
        x, y = np.array([[r]]), np.zeros((1, 1))
        found = layer.coefficient(x, y, cell, cell) / cell**2
        assert found[0, 0] == pytest.approx(exact, abs=2e-6)  # the mean over the cell
        assert (exact < 0.0) == (r >= 1.0)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_the_preconditioner_is_the_inverse_of_short_waves(base: Base, poisson: float) -> None:
    """Waves longer than that of the softest one count as stiff as that; no other one does."""
    fft, layer = FFT(Slab.alone(32, 32)), Layer(0.05, base, poisson=poisson)
    body = HalfSpace((1.0, 1.0), poisson, other=layer)
    softest, stiffness = layer.softest_wave
    product = body.symbol(fft) * body.inverse_symbol(fft)
    q = 2 * np.pi * np.hypot(*fft.modes)
    np.testing.assert_allclose(product[q >= softest], 1.0, rtol=1e-13)
    assert (body.inverse_symbol(fft)[(q < softest) & (q > 0.0)] == stiffness).all()
    assert (softest * 0.05 > 1.0) == (base == "bonded" and poisson == 0.5)
    assert product[q > 0.0].max() < 1.0 + 1e-5  # the softest wave is looked for among 2000


@pytest.mark.parametrize("poisson", [0.4, 0.49, 0.5])
def test_long_waves_are_stiffer_than_the_softest_one(poisson: float) -> None:
    """`softest + 1/(c0 + c2 q^2)` is the stiffness of waves longer than the thickness; of an incompressible layer c2 is
    d^3/3. What is left is (q d)^4 of the compliance."""
    layer = Layer(2.0, "bonded", poisson=poisson)
    waves, (_, softest) = layer.long_waves((100.0, 50.0)), layer.softest_wave
    assert waves is not None
    q = np.array([0.01, 0.02]) / layer.thickness
    compliance = (1 - poisson) / q * layer.compliance_ratio(q)
    added = 1.0 / compliance - softest
    np.testing.assert_allclose(added, 1.0 / (waves.c0 + waves.c2 * q**2), rtol=1e-3)
    assert np.diff(1.0 / added) == pytest.approx(waves.c2 * np.diff(q**2), rel=0.01)
    assert waves.c0 == pytest.approx(0.0) or poisson < 0.5
    assert waves.c2 == pytest.approx(8 / 3) or poisson < 0.5


def test_where_no_wave_is_stiffer_than_the_softest() -> None:
    """Smooth bases, compressible layers, and layers that are thick for their box."""
    for layer, size in ((Layer(1.0, "smooth"), 100.0), (Layer(1.0, "bonded", poisson=0.2), 100.0), (Layer(1.0), 2.0)):
        assert layer.long_waves((size, size)) is None


# -- long waves on a thin layer: one V-cycle against a direct solve, its symmetry, any ranks, its memory --------------

SIZE = (1.0, 1.5)


class Nothing:
    """A preconditioner that gives nothing, so that what long waves add is seen alone."""

    def apply(self, field: Array, out: Array) -> Array:
        out.fill(0.0)
        return out


def waves(thickness: float, squeezed: float) -> LongWaves:
    """A bonded layer; `squeezed` is c0 over `c2/thickness^2`, 0 if incompressible."""
    return LongWaves(squeezed * thickness / 3, thickness**3 / 3, thickness, SIZE)


def added(comm: MPI.Intracomm, r: Map, contact: NDArray[np.bool_], thickness: float, squeezed: float = 0.0) -> Map:
    """What is added on this rank's rows, 0 outside contact."""
    slab = Slab(comm, r.shape[1], r.shape[0])
    made = LongWavePreconditioner(waves(thickness, squeezed), slab, ExtendedPreconditioner(slab))
    z = slab.empty()
    z[...] = r[slab.rows]
    made.apply(Nothing(), contact[slab.rows].copy(), z)
    return np.where(contact[slab.rows], z, 0.0)


def solved(r: Map, contact: NDArray[np.bool_], thickness: float, squeezed: float) -> Map:
    """The solution of its equation by finite differences, with `1/L^2` for the longest wave."""
    (ny, nx), (lx, ly) = r.shape, SIZE
    number = np.arange(nx * ny).reshape(ny, nx)
    stiffness = squeezed / thickness**2 + 1.0 / max(SIZE) ** 2
    matrix = sparse.diags(np.where(contact, 0.0, 1.0 / (DECAY * thickness) ** 2).ravel() + stiffness)
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


@pytest.mark.parametrize(  # cells are smoothed from the finest grid on, and from twice that
    ("thickness", "squeezed"), [(0.03, 0.0), (0.15, 0.0), (0.15, 1.0)]
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_is_near_the_solution(thickness: float, squeezed: float, seed: int) -> None:
    """Its energy `<r, z>` is that of the solution within a factor 2, as preconditioners of this kind are."""
    contact, r = patches(48, 64, seed)
    z = added(MPI.COMM_SELF, r, contact, thickness, squeezed)
    ratio = np.sum(r * z) / np.sum(r * solved(r, contact, thickness, squeezed))
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
