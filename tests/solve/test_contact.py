"""The contact solver against the textbook one, closed forms and its own certificate.

Tolerances: a pressure follows the gap it is certified by, so two solves to 1e-11 agree to 1e-9 of the highest pressure;
what is exact in real numbers is asked for to some hundred roundings.
"""

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from parcontact.solve import certificate
from parcontact.solve.problem import Approach, MeanPressure

from . import polonsky_keer
from .bodies import BODIES, MODULUS, ROUNDING, TIGHT, keep, rough, solve, solver, white

# -- against others ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.02, 0.1, 0.5])
def test_agrees_with_polonsky_and_keer(load: float) -> None:
    """Pressures to 1e-8 of their mean, the oracle's own error: it ends when an iteration changes them by 1e-10."""
    h = rough(64)
    expected, iterations = polonsky_keer.solve(h, load * MODULUS, (1.0, 1.0), 1e-10)
    found = solve(h, load * MODULUS, tolerance=TIGHT)
    assert np.abs(found.p - expected).sum() < 1e-8 * expected.sum()
    assert_allclose(found.p > 1e-6 * load, expected > 1e-6 * load)
    assert found.iterations < iterations


@pytest.mark.parametrize("points", [256, 512, 1024])
@pytest.mark.parametrize("seed", [1, 2])
def test_iterations_from_a_cold_start(points: int, seed: int) -> None:
    """The promise: at most 32 to 5e-6 on every grid, for 5 to 75 % of contact; at most 14 where contact is 99.8 %.

    That is a gap of 1e-6 of the surface's height, of which the length of the certificate is less than a fifth.
    """
    h = rough(points, seed)
    for load, limit in ((0.02, 32), (0.1, 32), (0.5, 32), (1.5, 14)):
        found = solve(h, load * MODULUS, tolerance=5e-6)
        assert found.certificate.length < 0.2 * np.ptp(h)
        area = np.count_nonzero(found.p) / found.p.size
        print(f"{points} points, seed {seed}, p/(E* slope) = {load}: {found.iterations} iterations, {area:.1%} contact")
        assert found.iterations <= limit
    assert 0.995 < area < 1.0


def test_full_contact_is_solved_in_one_iteration() -> None:
    """`p = P0 + K h`: the preconditioner is the inverse of the operator, and nothing is cut."""
    h = rough(64)
    body = solver(h, tolerance=TIGHT)
    found = keep(body.solve(h, MeanPressure(20.0), np.zeros_like(h)))
    expected = 20.0 + body.preconditioner.apply(h - h.mean(), np.empty_like(h))
    assert found.iterations == 1
    assert_allclose(found.p, expected, atol=1e-11 * expected.max())
    assert_allclose(found.d, -h.mean(), atol=1e-12)


def test_single_cell_on_a_free_body() -> None:
    """The middle of a square cell of side a under the pressure p sinks by `asinh(1) p a/(pi G)` (Love, nu = 1/2)."""
    h = np.zeros((16, 16))
    h[5, 9] = 1.0
    found = solve(h, 1e-3, boundary="free", tolerance=TIGHT)
    pressure = 1e-3 * h.size
    assert np.flatnonzero(found.p).tolist() == [5 * 16 + 9]
    assert_allclose(found.p[5, 9], pressure, rtol=ROUNDING)
    assert_allclose(found.d, np.arcsinh(1.0) * pressure / 16 / np.pi - 1.0, rtol=1e-12)


# -- the certificate ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("control", ["load", "approach"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-8])
def test_certificate_follows_from_the_returned_fields(tolerance: float, control: str) -> None:
    """Recomputed with scipy's FFT; equal to 1e-3 of itself, or to what the rounding of gaps allows."""
    h = rough(96) + 3.0
    found = solve(h, 0.4, tolerance=tolerance)
    if control == "approach":
        found = keep(solver(h, tolerance=tolerance).solve(h, Approach(found.d), np.zeros_like(h)))
    u, weights = polonsky_keer.displacement(found.p, (1.0, 1.0)), found.p / found.p.sum()
    gap = u - h - found.d
    length = np.sqrt(np.sum(weights * (u - np.sum(weights * u)) ** 2))
    certificate = found.certificate
    assert_allclose(certificate.length, length, rtol=1e-9)
    complementarity = np.sum(weights * np.abs(gap)) / length
    assert_allclose(certificate.complementarity, complementarity, rtol=1e-3, atol=1e-13)
    assert_allclose(certificate.penetration, max(-gap.min(), 0.0) / length, rtol=1e-3, atol=1e-13)
    assert certificate.load <= ROUNDING
    assert certificate.worst <= tolerance
    assert found.p.min() >= 0.0
    if control == "load":
        assert_allclose(found.p.mean(), 0.4, rtol=ROUNDING)


