"""One sinusoid against tables, quadrature and the equation it solves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from parcontact.theory import wavy

AMPLITUDE, WAVELENGTH = 0.5e-6, 0.25e-3  # m
WAVE = (AMPLITUDE, WAVELENGTH, 2.75e6)  # and the shear modulus (Pa)
FULL = float(wavy.full_contact_pressure(*WAVE))
PARTIAL = (0.01, 0.1, 0.5, 0.9, 0.99)


def test_full_contact_pressure() -> None:
    """pi E* Delta/lambda with E* = 4 G; also the amplitude of the pressure that flattens the wave, 2 k G Delta."""
    assert_allclose(FULL, 69115.0383, rtol=1e-8)
    assert_allclose(FULL, 2 * (2 * np.pi / WAVELENGTH) * WAVE[2] * AMPLITUDE, rtol=1e-15)
    assert_allclose(wavy.full_contact_pressure(0.5e-6, 0.25e-3, 3.85e6, 0.3), FULL, rtol=1e-15)


def test_contact_fraction_table() -> None:
    loads = np.array([0.01, 0.05, 0.1, 0.3, 0.5, 0.9, 0.99])
    table = [0.0637686, 0.143566, 0.204833, 0.369010, 0.5, 0.795167, 0.936231]
    assert_allclose(wavy.contact_fraction(loads * FULL, *WAVE), table, rtol=5e-6)  # printed to 6 digits


@pytest.mark.parametrize("load", [*PARTIAL, 1.01])
def test_peak_pressure(load: float) -> None:
    """2 sqrt(p p*) in partial contact, p + p* above."""
    expected = 2 * np.sqrt(load) * FULL if load < 1 else (1 + load) * FULL
    assert_allclose(wavy.peak_pressure(load * FULL, *WAVE), expected, rtol=1e-14)


@pytest.mark.parametrize("load", PARTIAL)
def test_mean_gap_is_the_mean_of_the_gap(load: float) -> None:
    half = WAVELENGTH / 2 * float(wavy.contact_fraction(load * FULL, *WAVE))
    mean = quad(lambda x: wavy.gap(x, load * FULL, *WAVE), half, WAVELENGTH / 2)[0] * 2 / WAVELENGTH
    assert_allclose(mean, wavy.mean_gap(load * FULL, *WAVE), rtol=5e-8)  # of the rule at the contact's edge


@pytest.mark.parametrize("load", PARTIAL)
def test_gap_and_pressure_solve_the_problem(load: float) -> None:
    """Every wave of the pressure displaces the surface by p/(2 G k): the gap's waves, but for the surface's own."""
    points = 2**14
    x = WAVELENGTH * np.arange(points) / points
    waves = np.fft.rfft(wavy.pressure(x, load * FULL, *WAVE))[1:41] / points
    displaced = waves / (2 * WAVE[2] * 2 * np.pi / WAVELENGTH * np.arange(1, 41))
    gaps = np.fft.rfft(wavy.gap(x, load * FULL, *WAVE))[1:41] / points
    gaps[0] += AMPLITUDE / 2
    assert_allclose(gaps, displaced, rtol=0, atol=1e-6 * AMPLITUDE)  # sampling of the square root at the contact's edge


def test_no_load() -> None:
    x = WAVELENGTH * np.linspace(0, 1, 11)
    assert wavy.contact_fraction(0.0, *WAVE) == np.max(wavy.pressure(x, 0.0, *WAVE)) == 0
    assert_allclose(wavy.gap(x, 0.0, *WAVE), AMPLITUDE * (1 - np.cos(2 * np.pi * x / WAVELENGTH)), atol=1e-21)
    assert wavy.mean_gap(0.0, *WAVE) == AMPLITUDE
