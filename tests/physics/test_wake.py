"""Operators of steady sliding against integrals along the wake, and against the body's own relaxation."""

from itertools import pairwise

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from rubbers import complex_modulus
from scipy.integrate import quad

from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics import wake
from parcontact.physics.halfspace import HalfSpace
from parcontact.physics.love import love as elastic
from parcontact.physics.prony import Prony, creep_spectrum

from .maps import gathered, random_map

BODY = Prony(0.3, np.array([2.0, 0.7]), np.array([0.05, 2.0]))
CREEP = creep_spectrum(*BODY)
CELL = (0.1, 0.07)


def along_the_wake(x: float, y: float, velocity: tuple[float, float]) -> float:
    """`J_g A(x) + sum J_i int exp(-t/l_i)/l_i A(x + v t) dt` with Love's A, by adaptive quadrature in units of l_i."""

    def love(t: float) -> float:
        return float(elastic(np.array(x + velocity[0] * t), np.array(y + velocity[1] * t), *CELL))

    total = CREEP.glass * love(0.0)
    for compliance, time in zip(CREEP.compliances, CREEP.retardation_times, strict=True):
        nearest = -(x * velocity[0] + y * velocity[1]) / float(np.dot(velocity, velocity)) / time
        points = sorted({0.0, *(p for p in (nearest - 0.05, nearest, nearest + 0.05) if 0.0 < p < 40.0), 40.0})
        for start, stop in pairwise(points):
            part = quad(lambda s, time=time: np.exp(-s) * love(s * time), start, stop, epsabs=1e-12, limit=400)
            total += compliance * part[0]
    return total


@pytest.mark.parametrize("velocity", [(0.02, 0.0), (1.0, 0.0), (-0.3, 0.4), (0.0, 50.0)])
def test_coefficients_are_integrals_along_the_wake(velocity: tuple[float, float]) -> None:
    """To 1e-5, what six Gauss nodes per panel leave at the edge of the loaded cell; on it, before it, in its wake."""
    places = np.array([(0.0, 0.0), (0.05, 0.035), (0.3, 0.0), (-0.3, 0.14), (-2.0, -1.0), (1.0, 3.0)])
    found = wake.wake(places[None, :, 0], places[None, :, 1], *CELL, velocity, CREEP)[0]
    expected = [along_the_wake(float(x), float(y), velocity) for x, y in places]
    assert_allclose(found, expected, rtol=1e-5)


@pytest.mark.parametrize("velocity", [(0.002, 0.0), (0.02, 0.0), (-1.0, 0.0), (50.0, 0.0)])
def test_rows_along_the_velocity(velocity: tuple[float, float]) -> None:
    """What is found for whole rows, from cell to cell, is what is found for each cell: to 1e-5 as above."""
    x, y = CELL[0] * np.array([0.0, 1.0, 2.0, 3.0, -3.0, -2.0, -1.0]), CELL[1] * np.array([0.0, 1.0, -2.0])
    found = wake.wake(x[None, :], y[:, None], *CELL, velocity, CREEP)
    expected = [[along_the_wake(float(a), float(b), velocity) for a in x] for b in y]
    assert_allclose(found, expected, rtol=1e-5)


def test_far_coefficients_are_those_of_point_loads() -> None:
    """Love's displacement far away is that of a point load, `dx dy/(4 pi r)`, to the fourth power of cell over distance
    when two terms of its expansion are taken: here along the whole wake, to 1e-6."""
    velocity = (0.4, 0.1)
    x, y = 4.0, 3.0

    def point(t: float) -> float:
        return CELL[0] * CELL[1] / (4 * np.pi * np.hypot(x + velocity[0] * t, y + velocity[1] * t))

    expected = CREEP.glass * point(0.0)
    for compliance, time in zip(CREEP.compliances, CREEP.retardation_times, strict=True):
        expected += compliance * quad(lambda s, time=time: np.exp(-s) * point(s * time), 0.0, 40.0)[0]
    found = wake.wake(np.array([[x]]), np.array([[y]]), *CELL, velocity, CREEP)
    assert_allclose(found, expected, rtol=(max(CELL) / 5.0) ** 2)


