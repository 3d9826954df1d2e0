"""The contact solver against the textbook one, closed forms and its own certificate.

Tolerances: a pressure follows the gap it is certified by, so two solves to 1e-11 agree to 1e-9 of the highest pressure;
what is exact in real numbers is asked for to some hundred roundings.
"""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from parcontact.contact import starts
from parcontact.contact.problem import Approach, Box, MeanPressure, Operators
from parcontact.contact.solver import ContactSolver
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics import records
from parcontact.physics.halfspace import HalfSpace

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


@pytest.mark.parametrize("points", [256, 512])
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
    for field in dataclasses.fields(records.Certificate):
        assert f"{field.name}: " in str(records.Certificate.__doc__)


# -- what a contact costs: starts, messages and operator calls of an iteration, single precision ----------------------


def test_warm_start_from_the_solution() -> None:
    """Nothing is left to do but to see that it is one."""
    h = rough(64)
    solving = solver(h)
    p = np.zeros_like(h)
    first = keep(solving.solve(h, MeanPressure(0.4), p))
    operators = solving.slab.tally["operator"]
    again = keep(solving.solve(h, MeanPressure(0.4), p))
    assert again.iterations == 0
    assert solving.slab.tally["operator"] == operators + 1
    assert_allclose(again.p, first.p, rtol=1e-14)


def test_preconditioner_in_single_precision() -> None:
    """It need not be exact: as many iterations, the same pressures in double precision."""
    h = rough(128)
    double = solve(h, 0.4, tolerance=1e-9)
    solving = solver(h, tolerance=1e-9)
    narrow = FFT(Slab.alone(128, 128), dtype=np.float32)
    solving.preconditioner = HalfSpace((1.0, 1.0)).inverse(narrow)
    mixed = keep(solving.solve(h, MeanPressure(0.4), np.zeros_like(h)))
    assert abs(mixed.iterations - double.iterations) <= 2
    assert_allclose(mixed.p, double.p, atol=1e-7 * double.p.max())


@pytest.mark.parametrize("load", [0.02, 0.4, 4.0])
def test_calls_in_a_box_with_nothing_around(load: float) -> None:
    """At 1, 20 and 90 % of contact at most 25 calls give pressures to 1e-5 (of their L2 norm), from nested grids as
    programs start. With residuals that jump at the edges, as of a box that repeats, they
    are 25 to 50."""
    h = rough(256)
    free: dict[str, Any] = {"boundary": "free", "kernel": "love"}
    exact = solve(h, load, tolerance=1e-9, **free)

    def on(slab: Slab, tolerance: float) -> tuple[ContactSolver, Operators]:
        coarse = solver(np.zeros((slab.ny, slab.nx)), tolerance=tolerance, **free)
        coarse.solver.height = float(np.ptp(h))
        return coarse.solver, coarse.operators

    solving, p = solver(h, tolerance=1e-5, **free), np.zeros_like(h)
    before = solving.slab.tally["operator"]
    starts.prepare_start(solving.solver, solving.problem(h, MeanPressure(load)), p, on)
    found = keep(solving.solve(h, MeanPressure(load), p))
    assert np.linalg.norm(found.p - exact.p) <= 1e-5 * np.linalg.norm(exact.p)
    assert solving.slab.tally["operator"] - before <= 25


def cold_and_not(boundary: str, constraint: Box, control: MeanPressure | Approach) -> tuple[list[Any], list[int]]:
    """Pressures under a ball and operator calls, of a solve that is named cold and of one that is not, from 0."""
    x = (np.arange(64) + 0.5) / 64 - 0.5
    h, pressures, calls = -2.0 * np.add.outer(x**2, x**2), list[Any](), list[int]()
    bench = solver(h, boundary=boundary)
    bench.constraint = constraint
    for cold in (True, False):
        before = bench.slab.tally["operator"]
        contact = bench.solver.solve(bench.problem(h, control), np.zeros_like(h), cold=cold)
        assert contact.converged
        calls.append(bench.slab.tally["operator"] - before)
        pressures.append(contact.p.copy())
    return pressures, calls


def test_cold_solves_in_free_boxes_take_fewer_calls() -> None:
    """The same pressure within ten times the tolerance."""
    (p, expected), (calls, usual) = cold_and_not("free", Box(), MeanPressure(0.02))
    assert calls < usual
    assert_allclose(p, expected, atol=1e-5 * expected.max())


