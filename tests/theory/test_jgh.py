"""The surface wavy in two directions: closed forms, and the table against a small solver of the test's own."""

import jgh
import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.theory import hertz

WAVE = (2e-6, 1e-3, 1e6)  # amplitude (m), wavelength (m), shear modulus (Pa)
FULL = float(jgh.full_contact_pressure(*WAVE))


def solve(load: float, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Pressures over p* and gaps over Delta on a grid, from conjugate gradients on the points in contact."""
    phase = 2 * np.pi * np.arange(points) / points
    heights = np.cos(phase[:, None]) * np.cos(phase)
    waves = np.hypot(np.fft.fftfreq(points, 1 / points)[:, None], np.arange(points // 2 + 1))
    softness = np.sqrt(2) / np.where(waves > 0, waves, np.inf)  # of the wave of `heights` 1
    p, direction, last = np.full_like(heights, load), np.zeros_like(heights), np.inf
    for _ in range(400):
        residual = np.fft.irfft2(softness * np.fft.rfft2(p), heights.shape) - heights
        residual -= residual[p > 0].mean()
        square = np.sum(residual[p > 0] ** 2)
        direction = np.where(p > 0, residual + square / last * direction, 0)
        response = np.fft.irfft2(softness * np.fft.rfft2(direction), heights.shape)
        response -= response[p > 0].mean()
        step = np.sum((residual * direction)[p > 0]) / np.sum((response * direction)[p > 0])
        p = np.maximum(p - step * direction, 0)
        overlap = (p == 0) & (residual < 0)
        p[overlap] -= step * residual[overlap]
        last = np.inf if overlap.any() else square
        p *= load / p.mean()
        if square < 1e-22 * heights.size and not overlap.any():
            break
    return p, residual


@pytest.mark.parametrize("row", jgh.REFERENCE)
def test_table(row: jgh.Reference) -> None:
    """The tolerances are the error of the grid of 128 points per wave, largest where the contacts are small."""
    p, gap = solve(row.load, 128)
    assert_allclose(p.max(), row.peak_pressure, rtol=2e-3)
    assert_allclose(gap.mean(), row.mean_gap, rtol=5e-4, atol=1e-6)
    assert_allclose((p > 0).mean(), row.contact_fraction, rtol=0, atol=0.01)


def test_table_is_ordered() -> None:
    table = np.array(jgh.REFERENCE)
    assert np.all(np.diff(table[:, 0]) > 0)
    assert np.all(np.diff(table[:, 1]) > 0)
    assert np.all(np.diff(table[:, 3]) < 0)
    assert np.all(np.diff(table[:, 4]) > 0)


def test_table_meets_its_asymptotes() -> None:
    """Within 1.5 % (plus its error) at its first loads, where neighbours are felt, and within its error at its last."""
    for row in jgh.REFERENCE[:2]:
        low = jgh.low_load_contact_fraction(row.load * FULL, *WAVE)
        assert_allclose(row.contact_fraction, low, rtol=0.015, atol=row.contact_fraction_error)
    for row in jgh.REFERENCE[-2:]:
        high = jgh.high_load_contact_fraction(row.load * FULL, *WAVE)
        assert_allclose(row.contact_fraction, high, rtol=0, atol=4 * row.contact_fraction_error)


@pytest.mark.parametrize(
    ("load", "low", "high"),
    [(0.005, 0.02227, 0.5249), (0.05, 0.1034, 0.5464), (0.4, 0.4135, 0.7135), (0.9, 0.71, 0.9523)],
)
def test_asymptotes(load: float, low: float, high: float) -> None:
    """Printed to 4 digits."""
    assert_allclose(jgh.low_load_contact_fraction(load * FULL, *WAVE), low, rtol=5e-4)
    assert_allclose(jgh.high_load_contact_fraction(load * FULL, *WAVE), high, rtol=2e-4)


def test_low_loads_are_two_spheres_per_wave() -> None:
    amplitude, wavelength, modulus = WAVE
    p = 1e-3 * FULL
    radius = (wavelength / (2 * np.pi)) ** 2 / amplitude
    a = hertz.contact_radius(p * wavelength**2 / 2, radius, modulus)
    assert_allclose(jgh.low_load_contact_fraction(p, *WAVE), 2 * np.pi * a**2 / wavelength**2, rtol=1e-14)


def test_full_contact() -> None:
    """The pressure that flattens the surface, 2 q G h with q = sqrt(2) 2 pi/lambda, on the mean."""
    x = np.linspace(0, WAVE[1], 33)
    heights = WAVE[0] * np.cos(2 * np.pi * x[:, None] / WAVE[1]) * np.cos(2 * np.pi * x / WAVE[1])
    expected = 1.01 * FULL + 2 * np.sqrt(2) * 2 * np.pi / WAVE[1] * WAVE[2] * heights
    field = jgh.full_contact_pressure_field(x, x[:, None], 1.01 * FULL, *WAVE)
    assert_allclose(field, expected, rtol=1e-12)
    assert field.min() > 0
    assert jgh.high_load_contact_fraction(1.01 * FULL, *WAVE) == 1
