"""Compiled loops against the same in numpy; sums and maps of some ten digits, so rounding only."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics import loops
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.loops import lowest, rows_of, shape_of
from parcontact.physics.records import Units
from parcontact.physics.roughness import moments
from parcontact.physics.surface import Surface, friction_by_energy

NY, NX = 5, 7
BOUNDS = 0.0, np.inf
OFFSETS = [0, 1, 3, NX - 1, NX, 2 * NX + 2, -1, -NX - 3]


def maps(count: int, shape: tuple[int, int] = (NY, NX)) -> list[np.ndarray]:
    return list(np.random.default_rng(count).normal(size=(count, *shape)))


def roll(field: np.ndarray, offset: int) -> np.ndarray:
    return np.roll(field, offset, axis=1)


@pytest.mark.parametrize("count", [0, 3, 4, 9])
def test_begin(count: int) -> None:
    """Any number of branches, of which the loop takes four at once."""
    random = np.random.default_rng(count)
    branches, (du, buffer, u, heights) = random.normal(size=(count, NY, NX)), maps(4)
    decay, gain, back, weight = random.normal(size=(4, count, 1, 1))
    advanced = decay * branches + gain * du + back * buffer
    expected = roll(heights, 3) + (weight * advanced).sum(axis=0) - 0.3 * u + 0.7 * du
    a, b, c, w = (each[:, 0, 0].copy() for each in (decay, gain, back, weight))
    loops.begin(branches, a, b, c, du, buffer, w, 0.3, 0.7, u, heights, 3)
    assert_allclose(branches, advanced, atol=1e-14)
    assert_allclose(buffer, expected, atol=1e-14)


@pytest.mark.parametrize("shift", OFFSETS)
def test_travel(shift: int) -> None:
    """A pressure that grows evenly while it moves goes on so; where it would become negative it is 0."""
    p, slope = np.maximum(maps(2), 0.0)
    earlier, now, next_ = (roll(np.maximum(p + n * slope, 0.0), n * shift) for n in range(3))
    kept, out = now.copy(), np.empty_like(now)
    loops.travel(now, earlier, 2.0, 1.0, shift, *BOUNDS, out)
    assert_allclose(out, next_, rtol=1e-14, atol=1e-14)
    assert_array_equal(now, kept)
    loops.travel(now, earlier, 2.0, 1.0, shift, *BOUNDS, earlier)
    assert_array_equal(earlier, out)
    loops.travel(out, now, 1.0, 1e3, shift, *BOUNDS, out)
    assert out.min() == 0.0


# -- the tangential force of a pressure on the body's own surface -----------------------------------------------------

WEIGHTS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
DIRECTIONS = [(1.0, 0.0), (0.6, 0.8), (0.0, -1.0)]


def pressure_and_displacement(n: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(n)
    return random.random((n, n)) * (random.random((n, n)) < 0.4), random.random((n, n))


@pytest.mark.mpi
@pytest.mark.parametrize("cyclic", [True, False])
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("n", [3, 7, 32])
def test_differences_of_the_eighth_order(
    comm: MPI.Intracomm, n: int, direction: tuple[float, float], cyclic: bool
) -> None:
    """The sums written out with numpy, also where ranks have fewer rows than a difference is wide; to round-off."""
    slab, (p, u) = Slab(comm, n, n), pressure_and_displacement(n)
    wide = np.pad(u, 4, mode="wrap" if cyclic else "edge")
    inside = slice(4, n + 4)
    along_x = sum(w * (wide[inside, 5 + k :][:, :n] - wide[inside, 3 - k :][:, :n]) for k, w in enumerate(WEIGHTS))
    along_y = sum(w * (wide[5 + k :][:n] - wide[3 - k :][:n])[:, inside] for k, w in enumerate(WEIGHTS))
    expected = -(p * (direction[0] * along_x / 0.5 + direction[1] * along_y / 0.25)).sum() / p.sum()
    rows = slab.rows
    found = friction_by_energy(slab, p[rows].copy(), u[rows].copy(), (0.5, 0.25), direction, (cyclic, cyclic))
    assert found == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_elastic_body_has_no_friction(direction: tuple[float, float], free: bool) -> None:
    """As its operator commutes with differences: 0 to round-off for any pressure, away from the edge of a free box."""
    slab, (p, _) = Slab.alone(32, 32), pressure_and_displacement(32)
    if free:
        p[:4], p[-4:], p[:, :4], p[:, -4:] = 0.0, 0.0, 0.0, 0.0
    u = HalfSpace((1.0, 1.0), free=free).operator(FFT(slab)).apply(p, slab.empty())
    found = friction_by_energy(slab, p, u, (1 / 32, 1 / 32), direction, (not free, not free))
    assert abs(found) < 1e-13 * abs(np.diff(u)).max() * 32


def test_no_load_has_no_friction() -> None:
    slab = Slab.alone(8, 8)
    assert math.isnan(friction_by_energy(slab, slab.zeros(), slab.zeros(), (1.0, 1.0), (1.0, 0.0), (True, True)))


# -- the lowest waves of a transform, alone and dealt to ranks --------------------------------------------------------

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


# -- inner units: powers of two near what is typical ------------------------------------------------------------------

VALUES = st.floats(1e-15, 1e15)


@given(height=VALUES, length=VALUES, modulus=VALUES, value=st.floats(1e-100, 1e100))
def test_no_digit_is_lost(height: float, length: float, modulus: float, value: float) -> None:
    units = Units.near(height, length, modulus)
    for unit, typical in ((units.height, height), (units.length, length), (units.modulus, modulus)):
        assert unit / 1.5 < typical < unit * 1.5
    for unit in (units.pressure, units.height, units.length, units.modulus):
        assert value / unit * unit == value


def test_flat_surface() -> None:
    units = Units.near(0.0, 1e-3, 1e6)
    assert units.height == units.length == 2.0**-10


def test_derived_units() -> None:
    """Pressure: modulus times strain."""
    units = Units(2.0**-20, 2.0**-10, 2.0**20)
    assert units.pressure == pytest.approx(2.0**10)
