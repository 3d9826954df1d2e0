"""The tolerance of steps, from the error budget: what it allows, what it saves, and that a restart changes nothing."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import begun, column, marched
from mpi4py import MPI
from sliding import rough, slide

import parcontact as pc
from parcontact.job.history import Step
from parcontact.march.budget import ErrorBudget, ErrorParts
from parcontact.march.controller import (
    CLOSE,
    FIRST,
    MOST,
    OF_SOLVER,
    OF_SOLVER_IN_AREA,
    StepTolerance,
    tolerance_before,
)
from parcontact.march.loop import March

CERTIFICATE = 1e-3
STEPS = 40


def job(**numerics: Any) -> dict[str, Any]:
    """A short slide in quarters of a cell, whose starts are not the solution."""
    return rough(128, [slide(128, STEPS // 4, cells_per_step=0.25)], numerics=numerics)


def quarter(**numerics: Any) -> dict[str, Any]:
    """The same on a quarter of the box."""
    return {**job(**numerics), "grid": {"points": 64, "size": 5e-4}}


def after(march: March, friction: ErrorParts, area: ErrorParts, so_far: StepTolerance | None = None) -> StepTolerance:
    """The memory after many steps with such errors."""
    memory = so_far or StepTolerance()
    for _ in range(60):
        memory = march.scene.controller.learn(memory, CERTIFICATE, ErrorBudget(friction, area))
    return memory


def tolerance(march: March, memory: StepTolerance) -> float | None:
    return march.scene.controller.tolerance(memory, step(march))


def step(march: March, number: int = 5) -> Step:
    return march.timeline().span(number).step(number)


@pytest.mark.parametrize(
    ("rest", "allowed"),
    [(0.0, 1e-3), (5e-3, 1e-3), (9.5e-3, 1e-3), (3e-2, 3e-3)],  # the rest of the error: none, half, nearly all, more
)
def test_what_friction_allows(rest: float, allowed: float) -> None:
    """A tenth of 1 %, or of the rest of the error where that is more. Errors go with the certificate."""
    march = begun(job(accuracy=1e-2))
    for error in (allowed / 11.5, allowed / 20.0, allowed / 23.0):  # at a certificate of a fifth of the tolerance
        found = tolerance(march, after(march, ErrorParts(error, rest, 0.0, 0.0), ErrorParts(0.0, 0.0, 0.0, 0.0)))
        assert found is not None
        assert abs(np.log2(found / (CERTIFICATE * allowed / error))) <= 0.2501  # the nearest power of the root of two


def test_bounds() -> None:
    """The tolerance is between that of the job, 0.5 of the accuracy, and 8 times this; above it is at most 0.05."""
    nothing, much = ErrorParts(0.0, 0.0, 0.0, 0.0), ErrorParts(1.0, 0.0, 0.0, 0.0)
    for accuracy, highest in ((1e-3, MOST * 5e-4), (1e-2, MOST * 5e-3), (2e-2, 0.05), (0.5, 0.25)):
        march = begun(job(accuracy=accuracy))
        assert tolerance(march, after(march, nothing, nothing)) == pytest.approx(highest)
        assert tolerance(march, after(march, much, nothing)) == pytest.approx(0.5 * accuracy)
        area = ErrorParts(OF_SOLVER_IN_AREA * accuracy, 0.0, 0.0, 0.0)  # as much as allowed
        found = tolerance(march, after(march, nothing, area))
        assert found == pytest.approx(max(0.5 * accuracy, CERTIFICATE))


def test_what_it_saves() -> None:
    """A sixth of the operator calls at least: 202 of 252 are left here, and seven more may come from rounding. Friction
    and area are those of a tight run, within the share of the whole error that the solver may make."""
    _, tight = marched(job(tolerance=1e-7))
    _, fixed = marched(job(tolerance=5e-3))
    chosen, rows = marched(job())
    calls, own = (sum(row.operator_calls for row in each[2:]) for each in (fixed, rows))
    assert own <= 0.83 * calls
    for name, share in (("friction", OF_SOLVER), ("contact_area_corrected", OF_SOLVER_IN_AREA)):
        mean, exact = column(rows, name)[2:].mean(), column(tight, name)[2:].mean()
        parts = getattr(chosen.state.errors, {"friction": "friction"}.get(name, "area"))
        assert abs(mean / exact - 1.0) <= share * max(1e-2, parts.total)


def test_what_is_given_holds() -> None:
    """Also the tolerance that would have been chosen: as many calls as with one next to it, more than if it is."""
    given, near, chosen = (
        [row.operator_calls for row in marched(quarter(**numerics))[1]]
        for numerics in ({"tolerance": 5e-3}, {"tolerance": 5e-3 * (1.0 + 1e-9)}, {})
    )
    assert given == near
    assert sum(given) > sum(chosen)


@pytest.mark.parametrize("numerics", [{}, {"tolerance": 5e-3}], ids=["chosen", "given"])
def test_a_restart_goes_on_with_it(tmp_path: Path, numerics: dict[str, float]) -> None:
    """The memory is saved, and whether the tolerance was given: the same digits as without a stop, also of errors."""
    whole = pc.Simulation(job(**numerics), comm=MPI.COMM_SELF)
    rows = [(row.friction, row.error_friction, row.operator_calls) for row in whole.steps()]
    run = pc.Simulation(job(**numerics), comm=MPI.COMM_SELF)
    for row in run.steps():
        if row.step == STEPS // 2:
            break
    run.save(tmp_path / "state.h5")
    again = pc.Simulation.restore(tmp_path / "state.h5", comm=MPI.COMM_SELF)
    rest = [(row.friction, row.error_friction, row.operator_calls) for row in again.steps()]
    assert rest == rows[-len(rest) :]


# -- before a change --------------------------------------------------------------------------------------------------

INF, ONE, TAU = 1e6, 4e6, 1e-3
ZENER = {"model": "zener", "modulus_inf": INF, "branches": [{"modulus": ONE, "relaxation_time": TAU}]}
ROUGH_SURFACE = {
    "shape": "rough",
    "hurst": 0.9,
    "rms_slope": 0.02,
    "long_wavelength": 2.5e-4,
    "short_wavelength": 1.25e-4,
}
PRESSURE, SLOW, CELL = 1e5, 1e-2, 1e-3 / 128
STEADY = {"state": "steady", "velocity": SLOW, "pressure": PRESSURE}
BEFORE = {"pressure": PRESSURE, "velocity": SLOW, "distance": 4 * CELL, "cells_per_step": 1}
FAST = {"pressure": PRESSURE, "velocity": 3.0, "distance": 0.25 * CELL, "time_step": {"first": 1e-9, "growth": 1.5}}


def changing(history: list[dict[str, Any]], **sections: Any) -> dict[str, Any]:
    return {
        "grid": {"points": 128, "size": 128 * CELL},
        "surface": {**ROUGH_SURFACE, "seed": 1},
        "material": ZENER,
        "history": history,
        **sections,
    }


def at_ends(history: list[dict[str, Any]], **sections: Any) -> list[float]:
    """The largest tolerance of the start, and of all steps."""
    march = begun(changing(history, numerics={"tolerance": 0.1}, **sections))
    tolerances = [march.scene.controller.tolerance(StepTolerance(), each) or math.inf for each in march.timeline()]
    return [tolerance_before(march.scene.job, 0, march.scene.controller.relaxes), *tolerances]


def test_the_last_solve_before_a_change_is_close() -> None:
    """Of velocity and of load, in a stage and in the steady state before the first; in the first step after it, 1 %."""
    slow, rest = {**BEFORE, "velocity": 2e-3}, {"pressure": PRESSURE, "duration": 1e-2, "time_step": 5e-3}
    assert at_ends([FAST], initial={**STEADY, "velocity": 2e-3})[:2] == [CLOSE, FIRST]
    assert at_ends([slow, FAST])[1:7] == [math.inf, FIRST, math.inf, math.inf, CLOSE, FIRST]  # from the first load on
    assert at_ends([rest, {"pressure": 2 * PRESSURE}])[3] == CLOSE


def test_the_last_step_of_a_stage_is_solved_as_closely_as_the_first() -> None:
    """It seldom moves by whole cells. On a measured road its friction was 4 % too large, as the start was accepted."""
    assert at_ends([BEFORE], initial=STEADY)[-2:] == [math.inf, FIRST]


@pytest.mark.parametrize(("history", "first"), [([FAST], 1), ([BEFORE, FAST], 5)])
def test_stated_errors_hold_after_a_step_of_velocity(history: list[dict[str, Any]], first: int) -> None:
    """Friction and the corrected area of the first steps at 10 %, against the same steps at a tolerance of 1e-6, or the
    solver's share of these 10 % where no more is stated; the compound becomes forty times as stiff."""
    found = []
    for numerics in ({"accuracy": 0.1}, {"tolerance": 1e-6, "branch_error": 1e-2}):
        data = changing(history, initial=STEADY, numerics=numerics, material={"include": "synthetic_tyre"})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            found.append(list(pc.Simulation(data).steps())[first:])
    for row, exact in zip(*found, strict=True):
        assert abs(row.friction / exact.friction - 1.0) < max(row.error_friction, 5e-3)
        assert abs(row.contact_area_corrected / exact.contact_area_corrected - 1.0) < row.error_area
