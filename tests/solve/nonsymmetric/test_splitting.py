"""Projected steps, acceleration and splitting against dense linear algebra and independent formulas."""

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from parcontact.contact.certificate import Judge
from parcontact.contact.problem import STEPS, Approach, Box, InterfaceLaw, MeanPressure
from parcontact.contact.projected import Projected
from parcontact.contact.splitting import LEVEL_EXCESS, RELAXATION, Acceleration, Splitting, _Given
from parcontact.effects.layer.effect import Layer
from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.convolution import Convolution
from parcontact.physics.halfspace import HalfSpace

Map = NDArray[np.float64]


# -- projected steps against dense algebra ----------------------------------------------------------------------------


class Scaled:
    """The identity times a number."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def apply(self, field: Array, out: Array) -> Array:
        np.multiply(field, self.factor, out=out)
        return out


class FactoredMatrix:
    def __init__(self, matrix: Map) -> None:
        self.matrix = matrix

    def apply(self, field: Array, out: Array) -> Array:
        out[...] = (self.matrix @ field.ravel()).reshape(field.shape)
        return out


def test_goes_where_the_residual_is_smallest() -> None:
    """While all pressures stay positive, a step makes the residual the least squares one over the preconditioned
    residual and the last two changes; the third of them is compared with numpy, to 1e-9."""
    nx, ny = 6, 5
    n, random = nx * ny, np.random.default_rng(4)
    slab = Slab.alone(nx, ny)
    basis, _ = np.linalg.qr(random.normal(size=(n, n)))
    skew = random.normal(size=(n, n))
    A = basis @ np.diag(np.geomspace(0.2, 5.0, n)) @ basis.T + 0.2 * (skew - skew.T)
    steps = Projected(Judge(slab, 1.0), FactoredMatrix(A), Scaled(1.0))
    x = np.full((ny, nx), 100.0)
    h = (A @ (x.ravel() + random.normal(size=n))).reshape(ny, nx)
    u, working = slab.empty(), np.ones((ny, nx), dtype=np.bool_)
    operator = FactoredMatrix(A)
    operator.apply(x, u)
    steps.forget()
    history = [(x.copy(), u.copy())]

    def centred(field: Map) -> Map:
        return (field - field.mean()).ravel()

    for _ in range(3):
        steps.step(x, u, h, working, float(x.sum()))
        history.append((x.copy(), u.copy()))
    r = centred(history[2][1] - h)
    directions = [r, *(centred(history[k + 1][0] - history[k][0]) for k in (0, 1))]
    images = np.array([centred(A @ t) for t in directions]).T
    smallest = r - images @ np.linalg.lstsq(images, r, rcond=None)[0]
    np.testing.assert_allclose(centred(u - h), smallest, rtol=0, atol=1e-9 * float(np.abs(r).max()))
    assert x.min() > 0.0


def test_pressures_are_cut_off_and_stay_on_the_set() -> None:
    slab = Slab.alone(4, 3)
    steps = Projected(Judge(slab, 1.0), Scaled(1.0), Scaled(1.0))
    working = np.ones((3, 4), dtype=np.bool_)
    working[0, 0] = False
    x = np.full((3, 4), 0.1)
    h = np.zeros((3, 4))
    h[1, 1] = 5.0
    steps.forget()
    u = x.copy()
    steps.step(x, u, h, working, 6.0)
    assert x[0, 0] == 0.0
    assert x.min() == 0.0
    assert x[1, 1] > 1.0
    assert x.sum() == pytest.approx(6.0, rel=1e-15)
    np.testing.assert_array_equal(u, x)


# -- acceleration -----------------------------------------------------------------------------------------------------


@pytest.mark.mpi(2)
def test_acceleration_solves_a_linear_iteration(comm: MPI.Intracomm) -> None:
    """f(s) = b - M s with four different factors in M: from five changes on, the residual vanishes but for the
    rounding of changes to single precision and the share that is added to the trace, 1e-8."""
    slab = Slab(comm, 6, 4)
    random = np.random.default_rng(1)
    factors = random.choice([0.3, 0.8, 1.1, 1.3], (4, 6))[slab.rows]
    wanted, p, s = random.normal(size=(4, 6))[slab.rows], slab.zeros(), slab.zeros()
    accelerated, sizes = Acceleration(slab), list[float]()
    for _ in range(8):
        sizes.append(accelerated.residual(factors * (wanted - s), p, 0.0))
        accelerated.advance(s, plain=False)
    assert min(sizes[:4]) > 1e-3 * sizes[0]
    assert sizes[-1] < 1e-7 * sizes[0]
    np.testing.assert_allclose(s, wanted, rtol=0, atol=1e-6)


def test_plain_steps_are_relaxed() -> None:
    """A factor of 0.5 in each step, without earlier changes: `s - wanted` falls by `1 - 0.5 R`."""
    slab = Slab.alone(3, 2)
    accelerated, s, p = Acceleration(slab), slab.zeros(), slab.zeros()
    for step in range(1, 4):
        accelerated.residual(0.5 * (1.0 - s), p, 0.0)
        accelerated.advance(s, plain=True)
        np.testing.assert_allclose(1.0 - s, (1.0 - 0.5 * RELAXATION) ** step, rtol=1e-6)


# -- contact with a law of the interface, against a pointwise solution, an independent solver and closed forms --------

N = 32
RNG = np.random.default_rng(5)
X = np.arange(N) / N
HEIGHTS = np.sum(
    [
        RNG.normal() / (a * a + b * b) * np.cos(2 * np.pi * (a * X[None, :] + b * X[:, None]) + 6 * RNG.random())
        for a in range(1, 5)
        for b in range(1, 5)
    ],
    axis=0,
)
LAW = InterfaceLaw.of_table(np.array([0.1, 1.0, 10.0]), np.array([0.0, 0.3, 0.5]))


def made(tolerance: float, comm: MPI.Intracomm = MPI.COMM_SELF, **body: Any) -> tuple[Splitting, Convolution]:
    slab = Slab(comm, N, N)
    half_space, fft = HalfSpace((1.0, 1.0), **body), FFT(slab)
    operator, inverse = half_space.operator(fft), half_space.inverse(fft)
    assert isinstance(operator, Convolution)
    return Splitting(Judge(slab, float(np.ptp(HEIGHTS))), operator, inverse, tolerance, 1000), operator


@pytest.mark.parametrize("mean", [0.05, 1.0, 20.0])
def test_a_cold_start_is_full_contact_lowered_to_the_load(mean: float) -> None:
    """Above a level where its load is at most LEVEL_EXCESS times the given one, to which it is then scaled."""
    splitting, _ = made(1e-9)
    p, full = np.zeros((N, N)), splitting.inverse.apply(HEIGHTS, np.empty((N, N)))
    assert splitting._begin(_Given(HEIGHTS, MeanPressure(mean), Box(), 1e-9), p)
    factor = np.ptp(p[p > 0.0]) / np.ptp(full[p > 0.0])
    assert p.mean() == pytest.approx(mean, rel=1e-12)
    assert 1.0 / LEVEL_EXCESS <= factor * (1.0 + 1e-9) <= 1.0 + 1e-6


@pytest.mark.parametrize("mean", [0.05, 1.0, 20.0])
def test_conditions_with_a_law(mean: float) -> None:
    """p >= 0, w >= 0 and p w = 0 with w = A p + c(p) - h - d, under the mean: to the tolerance of the solve, 1e-9,
    relative to the height; c by its table here."""
    splitting, operator = made(1e-9)
    contact = splitting.solve(HEIGHTS, MeanPressure(mean), LAW, np.zeros((N, N)))
    assert contact.converged
    p = contact.p
    cubic = PchipInterpolator(np.log([0.1, 1.0, 10.0]), [0.0, 0.3, 0.5], extrapolate=False)
    fine = np.where(p > 10.0, 0.5, cubic(np.log(np.clip(p, 0.1, 10.0))))
    slope = float(cubic(np.log(0.1), 1))  # dc/d(log p) at the first rung: below it c goes on with it
    closing = np.where(p < 0.1, (p / 0.1 - 1.0) * slope, fine) + slope
    known = np.interp(p, LAW.pressures, LAW.closings)
    # straight lines in p between points a sixth of a decade apart: an eighth of its square times c_ll - c_l, l = log p
    logs = np.linspace(np.log(0.1), np.log(10.0), 400)
    bend = np.abs(cubic(logs, 2) - cubic(logs, 1)).max()
    assert np.abs(known - closing).max() < bend * (np.log(10.0) / 6) ** 2 / 8 * 1.3
    u = operator.apply(p, np.empty_like(p))
    gap = u + known - HEIGHTS - contact.d
    scale = np.ptp(HEIGHTS)
    assert p.min() >= 0.0
    assert p.mean() == pytest.approx(mean, rel=1e-12)
    assert gap.min() > -2e-9 * scale
    assert np.sum(p * np.abs(gap)) / p.sum() < 2e-9 * scale


def test_law_alone() -> None:
    """On flat ground the pressure is uniform, and the approach is the closing: `c(p) - d = 0`."""
    splitting, _ = made(1e-9)
    contact = splitting.solve(np.zeros((N, N)), MeanPressure(2.0), LAW, np.zeros((N, N)))
    assert np.ptp(contact.p) < 1e-12
    assert contact.d == pytest.approx(float(LAW.closing(np.array(2.0))), rel=1e-9)


@pytest.mark.mpi(3)
@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_a_layer_moves_in_the_mean(comm: MPI.Intracomm, poisson: float) -> None:
    """Under a load, and under the approach that it gives: the conditions of contact without a law to the tolerance,
    1e-8, of the height, and the same load, to 1e-6, as contact is stiff."""
    layer = Layer(0.1, "bonded", poisson=poisson)
    splitting, operator = made(1e-8, comm, poisson=poisson, other=layer)
    slab, mean = splitting.slab, 0.5
    h = HEIGHTS[slab.rows]
    found = splitting.solve(h, MeanPressure(mean), Box(), slab.zeros())
    assert found.converged
    p, gap = found.p.copy(), operator.apply(found.p, slab.empty()) - h - found.d
    load, wrong = slab.sum(float(p.sum()), float((p * np.abs(gap)).sum()))
    (deepest,) = slab.reduce((), [float((-gap).max(initial=0.0))])
    assert load == pytest.approx(mean * N * N, rel=1e-12)
    assert wrong / load < 2e-8 * np.ptp(HEIGHTS)
    assert deepest < 2e-8 * np.ptp(HEIGHTS)
    other = splitting.solve(h, Approach(found.d), Box(), slab.zeros())
    assert other.converged
    assert slab.sum(float(other.p.sum()))[0] == pytest.approx(load, rel=1e-6)


def test_a_start_that_is_the_solution_takes_one_application() -> None:
    splitting, _ = made(1e-6)
    p = splitting.solve(HEIGHTS, MeanPressure(1.0), LAW, np.zeros((N, N))).p
    splitting.tolerance, tally = 1e-5, splitting.slab.tally
    before = tally["operator"]
    again = splitting.solve(HEIGHTS, MeanPressure(1.0), LAW, p)
    assert (again.iterations, tally["operator"] - before) == (0, 1)


@pytest.mark.parametrize("worst", [np.nan, np.inf])
def test_numbers_that_are_not_finite_end_a_solve(worst: float) -> None:
    splitting, _ = made(1e-6)
    heights = HEIGHTS.copy()
    heights[3, 4] = worst
    with np.errstate(invalid="ignore"):
        found = splitting.solve(heights, MeanPressure(1.0), Box(), np.ones((N, N)))
    assert found.failure
    assert found.iterations <= 1


@pytest.mark.filterwarnings("error")
def test_a_solve_that_stalls_ends_before_its_numbers_overflow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tolerance of 0 is never met. Gamma is raised as often as steps are slow, but ends a solve when rounding hides
    the pressures."""
    splitting, _ = made(0.0)
    splitting.most = 10**6
    monkeypatch.setattr("parcontact.contact.splitting.SLOW", 1)
    found = splitting.solve(HEIGHTS, MeanPressure(1.0), Box(), np.ones((N, N)))
    assert found.failure
    assert np.isfinite(found.p).all()


def test_closings_that_fall_are_refused() -> None:
    with pytest.raises(InputError, match="do not fall"):
        InterfaceLaw.of_table(np.array([1.0, 2.0]), np.array([1.0, 0.5]))
    with pytest.raises(InputError, match="which rise"):
        InterfaceLaw.of_table(np.array([2.0, 1.0]), np.array([1.0, 1.5]))


def test_law_that_is_linear_in_the_logarithm() -> None:
    """It has the points of its table, STEPS equal pieces of log p between two of them, and the slope of the first one
    below: c = 0.2 (1 + log(p/p_1)), and c(0) = 0."""
    points = np.array([0.1, 1.0, 10.0, 30.0])
    law = InterfaceLaw.of_table(points, 0.7 + 0.2 * np.log(points))
    assert_allclose(law.pressures[1::STEPS], points, rtol=1e-14)
    assert_allclose(np.diff(np.log(law.pressures[1:])), np.repeat(np.diff(np.log(points)) / STEPS, STEPS), rtol=1e-12)
    assert_allclose(law.closings, [0.0, *(0.2 * (1.0 + np.log(law.pressures[1:] / 0.1)))], rtol=1e-13)
