"""Folded branches: which of them need no map, from the time scales of a job and the waves of its surface."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from .. import job as jobs
from ..history.chosen import ChosenEnds
from ..history.timeline import Span, Timeline
from ..job import Grid
from ..physics.folding import Band, FoldedBranches, Phase
from ..physics.prony import Prony
from ..printed import per_cent


def describe_folded_branches(found: FoldedBranches, prony: Prony) -> list[str]:
    """Return what a user should know about the branches of a material [Pa, s]: nothing if they are as the job says."""
    count = prony.moduli.size
    if not found.folded:
        return [f"branches: all {count} are followed in time: {found.reason}"] if found.reason and count > 1 else []
    folded = "; ".join(
        f"those of {', '.join(f'{prony.relaxation_times[k]:g}' for k in numbers)} s are {kind}"
        for kind, numbers in (("too fast to remember", found.memoryless), ("too slow to relax", found.frozen))
        if numbers
    )
    return [
        f"branches: {len(found.kept)} of {count} are followed in time; {folded}. "
        f"Error of friction by this, at rest of the modulus: at most {per_cent(found.bound)} "
        f"(numerics.branch_error allows {per_cent(found.allowed)})"
    ]


def phases(timeline: Timeline) -> Iterator[Phase]:
    """The stages of a history as phases of one velocity."""
    for span in timeline.spans:
        first, last = _first_and_last(span)
        duration = span.ends.elapsed(span.count) if span.count else 0.0
        yield Phase(duration, first, last, span.stage.velocity, span.jumps)


def _first_and_last(span: Span) -> tuple[float, float]:
    """The first and the last step of a stage [s]; those that it chooses lie between the shortest and the longest."""
    if isinstance(span.ends, ChosenEnds):
        return span.ends.limits.least, span.ends.limits.most
    first, last = (span.ends.interval(n) if n else 0.0 for n in (min(1, span.count), span.count))
    return first, last


def bands(grid: Grid, surface: Iterable[Any]) -> Iterator[Band]:
    """The waves of a surface of these shapes. Round shapes and files may have every wave from the box to two cells."""
    only = _direction_of_all_waves(grid)
    longest = 2 * np.pi / max(grid.size)
    finest = max(np.pi / min((cell for cell, n in _cells_and_points(grid) if n > 1), default=np.inf), longest)
    for shape in surface:
        if isinstance(shape, jobs.Wave) and any(shape.waves):
            kx, ky = (2 * np.pi * n / length for n, length in zip(shape.waves, grid.size, strict=True))
            yield Band(float(np.hypot(kx, ky)), float(np.hypot(kx, ky)), finest, (kx, ky))
        elif isinstance(shape, jobs.Rough):
            low, high = (2 * np.pi / length for length in (shape.long_wavelength, shape.short_wavelength))
            yield Band(max(low, longest), high, finest, only)
        elif isinstance(shape, jobs.Cylinder):
            yield Band(longest, finest, finest, (1.0, 0.0) if shape.axis == "y" else (0.0, 1.0))
        elif isinstance(shape, jobs.Sphere | jobs.OnOneMesh | jobs.Topography | jobs.RoughSpectrum):
            yield Band(longest, finest, finest, only)


def _cells_and_points(grid: Grid) -> Iterator[tuple[float, int]]:
    return zip((grid.dx, grid.dy), grid.points, strict=True)


def _direction_of_all_waves(grid: Grid) -> tuple[float, float] | None:
    """The direction of all waves on a grid of one line of points; None on a true one."""
    if grid.nx == 1:
        return 0.0, 1.0
    return (1.0, 0.0) if grid.ny == 1 else None
