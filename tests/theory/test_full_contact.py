"""Full contact against tables, Boltzmann's integral and maps made by Fourier transforms."""

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER, complex_modulus, relaxation
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from parcontact.physics.prony import Integrator, Prony, discrete_modulus
from parcontact.theory import full_contact

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
    frequency = full_contact.frequency(K, 0.0, v, 0.0)
    assert_allclose(frequency, omega, rtol=4e-6)
    modulus = complex_modulus(frequency, *ZENER)
    assert_allclose([modulus.real, modulus.imag], [storage, loss], rtol=3e-7)
    amplitude = full_contact.pressure_amplitude(HEIGHT, K, 0.0, modulus)
    assert_allclose(abs(amplitude), size, rtol=3e-7)
    assert_allclose(-np.angle(amplitude), phase, rtol=3e-6)
    assert_allclose(-np.angle(amplitude) / K, 1e-6 * shift, rtol=4e-5)


@pytest.mark.parametrize("row", STEADY)
def test_friction_table(row: tuple[float, ...]) -> None:
    """Printed to 7 digits."""
    v, mu, euler, exponential = row[0], *row[-3:]
    wave = (MEAN, HEIGHT, ALONG, ACROSS, v, 0.0)
    assert_allclose(full_contact.friction_coefficient(*wave, *ZENER), mu, rtol=3e-7)
    assert_allclose(stepped_friction(v, 1.0, "backward-euler"), euler, rtol=3e-7)
    assert_allclose(stepped_friction(v, 1.0, "exponential-linear"), exponential, rtol=3e-7)


def stepped_friction(v: float, cells: float, integrator: Integrator) -> np.ndarray:
    """Friction of the table's wave with a number of cells per step."""
    wave, dt = (HEIGHT, ALONG, ACROSS), cells * CELL / v
    return step_responses.discrete_friction_coefficient(MEAN, *wave, v, 0.0, dt, *ZENER, integrator=integrator)


@pytest.mark.parametrize(
    ("integrator", "order"), [("backward-euler", 1), ("exponential-linear", 2), ("exponential", 3)]
)
def test_friction_with_ever_smaller_steps(integrator: Integrator, order: int) -> None:
    exact = full_contact.friction_coefficient(MEAN, HEIGHT, ALONG, ACROSS, FAST, 0.0, *ZENER)
    errors = [stepped_friction(FAST, cells, integrator) - exact for cells in (0.25, 0.125)]
    assert_allclose(errors[0] / errors[1], 2**order, rtol=0.02)


# changes of velocity: before, after (m/s), 1e4 F/P0 at TIMES, its largest size and when (ms)

TIMES = 1e-3 * np.array([0, 0.1, 0.2, 0.5, 1, 1.5, 2, 3, 5, 10, 30])
FASTER = [-1.9449, -3.59, -5.0487, -8.3897, -11.18, -11.779, -11.39, -10.224, -9.6941, -9.771, -9.7709]
STARTED = [0, -1.8566, -3.5199, -7.4113, -10.853, -11.791, -11.524, -10.321, -9.6891, -9.771, -9.7709]
STOPPED = [-9.7709, -8.8411, -7.9997, -5.9264, -3.5945, -2.1802, -1.3223, -0.48646, -0.065836, -0.0004436, -9.1432e-13]
REVERSED = [-9.7709, -7.8229, -5.9097, -0.63082, 5.8867, 9.4625, 10.871, 10.734, 9.7336, 9.7717, 9.7709]
VELOCITY_STEPS = [
    (0.004, FAST, FASTER, 11.78, 1.471),
    (0, FAST, STARTED, 11.802, 1.571),
    (FAST, 0, STOPPED, 9.7709, 0),
    (FAST, -FAST, REVERSED, 11.081, 2.356),
]


def signed_friction(modulus: np.ndarray) -> np.ndarray:
    """1e4 times traction over mean pressure for the table's wave, at any number of times."""
    return 1e4 * full_contact.traction(HEIGHT, ALONG, ACROSS, modulus)[..., 0] / MEAN


