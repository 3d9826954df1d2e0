"""Slides in a periodic box that come round to where they began, while the body still remembers it."""

import math
from collections.abc import Iterator
from itertools import groupby
from typing import Any

from ..sections.geometry import Rough, Wave
from ..sections.materials import Elastic, Zener
from ..sections.settings import Grid
from ..sections.stages import Initial, Stage

NEAR = 0.4  # of the longest wave: as near to where it was, the surface is over its own imprint
REMEMBERS = 0.1  # of the time since: a branch that relaxes in less has forgotten
ROUNDS = 1000  # through the box that are looked at
SAME = 1e-9  # relative: ways this near are the same


def returns(
    grid: Grid, surface: tuple[Any, ...], material: Elastic | Zener, history: tuple[Stage, ...], initial: Initial
) -> Iterator[str]:
    """Yield a sentence about each slide, of stages of one velocity, that goes over the imprint of its own beginning.

    Waves that fill the box repeat themselves on a shorter way, and mean it. A slide that begins in its own steady state
    finds no other imprint.
    """
    branches = getattr(material, "branches", ())
    times = [branch.relaxation_time for branch in branches if branch.relaxation_time < math.inf]
    if grid.boundary != "periodic" or not times or all(isinstance(shape, Wave) for shape in surface):
        return
    memory = max(times) * getattr(material, "time_factor", 1.0)
    near = NEAR * max((shape.long_wavelength for shape in surface if isinstance(shape, Rough)), default=0.0)
    steady = (initial.velocity, initial.pressure) if initial.state == "steady" else None
    for velocity, stages in groupby(enumerate(history), key=lambda stage: stage[1].velocity):
        (index, first), *more = stages
        speed = math.hypot(*velocity)
        seconds = first.seconds + sum(stage.seconds for _, stage in more)
        if not speed * seconds or steady == (velocity, first.load.end):
            continue
        start = _round_trip(grid, velocity, seconds + near / speed, near) - near
        if speed * seconds > start * (1.0 + SAME) and memory > REMEMBERS * start / speed:
            yield (
                f"history.{index}: after {start:.3g} m of {speed * seconds:.3g} m the surface has come round the "
                "periodic box to where this slide began, over its own imprint, which the body remembers for "
                f"{memory:.3g} s: friction is that of the box then, and part of mu_dyn; use a shorter distance or a "
                "larger grid.size"
            )


def _round_trip(grid: Grid, velocity: tuple[float, float], most: float, near: float) -> float:
    """Return the way [m] after which a slide of at `most` so many seconds is within `near` of where it began, but for
    whole boxes; inf if it never is."""
    along = [abs(one) for one in velocity]
    main, other = (0, 1) if along[0] / grid.lx >= along[1] / grid.ly else (1, 0)
    for count in range(1, ROUNDS):
        seconds = count * grid.size[main] / along[main]
        if seconds > most * (1.0 + SAME):
            break
        if abs(math.remainder(along[other] * seconds, grid.size[other])) <= near + SAME * grid.size[other]:
            return math.hypot(*velocity) * seconds
    return math.inf
