"""One sinusoid against tables, quadrature and the equation it solves."""

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import ZENER
from scipy.integrate import quad

from parcontact.theory import westergaard

AMPLITUDE, WAVELENGTH = 0.5e-6, 0.25e-3  # m
WAVE = (AMPLITUDE, WAVELENGTH, 2.75e6)  # and the shear modulus (Pa)
FULL = float(westergaard.full_contact_pressure(*WAVE))
PARTIAL = (0.01, 0.1, 0.5, 0.9, 0.99)


def test_full_contact_pressure() -> None:
    """pi E* Delta/lambda with E* = 4 G; also the amplitude of the pressure that flattens the wave, 2 k G Delta."""
    assert_allclose(FULL, 69115.0383, rtol=1e-8)
    assert_allclose(FULL, 2 * (2 * np.pi / WAVELENGTH) * WAVE[2] * AMPLITUDE, rtol=1e-15)
    assert_allclose(westergaard.full_contact_pressure(0.5e-6, 0.25e-3, 3.85e6, 0.3), FULL, rtol=1e-15)


def test_contact_fraction_table() -> None:
    loads = np.array([0.01, 0.05, 0.1, 0.3, 0.5, 0.9, 0.99])
    table = [0.0637686, 0.143566, 0.204833, 0.369010, 0.5, 0.795167, 0.936231]
    assert_allclose(westergaard.contact_fraction(loads * FULL, *WAVE), table, rtol=5e-6)  # printed to 6 digits


def test_load_step_table() -> None:
    """10 kPa on a Zener body; printed to 6 digits."""
    times = 1e-3 * np.array([0, 0.1, 0.3, 1, 2, 3, 5, 7.5, 10])
    table = [0.248411, 0.259927, 0.281553, 0.346848, 0.423332, 0.488657, 0.601705, 0.730937, 0.885175]
    assert_allclose(
        step_responses.load_step_contact_fraction(times, 1e4, AMPLITUDE, WAVELENGTH, *ZENER), table, rtol=3e-6
    )


def test_load_step_reaches_full_contact() -> None:
    time = step_responses.load_step_full_contact_time(1e4, AMPLITUDE, WAVELENGTH, *ZENER)
    # J(t) = 4 pi Delta/(p lambda) by hand: J = 1/G0 + (1 - exp(-t/10 ms))/G1
    needed = 4 * np.pi * AMPLITUDE / (1e4 * WAVELENGTH)
    assert_allclose(time, -1e-2 * np.log1p(-(needed - 1 / 2.75e6) * 2.75e6 / 9), rtol=1e-12)
    assert_allclose(time, 10.695e-3, rtol=1e-4)
    around = time * np.array([1 - 1e-6, 1 + 1e-6])
    fractions = step_responses.load_step_contact_fraction(around, 1e4, AMPLITUDE, WAVELENGTH, *ZENER)
    assert 0.999 < fractions[0] < fractions[1] == 1
    assert step_responses.load_step_full_contact_time(1e3, AMPLITUDE, WAVELENGTH, *ZENER) == np.inf
    assert step_responses.load_step_full_contact_time(1e5, AMPLITUDE, WAVELENGTH, *ZENER) == 0


@pytest.mark.parametrize("load", [*PARTIAL, 1.01, 3.0])
def test_pressure_carries_the_load(load: float) -> None:
    """With x = a sin(t) the integrand is smooth."""
    half = WAVELENGTH / 2 * float(westergaard.contact_fraction(load * FULL, *WAVE))
    carried = quad(
        lambda t: westergaard.pressure(half * np.sin(t), load * FULL, *WAVE) * half * np.cos(t), -np.pi / 2, np.pi / 2
    )
    assert_allclose(carried[0] / WAVELENGTH, load * FULL, rtol=1e-10)


@pytest.mark.parametrize("load", [*PARTIAL, 1.01])
def test_peak_pressure(load: float) -> None:
    """2 sqrt(p p*) in partial contact, p + p* above."""
    expected = 2 * np.sqrt(load) * FULL if load < 1 else (1 + load) * FULL
    assert_allclose(westergaard.peak_pressure(load * FULL, *WAVE), expected, rtol=1e-14)


@pytest.mark.parametrize("load", PARTIAL)
def test_mean_gap_is_the_mean_of_the_gap(load: float) -> None:
    half = WAVELENGTH / 2 * float(westergaard.contact_fraction(load * FULL, *WAVE))
    mean = quad(lambda x: westergaard.gap(x, load * FULL, *WAVE), half, WAVELENGTH / 2)[0] * 2 / WAVELENGTH
    assert_allclose(mean, westergaard.mean_gap(load * FULL, *WAVE), rtol=5e-8)  # of the rule at the contact's edge


@pytest.mark.parametrize("load", PARTIAL)
def test_gap_and_pressure_solve_the_problem(load: float) -> None:
    """Every wave of the pressure displaces the surface by p/(2 G k): the gap's waves, but for the surface's own."""
    points = 2**14
    x = WAVELENGTH * np.arange(points) / points
    waves = np.fft.rfft(westergaard.pressure(x, load * FULL, *WAVE))[1:41] / points
    displaced = waves / (2 * WAVE[2] * 2 * np.pi / WAVELENGTH * np.arange(1, 41))
    gaps = np.fft.rfft(westergaard.gap(x, load * FULL, *WAVE))[1:41] / points
    gaps[0] += AMPLITUDE / 2
    assert_allclose(gaps, displaced, rtol=0, atol=1e-6 * AMPLITUDE)  # sampling of the square root at the contact's edge


def test_full_contact() -> None:
    x = WAVELENGTH * np.linspace(-2, 2, 101)
    for load in (1.0, 1.01, 50.0):
        expected = FULL * (load + np.cos(2 * np.pi * x / WAVELENGTH))
        assert_allclose(westergaard.pressure(x, load * FULL, *WAVE), expected, rtol=0, atol=1e-14 * load * FULL)
        assert westergaard.contact_fraction(load * FULL, *WAVE) == 1
        assert westergaard.mean_gap(load * FULL, *WAVE) == np.max(westergaard.gap(x, load * FULL, *WAVE)) == 0


def test_no_load() -> None:
    x = WAVELENGTH * np.linspace(0, 1, 11)
    assert westergaard.contact_fraction(0.0, *WAVE) == np.max(westergaard.pressure(x, 0.0, *WAVE)) == 0
    assert_allclose(westergaard.gap(x, 0.0, *WAVE), AMPLITUDE * (1 - np.cos(2 * np.pi * x / WAVELENGTH)), atol=1e-21)
    assert westergaard.mean_gap(0.0, *WAVE) == AMPLITUDE
