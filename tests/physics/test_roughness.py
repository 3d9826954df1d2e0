"""Random surfaces: the same waves on every grid and rank count, and the spectrum that was asked for.

`ROAD` is the surface of the paper's section 4 on a box of 1 mm: waves 4 <= |n| < 128 of the box.
"""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.roughness import Roughness, moments, shortest_wave

from .maps import gathered

pytestmark = pytest.mark.mpi

L = 1e-3
BOX = (L, L)
ROAD = Roughness(0.9, 2.5e-4, 2.5e-4, 7.8125e-6, seed=1, rms_slope=0.02)
C = 1.25983e-21  # m^4, the constant of an rms slope of 0.02 if the waves were dense
SMALL = Roughness(0.7, L, L / 2, L / 11.5, seed=3, rms_height=1e-7)  # 1 <= |n| <= 11, with a plateau


def heights_of(roughness: Roughness, comm: MPI.Intracomm, nx: int, ny: int, size: tuple[float, float] = BOX) -> Array:
    slab = Slab(comm, nx, ny)
    fft = FFT(slab)
    return gathered(fft.backward(roughness.spectrum(fft, size), slab.empty()), slab)


def moduli(roughness: Roughness, n: int, size: tuple[float, float] = BOX) -> tuple[Array, Array]:
    """Wavenumbers, and `|FFT(h)|^2 area/(nx ny)^2`, which stands for Phi."""
    heights = heights_of(roughness, MPI.COMM_SELF, n, n, size)
    kx, ky = (2 * np.pi * np.fft.fftfreq(n, length / n) for length in size)
    return np.hypot(kx[None, :], ky[:, None]), np.abs(np.fft.fft2(heights) / n**2) ** 2 * size[0] * size[1]


