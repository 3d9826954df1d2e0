"""Relaxation, creep and complex moduli against tables, differential equations and integrals."""

import numpy as np
import pytest
import rubbers
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER
from scipy.integrate import quad, solve_ivp

from parcontact.physics.prony import (
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


def test_creep_of_zener_branch_has_a_closed_form() -> None:
    series, kelvin, viscosity = 2.75e6, 0.305555555555555556e6, 3055.55555555555556
    times = np.geomspace(1e-9, 1e3, 50)
    closed = 1 / series - np.expm1(-times * kelvin / viscosity) / kelvin
    assert_allclose(creep(times, *zener_to_prony(series, kelvin, viscosity)), closed, rtol=1e-14)


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


@pytest.mark.parametrize("flows", [False, True])
def test_time_of_a_compliance(flows: bool) -> None:
    """The inverse of J(t), to rounding; 0 below J(0), and infinite above the last one of a body that does not flow."""
    spectrum = creep_spectrum(0.0 if flows else BODY.modulus_inf, BODY.moduli, BODY.relaxation_times)
    most = spectrum.glass + spectrum.compliances.sum()
    assert (spectrum.fluidity > 0.0) == flows
    assert spectrum.time(spectrum.glass / 2) == 0.0
    assert (spectrum.time(2 * most) == np.inf) == (not flows)
    for target in np.geomspace(spectrum.glass * 1.001, most * 0.999, 5):
        assert_allclose(spectrum.compliance(spectrum.time(target)), target, rtol=1e-12)
