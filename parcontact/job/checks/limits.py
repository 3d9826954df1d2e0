"""Values that are allowed one by one and yet lead to numbers that a run cannot compute with.

Judged is what follows from several keys together: squares of wave numbers, slopes, strains, counts of steps. Each must
be zero, or a number whose fourth power double precision can hold, and one over it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..sections.geometry import Cylinder, HeightFile, Rough, Sphere, Wave
from ..sections.height_arrays import HeightArray
from ..sections.materials import Elastic, Zener, ZenerBranch
from ..sections.settings import Grid
from ..sections.stages import AUTO, GeometricStep, Initial, Stage, Steady
from ..text.fault import Fault
from ..text.places import Key

SMALLEST, LARGEST = 1e-70, 1e70  # fourth powers and their reciprocals are normal numbers of double precision
MOST_STEPS = 10**8  # tuning: of a history; at a millisecond each they take more than a day


def _outside(value: float) -> bool:
    return value != 0.0 and not SMALLEST <= abs(value) <= LARGEST


def _fault(path: Key, what: str, value: float, unit: str) -> Fault:
    amount = f"{value:.3g} {unit}".strip()
    return Fault(f"leads to {what} of {amount}, too {'large' if abs(value) > 1.0 else 'small'} to compute with", path)


def _ratio(a: float, b: float) -> float:
    """a / b, infinite where b is nothing or the quotient too large."""
    return a / b if b else math.inf


def of_grid(grid: Grid) -> Iterator[Fault]:
    """The box: its cells, its area, the fourth power of its largest wave number."""
    cell = min(grid.dx, grid.dy)
    area = grid.lx * grid.ly
    for what, value, unit in (
        ("a cell", cell, "m"),
        ("a box", area, "m^2"),
        ("a square of wave numbers", _ratio(_ratio(1.0, cell), cell), "m^-2"),
    ):
        if cell == 0.0 or _outside(value):
            yield _fault(("grid", "size"), what, value, unit)
            return


def of_hardness(
    grid: Grid, material: Elastic | Zener, history: tuple[Stage, ...], initial: Initial, steady: Steady | None
) -> Iterator[Fault]:
    """Mean pressures that the counterbody bears; steady sliding, which is solved for one that does not yield."""
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


def of_surface(grid: Grid, surface: tuple[Any, ...]) -> Iterator[Fault]:
    """The heights of each shape, and its slopes over a cell."""
    if next(of_grid(grid), None):
        return
    for index, shape in enumerate(surface):
        for key, height in _heights(shape, grid):
            for what, value, unit in (
                ("heights", height, "m"),
                ("slopes", _ratio(height, min(grid.dx, grid.dy)), ""),
                ("curvatures", _ratio(_ratio(height, grid.dx), grid.dy), "m^-1"),
            ):
                if _outside(value):
                    yield _fault(("surface", index, key), what, value, unit)
                    break


def _heights(shape: Any, grid: Grid) -> Iterator[tuple[str, float]]:
    """The key that makes a shape high, and about how high [m]."""
    if isinstance(shape, Wave):
        yield "amplitude", shape.amplitude
    elif isinstance(shape, Sphere | Cylinder):
        yield "radius", _ratio(grid.lx * grid.ly, shape.radius)
        for length in shape.center or ():
            yield "center", length
    elif isinstance(shape, HeightFile):
        yield "scale", shape.scale
    elif isinstance(shape, HeightArray):
        yield "heights", shape.heights.largest
    elif isinstance(shape, Rough):
        if shape.rms_height is not None:
            yield "rms_height", shape.rms_height
        if shape.rms_slope is not None:
            yield "rms_slope", shape.rms_slope * shape.short_wavelength
        if shape.psd_constant is not None:
            yield "psd_constant", math.sqrt(shape.psd_constant) / math.sqrt(grid.lx * grid.ly)


def of_material(material: Elastic | Zener) -> Iterator[Fault]:
    """Moduli, those of each branch too, and relaxation times."""
    key = "shear_modulus" if isinstance(material, Elastic) else "modulus_inf"
    for path, value in (((key,), material.long_modulus), ((), material.instant_modulus)):
        if _outside(value):
            yield _fault(("material", *path), "a shear modulus", value, "Pa")
            return
    for index, branch in enumerate(getattr(material, "branches", ())):
        at: Key = ("material", "branches", index)
        springs = (branch.G0, branch.G1) if isinstance(branch, ZenerBranch) else (branch.modulus,)
        if wrong := [modulus for modulus in springs if _outside(modulus)]:
            yield _fault(at, "a shear modulus", wrong[0], "Pa")


def of_loads(grid: Grid, material: Elastic | Zener, history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Loads as pressures, and over the modulus as strains."""
    if next(of_grid(grid), None) or next(of_material(material), None):
        return
    area, modulus = grid.lx * grid.ly, material.instant_modulus
    for index, stage in enumerate(history):
        if stage is None:
            continue
        at: Key = ("history", index, stage.control)
        for load in (stage.load.start, stage.load.end):
            if stage.control == "approach" and _outside(load):
                yield _fault(at, "an approach", load, "m")
                break
            pressure = load / area if stage.control == "force" else load
            if (
                stage.control != "approach" and max(pressure, pressure / modulus) > LARGEST
            ):  # next to nothing is nothing
                yield _fault(at, "a mean pressure over the shear modulus", pressure / modulus, "")
                break


