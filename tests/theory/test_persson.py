"""Persson's theory against tables made with other quadratures, closed forms, and full contact."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, complex_modulus
from scipy.integrate import cumulative_simpson, simpson
from scipy.special import erf

from parcontact.theory import full_contact, persson
from parcontact.theory.full_contact import Waves

K_LONG, K_SHORT, SLOPE = 2 * np.pi * 4 / 1e-3, 2 * np.pi * 128 / 1e-3, 0.02  # rad/m, rad/m, root mean square
PRESSURE = 0.1e6  # Pa
# v (m/s), A/A0, mu of full contact, Var p (Pa^2): Gauss panels in log k, 5 digits
STEADY = [
    (0.001, 0.42205, 0.010631, 3.2304e10),
    (0.01, 0.18829, 0.032493, 1.7621e11),
    (0.3, 0.038407, 0.17788, 4.3124e12),
    (3.0, 0.013641, 0.46196, 3.4212e13),
    (100.0, 0.0041384, 0.99467, 3.7172e14),
]
AREAS = [(0.01e6, 0.0038422), (0.3e6, 0.11487), (3.0e6, 0.85144), (10.0e6, 1.0)]  # p0 (Pa), A/A0 at 0.3 m/s
# distance (um), mu, A/A0 after a step of velocity from 0.01 to 3 m/s; distances are printed to three digits
STEP = [
    (0.0, 0.0073373, 0.18829),
    (0.705, 0.015097, 0.029297),
    (2.1, 0.015357, 0.0158),
    (6.28, 0.013357, 0.012129),
    (56.1, 0.0086632, 0.013386),
    (500.0, 0.0083505, 0.01363),
]


def spectrum(k: np.ndarray) -> np.ndarray:
    """Hurst exponent 0.9; the root mean square slope is SLOPE."""
    return SLOPE**2 * 2 * np.pi / (5 * K_LONG**4) * (k / K_LONG) ** -3.8


@pytest.fixture(scope="module")
def road() -> Waves:
    return persson.spectral_waves(spectrum, K_LONG, K_SHORT)


def steady(waves: Waves, v: float) -> np.ndarray:
    return complex_modulus(full_contact.frequency(waves.kx, waves.ky, v, 0.0), *TWELVE_DECADES)


def test_slope(road: Waves) -> None:
    """The spectrum's constant follows from 32^0.2 = 2; 1000 rings err by 3e-6 in such sums."""
    square = np.sum(np.abs(road.amplitude) ** 2 * (road.kx**2 + road.ky**2)) / 2
    assert_allclose(square, SLOPE**2, rtol=5e-6)


def friction_by_simpson(pressure: float, v: float, gamma: float) -> float:
    """Another quadrature: Simpson's rule in the root of log(k/K_LONG), where P has no singularity; to 1e-7."""
    root = np.linspace(0.0, np.sqrt(np.log(K_SHORT / K_LONG)), 2001)
    angle = (np.arange(200) + 0.5) / 200 * np.pi / 2
    k = K_LONG * np.exp(root**2)
    modulus = complex_modulus(v * k[:, None] * np.cos(angle), *TWELVE_DECADES)
    weight = spectrum(k) * k**2 * 2 * root / (2 * np.pi)  # Phi k dk 2 pi/(4 pi^2), means over the angle follow
    variance = cumulative_simpson(weight * 4 * k**2 * np.mean(np.abs(modulus) ** 2, axis=1), x=root, initial=0.0)
    share = erf(pressure / np.sqrt(2 * np.maximum(variance, 1e-300)))
    factor = share * (gamma + (1 - gamma) * share**2)
    loss = np.mean(modulus.imag * np.cos(angle), axis=1)
    return float(simpson(weight * 2 * k**2 * loss * factor, x=root) / pressure)


@pytest.mark.parametrize("row", STEADY)
def test_velocities(road: Waves, row: tuple[float, ...]) -> None:
    """5 digits are printed; 1000 rings err by 3e-6 in these sums and by 3e-5 in friction."""
    v, area, full, variance = row
    modulus = steady(road, v)
    assert_allclose(full_contact.pressure_variance(*road, modulus), variance, rtol=6e-5)
    assert_allclose(persson.contact_area(PRESSURE, *road, modulus), area, rtol=6e-5)
    found = full_contact.friction_coefficient(PRESSURE, *road, v, 0.0, *TWELVE_DECADES)
    assert_allclose(found, full, rtol=6e-5)
    for gamma in (0.45, 1.0):
        found = persson.friction_coefficient(PRESSURE, *road, v, 0.0, modulus, gamma)
        assert_allclose(found, friction_by_simpson(PRESSURE, v, gamma), rtol=5e-5)


@pytest.mark.parametrize(("pressure", "area"), AREAS)
def test_pressures(road: Waves, pressure: float, area: float) -> None:
    modulus = steady(road, 0.3)
    assert_allclose(persson.contact_area(pressure, *road, modulus), area, rtol=6e-5)
    for gamma in (0.45, 1.0):
        found = persson.friction_coefficient(pressure, *road, 0.3, 0.0, modulus, gamma)
        assert_allclose(found, friction_by_simpson(pressure, 0.3, gamma), rtol=5e-5)


