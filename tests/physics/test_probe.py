"""Measures of maps that are known: SI values from a run's own units."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from numpy.testing import assert_allclose

from parcontact.effects.interface.effect import shares
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.energy import Probe
from parcontact.physics.records import SIDE, Units
from parcontact.physics.surface import InterfaceFriction, Round, Surface, single_wave

pytestmark = pytest.mark.mpi

LX, LY, NX, NY = 2e-3, 1e-3, 16, 8
HEIGHT, ALPHA = 3e-6, 0.7
UNITS = Units.near(2 * HEIGHT, LX, 1e6)
PRESSURE = ALPHA * UNITS.pressure  # Pa that the number 1 in a map stands for


def wave(comm: MPI.Intracomm, waves: tuple[int, int]) -> Surface:
    fft = FFT(Slab(comm, NX, NY))
    surface = Surface(fft.slab, fft, (LX, LY), single_wave(fft, HEIGHT, waves, 0.0))
    surface.rescale(UNITS.height)
    return surface


def angle(slab: Slab, waves: tuple[int, int]) -> np.ndarray:
    x, y = np.arange(NX) / NX, np.arange(NY)[slab.rows, None] / NY
    return 2 * np.pi * (waves[0] * x + waves[1] * y)


@pytest.mark.parametrize("waves", [(3, 0), (0, 2), (3, 2), (-3, 2)])
@pytest.mark.parametrize("cells", [(0.0, 0.0), (2.0, 0.0), (0.3, -1.7)])
def test_pressure_ahead_of_a_wave(comm: MPI.Intracomm, waves: tuple[int, int], cells: tuple[float, float]) -> None:
    """p = p0 + p1 cos(phase + lead) on h = H cos(phase) is drawn by `-p1 H q sin(lead)/2` per area; rounding."""
    surface = wave(comm, waves)
    slab, lead, p0, p1 = surface.slab, 0.6, 5.0, 2.0
    moved = 2 * np.pi * (waves[0] * cells[0] / NX + waves[1] * cells[1] / NY)
    shift = cells[0] * LX / NX, cells[1] * LY / NY
    p, h, d = slab.empty(), surface.heights(shift, slab.empty()), 0.25
    p[...] = p0 + p1 * np.cos(angle(slab, waves) - moved - lead)
    found = Probe(slab, surface, UNITS).measure(p, ALPHA, h + d, h, d, p, shift)
    q = 2 * np.pi * np.array([waves[0] / LX, waves[1] / LY])
    force = -0.5 * p1 * PRESSURE * HEIGHT * math.sin(lead) * q * LX * LY
    assert_allclose([found.force_x, found.force_y], force, rtol=1e-12, atol=1e-13 * np.abs(force).max())
    assert_allclose(found.pressure, p0 * PRESSURE, rtol=1e-14)
    assert_allclose(found.friction, math.hypot(*force) / (p0 * PRESSURE * LX * LY), rtol=1e-12)
    assert_allclose(found.max_pressure, slab.reduce((), [p.max(initial=0.0)])[0] * PRESSURE, rtol=1e-14)
    assert (found.contact_area, found.approach) == (1.0, d * UNITS.height)
    assert_allclose(found.mean_gap, 0.0, atol=1e-14 * UNITS.height)


def test_force_on_a_shape(comm: MPI.Intracomm) -> None:
    """One loaded point on the flank of a paraboloid: p dA times its slope -x/R; rounding."""
    slab = Slab(comm, NX, NY)
    surface = Surface(slab, FFT(slab), (LX, LY), shapes=[Round(1e-2, (LX / 2, LY / 2))], periodic=(False, False))
    surface.rescale(UNITS.height)
    p, u = slab.zeros(), slab.zeros()
    for row in range(NY)[slab.rows]:
        if row == NY // 2:
            p[row - slab.rows.start, NX // 2 + 2] = 3.0
    found = Probe(slab, surface, UNITS).measure(p, ALPHA, u, u, 0.0, p, (LX / NX, 0.0))
    distance = LX / NX  # two cells from where the centre was, which has moved by one
    assert_allclose(found.force_x, 3.0 * PRESSURE * (LX / NX) * (LY / NY) * (-distance / 1e-2), rtol=1e-13)
    assert_allclose(found.friction, distance / 1e-2, rtol=1e-13)
    assert found.force_y == 0.0


@settings(max_examples=40)
@given(st.integers(1, 9), st.integers(1, 5), st.booleans(), st.integers(0, 99))
def test_area_corrected_by_its_edges(nx: int, ny: int, periodic: bool, seed: int) -> None:
    """Cells counted less `excess_of` for each side on the edge of contact: whole numbers, so the same on every rank.

    `straight` compares the lengths of these sides along x and along y. In a periodic box of two cells each side is
        there twice, and counts twice; of one cell, not at all. Sides on the edge of a free box do not count.
    """
    slab = Slab(MPI.COMM_WORLD, nx, ny)
    surface = Surface(slab, FFT(slab), (LX, LY), shapes=[Round(1e-2, (0.0, 0.0))], periodic=(periodic, periodic))
    pressed = np.random.default_rng(seed).random((ny, nx)) < 0.5
    p, none = slab.zeros(), slab.zeros()
    p[...] = pressed[slab.rows]
    found = Probe(slab, surface, UNITS).measure(p, ALPHA, none, none, 0.0, p, (0.0, 0.0))
    if periodic:
        each = [np.count_nonzero(pressed != np.roll(pressed, 1, axis)) for axis in (0, 1)]
    else:
        each = [np.count_nonzero(np.diff(pressed, axis=axis)) for axis in (0, 1)]
    sides, (along_x, along_y) = sum(each), (each[0] * LX / nx, each[1] * LY / ny)
    assert found.contact_area == np.count_nonzero(pressed) / (nx * ny)
    long = min(LX / nx, LY / ny) / max(LX / nx, LY / ny)
    excess = SIDE if 1 in (nx, ny) else SIDE * long**0.1
    assert found.contact_area_corrected == (np.count_nonzero(pressed) - excess * sides) / (nx * ny)
    assert_allclose(found.straight * (along_x + along_y), abs(along_x - along_y), rtol=1e-14)


@settings(max_examples=40)
@given(st.integers(1, 9), st.integers(1, 5), st.booleans(), st.integers(0, 99))
@example(2, 2, True, 75)  # nothing yields, and yet the area is at least load over hardness
def test_area_and_gap_where_points_yield(nx: int, ny: int, periodic: bool, seed: int) -> None:
    """Between a point that has yielded and an open one the share 1 - p/H of a cell is in excess; nothing at the former;
    elsewhere edges are those of an elastic contact, and their excess is the most. Points that have yielded have no gap.
    Rounding."""
    slab, hardness = Slab(MPI.COMM_WORLD, nx, ny), 2.0 * PRESSURE
    surface = Surface(slab, FFT(slab), (LX, LY), shapes=[Round(1e-2, (0.0, 0.0))], periodic=(periodic, periodic))
    random = np.random.default_rng(seed)
    whole, gap = random.choice([0.0, 0.5, 1.5, 2.0], size=(ny, nx)), random.normal(size=(ny, nx))
    p, u, h = slab.zeros(), slab.zeros(), slab.zeros()
    p[...], u[...] = whole[slab.rows], gap[slab.rows] + 0.5
    found = Probe(slab, surface, UNITS, hardness=hardness).measure(p, ALPHA, u, h, 0.5, p, (0.0, 0.0))
    around = np.pad(whole, 1, mode="wrap" if periodic else "edge")
    alongside = np.array([around[1:-1, :-2], around[1:-1, 2:], around[:-2, 1:-1], around[2:, 1:-1]])
    sides, partly = (alongside == 0.0).sum(axis=0), (whole > 0.0) & (whole < 2.0)
    sharp = partly & (sides > 0) & (alongside == 2.0).any(axis=0)
    long = min(LX / nx, LY / ny) / max(LX / nx, LY / ny)
    excess = SIDE if 1 in (nx, ny) else SIDE * long**0.1
    taken = (1.0 - whole[sharp] / 2.0).sum() + excess * sides[partly & ~sharp].sum()
    taken = min(taken, excess * sides[whole > 0.0].sum())
    assert_allclose(found.spared * nx * ny, excess * sides[whole > 0.0].sum() - taken, atol=1e-5)
    area = np.count_nonzero(whole) - taken
    area = max(area, whole.sum() / 2.0) if whole.any() else 0.0
    assert_allclose(found.contact_area_corrected, area / (nx * ny), rtol=1e-5)
    assert_allclose(found.mean_gap, gap[whole < 2.0].sum() / (nx * ny) * UNITS.height, atol=1e-13 * UNITS.height)


@pytest.mark.parametrize("touches", [False, True])
def test_a_load_on_nothing_has_no_friction(comm: MPI.Intracomm, touches: bool) -> None:
    """Surfaces that stick and touch nowhere carry no load: one above 0 is an error of the solve, however small."""
    surface = wave(comm, (3, 0))
    slab, h = surface.slab, surface.heights((0.0, 0.0), surface.slab.empty())
    p = 1e-9 * (1.0 + np.cos(angle(slab, (3, 0)) - 0.6))
    touching = np.full_like(p, touches)
    found = Probe(slab, surface, UNITS).measure(p, ALPHA, h, h, 0.0, touching, (0.0, 0.0))
    assert found.pressure > 0.0
    assert (found.friction > 0.0) == touches


@pytest.mark.parametrize(("more", "defined"), [(0.0, False), (1e-12, False), (1e-6, True), (-1e-6, False)])
def test_no_friction_where_pull_and_push_balance(comm: MPI.Intracomm, more: float, defined: bool) -> None:
    """A load that rounding leaves of two forces is none; a load of a millionth of the pull is one."""
    surface = wave(comm, (3, 0))
    slab, h = surface.slab, surface.heights((0.0, 0.0), surface.slab.empty())
    p, instant = more + np.cos(angle(slab, (3, 0)) - 0.6), ((0.0, 0.0), (0.3, 0.0))
    (tension,) = slab.sum(-float(np.minimum(p, 0.0).sum()))
    pull = tension * ALPHA * UNITS.pressure * LX * LY / (slab.nx * slab.ny)
    probe = Probe(slab, surface, UNITS, [InterfaceFriction(2e5)])
    found = probe.measure(p, ALPHA, h, h, 0.0, np.ones_like(p), *instant, least_load=1e-9 * pull)
    assert found.force_x != 0.0
    assert_allclose(found.force_interface, 2e5 * LX * LY, rtol=1e-15)
    assert [each != 0.0 for each in (found.friction, found.friction_x, *shares(found, instant[1]))] == [defined] * 4
