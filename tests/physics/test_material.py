"""The body without space: with the operator 1 a map is a row of independent points."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rubbers import ZENER
from stepping_body import HeldBody

from parcontact.parallel.slab import Slab
from parcontact.physics.body import MovedHeights, ZenerBody
from parcontact.physics.prony import (
    Integrator,
    Prony,
    complex_modulus,
    creep,
    discrete_modulus,
    normal_form,
    zener_to_prony,
)
from parcontact.physics.records import Units

POINT = Slab.alone(1, 1)
# two Zener branches next to a spring of 0.5 MPa, and the time step of the printed numbers
BRANCHES = ([2e6, 1e6], [1e6, 0.0], [3e3, 1e4])
TWO = zener_to_prony(*BRANCHES, 0.5e6)
DT = 0.5e-3
INTEGRATORS: tuple[Integrator, ...] = ("exponential", "exponential-linear", "backward-euler")


def body(prony: Prony, integrator: Integrator = "exponential") -> HeldBody:
    return HeldBody(ZenerBody(POINT, normal_form(*prony), integrator))


def push(body: HeldBody, u: float, dt: float, growth: float = 0.0) -> float:
    """Prescribe the displacement of a point in a step, which is `growth` times as long as the one before; returns its
    total pressure."""
    heights = MovedHeights(np.full((1, 1), u))
    trial = body.begin(dt, heights, growth)
    displacement = trial.effective.copy()
    body.commit(trial, displacement)
    return float(trial.alpha * displacement[0, 0])


def load(body: HeldBody, p: float, dt: float, growth: float = 0.0) -> float:
    """Prescribe the total pressure of a point; returns its displacement."""
    heights = MovedHeights(np.zeros((1, 1)))
    trial = body.begin(dt, heights, growth)
    body.commit(trial, np.full((1, 1), p / trial.alpha))
    return float(body.u[0, 0])


# -- printed numbers, to their twelve digits ---------------------------------------------------------------------------


def test_unit_load_from_rest() -> None:
    made = body(TWO, "backward-euler")
    printed = [3.32453825858e-7, 3.70214632313e-7, 4.01109597129e-7, 4.26741965876e-7, 4.48328593833e-7]
    assert_allclose([load(made, 1.0, DT) for _ in printed], printed, rtol=1e-11)


def test_exponential_steps_are_exact_on_a_parabola() -> None:
    """u = t^2 in uneven steps, against the integral of `G(t - s) 2 s` over the past; the increment before the first
    step, which never was, is that of the same parabola. Rounding; where 2 t is far more than what relaxes, more."""
    dts = np.array([1e-4, 3e-4, 3e-4, 2e-3, 1e-5, 4e-4])
    ends = np.cumsum(dts) - dts[0]
    made = body(TWO)
    made.memory.increment[...] = -(dts[0] ** 2)
    for n in range(1, ends.size):
        t = ends[n]
        exact = TWO.modulus_inf * t**2
        for modulus, tau in zip(TWO.moduli, TWO.relaxation_times, strict=True):
            exact += 2 * modulus * tau * (t + tau * np.expm1(-t / tau))
        assert_allclose(push(made, t**2, dts[n], dts[n] / dts[n - 1]), exact, rtol=1e-11)


# -- jumps -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_jump_meets_the_instantaneous_modulus(integrator: Integrator) -> None:
    made = body(TWO, integrator)
    before = push(made, 1.0, 1e-3)
    instant = TWO.modulus_inf + TWO.moduli.sum()
    assert_allclose(push(made, 3.0, 0.0) - before, 2.0 * instant, rtol=1e-15)


@pytest.mark.parametrize(
    ("integrator", "order"), [("exponential", 3.0), ("exponential-linear", 2.0), ("backward-euler", 1.0)]
)
@pytest.mark.parametrize("again", [False, True])
def test_order_of_creep_after_jumps(integrator: Integrator, order: float, again: bool) -> None:
    """Largest error over 4 ms of creep under a load from t = 0 on, and another one from 2 ms on; orders within 3 %.

    The first step after a jump is linear, and its error of third order lasts: so the whole is of third order."""

    def error(count: int) -> float:
        made, dt, errors = body(TWO, integrator), 4e-3 / count, []
        load(made, 1.0, 0.0)
        for n in range(1, count + 1):
            added = 1.0 if again and 2 * n > count else 0.0
            u = load(made, 1.0 + added, dt, float(n != 1 and 2 * n != count + 2))
            t = n * dt
            exact = creep(t, *TWO) + (added and creep(t - 2e-3, *TWO))
            errors.append(abs(u - exact) / creep(4e-3, *TWO))
            if again and 2 * n == count:
                load(made, 2.0, 0.0)
        return float(np.max(errors))

    errors = [error(count) for count in (64, 128, 256)]
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert_allclose(orders, order, rtol=0.03)


# -- limits ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("z", [1e-300, 1e-15, 1e-13, 1e-6, 1.0, 1e6, 1e12, 1e300])
def test_coefficients_at_extreme_steps(integrator: Integrator, z: float) -> None:
    """Against the formulas in 1000 digits; a few units in the last of 16. Steps beyond 1e100 count as 1e100."""
    made = body(Prony(1.0, np.array([2.0]), np.array([1.0])), integrator)
    with localcontext(prec=1000):
        exact = min(Decimal(z), Decimal(10) ** 100)
        decay = 1 / (1 + exact) if integrator == "backward-euler" else (-exact).exp()
        gain, back = 2 * decay if integrator == "backward-euler" else 2 * (1 - decay) / exact, Decimal(0)
        if integrator == "exponential":  # after a step a third as long: kappa is 3/2
            bent = 3 * ((1 + decay) / (2 * exact) - (1 - decay) / exact**2)
            gain, back = gain + bent, -3 * bent
    found = np.ravel(made.body.coefficients(z, 3.0))
    assert_allclose(found, [float(decay), float(gain), float(back)], rtol=1e-15)


# -- what it does with maps --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_moved_heights_are_moved_heights(integrator: Integrator) -> None:
    """A map and an offset stand for the moved map; rounding of heights of size 1."""
    slab, rng = Slab.alone(6, 4), np.random.default_rng(1)
    base, prony = rng.normal(size=slab.shape), normal_form(*TWO)
    first, second = (HeldBody(ZenerBody(slab, prony, integrator)) for _ in range(2))
    for offset, dt in ((0, 0.0), (1, 1e-3), (5, 1e-3), (7, 2e-3), (-1, 1e-4)):
        here = MovedHeights(np.roll(base, offset, axis=1))
        trial, same = first.begin(dt, here), second.begin(dt, MovedHeights(base, offset))
        assert trial.alpha == same.alpha
        assert_allclose(same.effective, trial.effective, rtol=0, atol=1e-15)
        displacement = trial.effective + rng.uniform(size=slab.shape)
        first.commit(trial, displacement)
        second.commit(same, displacement)
        assert_allclose(second.u, first.u, rtol=0, atol=1e-14)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_beginning_again_with_another_step(integrator: Integrator) -> None:
    """Only the last `begin` before a `commit` counts, to the last digits of the branch maps."""
    first, second = body(TWO, integrator), body(TWO, integrator)
    for made in (first, second):
        push(made, 1.0, 1e-3)
    heights = MovedHeights(np.full((1, 1), 2.0))
    second.begin(5e-3, heights)
    second.begin(0.0, heights)
    assert_allclose(push(second, 2.0, 1e-3), push(first, 2.0, 1e-3), rtol=1e-15)


def test_state_restores_the_same_digits() -> None:
    first, second = body(TWO), body(TWO)
    push(first, 1.0, 1e-3)
    second.restore({name: np.array(entry.value) for name, entry in first.entries(Units(1.0, 1.0, 1.0)).items()})
    assert push(first, 2.0, 1e-4, 0.1) == push(second, 2.0, 1e-4, 0.1)


def test_memory_is_one_map_per_branch_and_three() -> None:
    """The last displacement, its last increment, and the buffer in which effective heights and the increment before
    take turns."""
    slab = Slab.alone(32, 16)
    memory = ZenerBody(slab, normal_form(*TWO), "exponential").at_rest()
    assert slab.tally["map bytes"] == (len(memory.branches) + 3) * 32 * 16 * 8


def test_a_step_that_is_dropped_leaves_the_memory() -> None:
    """With the new displacement in another map, all that follows from the old memory is what it was, to the last bit,
    until a step begins from the new one."""
    made, other = body(TWO), body(TWO)
    for each in (made, other):
        push(each, 1.0, 1e-3)
    dropped = made.begin(2e-3, MovedHeights(np.full((1, 1), 5.0)))
    made.body.commit(made.memory, dropped, np.full((1, 1), 7.0), np.empty((1, 1)))
    assert made.u == other.u
    assert push(made, 2.0, 1e-4) == push(other, 2.0, 1e-4)


# -- discrete moduli of time steps against tables, limits and a march of the body -------------------------------------


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


def test_the_shortest_time_is_of_a_branch_with_a_map() -> None:
    """Steps need not resolve branches without memory, and springs have no time."""
    series = Prony(1.0, np.array([1.0, 1.0, 1.0, 1.0]), np.array([1e-3, 1e-2, 1e-1, 1.0]))
    assert ZenerBody(POINT, series, "exponential", memoryless=[0], frozen=[3]).shortest_time == 1e-2
    assert ZenerBody(POINT, series, "exponential", memoryless=[0, 1, 2, 3]).shortest_time == np.inf


def test_branches_that_the_saved_run_had_without_maps() -> None:
    """A frozen one begins as G u, one without memory as 0, and one with a map as it was read."""
    series = Prony(1.0, np.array([2.0, 3.0, 5.0]), np.array([1e-3, 1e-2, 1e-1]))
    made = ZenerBody(POINT, series, "exponential")
    memory = made.at_rest()
    made.start_from(memory, np.full((1, 1), 0.5), [np.full((1, 1), 7.0)] * 3)
    saved = {"branch 1": np.full((1, 1), 7.0), "frozen": np.array([False, False, True])}
    assert made.restored(memory, saved).branches[:, 0, 0].tolist() == [0.0, 7.0, 2.5]
