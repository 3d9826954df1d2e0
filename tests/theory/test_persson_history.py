"""Persson's theory of histories: the recursion against closed forms of full contact, and against printed numbers."""

import tracemalloc

import numpy as np
import pytest
from closed_forms import step_responses
from numpy.testing import assert_allclose
from rubbers import TWELVE_DECADES, ZENER

from parcontact.theory import full_contact
from parcontact.theory.full_contact import Waves
from parcontact.theory.persson_history import CHUNK, Memory, SlidingLeg, TheoryOutcome, follow
from parcontact.theory.persson_rings import Rings, rings_of_spectrum, rings_of_surface

from .test_persson import K_LONG, K_SHORT, PRESSURE, spectrum

WAVES = Waves(np.array([0.5e-6, 0.2e-6 + 0.1e-6j]), np.array([25132.741, 30000.0]), np.array([0.0, -4e4]))
OBLIQUE = (0.03, -0.02)


def at(velocity: tuple[float, float], instants: np.ndarray, pressure: float = 2e5) -> SlidingLeg:
    return SlidingLeg(velocity, float(instants[-1]), instants, np.full(instants.shape, pressure))


@pytest.fixture
def memory() -> Memory:
    return Memory(rings_of_surface(WAVES), ZENER)


def frequencies(memory: Memory, velocity: tuple[float, float]) -> np.ndarray:
    return full_contact.frequency(memory.rings.waves.kx, memory.rings.waves.ky, *velocity)


def test_load_rest_slide(memory: Memory) -> None:
    """In closed form, to rounding."""
    instants = np.array([0.0, 1e-4, 1e-3, 7e-3])
    memory.slide((0.0, 0.0), 2e-3)
    exact = step_responses.load_rest_slide_modulus(instants, 2e-3, frequencies(memory, OBLIQUE), *ZENER)
    assert_allclose(memory.moduli(OBLIQUE, instants), exact, rtol=1e-13)


@pytest.mark.parametrize("after", [(0.04, 0.0), (-0.03, 0.02), (0.0, 0.0)])
def test_velocity_step(memory: Memory, after: tuple[float, float]) -> None:
    """Also a reversal and a stop: in closed form, to rounding."""
    instants = np.array([0.0, 1e-4, 1e-3, 7e-3])
    memory.slide_for_ever(OBLIQUE)
    exact = step_responses.velocity_step_modulus(
        instants, frequencies(memory, OBLIQUE), frequencies(memory, after), *ZENER
    )
    assert_allclose(memory.moduli(after, instants), exact, rtol=1e-13)


def test_any_history_against_boltzmann(memory: Memory) -> None:
    """Start, stop, reversal, new direction: M exp(i q s) = int G(t - t') d exp(i q s) by small steps.

    The sum over 10 000 steps a leg, exact for a position that is a chain of lines, errs by its chords of exp(i q s).
    """
    legs = [((0.05, 0.0), 1e-3), ((0.0, 0.0), 5e-4), ((-0.08, 0.01), 8e-4), ((0.02, -0.05), 1.2e-3)]
    waves, steps = memory.rings.waves, 10_000
    position, now, stress = np.zeros(2), np.ones(2, complex), np.full(2, ZENER.moduli[0], complex)
    for velocity, duration in legs:
        decay = np.exp(-duration / steps / ZENER.relaxation_times[0])
        chord = ZENER.moduli[0] * (1 - decay) * ZENER.relaxation_times[0] / (duration / steps)
        for _ in range(steps):
            position = position + np.array(velocity) * duration / steps
            later = np.exp(1j * (waves.kx * position[0] + waves.ky * position[1]))
            now, stress = later, decay * stress + chord * (later - now)
        found = memory.moduli(velocity, np.array([duration]))[0]
        assert_allclose(found, ZENER.modulus_inf + stress / now, rtol=1e-7)
        memory.slide(velocity, duration)


def test_full_contact_with_other_loads(memory: Memory) -> None:
    """The force does not depend on the load as long as all is in contact, nor on gamma; friction is force over load."""
    instants = np.linspace(0.0, 5e-3, 7)
    pressures = np.linspace(1e6, 3e6, 7)
    exact = full_contact.traction(*memory.rings.waves, memory.moduli(OBLIQUE, instants))
    for gamma in (0.0, 0.45, 1.0):
        (found,) = follow(Memory(memory.rings, ZENER), [SlidingLeg(OBLIQUE, 5e-3, instants, pressures)], gamma)
        assert_allclose(found.traction, exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())
        assert_allclose(found.friction(pressures), np.hypot(*exact.T) / pressures, rtol=1e-12)
        assert np.all(found.contact_area == 1.0)


