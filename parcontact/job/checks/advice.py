"""What is allowed in a job but will probably disappoint: warnings with their numbers and what to do.

Here are resolution and precision; `meaning.py` judges the physics of a job, `size.py` its size.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..sections.geometry import Rough
from ..sections.materials import Elastic, Zener
from ..sections.settings import Grid, Numerics
from ..sections.stages import AUTO, GeometricStep, Stage

LONG_WAVES = 4  # in the box: fewer make the statistics of one surface a matter of luck (paper, end of section 3)
CELLS_PER_WAVE = 8  # for an error of 1 %: fewer under-resolve the contact of the shortest waves
MESH_ORDER = 2.5  # in which the error of friction falls with them
STEPS_PER_WAVE = 4  # fewer skip over the shortest waves while sliding
ROUNDINGS = 4.0  # of a number in a certificate
SAME_LENGTH = 1e-9  # relative: lengths this close are the same


def resolution(
    grid: Grid, surface: tuple[Any, ...], material: Elastic | Zener, history: tuple[Stage, ...], numerics: Numerics
) -> Iterator[str]:
    """Sentences, in the order of the sections."""
    yield from _surface(grid, surface, numerics.accuracy)
    short = min((shape.short_wavelength for shape in surface if isinstance(shape, Rough)), default=None)
    for index, stage in enumerate(history):
        yield from _stage(index, stage, grid, material, numerics, short)
    yield from _precision(numerics)


def _directions(grid: Grid) -> Iterator[tuple[str, float, float]]:
    """Name, length and cell [m] of the directions that have more than one point."""
    if grid.nx > 1:
        yield "x", grid.lx, grid.dx
    if grid.ny > 1:
        yield "y", grid.ly, grid.dy


def cells_per_wave(accuracy: float) -> int:
    """How many cells the shortest wave of a rough surface needs."""
    return max(2, math.ceil(CELLS_PER_WAVE * (1e-2 / accuracy) ** (1.0 / MESH_ORDER) * (1 - SAME_LENGTH)))


def _surface(grid: Grid, surface: tuple[Any, ...], accuracy: float) -> Iterator[str]:
    directions, needed = list(_directions(grid)), cells_per_wave(accuracy)
    for index, shape in enumerate(surface):
        if not isinstance(shape, Rough) or not directions:
            continue
        name, length, _ = min(directions, key=lambda direction: direction[1])
        if length < LONG_WAVES * shape.long_wavelength * (1 - SAME_LENGTH):
            yield (
                f"surface.{index}: only {length / shape.long_wavelength:.3g} long waves fit into the box along {name}; "
                f"for a representative surface use at least {LONG_WAVES}: a size of "
                f"{LONG_WAVES * shape.long_wavelength:.4g} m or a long_wavelength of {length / LONG_WAVES:.4g} m"
            )
        name, length, cell = max(directions, key=lambda direction: direction[2])
        if shape.short_wavelength < needed * cell * (1 - SAME_LENGTH):
            yield (
                f"surface.{index}: only {shape.short_wavelength / cell:.3g} cells per shortest wave along {name}; "
                f"for a resolved contact use at least {needed}: "
                f"{math.ceil((1 - SAME_LENGTH) * needed * length / shape.short_wavelength)} points"
                f"{_price(grid, needed * cell / shape.short_wavelength)} or a "
                f"short_wavelength of {needed * cell:.4g} m"
            )


def measured(grid: Grid, wave: float, accuracy: float) -> Iterator[str]:
    """Yield what to say of the shortest wave [m] of a measured surface."""
    name, length, cell = max(_directions(grid), key=lambda direction: direction[2], default=("", 0.0, 0.0))
    needed = cells_per_wave(accuracy)
    if wave < needed * cell * (1 - SAME_LENGTH):
        yield (
            f"surface: only {wave / cell:.3g} cells per shortest wave along {name}, of {wave:.3g} m by the spectrum of "
            f"the heights; for a resolved contact use at least {needed}: "
            f"{math.ceil((1 - SAME_LENGTH) * needed * length / wave)} points{_price(grid, needed * cell / wave)}, to "
            f"which a map is interpolated, or heights without waves below {needed * cell:.4g} m"
        )


def _price(grid: Grid, finer: float) -> str:
    """What so many times the points along each direction cost, when steps of a slide are as many times shorter."""
    more = finer ** sum(n > 1 for n in grid.points)
    return f" ({more:.2g} times the memory, some {more * finer:.2g} times the time in sliding)"


def longest_step(stage: Stage, grid: Grid) -> float:
    """The longest time step of a stage [s], before steps are fitted to its end; 0 where it chooses its own."""
    step = stage.time_step
    if step == AUTO:
        return 0.0
    if stage.cells_per_step is not None:
        return min(stage.seconds, stage.cells_per_step * grid.dx / stage.speed)
    if isinstance(step, GeometricStep):  # n steps last first (growth^n - 1) / (growth - 1)
        return min(stage.seconds, (stage.seconds * (step.growth - 1) + step.first) / step.growth)
    return min(stage.seconds, step or 0.0)


def _stage(
    index: int, stage: Stage, grid: Grid, material: Elastic | Zener, numerics: Numerics, short: float | None
) -> Iterator[str]:
    step = longest_step(stage, grid)
    if stage.speed and not stage.seconds:
        yield f"history.{index}: nothing slides in a stage without duration or distance; its velocity has no effect"
    yield from _relaxation(index, step, material, numerics)
    slid = step * stage.speed
    if short is not None and slid > short / STEPS_PER_WAVE * (1 + SAME_LENGTH):
        yield (
            f"history.{index}: the surface slides {slid:.3g} m in one step, {slid / short:.2g} of its shortest wave; "
            f"use time steps up to {short / STEPS_PER_WAVE / stage.speed:.3g} s "
            f"(cells_per_step up to {short / STEPS_PER_WAVE / grid.dx:.3g})"
        )


def _precision(numerics: Numerics) -> Iterator[str]:
    reach = ROUNDINGS * 2.0**-52
    if numerics.tolerance < reach:
        yield (
            f"numerics.tolerance: {numerics.tolerance:g} is below {reach:.1g}, which double precision "
            "reaches where displacements are as large as the surface is high, in proportion more or less elsewhere; "
            "use a larger tolerance"
        )


def _relaxation(index: int, step: float, material: Elastic | Zener, numerics: Numerics) -> Iterator[str]:
    times = [branch.relaxation_time for branch in getattr(material, "branches", ())]
    shortest = min((time for time in times if 0 < time < float("inf")), default=None)
    if numerics.integrator == "backward-euler" and shortest is not None and step > shortest * (1 + SAME_LENGTH):
        yield (
            f"history.{index}: time steps up to {step:.3g} s are longer than the shortest relaxation time "
            f"{shortest:.3g} s, which backward-euler does not resolve; shorten the steps or use integrator: exponential"
        )
