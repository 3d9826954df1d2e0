"""The surface wavy in two directions: full contact, and the table against a small solver of the test's own."""

import jgh
import numpy as np
import pytest
from numpy.testing import assert_allclose

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


def test_full_contact() -> None:
    """The pressure that flattens the surface, 2 q G h with q = sqrt(2) 2 pi/lambda, on the mean."""
    x = np.linspace(0, WAVE[1], 33)
    heights = WAVE[0] * np.cos(2 * np.pi * x[:, None] / WAVE[1]) * np.cos(2 * np.pi * x / WAVE[1])
    expected = 1.01 * FULL + 2 * np.sqrt(2) * 2 * np.pi / WAVE[1] * WAVE[2] * heights
    field = jgh.full_contact_pressure_field(x, x[:, None], 1.01 * FULL, *WAVE)
    assert_allclose(field, expected, rtol=1e-12)
    assert field.min() > 0
    assert jgh.high_load_contact_fraction(1.01 * FULL, *WAVE) == 1
