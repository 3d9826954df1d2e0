"""The surface wavy in two directions: full contact, and the table against the textbook solver."""

import jgh
import numpy as np
import pytest
from numpy.testing import assert_allclose
from solve import polonsky_keer

WAVE = (2e-6, 1e-3, 1e6)  # amplitude (m), wavelength (m), shear modulus (Pa)
FULL = float(jgh.full_contact_pressure(*WAVE))


@pytest.mark.parametrize("row", jgh.REFERENCE)
def test_table(row: jgh.Reference) -> None:
    """The tolerances are the error of the grid of 128 points per wave, largest where the contacts are small."""
    wave, size = np.cos(2 * np.pi * np.arange(128) / 128), (1.0, 1.0)
    heights, full = wave[:, None] * wave, float(jgh.full_contact_pressure(1.0, 1.0, 1.0))
    p, _ = polonsky_keer.solve(heights, row.load * full, size, 1e-11)
    gap = polonsky_keer.displacement(p, size) - heights
    gap -= gap[p > 0].mean()
    assert_allclose(p.max() / full, row.peak_pressure, rtol=2e-3)
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
