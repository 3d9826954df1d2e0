"""Warnings about the thickness of a layer, compared with the surface, the mesh and the material.

As in `meaning`, heights and lengths are bounded from below, so that sound jobs get no warning.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ...doubts import Doubt
from ..sections.calculation import Grid
from ..sections.geometry import Flat, Rough, Sphere, Wave
from ..sections.stages import Stage
from . import Sections
from .cells import more_points

THICKEST = 1 / 3  # physics: limit of small strains for the indentation over the thickness of a layer
FEWEST_CELLS = 2.0  # accuracy: least cells in a thickness, the length over which pressure falls at the edge of contact
LONGEST = 100.0  # physics: wavelength over thickness above which the compressibility of rubber matters
NEARLY = 1e-4  # physics: distance of Poisson's ratio from 1/2 below which a body counts as incompressible


def doubts_of_layer(job: Sections) -> Iterator[Doubt]:
    """Yield warnings about the `body` section of a job, if it has one."""
    grid, surface, body, poisson = job.grid, job.surface, job.body, job.material.poisson
    if body is None:
        return
    cell = max(grid.dx, grid.dy)
    smooth = all(isinstance(shape, Wave | Flat) for shape in surface)
    if body.thickness < FEWEST_CELLS * cell and grid.boundary == "periodic" and not smooth:
        numbers = {"thickness": body.thickness, "least": FEWEST_CELLS, "cell": cell, "more": more_points(grid)}
        yield Doubt("thin", "body.thickness", numbers)
    yield from doubt_height(2.0 * _rms_height(grid, surface), body.thickness)
    yield from _indented(surface, body.thickness, job.history)
    longest = max(_wavelengths(grid, surface), default=0.0)
    if longest > LONGEST * body.thickness and poisson > 0.5 - NEARLY and body.base == "bonded":
        numbers = {"wave": longest, "times": LONGEST, "thickness": body.thickness, "poisson": poisson}
        yield Doubt("incompressible", "material.poisson", numbers)


def doubt_height(height: float, thickness: float) -> Iterator[Doubt]:
    """Yield a warning if a surface of this height [m] is too high for a layer of this thickness [m]."""
    if height > THICKEST * thickness:
        yield Doubt("high for a layer", "body.thickness", {"height": height, "thickness": thickness})


def _indented(surface: tuple[Any, ...], thickness: float, history: tuple[Stage, ...]) -> Iterator[Doubt]:
    """Yield a warning if the approach of a sphere is too large for the thickness [m]."""
    if len(surface) != 1 or not isinstance(surface[0], Sphere):
        return
    approaches = [(stage.load.highest, index) for index, stage in enumerate(history) if stage.control == "approach"]
    deepest, index = max(approaches, default=(0.0, 0))
    if deepest > THICKEST * thickness:
        numbers = {"approach": deepest, "thickness": thickness}
        yield Doubt("deep for a layer", f"history.{index}.approach", numbers)


def _rms_height(grid: Grid, surface: tuple[Any, ...]) -> float:
    """Return a lower bound of the rms height [m] of waves and roughness; slopes count for the shortest waves."""
    square = 0.0
    for shape in surface:
        if isinstance(shape, Wave):
            square += shape.amplitude**2 / 2
        elif isinstance(shape, Rough):
            by_slope = (shape.rms_slope or 0.0) * shape.short_wavelength / (2 * math.pi)
            square += max(shape.rms_height or 0.0, by_slope) ** 2
    return math.sqrt(square)


def _wavelengths(grid: Grid, surface: tuple[Any, ...]) -> Iterator[float]:
    for shape in surface:
        if isinstance(shape, Wave) and any(shape.waves):
            yield 1.0 / math.hypot(shape.waves[0] / grid.lx, shape.waves[1] / grid.ly)
        elif isinstance(shape, Rough):
            yield shape.long_wavelength