def test_length_of_a_sphere_and_of_a_wave() -> None:
    """Under a sphere `u = delta (1 - r^2/(2 a^2))` and `p ~ sqrt(1 - r^2/a^2)`: `L = delta sqrt(3/175)`, whatever the
    box; in full contact of waves L is their rms height as the pressure becomes uniform. Grids: 1 % and 1e-3."""
    x = (np.arange(64) - 31.7) / 64
    for side in (1.0, 2.0):  # of the box over 64 cells: twice the box at the same cell, four times the height
        x = (np.arange(round(64 * side)) - 31.7 * side) / 64
        h = -0.5 * (x[:, None] ** 2 + x**2)
        found = solve(h, 0.05 / side**2, tolerance=1e-6, size=(side, side), boundary="free", kernel="love")
        assert_allclose(found.certificate.length, found.d * np.sqrt(3 / 175), rtol=0.01)
    h = rough(64)
    assert_allclose(solve(h, 1e4, tolerance=1e-6).certificate.length, h.std(), rtol=1e-3)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    load=st.floats(-4, 3),
    body=st.sampled_from(BODIES),
    start=st.sampled_from(["zero", "random", "point"]),
)
def test_any_surface(seed: int, shape: tuple[int, int], load: float, body: tuple[str, str], start: str) -> None:
    """White noise, from a single cell to full contact, from any start: certified, never negative, load to 1e-13."""
    h = white(shape, seed)
    mean = 10.0**load
    solving = solver(h, boundary=body[0], kernel=body[1], tolerance=1e-8)
    p = white(shape, seed + 1) ** 2 if start == "random" else np.zeros(shape)
    if start == "point":
        p[0, 0] = 1.0
    found = keep(solving.solve(h, MeanPressure(mean), p))
    assert found.p.min() >= 0.0
    assert_allclose(found.p.mean(), mean, rtol=ROUNDING)
    assert np.min(found.u - h - found.d) >= -1e-8 * (np.ptp(h) or 1.0)


# -- controls ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("boundary", "kernel"), BODIES)
@pytest.mark.parametrize("mean", [0.01, 0.4, 2.0])
def test_load_and_approach_give_the_same_contact(boundary: str, kernel: str, mean: float) -> None:
    h = rough(48)
    options: dict[str, Any] = {"boundary": boundary, "kernel": kernel, "tolerance": TIGHT}
    loaded = solve(h, mean, **options)
    moved = keep(solver(h, **options).solve(h, Approach(loaded.d), np.zeros_like(h)))
    assert_allclose(moved.p, loaded.p, atol=1e-8 * loaded.p.max())
    assert_allclose(moved.p.mean(), mean, rtol=1e-8)


def test_approach_that_leaves_no_contact() -> None:
    """Also where the last solve left pressure."""
    h = rough(48)
    for start in (0.0, 1.0):
        apart = keep(solver(h).solve(h, Approach(-2.0 * h.max()), np.full_like(h, start)))
        assert not apart.p.any()
        assert not apart.u.any()


def test_no_load() -> None:
    """Nothing is pressed, and the highest point touches."""
    h = rough(48)
    touching = keep(solver(h).solve(h, MeanPressure(0.0), np.ones_like(h)))
    assert not touching.p.any()
    assert not touching.u.any()
    assert touching.d == -h.max()
    assert touching.iterations == 0


def test_periodic_approach_beyond_full_contact_fails() -> None:
    """There is no such state of a periodic body (a march refuses it before); the solver ends and says so."""
    h = rough(48)
    assert solver(h).solve(h, Approach(-h.mean() + 0.1), np.zeros_like(h)).failure


def test_what_a_contact_reports_is_documented() -> None:
    for field in dataclasses.fields(certificate.Certificate):
        assert f"{field.name}: " in str(certificate.Certificate.__doc__)
