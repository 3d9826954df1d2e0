"""Which branches are folded, and that the bound on it bounds: against closed forms, and against all branches."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from rubbers import complex_modulus

from parcontact.parallel.slab import Slab
from parcontact.physics.body import Heights, ZenerBody
from parcontact.physics.folding import Band, FoldedBranches, Phase, fold_branches, keep_all
from parcontact.physics.prony import Integrator, Prony, creep, normal_form
from parcontact.theory import full_contact

from .held import HeldBody

Array = NDArray[np.float64]

POINT = Slab.alone(1, 1)
INTEGRATORS: tuple[Integrator, ...] = ("exponential", "backward-euler")
# terms of 1 MPa, a decade apart, around a wave of frequency 1 rad/s
DECADES = normal_form(1e6, np.full(11, 1e6), 10.0 ** np.arange(-5, 6))
# parcontact/materials/synthetic_tyre.yaml
TYRE = normal_form(
    1e6,
    np.array([300, 350, 220, 80, 24, 7, 2.4, 1, 0.5, 0.3, 0.2, 0.15]) * 1e6,
    5e-9 * 10.0 ** np.arange(12),
)
ROAD = Band(2 * np.pi / 2.5e-4, 2 * np.pi / 3.125e-5, np.pi / (1e-3 / 512))
WAVE = Band(1.0, 1.0, 1.0, (1.0, 0.0))  # of one rad/m: at one m/s its frequency is one rad/s


def slide(seconds: float, dt: float, velocity: float = 1.0, jump: bool = False) -> Phase:
    return Phase(seconds, dt, dt, (velocity, 0.0), jump)


def frozen(prony: Prony, found: FoldedBranches) -> Prony:
    """The material with its frozen branches as springs."""
    others = [k for k in range(prony.moduli.size) if k not in found.frozen]
    spring = prony.modulus_inf + float(prony.moduli[list(found.frozen)].sum())
    return Prony(spring, prony.moduli[others], prony.relaxation_times[others])


# -- frozen branches against closed forms ------------------------------------------------------------------------------


@pytest.mark.parametrize("duration", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("rest", [0.0, 2.0])
def test_friction_of_a_wave_with_frozen_branches(rest: float, duration: float) -> None:
    """Full contact of one wave that slides after a rest: the closed form, with and without the frozen branches.

    The error of friction at any instant over the steady friction is within the bound, and more than a hundredth of it:
    the bound is of the right size although it is also one for partial contact.
    """
    start = (Phase(rest, rest, rest, (0.0, 0.0), jump=True),) if rest else ()
    found = fold_branches(DECADES, [*start, slide(duration, 1e-9, jump=not rest)], [WAVE], "exponential", 0.2)
    t = np.linspace(0.0, duration, 400)
    whole, fewer = (
        full_contact.load_rest_slide_modulus(t, rest, 1.0, *body).imag for body in (DECADES, frozen(DECADES, found))
    )
    wrong = np.max(np.abs(fewer - whole)) / complex_modulus(1.0, *DECADES).imag
    bound = sum(found.frozen_errors[k] for k in found.frozen)
    assert len(found.frozen) >= 2
    assert 0.01 * bound < wrong < bound


def test_creep_with_frozen_branches() -> None:
    """At rest the bound is one of the modulus, and of the creep compliance too, which the contact follows."""
    found = fold_branches(DECADES, [Phase(100.0, 1e-9, 1.0, (0.0, 0.0), jump=True)], [WAVE], "exponential", 0.01)
    t = np.geomspace(1e-3, 100.0, 200)
    wrong = np.max(np.abs(creep(t, *frozen(DECADES, found)) / creep(t, *DECADES) - 1.0))
    assert len(found.frozen) == 2
    assert 0.1 * found.bound < wrong < found.bound


# -- memoryless branches against all branches --------------------------------------------------------------------------


def stresses(material: ZenerBody, moments: list[tuple[float, float]]) -> Array:
    """The pressure of a point whose displacement is prescribed, a (dt, u) per step."""
    body, found = HeldBody(material), []
    for dt, u in moments:
        heights = Heights(np.full((1, 1), u))
        trial = body.begin(dt, heights)
        displacement = trial.effective.copy()
        body.commit(trial, displacement)
        found.append(float(trial.alpha * displacement[0, 0]))
    return np.array(found)


def swing(dt: float, steps: int) -> list[tuple[float, float]]:
    """A wave of frequency 1 rad/s that passes, after a jump."""
    return [(0.0 if n == 0 else dt, float(np.cos(n * dt))) for n in range(steps + 1)]


def rise(dt: float, steps: int) -> list[tuple[float, float]]:
    """Steady sliding that begins at the wave's zero, without a jump."""
    return [(dt, float(np.sin(n * dt))) for n in range(1, steps + 1)]


