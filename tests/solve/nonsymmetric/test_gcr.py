"""Generalized conjugate residuals on a set, against dense linear algebra on a tiny grid."""

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.parallel.slab import Array, Slab
from parcontact.solve.nonsymmetric.gcr import Directions, residual
from parcontact.solve.nonsymmetric.stripes import Plain

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
        directions = Directions(self.slab, Dense(self.A), Plain(Dense(inverse)), 13, np.float64)
        return directions.improve(self.x, self.u, self.h, self.working, limit, reduction)

    def residual(self) -> float:
        gaps = (self.u - self.h)[self.working]
        return float(np.linalg.norm(gaps - gaps.mean()))


def test_residual_of_a_set() -> None:
    """Small whole numbers, without rounding: u - h - mean on the set, nothing beside it, and the sum of squares."""
    working = np.array([[True, False, True], [False, True, False]])
    u, h, r = np.array([[5.0, 9.0, 2.0], [9.0, 4.0, 9.0]]), np.ones((2, 3)), np.full((2, 3), np.nan)
    assert residual(working, u, h, 2.0, r) == 2.0**2 + 1.0**2 + 1.0**2
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


def test_stops_at_the_reduction_asked_for() -> None:
    problem = Problem(0.5)
    first = problem.residual()
    steps = problem.improve(13, 0.3)
    assert 0 < steps < 12
    assert problem.residual() <= 0.3 * first
    fewer = Problem(0.5)
    fewer.improve(steps - 1, 0.0)
    assert fewer.residual() > 0.3 * first


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
