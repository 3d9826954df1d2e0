"""Full contact against tables, Boltzmann's integral and maps made by Fourier transforms."""

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER, complex_modulus

from parcontact.physics.prony import discrete_modulus
from parcontact.theory import wavy

K, HEIGHT, MEAN = 2 * np.pi / 0.25e-3, 0.5e-6, 0.2e6  # wave number (rad/m), amplitude (m), mean pressure (Pa)
ALONG, ACROSS = np.array([K]), np.array([0.0])  # kx and ky of one wave along x
CELL = 1e-3 / 256
FAST = 1e3 / K  # the velocity (m/s) of omega tau = 1, 0.0397887

# v, omega, G', G'', amplitude of p (Pa), phase (rad), shift (um), mu; then mu at one cell per step of backward Euler
# and of exponential steps
STEADY = [
    (0.001, 25.1327, 276562.4, 62164.27, 7124.196, 0.2211, 8.7973, 4.908294e-05, 4.888371e-05, 4.902519e-05),
    (0.004, 100.531, 299763.3, 246324.7, 9751.175, 0.687852, 27.369, 0.0001944902, 0.000192302, 0.0001943267),
    (0.01, 251.327, 422046.3, 585078.6, 18131.14, 0.945885, 37.636, 0.0004619595, 0.0004507858, 0.0004615856),
    (FAST, 1000, 1512500, 1237500, 49115.46, 0.68573, 27.284, 0.0009770908, 0.0009302677, 0.0009763055),
    (0.1, 2513.27, 2411726, 850176.1, 64269.19, 0.338916, 13.485, 0.0006712722, 0.0006487824, 0.0006707329),
    (0.4, 10053.1, 2725751, 243780.7, 68779.02, 0.0891988, 3.5491, 0.0001924815, 0.0001904834, 0.0001923269),
    (1, 25132.7, 2746088, 98321.46, 69060.94, 0.0357889, 1.424, 7.763152e-05, 7.726771e-05, 7.756915e-05),
]


@pytest.mark.parametrize("row", STEADY)
def test_steady_table(row: tuple[float, ...]) -> None:
    """One wave along x that slides along it; printed to 5, 6 or 7 digits."""
    v, omega, storage, loss, size, phase, shift, *_ = row
    frequency = wavy.frequency(K, 0.0, v, 0.0)
    assert_allclose(frequency, omega, rtol=4e-6)
    modulus = complex_modulus(frequency, *ZENER)
    assert_allclose([modulus.real, modulus.imag], [storage, loss], rtol=3e-7)
    amplitude = wavy.pressure_amplitude(HEIGHT, K, 0.0, modulus)
    assert_allclose(abs(amplitude), size, rtol=3e-7)
    assert_allclose(-np.angle(amplitude), phase, rtol=3e-6)
    assert_allclose(-np.angle(amplitude) / K, 1e-6 * shift, rtol=4e-5)


# changes of velocity: before, after (m/s), 1e4 F/P0 at TIMES, its largest size and when (ms)

# maps of many waves

NX, NY, LX, LY, VX, VY = 48, 40, 2e-3, 1e-3, 0.03, -0.02


@pytest.fixture
def heights() -> np.ndarray:
    rng = np.random.default_rng(7)
    spectrum = np.fft.fft2(rng.standard_normal((NY, NX)))
    row, column = np.meshgrid(np.fft.fftfreq(NY, 1 / NY), np.fft.fftfreq(NX, 1 / NX), indexing="ij")
    spectrum[(np.hypot(row, column) > 12) | ((row == 0) & (column == 0))] = 0
    return 1e-7 * np.fft.ifft2(spectrum).real + 3e-6


def test_waves_make_the_map(heights: np.ndarray) -> None:
    amplitude, kx, ky = wavy.waves(heights, LX, LY)
    x, y = LX / NX * np.arange(NX), LY / NY * np.arange(NY)[:, None]
    made = sum(np.real(a * np.exp(1j * (p * x + q * y))) for a, p, q in zip(amplitude, kx, ky, strict=True))
    assert_allclose(made, heights - heights.mean(), rtol=0, atol=1e-20)


def test_waves_do_not_depend_on_the_mean(heights: np.ndarray) -> None:
    lifted, lying = wavy.waves(heights + 1.0, LX, LY), wavy.waves(heights, LX, LY)
    assert_allclose(lifted.amplitude, lying.amplitude, rtol=0, atol=1e-15)  # rounding of 1 m
    assert wavy.waves(np.ones((4, 6)), LX, LY).amplitude.size == 0


def test_waves_refuse_two_points_per_period() -> None:
    with pytest.raises(ValueError, match="two points per period"):
        wavy.waves(np.tile([1.0, -1.0], (4, 4)), 1.0, 1.0)


def test_sums_over_waves_are_means_over_the_map(heights: np.ndarray) -> None:
    """Pressure of every Fourier mode of the map at once, friction as the mean of p grad h."""
    kx, ky = 2 * np.pi * np.fft.fftfreq(NX, LX / NX), 2 * np.pi * np.fft.fftfreq(NY, LY / NY)[:, None]
    spectrum = np.fft.fft2(heights)
    p = np.fft.ifft2(
        2 * np.hypot(kx, ky) * spectrum * np.conj(complex_modulus(kx * VX + ky * VY, *TWELVE_DECADES))
    ).real
    slopes = [np.fft.ifft2(1j * k * spectrum).real for k in (kx, ky)]
    traction = np.array([np.mean(p * slope) for slope in slopes])

    waves = wavy.waves(heights, LX, LY)
    modulus = complex_modulus(wavy.frequency(waves.kx, waves.ky, VX, VY), *TWELVE_DECADES)
    assert_allclose(wavy.traction(*waves, modulus), traction, rtol=1e-12)
    assert_allclose(step_responses.pressure_variance(*waves, modulus), p.var(), rtol=1e-12)
    mu = wavy.friction_coefficient(MEAN, *waves, VX, VY, *TWELVE_DECADES)
    assert_allclose(mu, -(traction @ [VX, VY]) / np.hypot(VX, VY) / MEAN, rtol=1e-12)


def test_waves_across_the_velocity_give_no_friction() -> None:
    case = (HEIGHT, ACROSS, ALONG)
    assert wavy.friction_coefficient(MEAN, *case, 1.0, 0.0, *ZENER) == 0
    assert wavy.frequency(ACROSS, ALONG, 1.0, 0.0) == 0.0


def test_changing_sign_gives_no_friction() -> None:
    """A wave of two cells, one cell per step: its discrete modulus is real."""
    modulus = discrete_modulus(np.pi / 1e-4, 1e-4, *ZENER)
    size = wavy.traction(HEIGHT, np.array([np.pi / CELL]), np.array([0.0]), np.array([modulus]))
    assert_allclose(size, 0, atol=1e-12 * MEAN)
