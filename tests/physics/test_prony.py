"""Relaxation, creep, complex and discrete moduli against tables, differential equations, integrals and a march.

The march is that of a single point, by the recursions of the two integrators.
"""

from collections.abc import Callable

import numpy as np
import pytest
import rubbers
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER
from scipy.integrate import quad, solve_ivp

from parcontact.physics.prony import (
    Integrator,
    Prony,
    complex_modulus,
    creep,
    creep_spectrum,
    discrete_modulus,
    normal_form,
    relaxation,
    relaxation_integral,
    zener_to_prony,
)

Drive = Callable[[float], float]


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


# equations and integrals

BODY = Prony(0.4, np.array([2.0, 0.5, 1.5]), np.array([0.03, 0.4, 5.0]))
TIMES = np.array([0.0, 0.01, 0.1, 1.0, 3.0, 10.0])


def stress_after_a_step(strain_rate: float, strain: float) -> np.ndarray:
    """Stresses at TIMES of springs and dashpots, by a solver of `dh/dt = G du/dt - h/tau`; to 1e-9 of the largest."""

    def rates(t: float, h: np.ndarray) -> np.ndarray:
        return BODY.moduli * strain_rate - h / BODY.relaxation_times

    tight = {"rtol": 1e-11, "atol": 1e-13}
    h = solve_ivp(rates, (0.0, TIMES[-1]), BODY.moduli * strain, "DOP853", TIMES, **tight).y
    return np.asarray(BODY.modulus_inf * (strain + strain_rate * TIMES) + h.sum(axis=0))


def test_relaxation_solves_the_equation_of_the_branches() -> None:
    assert_allclose(relaxation(TIMES, *BODY), stress_after_a_step(0.0, 1.0), rtol=1e-8)
    assert_allclose(relaxation_integral(TIMES, *BODY), stress_after_a_step(1.0, 0.0), rtol=1e-8, atol=1e-12)


def test_creep_solves_the_equation_of_the_branches() -> None:
    """Of unit stress: `G_inf du/dt + sum dh/dt = 0`, with the rates above; the solver is asked for 1e-11."""
    glass = BODY.modulus_inf + BODY.moduli.sum()

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        rate = np.sum(state[1:] / BODY.relaxation_times) / glass
        return np.array([rate, *(BODY.moduli * rate - state[1:] / BODY.relaxation_times)])

    start = np.array([1.0, *BODY.moduli]) / glass
    u = solve_ivp(rates, (0.0, TIMES[-1]), start, "DOP853", TIMES, rtol=1e-11, atol=1e-13).y[0]
    assert_allclose(creep(TIMES, *BODY), u, rtol=1e-8)


@pytest.mark.parametrize("omega", [0.1, 1.0, 40.0, -3.0])
def test_complex_modulus_is_a_fourier_integral(omega: float) -> None:
    """`G_inf + i omega int_0^inf (G(t) - G_inf) exp(-i omega t) dt` by quadrature of oscillations, to 1e-8."""

    def memory(t: float) -> float:
        return float(rubbers.relaxation(t, *BODY)) - BODY.modulus_inf

    even, odd = (quad(memory, 0, np.inf, weight=kind, wvar=abs(omega), limlst=500)[0] for kind in ("cos", "sin"))
    expected = BODY.modulus_inf + 1j * omega * (even - 1j * np.sign(omega) * odd)
    assert_allclose(complex_modulus(omega, *BODY), expected, rtol=1e-8)


@pytest.mark.parametrize("material", [BODY, ZENER, TWELVE_DECADES])
def test_functions_are_what_they_are_defined_as(material: Prony) -> None:
    """Term by term, to rounding; the tests of `theory` compare with these definitions."""
    times, omega = np.geomspace(1e-10, 1e4, 29), np.geomspace(1e-6, 1e10, 33)
    assert_allclose(relaxation(times, *material), rubbers.relaxation(times, *material), rtol=1e-14)
    assert_allclose(complex_modulus(omega, *material), rubbers.complex_modulus(omega, *material), rtol=1e-13)


# tables for one Zener branch


def test_relaxation_of_zener_branch() -> None:
    times = 1e-3 * np.array([0, 0.1, 0.5, 1, 2, 5, 10])
    table = [2750000, 2514472.61, 1776163.38, 1185501.62, 609954.83, 291676.42, 275112.36]
    assert_allclose(relaxation(times, *ZENER), table, rtol=0, atol=6e-3)  # printed to 0.01 Pa