def test_rings(road: Waves) -> None:
    """Friction errs by the square of their spacing."""
    exact = friction_by_simpson(PRESSURE, 3.0, 0.45)
    errors = []
    for rings in (100, 200, 400):
        waves = persson.spectral_waves(spectrum, K_LONG, K_SHORT, rings)
        found = persson.friction_coefficient(PRESSURE, *waves, 3.0, 0.0, steady(waves, 3.0))
        errors.append(abs(float(found) / exact - 1))
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.3)


@pytest.mark.parametrize(
    ("gamma", "mu"), [(0.0, 0.00172), (0.25, 0.00582), (0.5, 0.00991), (0.6, 0.01155), (1.0, 0.0181)]
)
def test_gammas(road: Waves, gamma: float, mu: float) -> None:
    """Printed to 5 decimals. Friction is linear in gamma."""
    found = persson.friction_coefficient(PRESSURE, *road, 0.3, 0.0, steady(road, 0.3), gamma)
    assert_allclose(found, mu, atol=6e-6)


@pytest.mark.parametrize("row", STEP)
def test_step_of_velocity(road: Waves, row: tuple[float, ...]) -> None:
    """The table's panels err by 1e-3 in friction at 3 m/s, and its distances are rounded to 3 digits."""
    distance, mu, area = row
    before, after = (full_contact.frequency(road.kx, road.ky, v, 0.0) for v in (0.01, 3.0))
    modulus = full_contact.velocity_step_modulus([1e-6 * distance / 3.0], before, after, *TWELVE_DECADES)
    assert_allclose(persson.friction_coefficient(PRESSURE, *road, 3.0, 0.0, modulus), [mu], rtol=2e-3)
    assert_allclose(persson.contact_area(PRESSURE, *road, modulus), [area], rtol=2e-3)


@pytest.mark.parametrize("pressure", [1e3, 1e4, 1e5])
def test_elastic(road: Waves, pressure: float) -> None:
    """A/A0 = erf(sqrt(2) p0/(E* slope)) with E* = 4 G; no friction. 3e-6 from the slope of the rings."""
    modulus = np.full(road.kx.shape, 1e6 + 0j)
    found = persson.contact_area(pressure, *road, modulus)
    assert_allclose(found, erf(np.sqrt(2) * pressure / (4e6 * SLOPE)), rtol=5e-6)
    assert persson.friction_coefficient(pressure, *road, 0.3, 0.0, modulus) == 0.0


@pytest.mark.parametrize("gamma", [0.0, 0.45, 1.0])
@pytest.mark.parametrize("direction", [0.0, 0.7, np.pi / 2])
def test_full_contact_is_exact(gamma: float, direction: float) -> None:
    """Of a surface, in any direction and for any gamma: to rounding, as P is 1."""
    heights = 1e-6 * np.random.default_rng(3).standard_normal((8, 8))
    kept = np.fft.fft2(heights)
    kept[4], kept[:, 4] = 0.0, 0.0
    waves = full_contact.waves(np.fft.ifft2(kept).real, 1e-3, 1e-3)
    vx, vy = 0.3 * np.cos(direction), 0.3 * np.sin(direction)
    modulus = complex_modulus(full_contact.frequency(waves.kx, waves.ky, vx, vy), *TWELVE_DECADES)
    pressure = 10 * float(np.sqrt(full_contact.pressure_variance(*waves, modulus)))
    found = persson.friction_coefficient(pressure, *waves, vx, vy, modulus, gamma)
    expected = full_contact.friction_coefficient(pressure, *waves, vx, vy, *TWELVE_DECADES)
    assert_allclose(found, expected, rtol=1e-13)
    assert persson.contact_area(pressure, *waves, modulus) == 1.0


def test_a_flat_surface_is_in_contact() -> None:
    flat = Waves(np.zeros(2, complex), np.array([1.0, 2.0]), np.zeros(2))
    modulus = np.ones(2, complex)
    assert np.all(persson.contact_share(1.0, *flat, modulus) == 1.0)
    assert persson.friction_coefficient(1.0, *flat, 1.0, 0.0, modulus) == 0.0


def test_the_half_of_a_ring() -> None:
    """Two waves of one k and one of another: the ring takes half of its own variance, whatever the order of waves."""
    waves = Waves(np.array([1.0, 2.0, 3.0], complex), np.array([2.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    single = 2 * np.array([2.0, 2.0, 3.0]) ** 2  # (2 k A)^2/2 with M = 1
    inner, outer = single[1] + single[2], single[0]
    below = np.array([inner + outer / 2, inner / 2, inner / 2])
    assert_allclose(persson.contact_share(5.0, *waves, np.ones(3)), erf(5.0 / np.sqrt(2 * below)), rtol=1e-14)
