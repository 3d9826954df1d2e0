"""Warnings about a layer: what its thickness means beside the surface, the mesh and the material.

Each says the value, the limit and what to change. All is judged by lower bounds, as in `meaning`.
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

THICKEST = 1 / 3  # physics: what presses into a layer over its thickness; beyond, strains are not small
FEWEST_CELLS = 2.0  # accuracy: in a thickness, over which the pressure at the edge of a contact falls
LONGEST = 100.0  # physics: thicknesses; to longer waves rubber yields by its compressibility, of 1e-3 of the shear's
NEARLY = 1e-4  # physics: below 1/2, of the Poisson's ratio of a rubber


def doubts_of_layer(job: Sections) -> Iterator[Doubt]:
    """Yield doubts about the `body` section of a job, which may be None."""
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
    """Yield a doubt about a layer into which a surface of such a height [m] presses."""
    if height > THICKEST * thickness:
        yield Doubt("high for a layer", "body.thickness", {"height": height, "thickness": thickness})


def _indented(surface: tuple[Any, ...], thickness: float, history: tuple[Stage, ...]) -> Iterator[Doubt]:
    """Judge an indenter by its approach: the layer is strained by its share of the thickness."""
    if len(surface) != 1 or not isinstance(surface[0], Sphere):
        return
    approaches = [
        (max(stage.load.start, stage.load.end), index)
        for index, stage in enumerate(history)
        if stage.control == "approach"
    ]
    deepest, index = max(approaches, default=(0.0, 0))
    if deepest > THICKEST * thickness:
        numbers = {"approach": deepest, "thickness": thickness}
        yield Doubt("deep for a layer", f"history.{index}.approach", numbers)


def _rms_height(grid: Grid, surface: tuple[Any, ...]) -> float:
    """Return a lower bound of the rms height of waves and roughness [m]: steep waves are the shortest at most."""
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