@pytest.mark.parametrize(("before", "after", "table", "peak", "peak_time"), VELOCITY_STEPS)
def test_velocity_step_table(before: float, after: float, table: list[float], peak: float, peak_time: float) -> None:
    """Printed to 5 digits, and to 1 us."""

    def friction(t: float | np.ndarray) -> np.ndarray:
        return signed_friction(step_responses.velocity_step_modulus(t, before * ALONG, after * ALONG, *ZENER))

    assert_allclose(friction(TIMES), table, rtol=6e-5, atol=1e-15)
    bounds = (max(0, 1e-3 * (peak_time - 1)), 1e-3 * (peak_time + 1))
    best = minimize_scalar(lambda t: -np.abs(friction(t)), bounds=bounds, options={"xatol": 1e-9})
    assert_allclose(-best.fun, peak, rtol=6e-5)
    assert_allclose(best.x, 1e-3 * peak_time, rtol=0, atol=6e-7)


TWO_TERMS = Prony(0.2e6, np.array([2e6, 1e6]), np.array([1e-3, 3e-4]))


def remembered(omega: float, start: float, end: float, now: float) -> complex:
    """The decaying part of int G(now - s) du(s) from start to end, with u = exp(i omega s)."""

    def rate(s: float) -> complex:
        decaying = relaxation(now - s, *TWO_TERMS) - TWO_TERMS.modulus_inf
        return complex(decaying * 1j * omega * np.exp(1j * omega * s))

    return complex(quad(rate, start, end, limit=400, complex_func=True)[0])


@pytest.mark.parametrize(("before", "after"), [(300.0, 2000.0), (1000.0, -1000.0), (500.0, 0.0)])
def test_velocity_step_by_boltzmann_integral(before: float, after: float) -> None:
    """M(t) u(t) = int G(t-s) du(s), with u = exp(i omega s) on either side of 0; 40 ms before are all of the past."""
    t = 0.7e-3
    stress = remembered(before, -0.04, 0, t) + remembered(after, 0, t, t)
    stress += TWO_TERMS.modulus_inf * np.exp(1j * after * t)
    expected = step_responses.velocity_step_modulus(t, before, after, *TWO_TERMS)
    assert_allclose(stress * np.exp(-1j * after * t), expected, rtol=1e-9)


def test_load_rest_slide_by_boltzmann_integral() -> None:
    """As before, where u jumps from 0 to 1 at the load and rests."""
    t, rest, omega = 0.7e-3, 0.4e-3, 2000.0
    stress = relaxation(t + rest, *TWO_TERMS) + remembered(omega, 0, t, t)
    stress = stress + TWO_TERMS.modulus_inf * (np.exp(1j * omega * t) - 1)
    expected = step_responses.load_rest_slide_modulus(t, rest, omega, *TWO_TERMS)
    assert_allclose(stress * np.exp(-1j * omega * t), expected, rtol=1e-9)


def test_velocity_step_ends() -> None:
    """It starts from the steady state before, whatever comes after, and ends in the steady state after."""
    before, after = np.array([10.0, 300.0, -5.0]), np.array([2e3, 0.0, 5.0])
    steady = [complex_modulus(omega, *ZENER) for omega in (before, after)]
    modulus = step_responses.velocity_step_modulus(np.array([0.0, 1.0]), before, after, *ZENER)
    assert_allclose(modulus, steady, rtol=1e-13)
    assert step_responses.velocity_step_modulus(TIMES, before, after, *TWELVE_DECADES).shape == (11, 3)


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
    amplitude, kx, ky = full_contact.waves(heights, LX, LY)
    x, y = LX / NX * np.arange(NX), LY / NY * np.arange(NY)[:, None]
    made = sum(np.real(a * np.exp(1j * (p * x + q * y))) for a, p, q in zip(amplitude, kx, ky, strict=True))
    assert_allclose(made, heights - heights.mean(), rtol=0, atol=1e-20)


def test_waves_do_not_depend_on_the_mean(heights: np.ndarray) -> None:
    lifted, lying = full_contact.waves(heights + 1.0, LX, LY), full_contact.waves(heights, LX, LY)
    assert_allclose(lifted.amplitude, lying.amplitude, rtol=0, atol=1e-15)  # rounding of 1 m
    assert full_contact.waves(np.ones((4, 6)), LX, LY).amplitude.size == 0


def test_waves_refuse_two_points_per_period() -> None:
    with pytest.raises(ValueError, match="two points per period"):
        full_contact.waves(np.tile([1.0, -1.0], (4, 4)), 1.0, 1.0)


