"""Generalized conjugate residuals on a set, against dense linear algebra on a tiny grid."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.convolution import Convolution
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.constraint import NonNegative
from parcontact.solve.interface_law import InterfaceLaw
from parcontact.solve.nonsymmetric import steady
from parcontact.solve.nonsymmetric.gcr import GcrBasis, centred_residual
from parcontact.solve.nonsymmetric.projected import Projected
from parcontact.solve.nonsymmetric.splitting import Splitting
from parcontact.solve.nonsymmetric.steady import SteadySolver
from parcontact.solve.nonsymmetric.stripes import FLOOR, Plain, Stripes
from parcontact.solve.preconditioner.extension import ExtendedPreconditioner
from parcontact.solve.problem import MeanPressure

Map = NDArray[np.float64]
NX, NY = 5, 4


class Dense:
    """A matrix on whole maps, for one rank."""

    def __init__(self, matrix: Map) -> None:
        self.matrix = matrix
        self.applied = 0

    def apply(self, field: Array, out: Array) -> Array:
        self.applied += 1
        out[...] = (self.matrix @ field.ravel()).reshape(field.shape)
        return out


def positive(skew: float, seed: int = 3) -> Map:
    """A positive matrix that is not symmetric: a symmetric one of condition 100, and `skew` of an antisymmetric one."""
    random = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(random.normal(size=(NX * NY, NX * NY)))
    other = random.normal(size=(NX * NY, NX * NY))
    return np.asarray(basis @ np.diag(np.geomspace(0.1, 10.0, NX * NY)) @ basis.T + skew * (other - other.T))


class Problem:
    """Heights, a set of 13 points, a start of mean 1 on it; the solution of `A x - h = d` there under the same sum."""

    def __init__(self, skew: float) -> None:
        random = np.random.default_rng(7)
        self.slab = Slab.alone(NX, NY)
        self.A = positive(skew)
        self.h = random.normal(size=(NY, NX))
        self.working = np.zeros((NY, NX), dtype=np.bool_)
        self.working.flat[random.permutation(NX * NY)[:13]] = True
        self.x = np.where(self.working, 1.0, 0.0)
        self.u = (self.A @ self.x.ravel()).reshape(NY, NX)

    def solution(self) -> Map:
        c = self.working.ravel()
        system = np.block([[self.A[np.ix_(c, c)], -np.ones((13, 1))], [np.ones((1, 13)), np.zeros((1, 1))]])
        x = np.zeros(NX * NY)
        x[c] = np.linalg.solve(system, np.append(self.h.ravel()[c], 13.0))[:13]
        return x.reshape(NY, NX)

    def improve(self, limit: int, reduction: float = 1e-13, preconditioner: Map | None = None) -> int:
        inverse = np.eye(NX * NY) if preconditioner is None else preconditioner
        directions = GcrBasis(self.slab, Dense(self.A), Plain(Dense(inverse)), 13, np.float64)
        return directions.improve(self.x, self.u, self.h, self.working, limit, reduction)

    def residual(self) -> float:
        gaps = (self.u - self.h)[self.working]
        return float(np.linalg.norm(gaps - gaps.mean()))


def test_residual_of_a_set() -> None:
    """Small whole numbers, without rounding: u - h - mean on the set, nothing next to it, and the sum of squares."""
    working = np.array([[True, False, True], [False, True, False]])
    u, h, r = np.array([[5.0, 9.0, 2.0], [9.0, 4.0, 9.0]]), np.ones((2, 3)), np.full((2, 3), np.nan)
    assert centred_residual(working, u, h, 2.0, r) == 2.0**2 + 1.0**2 + 1.0**2
    assert r.tolist() == [[2.0, 0.0, -1.0], [0.0, 1.0, 0.0]]


@pytest.mark.parametrize("skew", [0.0, 0.3, 3.0])
def test_solves_what_a_dense_solve_solves(skew: float) -> None:
    """13 points under a given sum: 12 steps reach the dense solution, to 1e-9; u stays A x to rounding."""
    problem = Problem(skew)
    assert problem.improve(13) <= 12
    np.testing.assert_allclose(problem.x, problem.solution(), rtol=0, atol=1e-9)
    np.testing.assert_allclose(problem.u.ravel(), problem.A @ problem.x.ravel(), rtol=0, atol=1e-11)
    assert problem.x[~problem.working].tolist() == [0.0] * 7
    assert problem.x.sum() == pytest.approx(13.0, rel=1e-13)


@pytest.mark.parametrize("steps", [1, 3, 6])
def test_residual_is_the_smallest_of_its_subspace(steps: int) -> None:
    """Least squares over `K r0, K A K r0, ...` (each centred on the set), to 1e-9 of the first residual."""
    problem = Problem(0.5)
    first = problem.residual()
    K = positive(0.1, seed=5)
    c = problem.working.ravel()
    centre = np.eye(13) - 1.0 / 13
    A, KK = centre @ problem.A[np.ix_(c, c)] @ centre, centre @ K[np.ix_(c, c)] @ centre
    r = centre @ (problem.u - problem.h).ravel()[c]
    basis = [KK @ r]
    while len(basis) < steps:
        basis.append(KK @ (A @ basis[-1]))
    images = A @ np.array([v / np.linalg.norm(v) for v in basis]).T
    smallest = np.linalg.norm(r - images @ np.linalg.lstsq(images, r, rcond=None)[0])
    assert problem.improve(steps, preconditioner=K) == steps
    assert problem.residual() == pytest.approx(float(smallest), abs=1e-9 * first)


def test_nothing_to_do() -> None:
    """Without a set, and at the solution, x is left as it is."""
    problem = Problem(0.5)
    problem.working[...] = False
    before = problem.x.copy()
    assert problem.improve(5) == 0
    np.testing.assert_array_equal(problem.x, before)
    done = Problem(0.5)
    done.h[...] = done.u
    assert done.improve(5) == 0


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
    steps = Projected(slab, FactoredMatrix(A), Scaled(1.0), NonNegative())
    x = np.full((ny, nx), 100.0)
    h = (A @ (x.ravel() + random.normal(size=n))).reshape(ny, nx)
    u, working = slab.empty(), np.ones((ny, nx), dtype=np.bool_)
    operator = FactoredMatrix(A)
    operator.apply(x, u)
    steps.begin()
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
    steps = Projected(slab, Scaled(1.0), Scaled(1.0), NonNegative())
    working = np.ones((3, 4), dtype=np.bool_)
    working[0, 0] = False
    x = np.full((3, 4), 0.1)
    h = np.zeros((3, 4))
    h[1, 1] = 5.0
    steps.begin()
    u = x.copy()
    steps.step(x, u, h, working, 6.0)
    assert x[0, 0] == 0.0
    assert x.min() == 0.0
    assert x[1, 1] > 1.0
    assert x.sum() == pytest.approx(6.0, rel=1e-15)
    np.testing.assert_array_equal(u, x)


# -- the preconditioner with means of stripes: what it gives to the operator, and that it is symmetric, on any ranks --


STRIPES_NX, STRIPES_NY = 24, 20
ALONG = pytest.mark.parametrize("along", [0, 1])


class Doubling:
    """Twice a map; it remembers what it was given."""

    def apply(self, field: Array, out: Array) -> Array:
        self.given = field.copy()
        np.multiply(field, 2.0, out=out)
        return out


@pytest.mark.mpi
@ALONG
def test_means_are_carried_on_along_stripes(comm: MPI.Intracomm, along: int) -> None:
    """A residual that is the same along each stripe: of half the points of a stripe, 1/(1 + 2 FLOOR) of it everywhere
    in the stripe; the rest of it, 2 FLOOR, as without stripes."""
    slab, doubling = Slab(comm, STRIPES_NX, STRIPES_NY), Doubling()
    stripes = Stripes(slab, doubling, ExtendedPreconditioner(slab), along)
    of_stripes = np.random.default_rng(2).uniform(1.0, 2.0, (STRIPES_NY, 1) if along == 1 else (1, STRIPES_NX))
    value = np.broadcast_to(of_stripes, (STRIPES_NY, STRIPES_NX))[slab.rows]
    working = (np.indices((STRIPES_NY, STRIPES_NX)).sum(axis=0) % 2 == 0)[slab.rows]
    stripes.apply(working, np.where(working, value, 0.0), slab.empty())
    np.testing.assert_allclose(doubling.given, value, rtol=4.0 * FLOOR)


# -- the maps of the steady solver: as many as it says, made when they are needed for the first time ------------------

STEADY_NX, STEADY_NY = 24, 20
SIZE = (1.2, 1.0)


class Identity:
    """So poor a preconditioner that the linear steps on a set use all directions."""

    def apply(self, field: Array, out: Array) -> Array:
        out[...] = field
        return out


@pytest.mark.mpi
@pytest.mark.parametrize(("tolerance", "pairs"), [(1e-8, 0), (1e-5, 0), (1e-5, 2), (1e-5, -2)])
def test_maps_are_made_when_they_are_needed(
    comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch, tolerance: float, pairs: int
) -> None:
    """Projected steps need few; with none of those allowed, an active set that uses all of its directions follows."""
    slab = Slab(comm, STEADY_NX, STEADY_NY)
    operator = HalfSpace(SIZE).operator(FFT(slab))
    before = slab.tally["map bytes"]
    solver = SteadySolver(slab, operator, Identity(), 1.0, tolerance, 1000, pairs=pairs)
    planned = Slab.planned(STEADY_NX, STEADY_NY, comm.size, comm.rank)
    counted = SteadySolver(planned, operator, Identity(), 1.0, tolerance, 1000, pairs=pairs)
    few = planned.tally["map bytes"]
    counted.hold_all()
    most = planned.tally["map bytes"]
    assert few < most or not slab.shape[0]

    def held() -> int:
        return slab.tally["map bytes"] - before

    assert held() == few
    h, start = np.random.default_rng(3).normal(size=(STEADY_NY, STEADY_NX))[slab.rows], slab.zeros()
    before += start.nbytes
    assert solver.solve(h, 1.0, start).sets == 0
    assert held() == few
    solver.steps_to_halve = 0
    monkeypatch.setattr(steady, "REDUCTION", 1e-9)
    start.fill(0.0)
    contact = solver.solve(h, 1.0, start)
    assert contact.steps >= steady.MAX_DIRECTIONS
    assert held() == most


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


def made(tolerance: float) -> tuple[Splitting, Convolution]:
    slab = Slab.alone(N, N)
    operator = HalfSpace((1.0, 1.0)).operator(FFT(slab))

    def resolvent(gamma: float) -> Convolution:
        return operator.mapped(lambda symbol: 1.0 / (1.0 + gamma * symbol), np.float64)

    return Splitting(slab, operator, resolvent, float(np.ptp(HEIGHTS)), tolerance, 20000), operator


@pytest.mark.parametrize("mean", [0.05, 1.0, 20.0])
def test_conditions_with_a_law(mean: float) -> None:
    """p >= 0, w >= 0 and p w = 0 with w = A p + c(p) - h - d, under the mean: to the tolerance of the solve, 1e-9,
    relative to the height; c by its table here."""
    splitting, operator = made(1e-9)
    contact = splitting.solve(HEIGHTS, MeanPressure(mean), LAW, 60.0)
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
    contact = splitting.solve(np.zeros((N, N)), MeanPressure(2.0), LAW, 60.0)
    assert np.ptp(contact.p) < 1e-12
    assert contact.d == pytest.approx(float(LAW.closing(np.array(2.0))), rel=1e-9)


def test_closings_that_fall_are_refused() -> None:
    with pytest.raises(InputError, match="do not fall"):
        InterfaceLaw.of_table(np.array([1.0, 2.0]), np.array([1.0, 0.5]))
    with pytest.raises(InputError, match="which rise"):
        InterfaceLaw.of_table(np.array([2.0, 1.0]), np.array([1.0, 1.5]))