@pytest.mark.parametrize(
    ("boundary", "constraint", "control"),
    [
        ("periodic", Box(), MeanPressure(0.02)),
        ("free", Box(), Approach(0.05)),
        ("free", Box(highest=0.5), MeanPressure(0.02)),
    ],
)
def test_other_cold_solves_are_as_all(boundary: str, constraint: Box, control: MeanPressure | Approach) -> None:
    """To the last bit: in a box that repeats, under a given approach, and with a hardness."""
    assert np.array_equal(*cold_and_not(boundary, constraint, control)[0])


# -- the safeguard -----------------------------------------------------------------------------------------------------


# Found by trial among small matrices B B' + 1 of whole numbers: no half space of ours needed the safeguard.
LOADED = [[23, -4, -23, -4, 12], [-4, 20, 2, 23, -13], [-23, 2, 29, 0, -6], [-4, 23, 0, 30, -17]]
LOADED += [[12, -13, -6, -17, 22]]


@pytest.mark.parametrize("control", [MeanPressure(0.4), Approach(0.5)])
def test_every_iteration_lowers_the_energy(control: MeanPressure | Approach) -> None:
    """From a start that is nowhere near; but for rounding."""
    h, start = rough(48), white((48, 48), 3) ** 2
    energies = []
    for limit in range(1, 15):
        solving = solver(h, boundary="free", max_iterations=limit, tolerance=1e-10)
        found = solving.solve(h, control, start.copy())
        d = found.d if isinstance(control, Approach) else 0.0
        energies.append(float(np.sum(found.p * (0.5 * found.u - h - d))))
    assert np.all(np.diff(energies) <= 1e-13 * np.abs(energies[0]))


@pytest.mark.parametrize(("aspect", "load"), [(2e3, 0.1), (1e-3, 50.0)])
def test_where_steps_are_halved_the_energy_never_rises(aspect: float, load: float) -> None:
    """On cells far longer than wide, where the preconditioner is far from the inverse: over all iterations of a solve
    of noise on a box of length 1 and width `aspect`; but for rounding."""
    h = white((6, 18), 3)
    energies, halved = [], False
    for limit in range(1, 60):
        body = solver(h, size=(1.0, aspect), tolerance=1e-8, max_iterations=limit)
        found = body.solve(h, MeanPressure(load), np.zeros_like(h))
        energies.append(float(np.sum(found.p * (0.5 * found.u - h))))
        halved = body.slab.tally["operator"] > 1 + 3 * found.iterations  # each try of a step costs one more
        if found.converged:
            break
    assert np.all(np.diff(energies) <= 1e-12 * np.abs(energies).max())
    assert found.converged
    assert halved


# -- what cannot be solved ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("control", [MeanPressure(0.4), MeanPressure(0.0), Approach(0.1)])
def test_heights_that_are_not_finite(value: float, control: MeanPressure | Approach) -> None:
    h = rough(48)
    solving = solver(h)
    h[3, 4] = value
    if value == -np.inf and control == MeanPressure(0.0):
        return  # a hole without a bottom, and the highest point touches
    assert solving.solve(h, control, np.zeros_like(h)).failure == "met numbers that are not finite"


@pytest.mark.parametrize("control", [MeanPressure(np.nan), MeanPressure(np.inf), Approach(np.nan), Approach(np.inf)])
def test_loads_that_are_not_finite(control: MeanPressure | Approach) -> None:
    h = rough(48)
    assert solver(h).solve(h, control, np.zeros_like(h)).failure == "met numbers that are not finite"


def test_iterations_run_out() -> None:
    h = rough(64)
    found = solver(h, max_iterations=3).solve(h, MeanPressure(0.4), np.zeros_like(h))
    assert not found.converged
    assert found.iterations == 3
    assert found.failure.startswith("did not converge in max_iterations = 3: the residual is ")
    assert found.failure.endswith(" where 1e-06 was asked for")


@pytest.mark.parametrize("control", [MeanPressure(0.4), Approach(-0.02)])
def test_stall(control: MeanPressure | Approach) -> None:
    """More than rounding allows is refused long before the iterations run out; the last iterate is still a good one."""
    h = rough(48)
    found = solver(h, tolerance=1e-300, max_iterations=10_000).solve(h, control, np.zeros_like(h))
    assert not found.converged
    assert found.failure.startswith("stalled: no residual below ")
    assert found.iterations < 300
    assert found.certificate.worst < 1e-12


