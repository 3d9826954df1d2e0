"""The same contact, moved, mirrored, scaled or drawn out, by the contact solver.

What is exact in real numbers is asked for to some hundred roundings; two solves to 1e-11 agree to 1e-9 of the highest
pressure.
"""

import dataclasses
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.solve.problem import MeanPressure

from .bodies import BODIES, TIGHT, keep, rough, solve, solver, white


@pytest.mark.parametrize("load", [0.05, 1.0])
def test_height_offset(load: float) -> None:
    """An offset of 1e6 times the roughness leaves its heights 1e-10 of themselves: the contact to 1e-8.

    The tolerance is some 1e-9 of the roughness, of which the length of the certificate is a sixth.
    """
    h = rough(64)
    offset = 1e6 * np.ptp(h)
    found, shifted = (solve(heights, load, tolerance=6e-9) for heights in (h, h + offset))
    assert_allclose(shifted.p, found.p, atol=1e-7 * found.p.max())
    assert_allclose(shifted.d + offset, found.d, atol=1e-8 * np.ptp(h))
    assert abs(shifted.iterations - found.iterations) <= 2


@pytest.mark.parametrize("factor", [2.0**-40, 2.0**60])
def test_scaling_by_powers_of_two_is_exact(factor: float) -> None:
    """The problem is linear in heights and loads together."""
    h = rough(48)
    body = solver(h)
    found = keep(body.solve(h, MeanPressure(0.4), np.zeros_like(h)))
    body.solver.height *= factor
    scaled = keep(body.solve(factor * h, MeanPressure(factor * 0.4), np.zeros_like(h)))
    assert np.array_equal(scaled.p, factor * found.p)
    assert scaled.d == factor * found.d
    length = factor * found.certificate.length
    assert scaled.certificate == dataclasses.replace(found.certificate, length=length)


def test_scaling_of_lengths() -> None:
    """Lengths times c at the same heights: pressures over c."""
    h = rough(48)
    found = solve(h, 0.4, tolerance=TIGHT)
    wide = solve(h, 0.4 / 1e3, tolerance=TIGHT, size=(1e3, 1e3))
    assert_allclose(1e3 * wide.p, found.p, atol=1e-9 * found.p.max())


@pytest.mark.parametrize(("boundary", "kernel"), BODIES)
def test_mirror_images_and_transposition(boundary: str, kernel: str) -> None:
    h = white((24, 36))
    options: dict[str, Any] = {"boundary": boundary, "kernel": kernel, "tolerance": TIGHT}
    found = solve(h, 2.0, size=(1.5, 1.0), **options)
    limit = 1e-9 * found.p.max()
    assert_allclose(solve(h[:, ::-1].copy(), 2.0, size=(1.5, 1.0), **options).p[:, ::-1], found.p, atol=limit)
    assert_allclose(solve(h[::-1].copy(), 2.0, size=(1.5, 1.0), **options).p[::-1], found.p, atol=limit)
    assert_allclose(solve(h.T.copy(), 2.0, size=(1.0, 1.5), **options).p.T, found.p, atol=limit)


def test_whole_cell_shifts() -> None:
    h = white((24, 36))
    found = solve(h, 2.0, tolerance=TIGHT)
    moved = solve(np.roll(h, (5, 7), axis=(0, 1)), 2.0, tolerance=TIGHT)
    assert_allclose(moved.p, np.roll(found.p, (5, 7), axis=(0, 1)), atol=1e-9 * found.p.max())


def test_long_thin_box() -> None:
    """A wave along x on a box of 1e4 : 1 is the one-dimensional wave, whatever the other direction is."""
    wave = np.cos(2 * np.pi * np.arange(64) / 64)
    square = solve(np.tile(wave, (64, 1)), 1.0, tolerance=TIGHT)
    for rows in (1, 5):
        thin = solve(np.tile(wave, (rows, 1)), 1.0, tolerance=TIGHT, size=(1.0, 1e-4))
        assert_allclose(thin.p, np.tile(square.p[0], (rows, 1)), atol=1e-9 * square.p.max())