def of_states(grid: Grid, material: Elastic | Zener, initial: Initial, steady: Steady | None) -> Iterator[Fault]:
    """Pressures and velocities of steady sliding."""
    if next(of_grid(grid), None) or next(of_material(material), None):
        return
    modulus = material.instant_modulus
    for path, pressures in (
        (("initial", "pressure"), (initial.pressure,) if initial.pressure else ()),
        (("steady", "pressures"), (steady.pressures or ()) if steady else ()),
    ):
        if wrong := [p for p in pressures if _outside(p) or _outside(p / modulus)]:
            yield _fault(path, "a mean pressure over the shear modulus", wrong[0] / modulus, "")
    speeds = (
        (("initial", "velocity"), initial.velocity),
        (("steady", "velocities"), steady.velocities if steady else ()),
    )
    for path, values in speeds:
        if wrong := [v for v in values if _outside(v)]:
            yield _fault(path, "a speed", wrong[0], "m/s")


def of_steps(grid: Grid, history: tuple[Stage | None, ...]) -> Iterator[Fault]:
    """Speeds, durations, and how many steps they have."""
    total = 0.0
    for index, stage in enumerate(history):
        if stage is None:
            continue
        at: Key = ("history", index)
        if any(_outside(v) for v in stage.velocity):
            yield _fault((*at, "velocity"), "a speed", max(map(abs, stage.velocity)), "m/s")
            continue
        seconds = _ratio(stage.distance, stage.speed) if stage.distance is not None else stage.duration or 0.0
        if not math.isfinite(seconds) or (stage.distance is not None and not seconds):
            yield _fault((*at, "distance"), "a duration", seconds, "s")
        elif seconds and _outside(stage.speed * seconds):
            yield _fault((*at, "velocity"), "a distance", stage.speed * seconds, "m")
        elif seconds:
            first = first_step(stage, grid)
            total += steps_of(stage, seconds, first)
            if not first or not math.isfinite(first) or total > MOST_STEPS:
                key = "cells_per_step" if stage.cells_per_step is not None else "time_step"
                count = f"{total:.3g} steps" if math.isfinite(total) else "steps without number"
                yield Fault(f"leads to {count}; a history has at most {MOST_STEPS:.0e}", (*at, key))
                return


def count_steps(grid: Grid, history: tuple[Stage, ...]) -> int:
    """About how many steps a history has; jumps are left out."""
    lasting = [stage for stage in history if stage.seconds]
    return math.ceil(sum(steps_of(stage, stage.seconds, first_step(stage, grid)) for stage in lasting))


def first_step(stage: Stage, grid: Grid) -> float:
    """The (first) time step [s] of a stage that lasts, before steps are fitted to its end."""
    if stage.cells_per_step is not None:
        return stage.cells_per_step * one_cell(stage, grid)
    if isinstance(stage.time_step, GeometricStep):
        return stage.time_step.first
    if stage.time_step == AUTO:
        return one_cell(stage, grid) if stage.speed else stage.seconds
    return stage.time_step or 0.0


def one_cell(stage: Stage, grid: Grid) -> float:
    """How long the surface takes to slide by one cell [s]."""
    cell = math.hypot(stage.velocity[0] / stage.speed * grid.dx, stage.velocity[1] / stage.speed * grid.dy)
    return cell / stage.speed


def steps_of(stage: Stage, seconds: float, first: float) -> float:
    """About how many steps a stage that lasts so long has."""
    count = _ratio(seconds, first)
    growth = stage.time_step.growth if isinstance(stage.time_step, GeometricStep) else 1.0
    return count if growth == 1.0 else min(count, math.log1p(count * (growth - 1.0)) / math.log(growth))
