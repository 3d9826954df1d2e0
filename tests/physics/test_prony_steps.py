"""Time steps of one point, and their discrete moduli, against tables, exact solutions and a march.

The march is that of a single point, by the recursions of the two integrators.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER

from parcontact.physics.prony import (
    Integrator,
    Prony,
    complex_modulus,
    creep,
    discrete_modulus,
    relaxation_integral,
    zener_to_prony,
)


class Point:
    """One point, P = G_inf U + sum h_j with unit influence coefficient, stepped by either integrator's recursion."""

    def __init__(self, material: Prony, integrator: Integrator) -> None:
        self.material, self.integrator = material, integrator
        self.displacement = self.pressure = 0.0
        self.memory = np.zeros_like(material.moduli)

    def factors(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """What is kept of the memory and what a displacement increment adds to it."""
        z = dt / self.material.relaxation_times
        if dt == 0:
            return np.ones_like(z), self.material.moduli
        if self.integrator == "backward-euler":
            return 1 / (1 + z), self.material.moduli / (1 + z)
        return np.exp(-z), self.material.moduli * -np.expm1(-z) / z

    def displace(self, displacement: float, dt: float) -> float:
        keep, gain = self.factors(dt)
        self.memory = keep * self.memory + gain * (displacement - self.displacement)
        self.displacement = displacement
        self.pressure = self.material.modulus_inf * displacement + self.memory.sum()
        return self.pressure

    def load(self, pressure: float, dt: float) -> float:
        keep, gain = self.factors(dt)
        stiffness = self.material.modulus_inf + gain.sum()
        self.displace((pressure + gain.sum() * self.displacement - keep @ self.memory) / stiffness, dt)
        return self.displacement


# time steps of a single point
TWO_BRANCHES = zener_to_prony([2e6, 1e6], [1e6, 0], [3e3, 1e4], modulus_inf=0.5e6)


@pytest.mark.parametrize(
    ("integrator", "pressures"),
    [
        ("backward-euler", [3.00793650794, 5.67422524565, 8.09979123925, 10.3525348663, 12.4783106898]),
        ("exponential", [3.19132975075, 5.92223979616, 8.35749337777, 10.5978241831, 12.7050910089]),
    ],
)
def test_displacement_driven_point(integrator: Integrator, pressures: list[float]) -> None:
    """Two branches, U = n um after n steps of 0.5 ms; printed to 12 digits."""
    point = Point(TWO_BRANCHES, integrator)
    assert_allclose([point.displace(1e-6 * n, 0.5e-3) for n in range(1, 6)], pressures, rtol=1e-11)


def test_displacement_ramp_is_exact_with_exponential_steps() -> None:
    point = Point(TWO_BRANCHES, "exponential")
    stepped = [point.displace(2e-3 * n * 0.5e-3, 0.5e-3) for n in range(1, 20)]
    exact = 2e-3 * relaxation_integral(0.5e-3 * np.arange(1, 20), *TWO_BRANCHES)
    assert_allclose(stepped, exact, rtol=1e-13)


def test_branch_of_displacement_driven_point() -> None:
    """The share of the first branch, with its long-term part; printed to 12 digits."""
    point = Point(zener_to_prony(2e6, 1e6, 3e3), "backward-euler")
    shares = [1.55555555556, 2.81481481481, 3.87654320988, 4.80658436214, 5.6488340192]
    assert_allclose([point.displace(1e-6 * n, 0.5e-3) for n in range(1, 6)], shares, rtol=1e-11)


def test_load_driven_point() -> None:
    """Unit pressure from rest without a jump; printed to 12 digits."""
    point = Point(TWO_BRANCHES, "backward-euler")
    displacements = [3.32453825858e-7, 3.70214632313e-7, 4.01109597129e-7, 4.26741965876e-7, 4.48328593833e-7]
    assert_allclose([point.load(1.0, 0.5e-3) for _ in range(5)], displacements, rtol=1e-11)


def test_complex_modulus_of_two_branches() -> None:
    table = [1176700.977 + 112341.901j, 2823432.343 + 765676.568j, 3499865.680 + 14331.999j]
    assert_allclose(complex_modulus(np.array([10, 1e3, 1e5]), *TWO_BRANCHES), table, rtol=1e-9)  # printed to 0.001 Pa


def largest_error(integrator: Integrator, dt: float, case: str) -> float:
    """The largest error of a point of ZENER in [0, 5 ms], relative to the largest value."""
    t = dt * np.arange(1, round(5e-3 / dt) + 1)
    point, omega = Point(ZENER, integrator), 1e3
    if case == "ramp":
        exact = relaxation_integral(t, *ZENER)
        stepped = [point.displace(now, dt) for now in t]
    elif case == "sine":
        memory = ZENER.moduli[0] * (np.sin(omega * t) + np.cos(omega * t) - np.exp(-t / 1e-3)) / 2  # omega tau = 1
        exact = ZENER.modulus_inf * np.sin(omega * t) + memory
        stepped = [point.displace(np.sin(omega * now), dt) for now in t]
    else:
        exact = creep(t, *ZENER)
        if case == "jump":
            point.load(1.0, 0.0)
        stepped = [point.load(1.0, dt) for _ in t]
    return float(np.max(np.abs(stepped - exact)) / np.max(np.abs(exact)))


@pytest.mark.parametrize(
    ("ratio", "ramp", "sine_euler", "sine", "jump_euler", "jump", "smeared"),
    [
        (1, 0.0853, 0.235, 0.0747, 0.0285, 0.00441, 0.0796),
        (0.5, 0.0494, 0.126, 0.0194, 0.0146, 0.00112, 0.0444),
        (0.25, 0.0269, 0.0674, 0.00493, 0.00741, 0.000281, 0.0235),
        (0.125, 0.0141, 0.0345, 0.00123, 0.00373, 7.04e-05, 0.0121),
        (0.0625, 0.00724, 0.0175, 0.000308, 0.00187, 1.76e-05, 0.00611),
        (0.03125, 0.00366, 0.00883, 7.71e-05, 0.000938, 4.4e-06, 0.00308),
        (0.01, 0.00118, 0.00284, 7.89e-06, 0.0003, 4.51e-07, 0.000989),
    ],
)
def test_errors_of_integrators(
    ratio: float, ramp: float, sine_euler: float, sine: float, jump_euler: float, jump: float, smeared: float
) -> None:
    """Printed to 3 digits; a load smeared over the first step costs the exponential integrator its second order."""
    dt = ratio * 1e-3
    assert_allclose(largest_error("backward-euler", dt, "ramp"), ramp, rtol=5e-3)
    assert_allclose(largest_error("backward-euler", dt, "sine"), sine_euler, rtol=5e-3)
    assert_allclose(largest_error("exponential", dt, "sine"), sine, rtol=5e-3)
    assert_allclose(largest_error("backward-euler", dt, "jump"), jump_euler, rtol=5e-3)
    assert_allclose(largest_error("exponential", dt, "jump"), jump, rtol=5e-3)
    assert_allclose(largest_error("exponential", dt, "smeared"), smeared, rtol=5e-3)


# moduli of time steps
@pytest.mark.parametrize(
    ("steps", "omega", "loss_euler", "loss", "storage_euler", "storage"),
    [
        (8, 1e4, -23.298, -7.017, 17.124, 15.597),
        (8, 1e6, -25.827, -6.299, 9.792, 9.312),
        (16, 1e4, -11.093, -1.662, 9.769, 6.171),
        (16, 1e6, -12.767, -1.477, 5.904, 3.199),
        (32, 1e4, -5.380, -0.385, 5.199, 2.258),
        (32, 1e6, -6.323, -0.348, 3.231, 1.023),
        (64, 1e4, -2.645, -0.090, 2.680, 0.773),
        (64, 1e6, -3.143, -0.083, 1.689, 0.299),
        (128, 1e4, -1.310, -0.022, 1.361, 0.265),
        (128, 1e6, -1.566, -0.020, 0.864, 0.085),
    ],
)
def test_discrete_modulus_table(
    steps: int, omega: float, loss_euler: float, loss: float, storage_euler: float, storage: float
) -> None:
    """Errors in per cent of a body of twelve decades, printed to 0.001."""
    exact = complex_modulus(omega, *TWELVE_DECADES)
    for integrator, table in (("backward-euler", (storage_euler, loss_euler)), ("exponential", (storage, loss))):
        dt = 2 * np.pi / (steps * omega)
        stepped = discrete_modulus(omega, dt, *TWELVE_DECADES, integrator=integrator)  # type: ignore[arg-type]
        errors = 100 * np.array([stepped.real / exact.real - 1, stepped.imag / exact.imag - 1])
        assert_allclose(errors, table, rtol=0, atol=6e-4)


@pytest.mark.parametrize("integrator", ["backward-euler", "exponential"])
@pytest.mark.parametrize(("omega", "dt"), [(1e3, 1e-4), (100.0, 1e-3), (np.pi * 1e3, 1e-3), (5.0, 0.1)])
def test_discrete_modulus_is_that_of_a_march(integrator: Integrator, omega: float, dt: float) -> None:
    """After 40 relaxation times nothing but rounding is left of the start; the last case takes steps of 100 of them."""
    phase = np.exp(1j * omega * dt * np.arange(max(400, round(0.04 / dt))))
    parts = []
    for displacement in (phase.real, phase.imag):
        point = Point(ZENER, integrator)
        parts.append([point.displace(now, dt) for now in displacement][-1])
    assert_allclose((parts[0] + 1j * parts[1]) / phase[-1], discrete_modulus(omega, dt, *ZENER, integrator), rtol=1e-10)


@pytest.mark.parametrize(
    ("speed", "euler", "exponential"), [(0.004, 1.937992e6, 2.570412e6), (0.4, 2.737974e6, 2.749980e6)]
)
def test_discrete_modulus_of_a_changing_sign(speed: float, euler: float, exponential: float) -> None:
    """Two steps per period, one cell of 1/256 mm per step; real, printed to 7 digits."""
    dt = 1e-3 / 256 / speed
    for integrator, table in (("backward-euler", euler), ("exponential", exponential)):
        modulus = discrete_modulus(np.pi / dt, dt, *ZENER, integrator=integrator)  # type: ignore[arg-type]
        assert_allclose(modulus, table, rtol=3e-7)


@pytest.mark.parametrize("integrator", ["backward-euler", "exponential"])
def test_limits_of_discrete_modulus(integrator: Integrator) -> None:
    """Short steps give the complex modulus (at first and second order), long ones the long-term spring."""
    order = {"backward-euler": 1, "exponential": 2}[integrator]
    exact = complex_modulus(1e3, *ZENER)
    errors = [abs(discrete_modulus(1e3, dt, *ZENER, integrator) - exact) for dt in (1e-5, 5e-6)]
    assert_allclose(errors[0] / errors[1], 2**order, rtol=0.01)
    for dt in (1e6, 1e300):
        lasting = discrete_modulus(1.0 / dt, dt, *ZENER, integrator)
        assert_allclose(lasting, ZENER.modulus_inf, rtol=10 * 1e-3 / dt + 1e-15)
    assert_allclose(discrete_modulus(1e3, 1e-13, *ZENER, integrator), exact, rtol=1e-9)
