"""Warnings about the resolution of a job: mesh, box, and time steps; `meaning.py` has physics, `size.py` memory."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from ...doubts import Doubt
from ...printed import per_cent
from ..sections.calculation import Accuracy, Grid
from ..sections.geometry import Rough
from ..sections.stages import AUTO, GeometricStep, Stage
from . import Sections
from .cells import ASIDE, Vector, needed, one_cell

LONG_WAVES = 4  # accuracy: least number of longest waves along the box for a representative surface (paper, section 3)
MOST_LONG_WAVES = 500  # tuning: number of longest waves along the box above which its unit is doubted
STEPS_PER_WAVE = 4  # accuracy: least time steps per shortest wave while sliding
SAME_LENGTH = 1e-9  # rounding: relative difference below which lengths are the same
LITTLE = 0.05  # tuning: relative lack of points that gets no warning

# Relative standard deviation over 8 to 12 seeds, times the number of longest waves along a side; found with six steady
# states of 2 to 50 % contact of bodies with one and twelve branches, in boxes of 2, 4 and 8 longest waves: 0.11 to 0.44
# for friction, 0.05 to 0.33 for the area.
SEED_FRICTION, SEED_AREA = 0.24, 0.17  # accuracy


def doubts_of_resolution(job: Sections, directions: Sequence[Vector] = (), chosen: bool = False) -> Iterator[Doubt]:
    """Yield warnings in the order of the sections; the surface slides along `directions` (unit vectors). The cells of a
    mesh that was `chosen` for the job are not checked."""
    grid, surface, numerics = job.grid, job.surface, job.numerics
    for index, shape in enumerate(surface):
        if isinstance(shape, Rough) and max(grid.points) > 1:
            yield from _long_waves(index, shape, grid)
            yield from doubt_size(index, shape, grid)
            if not chosen:
                yield from _short_waves(index, shape, grid, numerics.asked, directions)
    short = min((shape.short_wavelength for shape in surface if isinstance(shape, Rough)), default=None)
    times = [branch.relaxation_time for branch in job.material.fitted.branches]
    shortest = min((time for time in times if 0 < time < math.inf), default=math.inf)
    for index, stage in enumerate(job.history):
        yield from _steps(index, stage, grid, shortest if numerics.integrator == "backward-euler" else math.inf, short)


def _directions(grid: Grid) -> list[tuple[str, float, float]]:
    """Return name, box length and cell [m] of the axes that have more than one point."""
    found = zip("xy", grid.size, (grid.dx, grid.dy), grid.points, strict=True)
    return [(name, length, cell) for name, length, cell, points in found if points > 1]


def _long_waves(index: int, shape: Rough, grid: Grid) -> Iterator[Doubt]:
    name, length, _ = min(_directions(grid), key=lambda direction: direction[1])
    if length < LONG_WAVES * shape.long_wavelength * (1 - SAME_LENGTH):
        enough = {"size": LONG_WAVES * shape.long_wavelength, "wave": length / LONG_WAVES}
        numbers = {"waves": length / shape.long_wavelength, "axis": name, "least": LONG_WAVES, **enough}
        yield Doubt("few long waves", f"surface.{index}", numbers)


def doubt_size(index: int, shape: Rough, grid: Grid) -> Iterator[Doubt]:
    """Yield a warning about a box of more than MOST_LONG_WAVES longest waves."""
    length = max((length for _, length, _ in _directions(grid)), default=0.0)
    if length > MOST_LONG_WAVES * shape.long_wavelength:
        of_wave = {"wave": shape.long_wavelength, "times": length / shape.long_wavelength}
        numbers = {"length": length, "in_milli": length / 1000, "key": f"surface.{index}.long_wavelength", **of_wave}
        yield Doubt("large box", "grid.size", numbers)


def _short_waves(
    index: int, shape: Rough, grid: Grid, asked: Accuracy, directions: Sequence[Vector]
) -> Iterator[Doubt]:
    for numbers in _few_cells(shape.short_wavelength, grid, asked, directions):
        yield Doubt("few cells", f"surface.{index}", numbers)


def doubt_measured_waves(
    grid: Grid, wave: float, asked: Accuracy, directions: Sequence[Vector], spiky: bool = False
) -> Iterator[Doubt]:
    """Yield a warning about the shortest wave [m] of a measured surface that slides along `directions`; outliers of a
    `spiky` surface may shorten it."""
    spikes = ", which has outliers" if spiky else ""
    for numbers in _few_cells(wave, grid, asked, directions):
        yield Doubt("few cells of a map", "surface", {**numbers, "known": wave, "spikes": spikes})


def _few_cells(wave: float, grid: Grid, asked: Accuracy, directions: Sequence[Vector]) -> Iterator[dict[str, object]]:
    """Yield the numbers of a warning if the shortest wave [m] has too few cells: the points needed along the axis that
    lacks most, and the factors of memory and time."""
    wants = {name: needed("xy".index(name), directions, asked) for name, _, _ in _directions(grid)}
    lacks = {name: max(wants[name]) * cell / wave for name, _, cell in _directions(grid)}
    name, length, cell = max(_directions(grid), key=lambda direction: lacks[direction[0]], default=("", 0.0, 0.0))
    more = math.prod(max(lack, 1.0) for lack in lacks.values())
    if not name or more <= 1 + LITTLE:
        return
    least, of_area = wants[name]
    reason = "a resolved contact" if math.isclose(least, of_area) else "friction" if least > of_area else "its area"
    slides = lambda axis: not directions or any(abs(way["xy".index(axis)]) > ASIDE for way in directions)  # noqa: E731
    finer = max((max(lack, 1.0) for axis, lack in lacks.items() if slides(axis)), default=1.0)
    yield {
        "cells": wave / cell,
        "axis": name,
        "reason": reason,
        "needed": max(wants[name]),
        "points": math.ceil((1 - SAME_LENGTH) * max(wants[name]) * length / wave),
        "memory": more,
        "time": f", about {more * finer:.2g} times the time in sliding" if directions else "",
        "wave": max(wants[name]) * cell,
    }


def longest_step(stage: Stage, grid: Grid) -> float:
    """Return the longest time step of a stage [s], before steps are fitted to its end; 0 for `time_step: auto`."""
    step = stage.time_step
    if step == AUTO:
        return 0.0
    if stage.cells_per_step is not None:
        return min(stage.seconds, stage.cells_per_step * one_cell(stage, grid))
    if isinstance(step, GeometricStep):  # n steps last first (growth^n - 1) / (growth - 1)
        return min(stage.seconds, (stage.seconds * (step.growth - 1) + step.first) / step.growth)
    return min(stage.seconds, step or 0.0)


def _steps(index: int, stage: Stage, grid: Grid, resolved: float, short: float | None) -> Iterator[Doubt]:
    """Yield warnings about steps longer than the time `resolved` [s], or too long for the shortest wave `short` [m]."""
    step = longest_step(stage, grid)
    slid = step * stage.speed
    if stage.speed and not stage.seconds:
        yield Doubt("slides in no time", f"history.{index}")
    if step > resolved * (1 + SAME_LENGTH):
        yield Doubt("long steps", f"history.{index}", {"step": step, "shortest": resolved})
    if short is not None and slid > short / STEPS_PER_WAVE * (1 + SAME_LENGTH):
        enough = short / STEPS_PER_WAVE / stage.speed
        numbers = {"slid": slid, "share": slid / short, "step": enough, "cells": enough / one_cell(stage, grid)}
        yield Doubt("skipped waves", f"history.{index}", numbers)


def describe_sample(grid: Grid, surface: tuple[Any, ...], slides: bool) -> str:
    """Return a sentence on the scatter of friction (if it `slides`) and contact area between seeds; '' without a seed.

    The scatter falls with the square root of the number of longest waves in the box.
    """
    longest = max((shape.long_wavelength for shape in surface if isinstance(shape, Rough)), default=0.0)
    if not longest:
        return ""
    counts = [max(length / longest, 1.0) for _, length, _ in _directions(grid)]
    root = math.sqrt(math.prod(counts))
    friction = f"friction by about {per_cent(SEED_FRICTION / root)} and " if slides else ""
    return (
        f"another seed of the surface would change {friction}the contact area by about {per_cent(SEED_AREA / root)} "
        f"(standard deviation): {' x '.join(f'{count:.3g}' for count in counts)} of its longest waves fit into the box"
    )
