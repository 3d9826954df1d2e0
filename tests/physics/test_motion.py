"""Where the surface is: by whole cells with an index offset, by any fraction with new heights."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose, assert_array_equal

from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.body import MovedHeights
from parcontact.physics.motion import PARTS, AlongX, AnyFraction
from parcontact.physics.shapes import Round
from parcontact.physics.surface import Surface

from .maps import gathered, random_map

pytestmark = pytest.mark.mpi

SIZE = (2e-3, 5e-4)
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
