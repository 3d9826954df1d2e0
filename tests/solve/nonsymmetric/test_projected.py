"""Projected steps against dense algebra."""

import numpy as np
import pytest
from numpy.typing import NDArray

from parcontact.parallel.slab import Array, Slab
from parcontact.solve.constraint import NonNegative
from parcontact.solve.nonsymmetric.projected import Projected

Map = NDArray[np.float64]


class Scaled:
    """The identity times a number."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def apply(self, field: Array, out: Array) -> Array:
        np.multiply(field, self.factor, out=out)
        return out


class Dense:
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
    steps = Projected(slab, Dense(A), Scaled(1.0), NonNegative())
    x = np.full((ny, nx), 100.0)
    h = (A @ (x.ravel() + random.normal(size=n))).reshape(ny, nx)
    u, working = slab.empty(), np.ones((ny, nx), dtype=np.bool_)
    operator = Dense(A)
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