def test_creep_of_zener_branch() -> None:
    times = 1e-3 * np.array([0, 0.1, 0.5, 1, 2, 5, 10])
    table = [3.636364e-7, 3.962005e-7, 5.232492e-7, 6.750775e-7, 9.568812e-7, 1.651354e-6, 2.432395e-6]
    assert_allclose(creep(times, *ZENER), table, rtol=2e-7)  # printed to 7 digits


def test_creep_of_zener_branch_has_a_closed_form() -> None:
    series, kelvin, viscosity = 2.75e6, 0.305555555555555556e6, 3055.55555555555556
    times = np.geomspace(1e-9, 1e3, 50)
    closed = 1 / series - np.expm1(-times * kelvin / viscosity) / kelvin
    assert_allclose(creep(times, *zener_to_prony(series, kelvin, viscosity)), closed, rtol=1e-14)


def test_loss_of_zener_branch() -> None:
    assert_allclose(complex_modulus(1000.0, *ZENER).imag, 1.2375e6, rtol=1e-14)
    assert np.all(complex_modulus(np.array([990.0, 1010.0]), *ZENER).imag < 1.2375e6)
    peak = complex_modulus(np.sqrt(1e5), *ZENER)
    assert_allclose(peak.imag / peak.real, 1.42302, rtol=4e-6)  # printed to 6 digits


# Zener branches as a Prony series


def test_zener_branch_becomes_prony_series() -> None:
    series = zener_to_prony(2.75e6, 2.75e6 / 9, 2.75e6 / 9 * 0.01)
    assert_allclose(series.modulus_inf, ZENER.modulus_inf, rtol=1e-15)
    assert_allclose(series.moduli, ZENER.moduli, rtol=1e-15)
    assert_allclose(series.relaxation_times, ZENER.relaxation_times, rtol=1e-15)


def test_zener_branches_with_and_without_a_long_term_share_are_one_body() -> None:
    whole, maxwell = zener_to_prony(2.75e6, 2.75e6 / 9, 27.5e6 / 9e3), zener_to_prony(2.475e6, 0, 2475, 0.275e6)
    times = np.geomspace(1e-6, 1, 20)
    assert_allclose(relaxation(times, *whole), relaxation(times, *maxwell), rtol=1e-13)


@pytest.mark.parametrize(
    ("kelvin_modulus", "viscosity", "early", "late"),
    [
        (0.0, 10.0, 2.0, 0.0),  # Maxwell: flows in the end
        (3.0, 0.0, 1.2, 1.2),  # two springs in series
        (3.0, np.inf, 2.0, 2.0),  # the series spring alone
        (0.0, np.inf, 2.0, 2.0),
        (3.0, 10.0, 2.0, 1.2),
    ],
)
def test_limits_of_zener_branch(kelvin_modulus: float, viscosity: float, early: float, late: float) -> None:
    series = zener_to_prony(2.0, kelvin_modulus, viscosity, modulus_inf=0.5)
    assert_allclose(relaxation(np.array([1e-14, 1e6]), *series), [0.5 + early, 0.5 + late], rtol=1e-13)
    assert_allclose(creep(1e12, *series), 1 / (0.5 + late), rtol=1e-12)


def test_mistakes_are_sentences() -> None:
    with pytest.raises(ValueError, match="2 moduli but 1 relaxation"):
        normal_form(1.0, [1.0, 2.0], [1.0])
    with pytest.raises(ValueError, match="must not be negative"):
        relaxation(0.0, 1.0, [-1.0], [1.0])
    with pytest.raises(ValueError, match="must be positive and finite"):
        creep(0.0, 0.0, [1.0], [0.0])
    with pytest.raises(ValueError, match="a positive series modulus"):
        zener_to_prony(0.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="integrator"):
        discrete_modulus(1.0, 1.0, *ZENER, integrator="trapezoidal")  # type: ignore[arg-type]


# creep from relaxation

