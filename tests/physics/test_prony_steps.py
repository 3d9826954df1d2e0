"""Discrete moduli of time steps against tables, limits and a march of the body."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER

from parcontact.physics.prony import (
    Integrator,
    complex_modulus,
    discrete_modulus,
)

from .test_material import body, push


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
    for integrator, table in (("backward-euler", (storage_euler, loss_euler)), ("exponential-linear", (storage, loss))):
        dt = 2 * np.pi / (steps * omega)
        stepped = discrete_modulus(omega, dt, *TWELVE_DECADES, integrator=integrator)  # type: ignore[arg-type]
        errors = 100 * np.array([stepped.real / exact.real - 1, stepped.imag / exact.imag - 1])
        assert_allclose(errors, table, rtol=0, atol=6e-4)


@pytest.mark.parametrize("integrator", ["backward-euler", "exponential-linear", "exponential"])
@pytest.mark.parametrize(("omega", "dt"), [(1e3, 1e-4), (100.0, 1e-3), (np.pi * 1e3, 1e-3), (5.0, 0.1)])
def test_discrete_modulus_is_that_of_a_march(integrator: Integrator, omega: float, dt: float) -> None:
    """After 40 relaxation times nothing but rounding is left of the start; the last case takes steps of 100 of them."""
    phase = np.exp(1j * omega * dt * np.arange(max(400, round(0.04 / dt))))
    parts = []
    for displacement in (phase.real, phase.imag):
        point = body(ZENER, integrator)
        parts.append([push(point, now, dt, float(n > 0)) for n, now in enumerate(displacement)][-1])
    assert_allclose(
        (parts[0] + 1j * parts[1]) / phase[-1], discrete_modulus(omega, dt, *ZENER, integrator=integrator), rtol=1e-10
    )


@pytest.mark.parametrize("integrator", ["backward-euler", "exponential-linear", "exponential"])
def test_limits_of_discrete_modulus(integrator: Integrator) -> None:
    """Short steps give the complex modulus (at first, second and third order), long ones the long-term spring."""
    order = {"backward-euler": 1, "exponential-linear": 2, "exponential": 3}[integrator]
    exact = complex_modulus(1e3, *ZENER)
    errors = [abs(discrete_modulus(1e3, dt, *ZENER, integrator=integrator) - exact) for dt in (1e-5, 5e-6)]
    assert_allclose(errors[0] / errors[1], 2**order, rtol=0.01)
    for dt in (1e6, 1e300):
        lasting = discrete_modulus(1.0 / dt, dt, *ZENER, integrator=integrator)
        assert_allclose(lasting, ZENER.modulus_inf, rtol=20 * 1e-3 / dt + 1e-15)
    assert_allclose(discrete_modulus(1e3, 1e-13, *ZENER, integrator=integrator), exact, rtol=1e-9)
