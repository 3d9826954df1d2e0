"""The layer: closed forms and limits of its compliance, and one operator by two ways."""

import numpy as np
import pytest

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.layer import Base, Layer

BASES: list[Base] = ["bonded", "smooth"]


def test_incompressible_bonded_layer() -> None:
    """S(x) = (sinh 2x - 2x)/(cosh 2x + 1 + 2x^2); for small x it is 2/3 x^3 to x^2 of itself."""
    x = np.array([0.5, 2.0])
    exact = (np.sinh(2 * x) - 2 * x) / (np.cosh(2 * x) + 1 + 2 * x**2)
    np.testing.assert_allclose(Layer(1.0).compliance_ratio(x), exact, rtol=1e-13)
    np.testing.assert_allclose(exact, [0.05757363, 0.64145003], atol=5e-9)
    small = np.array([1e-8, 1e-4])
    np.testing.assert_allclose(Layer(1.0).compliance_ratio(small), 2 / 3 * small**3, rtol=2e-8)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_long_waves_on_a_compressible_bonded_layer(poisson: float) -> None:
    """The layer is strained in one direction then, as under a uniform pressure; what is left is of order (q d)^2."""
    layer = Layer(2.0, "bonded", poisson)
    q = np.array([1e-6])
    assert (1 - poisson) / q * layer.compliance_ratio(q) == pytest.approx(layer.mean_compliance, rel=1e-9)


def test_long_waves_on_a_smooth_base() -> None:
    """A wave strains the layer in a plane: `(1 - nu) d/2`."""
    assert Layer(2.0, "smooth").compliance_ratio(np.array([1e-6])) / 1e-6 == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_thick_layer_is_a_half_space(base: Base, poisson: float) -> None:
    ratio = Layer(1.0, base, poisson).compliance_ratio(np.array([20.0, 1e3]))
    np.testing.assert_allclose(ratio, 1.0, atol=1e-12)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_a_smooth_base_holds_less_than_a_bonded_one(poisson: float) -> None:
    x = np.geomspace(1e-3, 10.0, 200)
    bonded, smooth = (Layer(1.0, base, poisson).compliance_ratio(x) for base in BASES)
    assert (bonded < smooth).all()
    assert (np.diff(smooth) >= 0.0).all()  # it has no hump: below the half space at all wavelengths
    assert np.abs(np.diff(np.log(bonded))).max() < 3.2 * np.log(x[1] / x[0])  # no jump where the series ends


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.2, 0.5])
def test_isolated_and_periodic_layers_agree_in_a_wide_box(base: Base, poisson: float) -> None:
    """The neighbours are 16 thicknesses away, where a pressure moves an incompressible layer by 6e-4, others less.

    Means differ on a smooth base: it lets an isolated layer spread, but not one that repeats for ever.
    """
    slab = Slab.alone(128, 128)
    fft, x = FFT(slab), (np.arange(128) - 63.5) / 8.0
    pressure = np.exp(-(x**2 + x[:, None] ** 2))
    layer = Layer(1.0, base, poisson)
    moved = [
        HalfSpace((16.0, 16.0), poisson, "love", free, layer).operator(fft).apply(pressure.copy(), slab.empty()).copy()
        for free in (True, False)
    ]
    difference = moved[0] - moved[1]
    difference -= difference.mean() * (base == "smooth")
    assert np.abs(difference).max() < 1e-3 * np.abs(moved[1]).max()


def test_isolated_layer_against_the_integral_over_waves() -> None:
    """A point far from a small cell: `(1 - nu)/(2 pi) int S(q d) J0(q r) dq` by another quadrature, in the far field of
    which a sign changes: an incompressible layer bulges beside a force."""
    from scipy.integrate import quad
    from scipy.special import j0

    layer, cell = Layer(1.0), 1e-3
    for r in (0.5, 1.0, 2.0):
        beyond = quad(
            lambda q, r=r: (float(layer.compliance_ratio(np.array(q))) - 1.0) * j0(q * r), 0.0, 40.0, limit=400
        )[0]
        exact = 0.5 / (2 * np.pi) * (1.0 / r + beyond)
        x, y = np.array([[r]]), np.zeros((1, 1))
        found = layer.coefficients(x, y, cell, cell, cell**2 * 0.5 / (2 * np.pi) / np.hypot(x, y)) / cell**2
        assert found[0, 0] == pytest.approx(exact, abs=2e-6)  # the mean over the cell
        assert (exact < 0.0) == (r >= 1.0)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_the_preconditioner_is_the_inverse_of_short_waves(base: Base, poisson: float) -> None:
    """Waves longer than that of the softest one count as stiff as that; no other one does."""
    fft, layer = FFT(Slab.alone(32, 32)), Layer(0.05, base, poisson)
    body = HalfSpace((1.0, 1.0), poisson, layer=layer)
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
    layer = Layer(2.0, "bonded", poisson)
    waves, (_, softest) = layer.long_waves((100.0, 50.0)), layer.softest_wave
    assert waves is not None
    q = np.array([0.01, 0.02]) / layer.thickness
    compliance = (1 - poisson) / q * layer.compliance_ratio(q)
    added = 1.0 / compliance - softest
    np.testing.assert_allclose(added, 1.0 / (waves.c0 + waves.c2 * q**2), rtol=1e-3)
    assert waves.c0 == pytest.approx(0.0) or poisson < 0.5
    assert waves.c2 == pytest.approx(8 / 3) or poisson < 0.5


def test_where_no_wave_is_stiffer_than_the_softest() -> None:
    """Smooth bases, compressible layers, and layers that are thick for their box."""
    for layer, size in ((Layer(1.0, "smooth"), 100.0), (Layer(1.0, "bonded", 0.2), 100.0), (Layer(1.0), 2.0)):
        assert layer.long_waves((size, size)) is None
