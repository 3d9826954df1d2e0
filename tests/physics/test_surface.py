"""Heights of waves and shapes, moved by any distance, against their formulas."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.shapes import Round
from parcontact.physics.surface import Surface, single_wave

from .maps import coordinates, gathered, random_map
from .surfaces import CENTRE, SHAPES, SIZE, WAVES, A, R, heights_of, surface_of

pytestmark = pytest.mark.mpi


# -- waves ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("nx", "ny"), [(16, 12), (15, 11), (16, 1)])
@pytest.mark.parametrize("waves", [(0, 0), (1, 0), (0, 1), (3, 2), (-3, 2), (3, -2), (-4, -5), (0, -3), (-5, 0)])
def test_single_wave(communicators: list[MPI.Intracomm], nx: int, ny: int, waves: tuple[int, int]) -> None:
    """Any sign of its indices; on a grid of one row, waves along y are constant."""
    for comm in communicators:
        slab = Slab(comm, nx, ny)
        wave = (A, (waves[0], waves[1] if ny > 1 else 0), 0.4)
        heights = surface_of(slab, [wave]).heights((0.0, 0.0), slab.empty())
        assert_allclose(heights, heights_of(slab, [wave]), rtol=0, atol=1e-13 * A)


@pytest.mark.parametrize("waves", [(8, 0), (-8, 0), (0, 6), (0, -6), (8, 6), (8, 2), (-8, 2), (8, -2), (3, 6), (-3, 6)])
@pytest.mark.parametrize("phase", [0.0, 0.9])
def test_shortest_waves(comm: MPI.Intracomm, waves: tuple[int, int], phase: float) -> None:
    """Two cells per wavelength (Nyquist), alone or together with a longer one across."""
    slab = Slab(comm, 16, 12)
    heights = surface_of(slab, [(A, waves, phase)]).heights((0.0, 0.0), slab.empty())
    assert_allclose(heights, heights_of(slab, [(A, waves, phase)]), rtol=0, atol=1e-13 * A)


@pytest.mark.parametrize("shift", [(0.3, 0.0), (0.0, 0.25), (-0.7, 2.4), (1e3 + 0.5, -1e3 - 1 / 3)])
def test_shift_by_a_fraction(communicators: list[MPI.Intracomm], shift: tuple[float, float]) -> None:
    """Exact for waves longer than two cells; here to the rounding of a distance of a thousand cells."""
    for comm in communicators:
        slab = Slab(comm, 20, 13)
        moved = shift[0] * SIZE[0] / 20, shift[1] * SIZE[1] / 13
        heights = surface_of(slab, WAVES).heights(moved, slab.empty())
        assert_allclose(heights, heights_of(slab, WAVES, moved), rtol=0, atol=1e-12 * A)


def test_quarters_make_a_whole(comm: MPI.Intracomm) -> None:
    """A surface with all waves but the shortest, moved by four quarters of a cell, is the old one a cell further on."""
    slab = Slab(comm, 17, 15)
    fft = FFT(slab)
    surface = Surface(slab, fft, SIZE, fft.forward(random_map(17, 15)[slab.rows]).copy())
    dx, dy = surface.cell
    positions = [(quarter * dx / 4, quarter * dy / 4) for quarter in range(5)]
    maps = [gathered(surface.heights(position, slab.empty()), slab) for position in positions]
    assert_allclose(maps[4], np.roll(maps[0], (1, 1), axis=(0, 1)), atol=1e-13)
    assert np.abs(maps[1] - maps[0]).max() > 0.1
    assert_allclose([np.mean(heights**2) for heights in maps], np.mean(maps[0] ** 2), rtol=1e-13)


def test_checkerboard(comm: MPI.Intracomm) -> None:
    """At Nyquist along both axes: a cell changes its sign, two bring it back, half a cell leaves nothing."""
    slab = Slab(comm, 16, 12)
    surface = surface_of(slab, [(A, (8, 6), 0.0)])
    dx, dy = surface.cell
    j, i = np.indices((12, 16))[:, slab.rows]
    board = A * (-1.0) ** (i + j)
    for shift, factor in [((0, 0), 1), ((dx, 0), -1), ((0, dy), -1), ((dx, dy), 1), ((2 * dx, 0), 1), ((dx / 2, 0), 0)]:
        assert_allclose(surface.heights(shift, slab.empty()), factor * board, rtol=0, atol=1e-13 * A)


def test_units_of_height(comm: MPI.Intracomm) -> None:
    """Given once or again, waves and shapes alike."""
    slab = Slab(comm, 16, 12)
    surface = surface_of(slab, WAVES)
    surface.shapes = [Round(1e-3, (1e-3, 2e-4))]
    metres, pressure = surface.heights((0.0, 0.0), slab.zeros()).copy(), random_map(16, 12)[slab.rows] ** 2
    forces = np.array(surface.forces(pressure, (0.0, 0.0)))
    for unit in (1e-6, 2.0**-20):
        surface.rescale(unit)
        assert_allclose(surface.heights((0.0, 0.0), slab.zeros()) * unit, metres, rtol=1e-12, atol=1e-20)
        assert_allclose(np.array(surface.forces(pressure, (0.0, 0.0))) * unit, forces, rtol=1e-12)


# -- shapes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (1.3e-4, -7e-5)])
def test_heights_of_shapes(communicators: list[MPI.Intracomm], name: str, shift: tuple[float, float]) -> None:
    """Anywhere on an unbounded plane; the difference of roots in the formula costs digits, not ours."""
    shape, formula = SHAPES[name]
    for comm in communicators:
        slab = Slab(comm, 18, 13)
        x, y = coordinates(slab, SIZE)
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=False)
        heights = surface.heights(shift, slab.empty())
        expected = formula(x - CENTRE[0] - shift[0], y - CENTRE[1] - shift[1])
        assert_allclose(heights, expected, rtol=0, atol=1e-15 * R)


def test_shapes_repeat_on_a_periodic_box(comm: MPI.Intracomm) -> None:
    """The nearest image counts: moved by a box nothing changes, by cells the map rolls."""
    slab = Slab(comm, 20, 10)
    surface = Surface(slab, FFT(slab), SIZE, shapes=[Round(R, CENTRE)])
    start = gathered(surface.heights((0.0, 0.0), slab.empty()), slab)
    for columns, rows in [(20, 0), (0, -10), (3, 0), (-8, 4), (47, 33)]:
        shift = columns * SIZE[0] / 20, rows * SIZE[1] / 10
        moved = gathered(surface.heights(shift, slab.empty()), slab)
        assert_allclose(moved, np.roll(start, (rows, columns), axis=(0, 1)), rtol=0, atol=1e-12 * R)
    assert start.min() >= -((SIZE[0] / 2) ** 2 + (SIZE[1] / 2) ** 2) / (2 * R)


def test_a_small_sphere_ends_at_its_equator() -> None:
    sphere = Round(1.0, (0.0, 0.0), exact=True)
    x = np.array([0.0, 0.6, 1.0, 1.5, 40.0])
    assert_allclose(sphere.height(x, 0 * x), [0.0, -0.2, -1.0, -1.0, -1.0], atol=1e-15)
    assert_allclose(sphere.slope(x, 0 * x)[0], [0.0, -0.75, 0.0, 0.0, 0.0], atol=1e-15)


def test_a_shallow_sphere_keeps_its_digits() -> None:
    """Where R - sqrt(R^2 - r^2) would lose them all."""
    assert_allclose(Round(1.0, (0.0, 0.0), exact=True).height(np.array(1e-9), np.array(0.0)), -5e-19, rtol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_slopes_of_shapes(name: str) -> None:
    """Against central differences over a millionth of the radius; their error is some 1e-10."""
    shape, _ = SHAPES[name]
    y, x = 0.6 * R * (np.indices((7, 7)) / 6 - 0.45)
    step = 1e-6 * R
    along_x = (shape.height(x + step, y) - shape.height(x - step, y)) / (2 * step)
    along_y = (shape.height(x, y + step) - shape.height(x, y - step)) / (2 * step)
    assert_allclose(shape.slope(x, y), [along_x, along_y], atol=1e-9)


def test_waves_and_shapes_add_up(comm: MPI.Intracomm) -> None:
    slab = Slab(comm, 20, 13)
    fft = FFT(slab)
    shapes = [Round(R, CENTRE), Round(2 * R, (0.0, 0.0), (0.0, 1.0))]
    both = Surface(slab, fft, SIZE, single_wave(fft, *WAVES[1]), shapes)
    shift = (1e-4, 3e-5)
    parts = [Surface(slab, fft, SIZE, single_wave(fft, *WAVES[1]))]
    parts += [Surface(slab, fft, SIZE, shapes=[shape]) for shape in shapes]
    total = np.sum([part.heights(shift, slab.empty()) for part in parts], axis=0)
    assert_allclose(both.heights(shift, slab.empty()), total, rtol=0, atol=1e-15 * R)
    pressure = np.abs(random_map(20, 13))[slab.rows]
    forces = np.sum([part.forces(pressure, shift) for part in parts], axis=0)
    assert_allclose(both.forces(pressure, shift), forces, rtol=1e-12)


def test_flat(comm: MPI.Intracomm) -> None:
    slab = Slab(comm, 8, 8)
    surface = Surface(slab, FFT(slab), SIZE)
    assert not surface.heights((1e-4, 0.0), slab.empty()).any()
    assert surface.forces(np.ones(slab.shape), (0.0, 0.0)) == [0.0, 0.0]
    assert slab.tally["fft"] == 0
