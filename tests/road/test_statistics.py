"""Statistics against the closed forms of waves and of self-affine surfaces."""

import numpy as np
import pytest

from parcontact.physics import surface_statistics as statistics

from . import truth

LENGTH = 1e-3


def test_a_wave() -> None:
    """A sin(qx): rms A/sqrt 2, slope q A/sqrt 2, curvature half of q^2 A/sqrt 2, spectra that hold its whole power."""
    x = np.arange(64) * LENGTH / 64
    q, amplitude = 2 * np.pi * 5 / LENGTH, 2e-6
    found = statistics.describe(np.tile(amplitude * np.sin(q * x), (32, 1)), (LENGTH, LENGTH / 2))
    rms = amplitude / np.sqrt(2.0)
    assert found.rms_height == pytest.approx(rms, rel=1e-12)
    assert found.rms_slope == pytest.approx(q * rms, rel=1e-12)
    assert found.rms_curvature == pytest.approx(0.5 * q**2 * rms, rel=1e-12)
    assert np.sum(found.psd_x) * 2 * np.pi / LENGTH == pytest.approx(rms**2, rel=1e-12)
    assert found.qx[np.argmax(found.psd_x)] == pytest.approx(q, rel=1e-12)


def test_a_self_affine_road() -> None:
    """The exponent that it was made with, to 0.05; the square height is the integral of either spectrum."""
    heights = truth.rough(256, LENGTH, LENGTH, LENGTH / 100, 0.1, hurst=0.8)
    found = statistics.describe(heights, (LENGTH, LENGTH))
    assert found.hurst == pytest.approx(0.8, abs=0.05)
    assert found.rms_slope == pytest.approx(0.1, rel=1e-12)
    one = np.sum(found.psd_y) * 2 * np.pi / LENGTH
    assert one == pytest.approx(np.mean((heights - heights.mean(axis=0)) ** 2), rel=1e-6)


@pytest.mark.parametrize("hurst", [-0.4, 1.6])
def test_a_steeper_or_flatter_spectrum_is_not_self_affine(hurst: float) -> None:
    """Exponents of a power law that no self-affine surface has, 0 to 1, are not told."""
    q = np.geomspace(1.0, 1e2, 24)
    assert np.isnan(statistics._hurst(q, q ** (-2.0 * (1.0 + hurst))))
    assert statistics._hurst(q, q ** (-2.0 * (1.0 + 0.7))) == pytest.approx(0.7, rel=1e-9)


def test_white_noise_has_no_hurst_exponent() -> None:
    found = statistics.describe(np.random.default_rng(3).standard_normal((64, 64)), (1.0, 1.0))
    assert np.isnan(found.hurst)
    assert found.nayak > 1.5  # of an isotropic random surface at least 1.5
