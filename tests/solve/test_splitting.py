"""Contact with a law of the interface, against a pointwise solution, an independent solver and closed forms."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from parcontact.errors import InputError
from parcontact.parallel.fft import FFT
from parcontact.parallel.slab import Slab
from parcontact.physics.convolution import Convolution
from parcontact.physics.halfspace import HalfSpace
from parcontact.solve.interface_law import HARD, InterfaceLaw
from parcontact.solve.nonsymmetric.splitting import Splitting

from .bodies import solve

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
    contact = splitting.solve(HEIGHTS, mean, LAW, 60.0)
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


@pytest.mark.parametrize("mean", [0.3, 3.0])
def test_hard_walls_are_those_of_the_conjugate_gradients(mean: float) -> None:
    """Without a law it is the contact of `solve.contact`: both to 1e-9, pressures to 1e-6 of the highest."""
    splitting, _ = made(1e-9)
    contact = splitting.solve(HEIGHTS, mean, HARD, 60.0)
    other = solve(HEIGHTS, mean, tolerance=1e-9)
    assert np.abs(contact.p - other.p).max() < 1e-6 * contact.p.max()
    assert contact.d == pytest.approx(other.d, abs=1e-8)


def test_law_alone() -> None:
    """On flat ground the pressure is uniform, and the approach is the closing: `c(p) - d = 0`."""
    splitting, _ = made(1e-9)
    contact = splitting.solve(np.zeros((N, N)), 2.0, LAW, 60.0)
    assert np.ptp(contact.p) < 1e-12
    assert contact.d == pytest.approx(float(LAW.closing(np.array(2.0))), rel=1e-9)


def test_closings_that_fall_are_refused() -> None:
    with pytest.raises(InputError, match="do not fall"):
        InterfaceLaw.of_table(np.array([1.0, 2.0]), np.array([1.0, 0.5]))
    with pytest.raises(InputError, match="which rise"):
        InterfaceLaw.of_table(np.array([2.0, 1.0]), np.array([1.0, 1.5]))
