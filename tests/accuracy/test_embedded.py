"""The embedded pair: what the other integrator would have made of a step, and what a look at it costs."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from stepping_body import HeldBody

from parcontact.march.controller import SAMPLED_ROWS, EmbeddedPair
from parcontact.parallel.slab import Slab
from parcontact.physics.body import MovedHeights, ZenerBody
from parcontact.physics.prony import Prony

PRONY = Prony(0.5, np.array([2.0, 1.0, 4.0]), np.array([1e-3, 1e-1, 3.0]))
DX = 0.25


def march(comm: MPI.Intracomm, name: str, nx: int, ny: int, dt: float) -> tuple[EmbeddedPair, list[np.ndarray], float]:
    """Two steps of a body under displacements that are given; the look at the second, and its maps on all rows."""
    slab = Slab(comm, nx, ny)
    body = HeldBody(ZenerBody(slab, PRONY, name))
    dice = np.random.default_rng(3)
    heights, first, second, p = (dice.normal(size=(ny, nx))[slab.rows] for _ in range(4))
    pair = EmbeddedPair(slab, body.body, DX)
    for u, step in ((first, 2e-3), (second, dt)):
        trial = body.begin(step, MovedHeights(heights, 2))
        displacement = u + trial.effective - np.roll(heights, 2, axis=1)  # so that u is the new displacement
        body.commit(trial, displacement)
    pressure = np.maximum(p, 0.0)
    look = pair.compare(dt, trial, body.memory, pressure, displacement, slab.sum(float(pressure.sum()))[0], 1.0)
    found = [body.u.copy(), pressure, displacement * trial.alpha, np.roll(heights, 2, axis=1)]
    return pair, [*found, np.array([look.difference, look.slope, look.angle])], trial.alpha


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["exponential", "backward-euler"])
@pytest.mark.parametrize("dt", [1e-5, 1e-2, 10.0])
def test_difference_of_the_integrators(comm: MPI.Intracomm, name: str, dt: float) -> None:
    """Two bodies that differ in the integrator of their last step only: `A p` at its end, on every row; rounding."""
    nx, ny = 12, 9
    _, (u, p, ap, h, look), _ = march(comm, name, nx, ny, dt)
    slab = Slab(comm, nx, ny)
    dice = np.random.default_rng(3)
    _, first, second, _ = (dice.normal(size=(ny, nx))[slab.rows] for _ in range(4))
    assert_allclose(u, second, atol=1e-12)
    ends = []
    for last in ("exponential", "backward-euler"):
        total = PRONY.modulus_inf * second
        for modulus, tau in zip(PRONY.moduli, PRONY.relaxation_times, strict=True):
            branch = 0.0
            for change, step, kind in ((first, 2e-3, name), (second - first, dt, last)):
                z = step / tau
                if kind == "exponential":
                    branch = np.exp(-z) * branch + modulus * -np.expm1(-z) / z * change
                else:
                    branch = (branch + modulus * change) / (1.0 + z)
            total = total + branch
        ends.append(total)
    wrong, size, load, slopes, height, square, turned = slab.sum(
        float(np.sum(p * (ends[0] - ends[1]) ** 2)),
        float(np.sum(p * ap**2)),
        float(p.sum()),
        float(np.sum(p * ((np.roll(h, -1, axis=1) - np.roll(h, 1, axis=1)) / (2 * DX)) ** 2)),
        float(np.sum(p * h)),
        float(np.sum(p * h**2)),
        float(np.sum(p * (second - first) ** 2)),
    )
    angle = np.sqrt(turned / load) / np.sqrt(square / load - (height / load) ** 2)
    assert_allclose(look, [np.sqrt(wrong / size), np.sqrt(slopes / load), angle], rtol=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("growth", [0.3, 2.0])
def test_difference_of_quadratic_and_linear_steps(comm: MPI.Intracomm, growth: float) -> None:
    """Two bodies, whose last step is linear in one of them, under the same displacements on every row; rounding."""
    slab, dt = Slab(comm, 12, 9), 1e-2
    dice = np.random.default_rng(3)
    first, second, p = (dice.normal(size=(9, 12))[slab.rows] for _ in range(3))
    ends, held = [], [HeldBody(ZenerBody(slab, PRONY, "exponential")) for _ in range(2)]
    for body, last in zip(held, (growth, 0.0), strict=True):
        for u, step, grown in ((first, dt / growth, 0.0), (second, dt, last)):
            trial = body.begin(step, MovedHeights(u), grown)
            displacement = trial.effective.copy()
            body.commit(trial, displacement)
        ends.append((displacement * trial.alpha, trial, displacement))
    pressure = np.maximum(p, 0.0)
    (ap, trial, displacement), (other, *_) = ends
    sums = slab.sum(*(float(np.sum(pressure * each)) for each in ((ap - other) ** 2, ap**2, 1.0)))
    pair = EmbeddedPair(slab, held[0].body, DX)
    found = pair.compare(dt, trial, held[0].memory, pressure, displacement, sums[2], 1.0, growth)
    assert_allclose(found.difference, np.sqrt(sums[0] / sums[1]), rtol=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("row", [0, 1, 63, 150])
def test_a_contact_that_the_sample_misses(comm: MPI.Intracomm, row: int) -> None:
    """Pressure on a single row of 200: all ranks see what is on it, and find the same as if that was all the map."""
    slab = Slab(comm, 8, 200)
    body = HeldBody(ZenerBody(slab, PRONY, "exponential"))
    pair = EmbeddedPair(slab, body.body, DX)
    pressure = slab.zeros()
    if row in range(*slab.rows.indices(200)):
        pressure[row - slab.rows.start] = 1.0
    trial = body.begin(1e-2, MovedHeights(slab.zeros()))
    displacement = slab.zeros()
    displacement[...] = 1.0
    body.commit(trial, displacement)
    line = Slab.alone(8, 1)
    alone = HeldBody(ZenerBody(line, PRONY, "exponential"))
    one = alone.begin(1e-2, MovedHeights(np.zeros((1, 8))))
    alone.commit(one, np.ones((1, 8)))
    expected = EmbeddedPair(line, alone.body, DX).compare(
        1e-2, one, alone.memory, np.ones((1, 8)), np.ones((1, 8)), 8.0, 1.0
    )
    assert expected.difference > 0.0
    assert_allclose(
        pair.compare(1e-2, trial, body.memory, pressure, displacement, 8.0, 1.0).difference,
        expected.difference,
        rtol=1e-12,
    )


def test_nothing_pressed_and_jumps() -> None:
    """No pressure: no difference. A jump relaxes nothing, in either integrator."""
    slab = Slab.alone(4, 4)
    body = HeldBody(ZenerBody(slab, PRONY, "exponential"))
    pair = EmbeddedPair(slab, body.body, DX)
    trial = body.begin(0.0, MovedHeights(slab.zeros()))
    body.commit(trial, np.ones((4, 4)))
    assert pair.compare(0.0, trial, body.memory, np.ones((4, 4)), np.ones((4, 4)), 16.0, 1.0).difference == 0.0
    assert pair.compare(1.0, trial, body.memory, np.zeros((4, 4)), np.ones((4, 4)), 0.0, 0.0).difference == 0.0


def test_second_order_of_a_step() -> None:
    """Smooth motion: half the step, a quarter of the difference to backward Euler, an eighth of that between quadratic
    and linear steps; the order of what du weighs, to z = dt/tau of the fastest branch."""
    slab = Slab.alone(4, 1)
    found, curved = [], []
    for count in (64, 128):
        body = HeldBody(ZenerBody(slab, PRONY, "exponential"))
        pair, dt = EmbeddedPair(slab, body.body, DX), 1e-3 / count
        for step in range(1, count + 1):
            trial = body.begin(dt, MovedHeights(slab.zeros()), float(step > 1))
            body.commit(trial, np.sin(3e3 * step * dt) + trial.effective)
        of_step = dt, trial, body.memory, np.ones((1, 4)), np.ones((1, 4)), 4.0, 1.0
        found.append(pair.compare(*of_step).difference)
        curved.append(pair.compare(*of_step, 1.0))
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.05)
    bends = np.sin(3.0 * (1.0 - 1.0 / 64)) / np.sin(3.0 * (1.0 - 1.0 / 128))  # second differences are of a step before
    assert curved[0].difference / curved[1].difference == pytest.approx(8.0 * bends, rel=0.01)
    assert curved[1].order == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize(
    ("times", "dt", "order"),
    [([1.0], 1e-6, 2.0), (np.logspace(-9.0, 9.0, 73).tolist(), 1e-3, 1.0), ([1.0], 0.0, 2.0), ([], 1e-3, 2.0)],
)
def test_order_in_the_length_of_a_step(times: list[float], dt: float, order: float) -> None:
    """Two where the branch is slow, to z = dt/tau; one where there are as many branches of every time, to the share of
    those beyond the ends. A jump, and a body of no branch, have none: two is returned."""
    slab, prony = Slab.alone(4, 1), Prony(1.0, np.full(len(times), 1e-3), np.array(times))
    body = HeldBody(ZenerBody(slab, prony, "exponential"))
    trial = body.begin(dt, MovedHeights(slab.zeros()))
    body.commit(trial, np.ones((1, 4)))
    look = EmbeddedPair(slab, body.body, DX).compare(dt, trial, body.memory, np.ones((1, 4)), np.ones((1, 4)), 4.0, 1.0)
    assert look.order == pytest.approx(order, rel=1e-5)


@pytest.mark.mpi
def test_a_sample_of_the_rows(communicators: list[MPI.Intracomm]) -> None:
    """Rows at equal distances in the whole map, the same on any number of ranks: between 8 and 16 of them in full
    contact, ten times as many where 1 % of the points is pressed."""
    whole = march(MPI.COMM_SELF, "exponential", 8, 200, 1e-2)[1][4]
    assert whole[0] > 0.0
    for comm in communicators:
        assert_allclose(march(comm, "exponential", 8, 200, 1e-2)[1][4], whole, rtol=1e-12)
    for ny in (1, 31, 64, 200, 1024, 4096):
        pair = EmbeddedPair(Slab.alone(4, ny), ZenerBody(Slab.alone(1, 1), PRONY, "exponential"), DX)
        assert len(range(0, ny, pair.stride(1.0))) <= 2 * SAMPLED_ROWS
        assert len(range(0, ny, pair.stride(1.0))) >= min(ny, SAMPLED_ROWS)
        assert len(range(0, ny, pair.stride(0.01))) >= min(ny, 10 * SAMPLED_ROWS)