@pytest.mark.parametrize("roughness", [SMALL, replace(SMALL, random_amplitudes=False), replace(SMALL, seed=2**63)])
def test_a_finer_grid_refines_the_same_surface(comm: MPI.Intracomm, roughness: Roughness) -> None:
    """At common points, to rounding; 24 points hold its waves just so."""
    coarse = heights_of(roughness, comm, 24, 24)
    for nx, ny in [(48, 48), (24, 72), (120, 24), (96, 240)]:
        fine = heights_of(roughness, comm, nx, ny)
        assert_allclose(fine[:: ny // 24, :: nx // 24], coarse, rtol=0, atol=1e-14 * 1e-6)


def test_seeds_differ(comm: MPI.Intracomm) -> None:
    first, other = (heights_of(replace(SMALL, seed=seed), comm, 32, 32) for seed in (3, 4))
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.5
    assert np.array_equal(first, heights_of(SMALL, comm, 32, 32))


@pytest.mark.parametrize("size", [BOX, (2 * L, 0.5 * L)])
@pytest.mark.parametrize("random", [True, False])
def test_exact_scale(comm: MPI.Intracomm, size: tuple[float, float], random: bool) -> None:
    """The rms value over all points of the map is the one asked for, to 1e-12."""
    slab = Slab(comm, 72, 60)
    fft = FFT(slab)
    for seed in range(3):
        wanted = Roughness(0.8, L, L / 3, L / 14, seed, random, rms_height=3e-8)
        heights = heights_of(wanted, comm, 72, 60, size)
        assert np.sqrt(np.mean(heights**2)) == pytest.approx(3e-8, rel=1e-12)
        assert abs(heights.mean()) < 1e-12 * 3e-8
        sloped = replace(wanted, rms_height=None, rms_slope=0.1).spectrum(fft, size)
        kx, ky = (2 * np.pi * mode / length for mode, length in zip(fft.modes, size, strict=True))
        slopes = [fft.backward(1j * k * sloped, slab.empty()).copy() for k in (kx, ky)]
        mean_square = slab.sum(float(np.sum(np.square(slopes))))[0] / slab.points
        assert np.sqrt(mean_square) == pytest.approx(0.1, rel=1e-12)


def test_spectrum_of_fixed_amplitudes() -> None:
    """Phi of the paper's Eq. 13 at every wave, to 1e-12: a plateau, a power law, and outside 1e-20 of the plateau.

    Waves just at the long end are kept, those at the short end are not.
    """
    roughness = Roughness(0.8, L / 2, L / 4, L / 12, 5, random_amplitudes=False, psd_constant=1e-22)
    k, density = moduli(roughness, 32)
    n = np.rint((k * L / (2 * np.pi)) ** 2)  # square of the wave number
    plateau, slope = (n >= 4) & (n < 16), (n >= 16) & (n < 144)
    assert_allclose(density[plateau], 1e-22, rtol=1e-12)
    assert_allclose(density[slope], 1e-22 * (n[slope] / 16) ** -1.8, rtol=1e-12)
    assert density[~(plateau | slope)].max() < 1e-42
    assert density[0, 2] > 1e-23  # along the axis: just the long end
    assert density[12, 0] < 1e-42  # and just the short one


def test_random_amplitudes_have_this_spectrum_in_the_mean() -> None:
    """|FFT(h)|^2 is exponentially distributed: over N waves its mean is good to 1/sqrt(N), its variance is 1."""
    roughness = Roughness(0.8, L / 2, L / 4, L / 12, psd_constant=1e-22)
    k, _ = moduli(roughness, 32)
    expected = 1e-22 * roughness.density(k)
    inside = expected > 0
    inside[:, 17:] = inside[17:, 0] = False  # each pair of conjugate waves once
    ratios = np.array([moduli(replace(roughness, seed=seed), 32)[1][inside] / expected[inside] for seed in range(100)])
    error = 1 / np.sqrt(ratios.size)
    assert abs(ratios.mean() - 1) < 4 * error
    assert abs(ratios.var() - 1) < 12 * error  # the fourth moment of an exponential is large
    assert abs(np.mean(ratios > 1) - np.exp(-1)) < 3 * error
    assert np.abs(ratios.mean(axis=0) - 1).max() < 0.6


def test_lattice_sums_of_the_road(comm: MPI.Intracomm) -> None:
    """With the constant C the waves of the box have an rms slope of 0.020105 and an rms height of 0.2776 um."""
    slab = Slab(comm, 256, 256)
    fft = FFT(slab)
    fixed = replace(ROAD, rms_slope=None, psd_constant=C, random_amplitudes=False)
    found = moments(fixed.spectrum(fft, BOX), fft, BOX)
    assert found.rms_slope == pytest.approx(0.020105, abs=5e-7)
    assert found.rms_height == pytest.approx(0.2776e-6, abs=5e-11)
    shorter = replace(fixed, long_wavelength=2.5e-4 / 1.001, rolloff_wavelength=2.5e-4)  # without those at the end
    found = moments(shorter.spectrum(fft, BOX), fft, BOX)
    assert found.rms_slope == pytest.approx(0.020025, abs=5e-7)
    assert found.rms_height == pytest.approx(0.2684e-6, abs=5e-11)


@pytest.mark.parametrize("psd_constant", [None, 1e-22])
def test_no_wave_within_the_limits(comm: MPI.Intracomm, psd_constant: float | None) -> None:
    """Said in one sentence on every rank, instead of a flat surface."""
    empty = Roughness(
        0.8, L / 1.1, L / 1.1, L / 1.3, rms_slope=None if psd_constant else 0.1, psd_constant=psd_constant
    )
    with pytest.raises(InputError, match="no wave between"):
        empty.spectrum(FFT(Slab(comm, 32, 32)), BOX)


def test_scale_is_needed(comm: MPI.Intracomm) -> None:
    with pytest.raises(ValueError, match="is needed"):
        Roughness(0.8, L, L, L / 8).spectrum(FFT(Slab(comm, 32, 32)), BOX)


def test_one_row(comm: MPI.Intracomm) -> None:
    """Waves along x only."""
    heights = heights_of(SMALL, comm, 64, 1)
    assert np.sqrt(np.mean(heights**2)) == pytest.approx(1e-7, rel=1e-12)


def test_a_single_point_has_no_wave() -> None:
    """On a grid of one point the only wave is the mean, whatever the shape of the box."""
    fft = FFT(Slab.alone(1, 1))
    assert shortest_wave(fft.forward(np.full((1, 1), 2.0)), fft, (1e-3, 2e-5)) == np.inf


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2])
def test_a_stretched_surface(angle: float) -> None:
    """Each wave has Phi of the length of (ratio k_along, k_across), exactly where amplitudes are fixed. Mean square
    slopes along and across differ by ratio^2: to 10 %, as a sum over waves is compared with an integral."""
    ratio, n = 3.0, 256
    plain = Roughness(0.8, L / 2, L / 2, L / 60, seed=2, random_amplitudes=False, psd_constant=C)
    heights = heights_of(replace(plain, stretch=(ratio, angle)), MPI.COMM_SELF, n, n)
    k = 2 * np.pi * np.fft.fftfreq(n, L / n)
    along = k * np.cos(angle) + k[:, None] * np.sin(angle)
    across = k[:, None] * np.cos(angle) - k * np.sin(angle)
    power = np.abs(np.fft.fft2(heights) / n**2) ** 2 * L**2
    expected = C * plain.density(np.hypot(ratio * along, across))
    assert_allclose(power, expected, rtol=1e-9, atol=1e-20 * C)
    assert np.sum(power * across**2) / np.sum(power * along**2) == pytest.approx(ratio**2, rel=0.1)
