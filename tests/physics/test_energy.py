"""The energy balance of a body without space (operator 1: a map is a row of independent points)."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from rubbers import complex_modulus
from stepping_body import HeldBody

from parcontact.parallel.slab import Array, Slab
from parcontact.physics.body import MovedHeights, ZenerBody
from parcontact.physics.energy import (
    AppliedInverse,
    ElasticEnergy,
    EnergyMemory,
    Pressed,
    ZenerEnergy,
    bend_weights,
    dissipation_weights,
)
from parcontact.physics.prony import Integrator, Prony

BODY = Prony(0.3, np.array([0.5, 2.0, 1.0]), np.array([0.05, 0.4, 1e2]))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


@pytest.mark.parametrize("z", [1e-12, 1e-6, 3e-3, 0.1, 0.999, 1.001, 10.0, 30.0])
def test_weights_are_integrals_over_the_step(z: float) -> None:
    """By Gauss's rule of forty nodes, of the motion (1) as an integral, too; rounding of the rule."""
    s, weights = 0.5 * (NODES + 1), 0.5 * WEIGHTS
    later = s[:, None] * s
    memory, change = np.exp(-z * s), s * (np.exp(-z * later) @ weights)
    bent = s * ((np.exp(-z * later) * (2 * s[:, None] * (1 - s) - 1)) @ weights)
    parts = memory, change, bent
    squares = [(1 + (i != j)) * parts[i] * parts[j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    assert_allclose(dissipation_weights(np.array(z)), [z * weights @ square for square in squares], rtol=4e-12)
    ends = [0.5 * (1 + np.exp(-z)), -0.5 * np.expm1(-z) / z]
    at_end = weights @ (np.exp(-z * (1 - s)) * (2 * s - 1))  # b there
    rises = [weights @ (part * (2 * s - 1)) for part in parts]
    work = [weights @ memory - ends[0], weights @ change - ends[1], rises[0]]
    work += [weights @ bent - 0.5 * at_end + rises[1], rises[2]]
    assert_allclose(bend_weights(np.array(z)), [0.0, *work], rtol=1e-13, atol=4e-15)


class Identity:
    """The inverse of an operator that is 1."""

    def apply(self, field: Array, out: Array) -> Array:
        out[...] = field
        return out


class Driven:
    """Four points of a body whose displacements are prescribed, and its energy."""

    def __init__(self, integrator: Integrator) -> None:
        slab = Slab.alone(4, 1)
        self.zener = HeldBody(ZenerBody(slab, BODY, integrator))
        self.energy = ZenerEnergy(slab, self.zener.body, AppliedInverse(Identity(), slab.empty))
        self.balance = self.energy.at_rest()
        self.p, self.alpha, self.dt = slab.zeros(), 1.0, 0.0

    def to(self, u: Array, dt: float) -> EnergyMemory:
        heights, growth = MovedHeights(u.reshape(1, 4)), dt / self.dt if self.dt else 0.0
        trial = self.zener.begin(dt, heights, growth)
        p, alpha = trial.effective.copy(), trial.alpha
        self.zener.commit(trial, p)
        pressed = Pressed(p, alpha), Pressed(self.p, self.alpha)
        self.balance = self.energy.advance(self.balance, dt, *pressed, u, self.zener.memory, growth)
        self.p, self.alpha, self.dt = p, alpha, dt
        return self.balance

    def stored(self) -> float:
        """From the maps themselves."""
        branches = sum(np.sum(h**2) / modulus for h, modulus in zip(self.zener.branches, BODY.moduli, strict=True))
        return float(0.5 * (BODY.modulus_inf * np.sum(self.zener.u**2) + branches))


def motion(t: float) -> Array:
    return np.array([1.0, 0.5, -2.0, 0.0]) * np.sin(3.0 * t) + np.array([0.0, t, 0.0, 1.0])


@pytest.mark.parametrize("integrator", ["exponential", "exponential-linear"])
def test_exponential_balance_closes(integrator: Integrator) -> None:
    """Work is of pressures, stored and dissipated energies are of branches; equal but for the rounding of 300 steps,
    some of which are ten times as long as the one before, or a millionth of it."""
    driven, t = Driven(integrator), 0.0
    for n in range(300):
        dt = 0.0 if n % 60 == 0 else 10.0 ** (-5 + n % 7)
        t += dt or 0.1
        balance = driven.to(motion(t), dt)
        assert np.all(balance.dissipated >= 0.0)
    assert_allclose(balance.stored + balance.dissipated.sum(), balance.work, rtol=1e-12)


@pytest.mark.parametrize(
    ("integrator", "order"), [("exponential", 4.0), ("exponential-linear", 2.0), ("backward-euler", 1.0)]
)
def test_dissipation_of_each_branch_converges(integrator: Integrator, order: float) -> None:
    """Sixth period of a sine: branch k loses `pi G'' per period; orders within 6 %. The error of third order of
    the quadratic step is in phase with u, and loses nothing."""
    omega = 4.0
    alone = [complex_modulus(omega, 0.0, *branch) for branch in zip(BODY.moduli, BODY.relaxation_times, strict=True)]
    exact = 4 * np.pi * np.imag(alone)[:2]  # of four points

    def errors(count: int) -> Array:
        driven, dt = Driven(integrator), 2 * np.pi / omega / count
        lost: Array = np.zeros(3)
        for n in range(1, 6 * count + 1):
            if n == 5 * count + 1:
                lost = driven.balance.dissipated.copy()
            driven.to(np.full(4, np.sin(n * dt * omega)), dt)
        return np.abs((driven.balance.dissipated - lost)[:2] / exact - 1.0)  # the third has not settled

    coarse, fine = errors(160), errors(320)
    assert fine.max() < 0.03
    assert_allclose(np.log2(coarse / fine), order, rtol=0.06)


def test_backward_euler_balance_closes_to_first_order() -> None:
    """On a ramp; the order within 5 %."""

    def gap(count: int) -> float:
        driven, dt = Driven("backward-euler"), 5.0 / count
        for n in range(1, count + 1):
            balance = driven.to(np.full(4, n * dt), dt)
        return float(abs(balance.work - balance.stored - balance.dissipated.sum()) / balance.work)

    gaps = [gap(count) for count in (400, 800, 1600)]
    assert gaps[-1] < 0.01
    assert_allclose(np.log2(np.array(gaps[:-1]) / gaps[1:]), 1.0, rtol=0.05)


@pytest.mark.mpi
def test_sums_go_over_all_ranks(comm: MPI.Intracomm) -> None:
    """Three rows on any number of ranks; the numbers are small and exact."""
    slab = Slab(comm, 4, 3)
    p, u = slab.zeros(), slab.zeros()
    p += 2.0
    u += 3.0
    elastic = ElasticEnergy(slab)
    zener = HeldBody(ZenerBody(slab, BODY, "exponential"))
    balance = elastic.advance(elastic.at_rest(), 0.0, Pressed(p, 0.5), Pressed(p, 0.5), u, zener.memory)
    assert balance.work == balance.stored == 0.5 * 0.5 * 6.0 * 12
    energy = ZenerEnergy(slab, zener.body, AppliedInverse(Identity(), slab.empty))
    trial = zener.begin(0.0, MovedHeights(u))
    zener.commit(trial, trial.effective.copy())
    pressed = Pressed(u, trial.alpha)
    balance = energy.advance(energy.at_rest(), 0.0, pressed, pressed, u, zener.memory)
    assert_allclose(balance.stored, 0.5 * 12 * 9 * (BODY.modulus_inf + BODY.moduli.sum()), rtol=1e-14)