def jump_at_half(dt: float, steps: int) -> list[tuple[float, float]]:
    """A wave that is doubled at an instant half-way."""
    first, rest = rise(dt, steps // 2), rise(dt, steps)[steps // 2 :]
    return [*first, (0.0, 2 * first[-1][1]), *((dt, 2 * u) for _, u in rest)]


HISTORIES: dict[str, tuple[Callable[[float, int], list[tuple[float, float]]], float]] = {  # and the largest wave
    "from a jump": (swing, 1.0),
    "from nothing": (rise, 1.0),
    "jump on the way": (jump_at_half, 2.0),
}


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("history", HISTORIES)
def test_stress_of_a_wave_without_the_memory_of_a_branch(history: str, integrator: Integrator) -> None:
    """Each branch alone, as memoryless: the error of the stress is within what the bound says, and near it once.

    A wave of size 1 is one of |dM|, and the bound at least `|dM|/G'' + |dM|/|G*|`.
    """
    dt, steps = 0.3, 40
    displacements, size = HISTORIES[history]
    half = dt * steps / 2
    phases = [slide(half, dt, jump=history == "from a jump"), slide(half, dt, jump=history == "jump on the way")]
    errors = np.array(fold_branches(DECADES, phases, [WAVE], integrator, 1.0).memoryless_errors)
    modulus = complex_modulus(1.0, *DECADES)
    moments = displacements(dt, steps)
    whole = stresses(ZenerBody(POINT, DECADES, integrator), moments)
    shares = []
    for k in range(6):
        fewer = stresses(ZenerBody(POINT, DECADES, integrator, memoryless=[k]), moments)
        wrong = np.max(np.abs(fewer - whole)) / size * (1.0 / modulus.imag + 1.0 / abs(modulus))
        shares.append(wrong / max(errors[k], 1e-14))  # 1e-14: rounding, where exp(-z) is less
    assert max(shares) <= 1.0
    assert max(shares) > 0.2


def test_rest_after_a_jump_without_the_memory_of_a_branch() -> None:
    """A displacement that is held: the step after the jump lacks exp(-z) of the branch, over the step's modulus."""
    dt = 1e-4
    errors = fold_branches(DECADES, [Phase(1.0, dt, dt, (0.0, 0.0), jump=True)], [WAVE], "exponential", 1.0)
    held = [(0.0, 1.0), (dt, 1.0), (dt, 1.0)]
    whole, fewer = (stresses(ZenerBody(POINT, DECADES, "exponential", memoryless=fast), held) for fast in ([], [0]))
    assert whole[0] == fewer[0]
    wrong = (
        np.abs(fewer - whole)[1:]
        / HeldBody(ZenerBody(POINT, DECADES, "exponential")).begin(dt, Heights(np.zeros((1, 1)))).alpha
    )
    assert_allclose(wrong[0], errors.memoryless_errors[0], rtol=1e-6)
    assert wrong[1] < 1e-3 * wrong[0]


def test_steps_that_outgrow_stiffer_branches() -> None:
    """A stiff branch makes the modulus of the first step a thousand times the second one's; that goes to sleep long
    before. A displacement that grows with time, in steps that do: what is dropped is a part of the step's modulus."""
    prony, steps = normal_form(1e3, [1e9, 1e6], [1.0, 1e6]), 10.0 ** np.arange(0, 8)
    whole, fewer = (ZenerBody(POINT, prony, "exponential", memoryless=fast) for fast in ([], [1]))
    moments = [(dt, float(time)) for dt, time in zip(steps, np.cumsum(steps), strict=True)]
    moduli = [HeldBody(whole).begin(dt, Heights(np.zeros((1, 1)))).alpha for dt in steps]
    wrong = np.abs(stresses(fewer, moments) - stresses(whole, moments)) / moduli / np.cumsum(steps)
    found = fold_branches(prony, [Phase(moments[-1][1], 1.0, 1e7, (0.0, 0.0), jump=False)], [WAVE], "exponential", 0.5)
    assert 0.05 < wrong.max() <= found.memoryless_errors[1]
    assert 1 not in found.memoryless


# -- what is chosen ----------------------------------------------------------------------------------------------------


def test_tyre_at_three_metres_per_second() -> None:
    """Half a millimetre at one cell of 2 um per step: five of twelve decades of relaxation times play."""
    phases = [slide(5e-4 / 3, 1e-3 / 512 / 3, 3.0, jump=True)]
    found = fold_branches(TYRE, phases, [ROAD], "exponential", 1e-3)
    assert found.memoryless == (0, 1)
    assert found.kept == (2, 3, 4, 5, 6)
    assert found.frozen == (7, 8, 9, 10, 11)
    errors = [found.memoryless_errors[k] for k in found.memoryless] + [found.frozen_errors[k] for k in found.frozen]
    assert_allclose(found.bound, sum(errors), rtol=1e-12)
    assert found.bound <= 1e-3


@pytest.mark.parametrize("allowed", [1e-7, 1e-4, 1.5e-4, 3.3e-4, 4.1e-4, 1e-2])
def test_errors_add_up_to_what_is_allowed_at_most(allowed: float) -> None:
    """Half of it at most is for memoryless branches; one branch more of either kind would be too much."""
    phases = [slide(5e-4 / 3, 1e-3 / 512 / 3, 3.0, jump=True)]
    found = fold_branches(TYRE, phases, [ROAD], "exponential", allowed)
    fast, slow = (np.array(errors) for errors in (found.memoryless_errors, found.frozen_errors))
    assert fast[list(found.memoryless)].sum() <= allowed / 2 < fast[: len(found.memoryless) + 1].sum()
    kept = list(found.kept)
    assert found.bound <= allowed < found.bound + slow[kept].min()


def test_no_error_allowed_no_folding() -> None:
    found = fold_branches(TYRE, [slide(1e-9, 1e-9)], [ROAD], "exponential", 0.0)
    assert found.folded == 0
    assert found.kept == tuple(range(12))
    assert keep_all(TYRE, "why").kept == found.kept


@pytest.mark.parametrize("count", [0, 3])
def test_a_body_that_has_no_time_is_elastic(count: int) -> None:
    instants = [Phase(0.0, 0.0, 0.0, (0.0, 0.0), jump=True)] * count
    found = fold_branches(TYRE, instants, [ROAD], "exponential", 1e-3)
    assert found.frozen == tuple(range(12))
    assert found.bound == 0.0


def test_two_jumps_at_one_instant_wake_what_has_no_memory() -> None:
    """After one jump a branch holds all of its stress when the next comes, however fast it is."""
    later = slide(1e-3, 1e-6, 1.0)
    one = fold_branches(TYRE, [Phase(0.0, 0.0, 0.0, (0.0, 0.0), True), later], [ROAD], "exponential", 1e-3)
    two = fold_branches(TYRE, [*[Phase(0.0, 0.0, 0.0, (0.0, 0.0), True)] * 2, later], [ROAD], "exponential", 1e-3)
    assert one.memoryless == (0, 1)
    assert two.memoryless == ()


def test_after_steady_sliding_nothing_is_frozen() -> None:
    """Its branches are not G u: those slower than everything have relaxed."""
    phases = [slide(5e-4 / 3, 1e-3 / 512 / 3, 3.0)]
    found = fold_branches(TYRE, phases, [ROAD], "exponential", 1e-3, start=(3.0, 0.0))
    assert found.frozen == ()
    assert found.memoryless == (0, 1)


def test_a_longer_job_has_the_same_memoryless_branches() -> None:
    """So that --until never asks for what a memoryless branch remembered."""
    chosen = [fold_branches(TYRE, [slide(t, 1e-6, 3.0)], [ROAD], "exponential", 1e-3) for t in (1e-4, 1e-2, 1.0, 100.0)]
    assert {found.memoryless for found in chosen} == {(0, 1)}
    assert [len(found.frozen) for found in chosen] == [5, 3, 1, 0]


@pytest.mark.parametrize("bands", [[], [Band(1.0, 1.0, 1.0, (0.0, 1.0))]])
def test_waves_that_never_pass_are_at_rest(bands: list[Band]) -> None:
    """A flat surface, or ridges along the way, give no friction: the modulus is judged."""
    assert fold_branches(TYRE, [slide(1.0, 1e-6)], bands, "exponential", 1e-3) == fold_branches(
        TYRE, [slide(1.0, 1e-6, 0.0)], [WAVE], "exponential", 1e-3
    )


@pytest.mark.parametrize("unit", [2.0**600, 2.0**-600])
def test_any_unit_of_time(unit: float) -> None:
    """A rubber slower by a factor on which everything happens slower by it has the same errors, to the last bit."""
    phases = [slide(1e-3, 1e-6, 3.0, jump=True), slide(1e-2, 1e-6, 0.1)]
    slower = [
        Phase(p.duration * unit, p.first * unit, p.last * unit, (p.velocity[0] / unit, 0.0), p.jump) for p in phases
    ]
    other = Prony(TYRE.modulus_inf, TYRE.moduli, TYRE.relaxation_times * unit)
    expected = fold_branches(TYRE, phases, [ROAD], "exponential", 1e-3)
    assert expected.bound > 0.0
    assert fold_branches(other, slower, [ROAD], "exponential", 1e-3) == expected