def test_sums_over_waves_are_means_over_the_map(heights: np.ndarray) -> None:
    """Pressure of every Fourier mode of the map at once, friction as the mean of p grad h."""
    kx, ky = 2 * np.pi * np.fft.fftfreq(NX, LX / NX), 2 * np.pi * np.fft.fftfreq(NY, LY / NY)[:, None]
    spectrum = np.fft.fft2(heights)
    p = np.fft.ifft2(
        2 * np.hypot(kx, ky) * spectrum * np.conj(complex_modulus(kx * VX + ky * VY, *TWELVE_DECADES))
    ).real
    slopes = [np.fft.ifft2(1j * k * spectrum).real for k in (kx, ky)]
    traction = np.array([np.mean(p * slope) for slope in slopes])

    waves = full_contact.waves(heights, LX, LY)
    modulus = complex_modulus(full_contact.frequency(waves.kx, waves.ky, VX, VY), *TWELVE_DECADES)
    assert_allclose(full_contact.traction(*waves, modulus), traction, rtol=1e-12)
    assert_allclose(step_responses.pressure_variance(*waves, modulus), p.var(), rtol=1e-12)
    mu = full_contact.friction_coefficient(MEAN, *waves, VX, VY, *TWELVE_DECADES)
    assert_allclose(mu, -(traction @ [VX, VY]) / np.hypot(VX, VY) / MEAN, rtol=1e-12)


def test_march_of_a_map(heights: np.ndarray) -> None:
    """One cell per step along x until steady, backward Euler, mode by mode: the discrete friction."""
    kx, ky = 2 * np.pi * np.fft.fftfreq(NX, LX / NX), 2 * np.pi * np.fft.fftfreq(NY, LY / NY)[:, None]
    spectrum, dt = np.fft.fft2(heights), LX / NX / VX
    keep = 1 / (1 + dt / ZENER.relaxation_times[0])
    memory, last = np.zeros_like(spectrum), np.zeros_like(spectrum)
    for n in range(120):
        now = spectrum * np.exp(-1j * kx * n * VX * dt)
        memory, last = keep * (memory + ZENER.moduli[0] * (now - last)), now
    p = np.fft.ifft2(2 * np.hypot(kx, ky) * (ZENER.modulus_inf * now + memory)).real
    mu = -np.mean(p * np.fft.ifft2(1j * kx * now).real) / MEAN
    waves = full_contact.waves(heights, LX, LY)
    expected = step_responses.discrete_friction_coefficient(
        MEAN, *waves, VX, 0.0, dt, *ZENER, integrator="backward-euler"
    )
    assert_allclose(mu, expected, rtol=1e-11)


def test_waves_across_the_velocity_give_no_friction() -> None:
    case = (HEIGHT, ACROSS, ALONG)
    assert full_contact.friction_coefficient(MEAN, *case, 1.0, 0.0, *ZENER) == 0
    assert full_contact.frequency(ACROSS, ALONG, 1.0, 0.0) == 0.0


def test_changing_sign_gives_no_friction() -> None:
    """A wave of two cells, one cell per step: its discrete modulus is real."""
    modulus = discrete_modulus(np.pi / 1e-4, 1e-4, *ZENER)
    size = full_contact.traction(HEIGHT, np.array([np.pi / CELL]), np.array([0.0]), np.array([modulus]))
    assert_allclose(size, 0, atol=1e-12 * MEAN)


def test_scaling_and_reversal() -> None:
    """mu is the same for pressures times g and times times t and in both directions; it is 0 for v -> 0 and inf."""
    case = (HEIGHT, ALONG, ALONG)
    other = Prony(5 * ZENER.modulus_inf, 5 * ZENER.moduli, 3 * ZENER.relaxation_times)
    mu = full_contact.friction_coefficient(MEAN, *case, 0.03, 0.01, *ZENER)
    assert_allclose(full_contact.friction_coefficient(5 * MEAN, *case, 0.01, 0.01 / 3, *other), mu, rtol=1e-14)
    assert_allclose(full_contact.friction_coefficient(MEAN, *case, -0.03, -0.01, *ZENER), mu, rtol=1e-14)
    for v in (1e-9, 1e9):
        assert abs(full_contact.friction_coefficient(MEAN, *case, v, 0.0, *ZENER)) < 1e-7 * mu