BODIES = [
    ZENER,
    TWELVE_DECADES,
    Prony(0.0, TWELVE_DECADES.moduli, TWELVE_DECADES.relaxation_times),
    Prony(1e-9, np.ones(21), np.logspace(-10, 10, 21)),
    Prony(0.0, np.logspace(10, -10, 21), np.logspace(-10, 10, 21)),
    Prony(1.0, np.array([1.0, 1e-14, 1e-30]), np.array([1e-3, 1.0, 1e3])),
    Prony(1.0, np.array([1e-20, 1.0, 1e-20]), np.array([1e-3, 1.0, 1e3])),
    Prony(1.0, np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0 + 1e-15, 1.0 + 1e-12])),
    Prony(3.0, np.array([1.0, 2.0, 4.0, 0.0]), np.array([2.0, 2.0, np.inf, 5.0])),
    Prony(1e-12, np.array([1.0]), np.array([1.0])),
    Prony(2.0, np.array([]), np.array([])),
    Prony(0.0, np.array([2.0]), np.array([3.0])),
]


@pytest.mark.parametrize("material", BODIES)
def test_creep_and_relaxation_are_inverse(material: Prony) -> None:
    """Their transforms multiply to 1. For real s > 0 both are sums of positive terms: only rounding is allowed for."""
    s = np.geomspace(1e-25, 1e25, 301)[:, None]
    spring, terms, times = normal_form(*material)
    modulus = spring + (s * times / (1 + s * times)) @ terms
    glass, compliances, retardation_times, fluidity = creep_spectrum(*material)
    compliance = glass + 1 / (1 + s * retardation_times) @ compliances + fluidity / s[:, 0]
    assert_allclose(modulus * compliance, 1, rtol=1e-12)


@pytest.mark.parametrize("material", BODIES)
def test_retardation_times_lie_between_relaxation_times(material: Prony) -> None:
    times, later = normal_form(*material).relaxation_times, creep_spectrum(*material).retardation_times
    assert np.all(later >= times[: later.size])  # equal where they differ by less than rounding
    assert np.all(later[: times.size - 1] <= times[1:])


def test_creep_and_complex_modulus_are_inverse() -> None:
    omega = np.geomspace(1e-6, 1e12, 100)
    glass, compliances, times, _ = creep_spectrum(*TWELVE_DECADES)
    compliance = glass + 1 / (1 + 1j * omega[:, None] * times) @ compliances
    assert_allclose(compliance * complex_modulus(omega, *TWELVE_DECADES), 1, rtol=1e-13)


def test_a_maxwell_body_flows() -> None:
    times = np.array([0.0, 1e-3, 1.0, 1e6])
    assert_allclose(creep(times, 0.0, [2.0], [3.0]), 0.5 + times / 6, rtol=1e-15)


@pytest.mark.parametrize("material", BODIES)
def test_time_of_a_compliance(material: Prony) -> None:
    spectrum = creep_spectrum(*material)
    assert spectrum.time(spectrum.glass / 2) == 0
    most = spectrum.glass + spectrum.compliances.sum()
    assert (spectrum.time(2 * most) == np.inf) == (spectrum.fluidity == 0)
    for target in np.geomspace(spectrum.glass * 1.001, most * 0.999, 5) if most > 1.1 * spectrum.glass else []:
        assert_allclose(spectrum.compliance(spectrum.time(target)), target, rtol=1e-12)


def test_relaxation_integral() -> None:
    times = np.geomspace(1e-10, 1e4, 200)
    middle, h = np.sqrt(times[1:] * times[:-1]), 1e-5
    slope = np.diff([relaxation_integral(middle * factor, *TWELVE_DECADES) for factor in (1 - h, 1 + h)], axis=0)
    assert_allclose(slope[0] / (2 * h * middle), relaxation(middle, *TWELVE_DECADES), rtol=1e-7)  # rounding / h


def test_shapes_and_units() -> None:
    t = np.ones((2, 3))
    assert relaxation(t, *TWELVE_DECADES).shape == creep(t, *TWELVE_DECADES).shape == (2, 3)
    assert relaxation(1.0, *ZENER).shape == creep(1.0, *ZENER).shape == ()
    stiffer = Prony(7 * ZENER.modulus_inf, 7 * ZENER.moduli, 3 * ZENER.relaxation_times)
    assert_allclose(relaxation(3 * t, *stiffer), 7 * relaxation(t, *ZENER), rtol=1e-14)
    assert_allclose(creep(3 * t, *stiffer), creep(t, *ZENER) / 7, rtol=1e-14)
    assert_allclose(complex_modulus(t / 3, *stiffer), 7 * complex_modulus(t, *ZENER), rtol=1e-14)


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
