"""The tangential force on waves and shapes, against the formulas of their slopes."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.shapes import Round
from parcontact.physics.surface import Surface, single_wave

from .maps import coordinates, gathered, product, random_map
from .surfaces import CENTRE, SHAPES, SIZE, WAVES, A, R, heights_of, slopes_of, surface_of

pytestmark = pytest.mark.mpi


@pytest.mark.parametrize("waves", [(4, 0), (0, 3), (3, 2), (2, -5), (-4, 1)])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (3.1e-5, -1.7e-5)])
def test_force_on_a_wave(
    communicators: list[MPI.Intracomm], waves: tuple[int, int], shift: tuple[float, float]
) -> None:
    """p = P cos(q (x - s) + lag) on h = A cos(q (x - s)): the mean of p grad h is P A q sin(lag)/2, oblique too."""
    lag, P = 0.4, 1e5
    for comm in communicators:
        slab = Slab(comm, 18, 14)
        pressure = heights_of(slab, [(P, waves, lag)], shift) + 3 * P
        forces = surface_of(slab, [(A, waves, 0.0)]).forces(pressure, shift)
        q = np.array([2 * np.pi * n / length for n, length in zip(waves, SIZE, strict=True)])
        expected = slab.points * P * A * q * np.sin(lag) / 2
        assert_allclose(forces, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("shift", [(0.0, 0.0), (3.1e-5, -1.7e-5)])
def test_force_is_the_sum_over_points(communicators: list[MPI.Intracomm], shift: tuple[float, float]) -> None:
    """Of any pressure times the exact slope of a sum of waves."""
    for comm in communicators:
        slab = Slab(comm, 20, 13)
        pressure = np.abs(random_map(20, 13))[slab.rows]
        expected = [product(pressure, slope, slab) for slope in slopes_of(slab, WAVES, shift)]
        assert_allclose(surface_of(slab, WAVES).forces(pressure, shift), expected, rtol=1e-12)


@pytest.mark.parametrize("shapes", [False, True])
def test_finite_differences_are_those_of_the_map(comm: MPI.Intracomm, shapes: bool) -> None:
    """Across the edge of a periodic box too."""
    slab = Slab(comm, 20, 13)
    surface = surface_of(slab, WAVES, differences=True)
    surface.shapes = [Round(R, CENTRE), Round(R, (0.0, 0.0), (1.0, 0.0), exact=True)] if shapes else []
    shift = (1.23e-4, 4e-5)
    whole = gathered(surface.heights(shift, slab.empty()), slab)
    pressure = np.abs(random_map(20, 13))
    expected = [
        np.sum(pressure * (np.roll(whole, -1, axis) - np.roll(whole, 1, axis)) / (2 * step))
        for axis, step in zip((1, 0), surface.cell, strict=True)
    ]
    assert_allclose(surface.forces(pressure[slab.rows], shift), expected, rtol=1e-10)


@pytest.mark.parametrize("differences", [False, True])
def test_no_force_on_a_checkerboard(comm: MPI.Intracomm, differences: bool) -> None:
    """The slope of the shortest wave is 0 at all points."""
    slab = Slab(comm, 16, 12)
    for waves in [(8, 6), (8, 0), (0, 6)]:
        surface = surface_of(slab, [(A, waves, 0.0)], differences=differences)
        pressure = np.abs(random_map(16, 12))[slab.rows]
        for shift in [(0.0, 0.0), (surface.cell[0], 0.0), (0.3 * surface.cell[0], 0.1 * surface.cell[1])]:
            assert_allclose(surface.forces(pressure, shift), [0.0, 0.0], atol=1e-12 * A / surface.cell[1])


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("periodic", [False, True])
def test_force_on_shapes(communicators: list[MPI.Intracomm], name: str, periodic: bool) -> None:
    """Pressure times slope, summed over the points in contact."""
    shape, _ = SHAPES[name]
    shift = (1.3e-4, -7e-5)
    for comm in communicators:
        slab = Slab(comm, 18, 13)
        x, y = coordinates(slab, SIZE)
        x, y = x - CENTRE[0] - shift[0], y - CENTRE[1] - shift[1]
        if periodic:
            x, y = x - SIZE[0] * np.round(x / SIZE[0]), y - SIZE[1] * np.round(y / SIZE[1])
        pressure = np.maximum(random_map(18, 13), 0.0)[slab.rows]
        expected = [product(pressure, slope, slab) for slope in shape.slope(x, y)]
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=periodic)
        assert_allclose(surface.forces(pressure, shift), expected, rtol=1e-11, atol=1e-12)


def test_single_precision(comm: MPI.Intracomm) -> None:
    """Heights to 1e-6 of the amplitude, forces to 1e-5."""
    slab = Slab(comm, 20, 13)
    fft = FFT(slab, dtype=np.float32)
    waves = np.sum([single_wave(fft, *wave) for wave in WAVES], axis=0).astype(np.complex64)
    surface = Surface(slab, fft, SIZE, waves, [Round(R, CENTRE)])
    exact = surface_of(slab, WAVES)
    exact.shapes = surface.shapes
    shift = (1.23e-4, 4e-5)
    heights = surface.heights(shift, slab.empty(np.float32))
    reference = exact.heights(shift, slab.empty())
    assert heights.dtype == np.float32
    assert_allclose(heights, reference, rtol=0, atol=1e-6 * np.ptp(gathered(reference, slab)))
    pressure = np.abs(random_map(20, 13))[slab.rows].astype(np.float32)
    assert_allclose(surface.forces(pressure, shift), exact.forces(pressure, shift), rtol=1e-5)