def test_no_load(memory: Memory) -> None:
    (found,) = follow(memory, [at((0.1, 0.0), np.array([1e-3]), pressure=0.0)])
    assert found.contact_area == [0.0]
    assert found.friction(np.array([0.0])) == [0.0]


def test_chunks(memory: Memory, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is held at a time changes nothing."""
    whole = next(follow(Memory(memory.rings, ZENER), [at(OBLIQUE, np.linspace(0.0, 1e-3, 10))]))
    monkeypatch.setattr("parcontact.theory.persson_history.CHUNK", 6)
    parts = next(follow(memory, [at(OBLIQUE, np.linspace(0.0, 1e-3, 10))]))
    assert_allclose(parts.traction, whole.traction, rtol=1e-14)
    assert_allclose(parts.contact_area, whole.contact_area, rtol=1e-14)


@pytest.fixture(scope="module")
def road() -> Rings:
    return rings_of_spectrum(spectrum, K_LONG, K_SHORT, 5e-4)


def test_memory_of_many_waves(road: Rings) -> None:
    """64 000 waves, twelve branches, many instants: below 300 MB, a chunk and some ten times its size."""
    assert road.waves.kx.size > 60_000
    assert CHUNK * 16 * 12 < 300e6
    tracemalloc.start()
    memory = Memory(road, TWELVE_DECADES)
    list(follow(memory, [at((3.0, 0.0), np.linspace(0.0, 1e-4, 40), PRESSURE)]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 300e6


def test_refinement(road: Rings) -> None:
    """Transients too are converged, to 3e-6: with nearly three times as many waves nothing changes."""
    distances = np.array([1e-6, 1e-5, 1e-4, 4e-4])
    fine = rings_of_spectrum(spectrum, K_LONG, K_SHORT, 5e-4, refinement=2)
    outcomes = []
    for rings in (road, fine):
        memory = Memory(rings, TWELVE_DECADES)
        memory.slide_for_ever((0.01, 0.0))
        outcomes += list(follow(memory, [at((3.0, 0.0), distances / 3.0, PRESSURE)]))
    coarse, better = outcomes
    assert_allclose(coarse.traction[:, 0], better.traction[:, 0], rtol=3e-6)
    assert_allclose(coarse.contact_area, better.contact_area, rtol=1e-5)


@pytest.fixture(scope="module")
def small_road() -> Rings:
    """For 20 um."""
    return rings_of_spectrum(spectrum, K_LONG, K_SHORT, 2e-5)


# V1 (m/s), highest mu after sliding at 0.01 m/s, where (um); printed from panels that err by 2e-3 from 3 m/s on
PEAKS = [(0.1, 0.01216, 2.38), (0.3, 0.01377, 2.1), (3.0, 0.01545, 1.46), (10.0, 0.01578, 1.29)]


@pytest.mark.parametrize("row", PEAKS)
def test_peak_after_a_velocity_step(small_road: Rings, row: tuple[float, ...]) -> None:
    velocity, highest, where = row
    memory = Memory(small_road, TWELVE_DECADES)
    memory.slide_for_ever((0.01, 0.0))
    distances = np.linspace(1.0, 3.0, 41) * 1e-6
    (found,) = follow(memory, [at((velocity, 0.0), distances / velocity, PRESSURE)])
    friction = found.friction(np.full(41, PRESSURE))
    assert_allclose(friction.max(), highest, rtol=2e-3)
    assert_allclose(1e6 * distances[friction.argmax()], where, atol=0.1)


def tyre(road: Rings, velocity: float, distances: np.ndarray) -> tuple[TheoryOutcome, TheoryOutcome]:
    """1 ms at rest under load, then sliding."""
    rest = at((0.0, 0.0), np.array([1e-6, 1e-5, 1e-4, 5e-4, 1e-3]), PRESSURE)
    resting, sliding = follow(Memory(road, TWELVE_DECADES), [rest, at((velocity, 0.0), distances / velocity, PRESSURE)])
    return resting, sliding


@pytest.mark.parametrize(("velocity", "highest", "where"), [(1.0, 0.01455, 2.45), (3.0, 0.01530, 2.04)])
def test_tyre(small_road: Rings, velocity: float, highest: float, where: float) -> None:
    """Load, rest, slide; the area to the digits that are printed, friction to its panels' 2e-3."""
    distances = np.linspace(1.0, 3.0, 41) * 1e-6
    resting, sliding = tyre(small_road, velocity, distances)
    assert_allclose(resting.contact_area, [0.0152, 0.0465, 0.1371, 0.2487, 0.3210], atol=6e-5)
    friction = sliding.friction(np.full(41, PRESSURE))
    assert_allclose(friction.max(), highest, rtol=2e-3)
    assert_allclose(1e6 * distances[friction.argmax()], where, atol=0.1)
