"""The lowest waves of a transform, alone and dealt to ranks."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.lowest import lowest, rows_of, shape_of
from parcontact.physics.roughness import moments
from parcontact.physics.surface import Surface

SIZE = (2.0, 1.0)


@pytest.mark.parametrize(
    ("count", "my", "rows"),
    [(1, 6, [0]), (3, 6, [0, 1, 5]), (5, 6, [0, 1, 2, 4, 5]), (6, 6, range(6)), (5, 5, range(5)), (1, 1, [0])],
)
def test_rows(count: int, my: int, rows: list[int]) -> None:
    assert rows_of(count, my).tolist() == list(rows)


def test_shape() -> None:
    """At most that of the spectrum; of ranks beyond the highest wave nothing."""
    assert shape_of((3, 2), (16, 9), slice(0, 9)) == (5, 4)
    assert shape_of((3, 2), (16, 9), slice(2, 5)) == (5, 2)
    assert shape_of((3, 2), (16, 9), slice(5, 9)) == (5, 0)
    assert shape_of((100, 100), (16, 9), slice(0, 9)) == (9, 9)


@pytest.mark.parametrize("waves", [(0, 0), (2, 3), (8, 2), (20, 20)])
def test_a_surface_without_its_zeros(communicators: list[MPI.Intracomm], waves: tuple[int, int]) -> None:
    """Heights, forces and moments are those of the whole transform, whose other waves are 0."""
    nx, ny = 16, 12
    random = np.random.default_rng(7)
    whole = np.fft.rfft2(random.normal(size=(ny, nx)))
    kx, ky = np.arange(nx // 2 + 1), np.abs(np.fft.fftfreq(ny, 1 / ny))
    whole[(kx > waves[0])[None, :] | (ky > waves[1])[:, None]] = 0.0
    pressure = np.maximum(random.normal(size=(ny, nx)), 0.0)
    for comm in communicators:
        slab = Slab(comm, nx, ny)
        fft, shift = FFT(slab), (0.3, -0.1)
        own = whole[:, fft.columns]
        full, few = Surface(slab, fft, SIZE, own.copy()), Surface(slab, fft, SIZE, lowest(own, fft, waves))
        heights = [surface.heights(shift, slab.empty()) for surface in (full, few)]
        assert_allclose(heights[1], heights[0], rtol=0, atol=1e-14)
        forces = [surface.forces(pressure[slab.rows], shift) for surface in (full, few)]
        assert_allclose(forces[1], forces[0], rtol=0, atol=1e-11)
        found = [moments(surface.waves, fft, SIZE) for surface in (full, few) if surface.waves is not None]
        for name in ("m0", "m2", "m4"):
            assert getattr(found[1], name) == pytest.approx(getattr(found[0], name), rel=1e-13, abs=1e-30)