# -- the same contact, moved or mirrored, by the contact solver: two solves to 1e-11 agree to 1e-9 of the largest -----


def test_whole_cell_shifts() -> None:
    h = white((24, 36))
    found = solve(h, 2.0, tolerance=TIGHT)
    moved = solve(np.roll(h, (5, 7), axis=(0, 1)), 2.0, tolerance=TIGHT)
    assert_allclose(moved.p, np.roll(found.p, (5, 7), axis=(0, 1)), atol=1e-9 * found.p.max())


# -- iterations do not grow out of hand at any load, and the last gap closes without coming and going -----------------

LIMIT = 60  # iterations to 1e-6
ALMOST = 0.9999  # of all points: there the loads end


@pytest.mark.parametrize("cells", [16, 2, None])
def test_cold_starts_at_all_loads(cells: int | None) -> None:
    """From one point to 99.99 % of contact, which grows with the load; roughness down to a given number of cells, or a
    sphere."""
    square = (np.arange(128) / 128 - 0.5) ** 2
    heights = -np.add.outer(square, square) if cells is None else rough(128, cells=cells)
    body, load, areas = solver(heights), 1e-3 / heights.size / heights.shape[0], [0.0]
    while areas[-1] < ALMOST:
        found = body.solve(heights, MeanPressure(load * MODULUS), np.zeros_like(heights))
        assert found.converged, (load, found.failure)
        assert found.iterations < LIMIT
        areas.append(np.count_nonzero(found.p) / heights.size)
        load *= 10.0 if areas[-1] < 0.5 else 10.0**0.25
    assert areas[1] == 1 / heights.size
    assert all(before <= after for before, after in pairwise(areas))


@pytest.mark.parametrize("two_ways", [False, True], ids=["Westergaard", "Johnson"])
@pytest.mark.parametrize("share", [0.99, 1.0, 1.01])
def test_last_gap(two_ways: bool, share: float) -> None:
    """Points open after each iteration to 1e-9, at shares of the load of full contact: they settle from one side."""
    x = np.cos(2 * np.pi * (np.arange(128) + 0.3) / 128)
    heights = x[:, None] * x[None, :] if two_ways else np.tile(x, (128, 1))
    full = np.pi * MODULUS * (np.sqrt(2.0) if two_ways else 1.0)
    count: list[int] = []
    for limit in range(1, 20):
        body = solver(heights, tolerance=1e-9, max_iterations=limit)
        found = body.solve(heights, MeanPressure(share * full), np.zeros_like(heights))
        count.append(heights.size - int(np.count_nonzero(found.p)))
        if found.converged:
            break
    assert found.converged
    assert reversals(count) == 0
    assert (count[-1] == 0) == (share >= 1.0)


def reversals(count: list[int]) -> int:
    """Return how often a count that has fallen rises, or the other way round."""
    steps = [after - before for before, after in pairwise(count) if after != before]
    return sum(first * second < 0 for first, second in pairwise(steps))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_last_gap_between_points(side: float) -> None:
    """On 37 x 31 points with the deepest point between them, at 1e-1 to 1e-16 from full contact: no pressure pulls,
    and above it is p + K h to 1e-9; the nearer, the fewer iterations."""
    x, y = (np.cos(2 * np.pi * (np.arange(points) + 0.3) / points) for points in (37, 31))
    heights = x[None, :] * y[:, None]
    body = solver(heights, tolerance=1e-10)
    waves = body.preconditioner.apply(heights - heights.mean(), np.empty_like(heights))
    counts = []
    for exponent in range(-1, -17, -1):
        mean = -waves.min() * (1.0 + side * 10.0**exponent)
        found = body.solve(heights, MeanPressure(mean), np.zeros_like(heights))
        assert found.converged
        assert found.p.min() >= 0.0
        counts.append(found.iterations)
        if side > 0.0:
            assert_allclose(found.p, mean + waves, rtol=0, atol=1e-9 * float(waves.max()))
    assert max(counts) < 20
    assert all(before >= after for before, after in pairwise(counts))
