"""How many steps a history has, and which loads a counterbody bears."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..sections.materials import AnyMaterial
from ..sections.settings import Grid
from ..sections.stages import AUTO, GeometricStep, Initial, Stage, Steady
from ..text.fault import Fault

MOST_STEPS = 10**8  # tuning: of a history; at a millisecond each they take more than a day


def of_hardness(
    grid: Grid, material: AnyMaterial, history: tuple[Stage | None, ...], initial: Initial, steady: Steady | None
) -> Iterator[Fault]:
    """Check that the counterbody bears the mean pressures, and that no steady sliding is asked of one that yields."""
    hardness = material.hardness
    if hardness is None:
        return
    for key, given in (("initial", initial.state == "steady"), ("steady", steady is not None)):
        if given:
            yield Fault("does not go with material.hardness: slide into the steady state with a stage", (key,))
    for index, stage in enumerate(history):
        if stage is None or stage.control == "approach":
            continue
        mean = max(stage.load.start, stage.load.end) / (grid.lx * grid.ly if stage.control == "force" else 1.0)
        if mean >= hardness:
            sentence = f"leads to a mean pressure of {mean:.4g} Pa, no less than material.hardness = {hardness:g} Pa"
            yield Fault(f"{sentence}: there is no equilibrium", ("history", index, stage.control))


def of_steps(grid: Grid, history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Check how many steps the stages have together."""
    total = 0.0
    for index, stage in enumerate(history):
        if stage is None:
            return
        if stage.seconds:
            total += steps_of(stage, stage.seconds, first_step(stage, grid))
        if total > MOST_STEPS:
            key = "cells_per_step" if stage.cells_per_step is not None else "time_step"
            yield Fault(f"leads to {total:.3g} steps; a history has at most {MOST_STEPS:.0e}", ("history", index, key))
            return


def count_steps(grid: Grid, history: tuple[Stage, ...]) -> int:
    """Return about how many steps a history has; jumps are left out."""
    lasting = [stage for stage in history if stage.seconds]
    return math.ceil(sum(steps_of(stage, stage.seconds, first_step(stage, grid)) for stage in lasting))


def first_step(stage: Stage, grid: Grid) -> float:
    """Return the (first) time step [s] of a stage that lasts, before steps are fitted to its end."""
    if stage.cells_per_step is not None:
        return stage.cells_per_step * one_cell(stage, grid)
    if isinstance(stage.time_step, GeometricStep):
        return stage.time_step.first
    if stage.time_step == AUTO:
        return one_cell(stage, grid) if stage.speed else stage.seconds
    return stage.time_step or 0.0


def one_cell(stage: Stage, grid: Grid) -> float:
    """Return how long the surface takes to slide by one cell [s]."""
    cell = math.hypot(stage.velocity[0] / stage.speed * grid.dx, stage.velocity[1] / stage.speed * grid.dy)
    return cell / stage.speed


def steps_of(stage: Stage, seconds: float, first: float) -> float:
    """Return about how many steps a stage that lasts so long has."""
    count = seconds / first if first else math.inf
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    return count if growth == 1.0 else min(count, math.log1p(count * (growth - 1.0)) / math.log(growth))
