"""Frequencies at which the surface of a job loads the body."""

from __future__ import annotations

import math
from typing import Any

from ..sections.calculation import Grid
from ..sections.geometry import Flat, Rough, Wave
from . import Sections


def excited_band(job: Sections) -> tuple[float, float] | None:
    """Return the range of frequencies [Hz] at which the waves of a job's surface load a point of the body, over all
    stages and steady velocities; None if the surface does not move and no load oscillates."""
    velocities = [*(stage.velocity for stage in job.history), job.initial.velocity]
    speeds = [*(math.hypot(*velocity) for velocity in velocities), *(job.steady.velocities if job.steady else ())]
    turns = [stage.frequency for stage in job.history if stage.frequency]
    moving, waves = (
        [speed for speed in speeds if speed > 0.0],
        [number for shape in job.surface for number in wave_numbers(shape, job.grid)],
    )
    if moving and waves:
        turns += [min(moving) * min(waves) / (2 * math.pi), max(moving) * max(waves) / (2 * math.pi)]
    return (min(turns), max(turns)) if turns else None


def wave_numbers(shape: Any, grid: Grid) -> tuple[float, ...]:
    """Return the wavenumbers [rad/m] of a shape, or the lowest and the highest one; none for a flat surface. Round
    shapes and files may have every wave from the box to two cells."""
    longest = 2.0 * math.pi / max(grid.size)
    cells = [cell for cell, n in zip((grid.dx, grid.dy), grid.points, strict=True) if n > 1]
    if isinstance(shape, Flat):
        return ()
    if isinstance(shape, Wave):
        waves = [2.0 * math.pi * n / length for n, length in zip(shape.waves, grid.size, strict=True)]
        return (math.hypot(*waves),) if any(waves) else ()
    if isinstance(shape, Rough):
        ratio = shape.anisotropy.ratio if shape.anisotropy else 1.0
        return max(2.0 * math.pi / (ratio * shape.long_wavelength), longest), 2.0 * math.pi / shape.short_wavelength
    return longest, max(math.pi / min(cells, default=math.inf), longest)
