"""Heights of waves and shapes, moved by any distance, against their formulas."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.body import MovedHeights
from parcontact.physics.motion import PARTS, AlongX, AnyFraction
from parcontact.physics.shapes import Round
from parcontact.physics.surface import Surface, single_wave

from .maps import coordinates, gathered, product, random_map
from .surfaces import CENTRE, SHAPES, SIZE, WAVES, A, R, heights_of, slopes_of, surface_of

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
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=(False, False))
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


@pytest.mark.parametrize("shift", [(0.0, 0.0), (3.1e-5, -1.7e-5)])
def test_force_is_the_sum_over_points(communicators: list[MPI.Intracomm], shift: tuple[float, float]) -> None:
    """Of any pressure times the exact slope of a sum of waves."""
    for comm in communicators:
        slab = Slab(comm, 20, 13)
        pressure = np.abs(random_map(20, 13))[slab.rows]
        expected = [product(pressure, slope, slab) for slope in slopes_of(slab, WAVES, shift)]
        assert_allclose(surface_of(slab, WAVES).forces(pressure, shift), expected, rtol=1e-12)


def test_no_force_on_a_checkerboard(comm: MPI.Intracomm) -> None:
    """The slope of the shortest wave is 0 at all points."""
    slab = Slab(comm, 16, 12)
    for waves in [(8, 6), (8, 0), (0, 6)]:
        surface = surface_of(slab, [(A, waves, 0.0)])
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
        surface = Surface(slab, FFT(slab), SIZE, shapes=[shape], periodic=(periodic, periodic))
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


def test_standing_still_makes_no_new_heights(comm: MPI.Intracomm) -> None:
    surface = surface_on(comm)
    tally = surface.slab.tally
    path = AnyFraction(surface)
    first = path.at((1e-5, 2e-5))
    before = tally.copy()
    assert path.at((1e-5, 2e-5)).base is first.base
    assert tally.since(before) == {}
    path.at((1.1e-5, 2e-5))
    assert tally["shift"] == 2


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


def test_part_of_a_cell(communicators: list[MPI.Intracomm]) -> None:
    """The heights made anew where the surface is, to their rounding and 1e-9 of what a cell changes them by."""
    for comm in communicators:
        surface = surface_on(comm)
        path, exact = AlongX(surface, PARTS), AnyFraction(surface)
        for cells in (0.0, 0.3, 1.0 - 1e-9, 7.5, -3.25, 17.3):
            position = (cells * SIZE[0] / NX, 0.0)
            assert_allclose(whole(path.at(position), surface.slab), whole(exact.at(position), surface.slab), atol=1e-14)


def test_a_very_small_part_of_a_cell(comm: MPI.Intracomm) -> None:
    """Steps of 1e-7 of a cell move the surface by that, to 1 %, which is 1e-9 of a cell: stiff bodies feel them."""
    surface = surface_on(comm)
    path, exact = AlongX(surface, PARTS), AnyFraction(surface)
    start = whole(exact.at((0.0, 0.0)), surface.slab)
    for cells in (1e-7, -1e-7, 6e-7):
        position = (cells * SIZE[0] / NX, 0.0)
        change = whole(exact.at(position), surface.slab) - start
        found = whole(path.at(position), surface.slab) - start
        assert_allclose(found, change, atol=0.01 * np.abs(change).max())


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