@pytest.mark.parametrize(("speed", "compliance"), [(1e-9, CREEP.glass + CREEP.compliances.sum()), (1e9, CREEP.glass)])
def test_slow_and_fast_bodies_are_elastic(speed: float, compliance: float) -> None:
    """Relaxed, to the share of a cell that is crept along (rounding, where this is left out); glassy, to the distance
    over a creep length."""
    x, y = np.array([[0.0, 0.2, -1.0]]), np.array([[0.0, 0.1, 2.0]])
    found = wake.wake(x, y, *CELL, (speed, 0.0), CREEP)
    assert_allclose(found, compliance * elastic(x, y, *CELL), rtol=1e-6)


@pytest.mark.mpi
@pytest.mark.parametrize("velocity", [(0.7, 0.0), (0.3, -0.4)])
def test_periodic_is_the_symbol(comm: MPI.Intracomm, velocity: tuple[float, float]) -> None:
    """Against numpy's complex transform of the whole map with `1/(2 |q| G*(-q v))`, to rounding; the Nyquist wave,
    which has two signs, takes the mean of both. The inverse undoes it but for the mean."""
    nx, ny, size = 12, 9, (1.5, 0.8)
    slab = Slab(comm, nx, ny)
    fft = FFT(slab)
    half_space = HalfSpace(size)
    forward = half_space.sliding_operator(fft, velocity, BODY)
    inverse = half_space.sliding_inverse(fft, velocity, BODY)
    p = random_map(nx, ny)
    own = slab.empty()
    own[...] = p[slab.rows]
    qx = 2 * np.pi / size[0] * np.fft.fftfreq(nx, 1 / nx)[None, :]
    qy = 2 * np.pi / size[1] * np.fft.fftfreq(ny, 1 / ny)[:, None]
    modulus = complex_modulus(-(qx * velocity[0] + qy * velocity[1]), *BODY)
    other = complex_modulus(-(-qx * velocity[0] + qy * velocity[1]), *BODY)
    modulus[:, nx // 2] = 0.5 * (modulus + other)[:, nx // 2]
    q = np.hypot(qx, qy)
    symbol = np.divide(0.5, q * modulus, out=np.zeros((ny, nx), complex), where=q > 0)
    expected = np.fft.ifft2(symbol * np.fft.fft2(p)).real
    u = forward.apply(own, slab.empty())
    assert_allclose(gathered(u, slab), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    back = gathered(inverse.apply(u, slab.empty()), slab)
    assert_allclose(back - back.mean(), p - p.mean(), rtol=0, atol=1e-12)


@pytest.mark.mpi
def test_free_is_the_sum_of_coefficients(comm: MPI.Intracomm) -> None:
    """Against the double sum over all pairs of cells, to rounding; what is upstream stays so, nothing wraps around."""
    nx, ny, size, velocity = 7, 5, (0.7, 0.35), (0.5, 0.2)
    slab = Slab(comm, nx, ny)
    p = random_map(nx, ny)
    own = slab.empty()
    own[...] = p[slab.rows]
    operator = HalfSpace(size, free=True).sliding_operator(FFT(slab), velocity, BODY)
    u = gathered(operator.apply(own, slab.empty()), slab)
    x, y = (0.1 * np.arange(nx))[None, :], (0.07 * np.arange(ny))[:, None]
    expected = np.zeros((ny, nx))
    for j in range(ny):
        for i in range(nx):
            expected += p[j, i] * wake.wake(x - x[0, i], y - y[j, 0], *CELL, velocity, CREEP)
    assert_allclose(u, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_waits_for_no_endless_wake() -> None:
    half_space, fft = HalfSpace((1.0, 1.0), free=True), FFT(Slab.alone(4, 4))
    with pytest.raises(InputError, match="endless wake"):
        half_space.sliding_operator(fft, (1.0, 0.0), Prony(0.0, np.ones(1), np.ones(1)))


def test_a_branch_that_is_far_too_soft_makes_nothing() -> None:
    """Its retardation time is its relaxation time to the last digit: as an operator it is 0, not infinite."""
    slab = Slab.alone(4, 4)
    body = Prony(1.0, np.array([1e-30]), np.array([2.0]))
    with np.errstate(all="raise"):
        branch = HalfSpace((1.0, 1.0), free=True).branch_operator(FFT(slab), (1.0, 0.0), body, 0)
        found = branch.apply(np.ones((4, 4)), slab.empty())
    assert np.abs(found).max() < 1e-29
