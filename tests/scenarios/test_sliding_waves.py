"""A wave that slides in full contact: friction against its closed form, and its order in time."""

from pathlib import Path

import numpy as np
import pytest
from closed_forms import step_responses
from marching import PRONY, column, marched
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from rubbers import relaxation
from sliding import CELL, FAST, HEIGHT, MEAN, WAVELENGTH, K, wave

from parcontact.physics.prony import Integrator
from parcontact.storage.row import StepRow
from parcontact.theory import full_contact

INTEGRATORS: tuple[Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")

# velocity and the friction of steady sliding at one cell per step, of exponential and of backward Euler steps
STEADY = [
    (0.001, 4.902519e-05, 4.888371e-05),
    (0.004, 0.0001943267, 0.000192302),
    (0.01, 0.0004615856, 0.0004507858),
    (FAST, 0.0009763055, 0.0009302677),
    (0.1, 0.0006707329, 0.0006487824),
    (0.4, 0.0001923269, 0.0001904834),
    (1.0, 7.756915e-05, 7.726771e-05),
]


def traction(rows: list[StepRow]) -> NDArray[np.float64]:
    """Tangential force over normal force, along x."""
    return column(rows, "force_x") / (column(rows, "pressure") * WAVELENGTH**2)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(("velocity", "exponential", "euler"), STEADY)
def test_steady_friction(integrator: Integrator, velocity: float, exponential: float, euler: float) -> None:
    """After 25 relaxation times the friction that these steps must give: computed to 1e-9, and printed to 7 digits but
    for the quadratic steps."""
    cells = max(60, np.ceil(25e-3 * velocity / CELL))
    data = wave([{"velocity": velocity, "distance": cells * CELL, "cells_per_step": 1}], integrator=integrator)
    data["grid"]["size"][1] = 1e-4 * WAVELENGTH  # a very long and narrow box is all right
    _, rows = marched(data)
    found = rows[-1].measures.friction
    if integrator != "exponential":
        assert found == pytest.approx(exponential if integrator == "exponential-linear" else euler, rel=3e-7)
    waves = (MEAN, HEIGHT, np.array([K]), np.array([0.0]), velocity, 0.0)
    exact = step_responses.discrete_friction_coefficient(*waves, CELL / velocity, *PRONY, integrator=integrator)
    assert found == pytest.approx(float(exact), rel=1e-9)
    assert rows[-1].measures.force_x < 0.0
    assert rows[-1].operator_calls <= 4


def test_error_of_a_step_in_full_contact() -> None:
    """The estimate is one to three times the error of the loss of these steps, here at z = dt/tau of 0.1."""
    stage = {"velocity": FAST, "distance": 60 * CELL, "cells_per_step": 1, "pressure": 1e2 * MEAN}
    _, rows = marched(wave([stage], tolerance=1e-10))
    errors, waves = rows[-1].errors, (MEAN, HEIGHT, np.array([K]), np.array([0.0]), FAST, 0.0)
    assert errors is not None
    assert errors.friction is not None
    stepped = step_responses.discrete_friction_coefficient(*waves, CELL / FAST, *PRONY)
    true = abs(float(stepped / full_contact.friction_coefficient(*waves, *PRONY)) - 1.0)
    assert true < errors.friction.time < 3.0 * true


def transient(before: float, after: float, steps: int, integrator: Integrator) -> float:
    """Largest error, over the largest exact value, in 5 ms after 20 ms at one velocity and then at another."""
    stages = [{"duration": 20e-3, "time_step": 20e-3 / (4 * steps if before else 1), "velocity": before}]
    stages += [{"duration": 5e-3, "time_step": 5e-3 / steps, "velocity": after}]
    _, rows = marched(wave(stages, points=(8, 1), integrator=integrator))
    late = [row for row in rows if row.time > 20.0001e-3]
    t = column(late, "time") - 20e-3
    modulus = step_responses.velocity_step_modulus(t, K * before, np.array([K * after]), *PRONY)
    exact = full_contact.traction(HEIGHT, np.array([K]), np.array([0.0]), modulus)[:, 0] / MEAN
    return float(np.abs(traction(late) - exact).max() / np.abs(exact).max())


def test_start_after_a_rest() -> None:
    """Load, 1 ms of rest, sliding: within 1e-6 of the peak at 500 steps in 5 ms, with order 3."""
    errors = []
    for steps in (125, 250, 500):
        sliding = {"duration": 5e-3, "time_step": 5e-3 / steps, "velocity": FAST}
        stages = [{"duration": 1e-3, "time_step": 1e-3}, sliding]
        _, rows = marched(wave(stages, points=(8, 1)))
        late = rows[2:]
        t = column(late, "time") - 1e-3
        modulus = step_responses.load_rest_slide_modulus(t, 1e-3, np.array([K * FAST]), *PRONY)
        exact = full_contact.traction(HEIGHT, np.array([K]), np.array([0.0]), modulus)[:, 0] / MEAN
        errors.append(float(np.abs(traction(late) - exact).max() / np.abs(exact).max()))
    assert errors[-1] < 1e-6
    assert_allclose(np.log2(errors[:-1]) - np.log2(errors[1:]), 3.0, rtol=0.05)
    printed = [0, -1.20719, -2.35062, -5.32082, -8.62804, -10.6389, -9.73556]
    at = np.array([0, 0.1, 0.2, 0.5, 1, 2, 5]) * 1e-3
    assert_allclose(np.interp(at, t, traction(late)), 1e-4 * np.array(printed), rtol=0, atol=5e-6 * 1e-4 * 11)


@pytest.mark.parametrize(
    ("integrator", "order"), [("exponential", 3.0), ("exponential-linear", 2.0), ("backward-euler", 1.0)]
)
def test_order_of_a_velocity_step(integrator: Integrator, order: float) -> None:
    errors = [transient(0.004, FAST, steps, integrator) for steps in (100, 200, 400)]
    assert_allclose(np.log2(errors[:-1]) - np.log2(errors[1:]), order, rtol=0.05)


@pytest.mark.parametrize("waves", [(1, 1), (2, 1), (1, -2)])
def test_oblique_waves(waves: tuple[int, int]) -> None:
    """Sliding along x: mu = |q| kx h0^2 G''(kx v)/P0 of these steps; and a force across. To 1e-9."""
    velocity = 0.4 * FAST
    cell = WAVELENGTH / 32
    stage = {"velocity": velocity, "distance": 50 * cell, "cells_per_step": 1}
    _, rows = marched(wave([{"duration": 20e-3, "time_step": 20e-3}, stage], waves, (32, 32)))
    kx, ky = K * waves[0], K * waves[1]
    data = rows[-1].measures
    dt = cell / velocity
    moment = (MEAN, HEIGHT, np.array([kx]), np.array([ky]), velocity, 0.0, dt, *PRONY)
    mu = float(step_responses.discrete_friction_coefficient(*moment))
    settled = np.exp(-50 * dt / 1e-3)
    load = MEAN * WAVELENGTH**2
    assert_allclose([-data.force_x / load, -data.force_y / load], [mu, mu * ky / kx], rtol=1e-9 + 3 * settled)
    assert_allclose(data.friction, mu * np.hypot(kx, ky) / kx, rtol=1e-9 + 3 * settled)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_only_motion_along_a_wave_dissipates(direction: tuple[float, float]) -> None:
    """A wave along y (or x) that slides along x (or y) relaxes as at rest: amplitude 2 k h0 G(t), no friction."""
    velocity = (FAST * np.array(direction)).tolist()
    stage = {"velocity": velocity, "duration": 2e-3, "time_step": 2e-4}
    for waves, along in (((1, 0), direction[0]), ((0, 1), direction[1])):
        march, rows = marched(wave([stage], waves, (16, 16)))
        amplitude = np.ptp(march.field("pressure")) / 2
        if along == 0.0:
            assert amplitude == pytest.approx(float(2 * K * HEIGHT * relaxation(2e-3, *PRONY)), rel=1e-12)
            assert_allclose(column(rows, "friction"), 0.0, atol=1e-15)
        else:
            assert rows[-1].measures.friction > 1e-4


def test_a_reversal_changes_the_sign_of_friction_x() -> None:
    """`-force_x` over the normal force to rounding, past 0 after the reversal, where `friction` has a cusp."""
    there, back = ({"velocity": speed, "distance": 16 * CELL, "cells_per_step": 1} for speed in (FAST, -FAST))
    _, rows = marched(wave([there, back]))
    signed, magnitude = (column(rows, name) for name in ("friction_x", "friction"))
    assert_allclose(signed[1:], -traction(rows[1:]), rtol=1e-14)
    assert np.array_equal(np.abs(signed), magnitude)
    assert np.all(signed[2:17] > 0.0)
    assert signed[-1] < 0.0


@pytest.mark.parametrize(("cells", "boundary"), [(3.0, "periodic"), (2.25, "periodic"), (2.25, "free")])
def test_height_is_where_the_surface_is(tmp_path: Path, cells: float, boundary: str) -> None:
    """`h0(x - s)` with its mean, to 1e-12 of it, which the gap is counted from; 10 roundings of each length."""
    x = np.arange(64) * CELL
    np.save(tmp_path / "wave.npy", 3.0 * HEIGHT + HEIGHT * np.cos(K * x)[None, :])
    data = wave([{"velocity": FAST, "distance": cells * CELL, "cells_per_step": cells}], tolerance=1e-6)
    data["grid"]["boundary"] = boundary
    data["surface"] = {"shape": "file", "path": str(tmp_path / "wave.npy")}
    march, _ = marched(data)
    height, gap, displacement = (march.field(name) for name in ("height", "gap", "displacement"))
    assert_allclose(height[0], 3.0 * HEIGHT + HEIGHT * np.cos(K * (x - cells * CELL)), rtol=1e-12)
    approach = march.row.measures.approach
    assert_allclose(gap, displacement - height - approach, rtol=0.0, atol=4e-15 * (3 * HEIGHT + abs(approach)))
