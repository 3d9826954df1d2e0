"""How steps are proposed and judged, for errors that are given: no contact is solved here."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from marched_jobs import SLS, begun

from parcontact.job import Grid, Job
from parcontact.job.history import MadeStep, Step, most_cells
from parcontact.job.stages import Stage
from parcontact.job.surfaces import Flat, HeightFile, Rough, Sphere, Wave
from parcontact.march.controller import MOST_GROWTH, OF_STEPS, REJECTED, SAFETY
from parcontact.march.loop import March

Json = dict[str, Any]
CELL = 1e-3 / 32
PRESS: Json = {"pressure": 1e4, "duration": 5e-3}
SLIDE: Json = {"pressure": 1e4, "velocity": 0.1, "distance": 6.3 * CELL}
ALLOWED = OF_STEPS * 1e-2  # of numerics.accuracy
Errors = Callable[[int, Step], float]


def march_of(*history: Json, **numerics: Any) -> March:
    wave = {"shape": "wave", "amplitude": 2e-6, "waves": [2, 1]}
    scene = {"grid": {"points": 32, "size": 1e-3}, "surface": wave, "material": SLS}
    return begun({**scene, "history": list(history), "numerics": {"accuracy": 1e-2, **numerics}})


def attempts(march: March, error: Errors, most: int = 1000) -> list[list[Step]]:
    """The tries of each step that is chosen, the one that is made last, for the `error(number, step)` of each; at most
    a given number of steps."""
    chosen, found, number = march.state.chosen, list[list[Step]](), 0
    assert chosen is not None
    while (number := number + 1) <= len(march.timeline()) and len(found) < most:
        span = march.timeline().span(number)
        if span.place(number) == 0:
            continue
        tries = [march.scene.controller.propose(chosen, span, number)]
        while isinstance(verdict := judged(tries[-1], error(number, tries[-1])), Step):
            assert verdict.dt < (1.0 - 1e-6) * tries[-1].dt
            tries.append(verdict)
        chosen.add(verdict)
        found.append(tries)
    return found


def judged(step: Step, error: float) -> Step | MadeStep:
    """What its judge says of a step."""
    assert step.decide is not None
    return step.decide(error)


def made(march: March, error: Errors) -> list[Step]:
    """Those that are made."""
    return [tries[-1] for tries in attempts(march, error)]


@pytest.mark.parametrize(("integrator", "order"), [("exponential", 1.7), ("backward-euler", 1.0)])
def test_as_much_shorter_as_the_error_is_too_large(integrator: str, order: float) -> None:
    """At rest, where lengths are powers of the fourth root of two: by three of them for an error that is a little less
    than 2^(3p/4) times the largest that is accepted, by four for one that is a little more; by a sixteenth at most."""
    for factor, levels in ((0.99 * 2.0 ** (0.75 * order), 3), (1.01 * 2.0 ** (0.75 * order), 4), (1e9, 16)):
        march, errors = march_of(PRESS, integrator=integrator), [0.0, factor * REJECTED * ALLOWED]
        [[first, second]] = attempts(march, lambda *_, left=errors: left.pop(), most=1)
        assert second.dt == pytest.approx(first.dt * 2.0 ** (-levels / 4), rel=1e-12)


@pytest.mark.parametrize(
    ("share", "levels"),
    [
        (0.0, 4),
        (1.01 * (SAFETY / MOST_GROWTH) ** 1.7, 3),
        (0.99 * (SAFETY / 2.0**0.25) ** 1.7, 1),
        (1.01 * (SAFETY / 2.0**0.25) ** 1.7, 0),
        (1.0, 0),
        (REJECTED, 0),
    ],
)
def test_as_much_longer_as_the_error_is_small(share: float, levels: int) -> None:
    """In powers of the fourth root of two, up to twice as long; not shorter after a step that is accepted."""
    first, second = (tries[-1].dt for tries in attempts(march_of(PRESS), lambda *_: share * ALLOWED, most=2))
    assert second == pytest.approx(first * 2.0 ** (levels / 4), rel=1e-12)


def test_a_step_after_one_that_was_made_anew_does_not_grow() -> None:
    """The one after that does."""
    march = march_of(PRESS)
    errors = iter([2.0 * ALLOWED, 0.0, 0.0, 0.0])
    (_, shorter), (second,), (third,) = attempts(march, lambda *_: next(errors), most=3)
    assert second.dt == pytest.approx(shorter.dt, rel=1e-12)
    assert third.dt == pytest.approx(2.0 * second.dt, rel=1e-12)


def test_growth_is_from_the_step_before() -> None:
    """In the same stage; in the first one there is none."""
    steps = made(march_of(PRESS, SLIDE), lambda number, step: ALLOWED * (0.1, 2.0, 0.4)[number % 3] * step.dt / 1e-4)
    assert len({step.dt for step in steps}) > 5
    before: Step | None = None
    for step in steps:
        expected = step.dt / before.dt if before is not None and before.stage == step.stage else 0.0
        assert step.growth == pytest.approx(expected, rel=1e-9)
        before = step


@pytest.mark.parametrize(
    ("changes", "goes_on"),
    [({}, True), ({"velocity": 0.2}, False), ({"velocity": -0.1}, False), ({"pressure": 2e4}, False)],
)
def test_a_stage_goes_on_with_the_steps_before_it_if_nothing_has_changed(changes: Json, goes_on: bool) -> None:
    """With small parts of a cell; else a whole one is tried first."""
    march = march_of({**SLIDE, "distance": 6 * CELL}, {**SLIDE, **changes})
    tries = attempts(march, lambda number, step: ALLOWED * (2.0 if step.dt > 0.13 * CELL / 0.1 else 1.0))
    last = [steps[-1] for steps in tries if steps[-1].stage == 0][-1]
    first = next(step for steps in tries for step in steps if step.stage == 1)
    assert last.dt < 0.13 * CELL / 0.1
    assert first.dt == pytest.approx(last.dt if goes_on else CELL / abs(first.velocity[0]), rel=1e-9)


@pytest.mark.parametrize(("velocity", "cells"), [(0.2, [7, 8, 9, 10, 11, 12, 12.6]), (-0.1, [5, 4, 3, 2, 1, 0])])
def test_whole_cells_are_those_of_where_the_surface_was_at_first(velocity: float, cells: list[float]) -> None:
    """In either direction, from a part of a cell: to the next one that is LEAST_WAY of a cell away, or more. The error
    of a step of a cell is too large for one of two."""
    march = march_of(SLIDE, {**SLIDE, "velocity": velocity})
    steps = made(march, lambda number, step: 0.7 * ALLOWED * (step.dt * abs(step.velocity[0]) / CELL) ** 1.7)
    found = [step.position[0] / CELL for step in steps]
    np.testing.assert_allclose(found, [1, 2, 3, 4, 5, 6, 6.3, *cells], rtol=0, atol=1e-9)


@pytest.mark.parametrize("duration", np.linspace(3.05e-4, 5.05e-4, 21).tolist())
def test_no_short_step_is_left_over_at_rest(duration: float) -> None:
    """The last of several equal steps is a tenth longer at most, or the last two are halves of what is left.
    The error is what is allowed where a step is as long as the first, and goes with the power 1.7."""
    first = list[float]()

    def error(number: int, step: Step) -> float:
        first.append(step.dt)
        return ALLOWED * (step.dt / first[0]) ** 1.7

    steps = np.array([step.dt for step in made(march_of({**PRESS, "duration": duration}), error)])
    assert steps.sum() == pytest.approx(duration, rel=1e-12)
    assert np.all(steps[:-2] == pytest.approx(steps[0], rel=1e-9))
    assert np.all(steps <= 1.1 * steps[0] * (1.0 + 1e-9))
    assert np.all(steps >= 0.55 * steps[0] * (1.0 - 1e-9))


def test_a_stretched_step_that_is_rejected_is_made_shorter() -> None:
    """The last of 19 steps, 2^(17/4) - 18 times as long as the others. Its error asks for a length that would be
    stretched to the same one."""
    first = list[float]()

    def error(number: int, step: Step) -> float:
        first.append(step.dt)
        return ALLOWED * (1.25 if step.dt > 1.001 * first[0] else 1.0)

    tries = attempts(march_of({**PRESS, "duration": 1.8e-3}), error)  # which holds each of them to be shorter
    assert [step.dt for step in tries[18]][:1] == pytest.approx([first[0] * (2.0**4.25 - 18.0)], rel=1e-9)
    assert len(tries[18]) > 1


SPHERE, FLAT, FILE = SPHERE, FLAT, FILE = Sphere.model_construct(), Flat.model_construct(), HeightFile.model_construct()


def wave(*waves: int) -> Wave:
    return Wave.model_construct(waves=waves)


@pytest.mark.parametrize(
    ("surface", "cells"),
    [
        ([SPHERE, FLAT], 4),
        ([wave(1, 0)], 4),
        ([wave(2, 0)], 4),
        ([wave(0, 2)], 4),
        ([wave(3, 1)], 4),
        ([wave(8, 0)], 2),
        ([wave(1, 0), SPHERE, wave(0, -4)], 2),
        ([wave(31, 0)], 1),
        ([Rough.model_construct(long_wavelength=1.0, short_wavelength=32e-3 / 64)], 4),
        ([Rough.model_construct(long_wavelength=1.0, short_wavelength=31e-3 / 64)], 2),
        ([SPHERE, FILE], 1),
    ],
)
def test_longest_step_of_a_slide(surface: list[Any], cells: int) -> None:
    """A power of two of cells, on 64 x 32 of them: four, or a quarter of the shortest wave along either direction, of
    which those of a rough surface count with the longer side of a cell; one for any heights."""
    still = Stage.model_construct(velocity=(0.0, 0.0))
    assert most_cells(job_with((64, 32), surface, still)) == cells


def test_long_cells_count_along_the_slide() -> None:
    """Cells four times as long across it: as many as on squares of the shorter side; along it as of the longer."""
    rough = Rough.model_construct(long_wavelength=1.0, short_wavelength=32e-3 / 64)
    stages = [Stage.model_construct(velocity=velocity) for velocity in ((1.0, 0.0), (0.0, 1.0))]
    assert [most_cells(job_with((64, 16), [rough], stage)) for stage in stages] == [4, 2]


def job_with(points: tuple[int, int], surface: list[Any], stage: Stage) -> Job:
    changed = {"grid": Grid(points=points, size=(1e-3, 1e-3)), "surface": tuple(surface), "history": (stage,)}
    return march_of(SLIDE).scene.job.model_copy(update=changed)
