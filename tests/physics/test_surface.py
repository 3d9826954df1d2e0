"""Heights of waves and shapes, moved by any distance, against their formulas."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.body import MovedHeights
from parcontact.physics.surface import PARTS, AlongX, AnyFraction, Round, Surface, single_wave

from .maps import coordinates, gathered, product, random_map
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


# -- shapes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (1.3e-4, -7e-5)])
def test_heights_of_shapes(communicators: list[MPI.Intracomm], name: str, shift: tuple[float, float]) -> None:
    """Anywhere on an unbounded plane; the difference of roots in the formula costs digits, not ours."""
    shape, formula = SHAPES[name]
    for comm in communicators:
        slab = Slab(comm, 18, 13)
        x, y = coordinates(slab, SIZE)
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=(False, False))
        heights = surface.heights(shift, slab.empty())
        expected = formula(x - CENTRE[0] - shift[0], y - CENTRE[1] - shift[1])
        assert_allclose(heights, expected, rtol=0, atol=1e-15 * R)


def test_a_small_sphere_ends_at_its_equator() -> None:
    sphere = Round(1.0, (0.0, 0.0), exact=True)
    x = np.array([0.0, 0.6, 1.0, 1.5, 40.0])
    assert_allclose(sphere.height(x, 0 * x), [0.0, -0.2, -1.0, -1.0, -1.0], atol=1e-15)
    assert_allclose(sphere.slope(x, 0 * x)[0], [0.0, -0.75, 0.0, 0.0, 0.0], atol=1e-15)


def test_a_shallow_sphere_keeps_its_digits() -> None:
    """Where R - sqrt(R^2 - r^2) would lose them all."""
    assert_allclose(Round(1.0, (0.0, 0.0), exact=True).height(np.array(1e-9), np.array(0.0)), -5e-19, rtol=1e-12)


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


# -- the tangential force on waves and shapes, against the formulas of their slopes -----------------------------------


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
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=(periodic, periodic))
        assert_allclose(surface.forces(pressure, shift), expected, rtol=1e-11, atol=1e-12)


# -- where the surface is: by whole cells with an index offset, by any fraction with new heights ----------------------

NX, NY = 17, 11


def surface_on(comm: MPI.Intracomm) -> Surface:
    """All waves that the grid holds, and a sphere."""
    slab = Slab(comm, NX, NY)
    fft = FFT(slab)
    return Surface(
        slab, fft, SIZE, fft.forward(1e-6 * random_map(NX, NY)[slab.rows]).copy(), [Round(1e-3, (5e-4, 2e-4))]
    )


def whole(heights: MovedHeights, slab: Slab) -> Array:
    return gathered(np.roll(heights.base, heights.offset, axis=1), slab)


def test_whole_cells(communicators: list[MPI.Intracomm]) -> None:
    """Any number of them, either way, from one map; equal to the heights made anew."""
    for comm in communicators:
        surface = surface_on(comm)
        path, exact = AlongX(surface), AnyFraction(surface)
        start = path.at((0.0, 0.0))
        for cells in (0, 1, 5, 16, 17, 40, -3, 17001):
            position = (cells * SIZE[0] / NX, 0.0)
            moved = path.at(position)
            assert moved.base is start.base
            assert moved.offset == cells % NX
            assert_allclose(whole(moved, surface.slab), np.roll(whole(start, surface.slab), cells, axis=1), rtol=0)
            assert_allclose(whole(moved, surface.slab), whole(exact.at(position), surface.slab), rtol=0, atol=1e-15)


def test_any_fraction(communicators: list[MPI.Intracomm]) -> None:
    """Always from the original, never from what has been moved: the way to a position does not matter."""
    for comm in communicators:
        surface = surface_on(comm)
        path = AnyFraction(surface)
        for position in [(0.0, 0.0), (1.7e-5, 0.0), (-3e-4, 2.2e-5), (0.11, -0.2), (1.7e-5, 0.0)]:
            direct = surface.heights(position, surface.slab.empty())
            moved = path.at(position)
            assert moved.offset == 0
            assert_array_equal(moved.base, direct)


def test_whole_cells_cost_nothing(comm: MPI.Intracomm) -> None:
    surface = surface_on(comm)
    tally = surface.slab.tally
    before = tally.copy()
    path = AlongX(surface)
    assert tally.since(before)["fft"] == 1
    before = tally.copy()
    for cells in range(5):
        path.at((cells * SIZE[0] / NX, 0.0))
    assert tally.since(before) == {}


def test_the_same_part_of_a_cell_costs_nothing(comm: MPI.Intracomm) -> None:
    """Whatever the rounding of positions, and to the same digits, whichever of them came first."""
    surface = surface_on(comm)
    tally = surface.slab.tally
    path, other = AlongX(surface, PARTS), AlongX(surface, PARTS)
    positions = [(cells + 0.7) * (SIZE[0] / NX) * (1.0 + n * 2e-16) for n, cells in enumerate((2, 3, 5, 1000))]
    first = path.at((positions[0], 0.0))
    before = tally.copy()
    for position, cells in zip(positions, (2, 3, 5, 1000), strict=True):
        moved = path.at((position, 0.0))
        assert moved.base is first.base
        assert moved.offset == cells % NX
    assert tally.since(before) == {}
    assert_array_equal(other.at((positions[-1], 0.0)).base, first.base)
