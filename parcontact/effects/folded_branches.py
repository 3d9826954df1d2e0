"""Folded branches: which of them need no map, from the time scales of a job and the waves of its surface."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .. import job as jobs
from ..history.chosen import ChosenEnds
from ..history.timeline import Span, Timeline
from ..job import Grid, Job
from ..physics.folding import Band, FoldedBranches, Phase, fold_branches, keep_all
from ..physics.prony import Prony
from .effect import Decision
from .relaxation import relaxation_of


def decide(job: Job) -> Decision:
    """Branches far faster or slower than all that happens have no map (`physics.folding`)."""
    name, found = "folded branches", fold_branches_of(job)
    if not found.folded:
        return Decision(name, False, found.reason or "no branch is far faster or slower than all that happens")
    kinds = ((found.memoryless, "memoryless"), (found.frozen, "frozen"))
    folded = " and ".join(f"{len(numbers)} {kind}" for numbers, kind in kinds if numbers)
    count = len(found.kept) + found.folded
    return Decision(name, True, f"{folded} of {count}; error of friction {found.bound:.2g} at most")


def fold_branches_of(job: Job, until: float = 0.0) -> FoldedBranches:
    """Which branches of a job's material need a map, if its last stage goes on to `until` [s]; from the job alone."""
    prony, numerics = relaxation_of(job), job.numerics
    if prony.moduli.size == 0:
        return keep_all(prony, "the body has no branch")
    reason = "output.energy counts the energy of every branch" if job.output.energy else ""
    reason = reason or ("" if numerics.branch_error else "numerics.branch_error is 0")
    allowed = 0.0 if reason else numerics.branch_error
    start = job.initial.velocity if job.initial.state == "steady" else None
    found = fold_branches(prony, list(phases(job, until)), list(bands(job)), numerics.integrator, allowed, start)
    return replace(found, reason=reason)


def describe_folded_branches(found: FoldedBranches, prony: Prony) -> list[str]:
    """What a user should know about the branches of a material [Pa, s]: nothing if they are as the job says."""
    count = prony.moduli.size
    if not found.folded:
        return [f"branches: all {count} have a map: {found.reason}"] if found.reason and count > 1 else []
    times = {
        kind: ", ".join(f"{prony.relaxation_times[k]:g}" for k in numbers) + " s"
        for kind, numbers in (("memoryless", found.memoryless), ("frozen", found.frozen))
        if numbers
    }
    folded = "; ".join(f"{kind} {text}" for kind, text in times.items())
    return [
        f"branches: {len(found.kept)} of {count} have a map, {folded}; friction (at rest: the modulus) is wrong by at "
        f"most {found.bound:.2g} of itself (numerics.branch_error {found.allowed:g})"
    ]


def phases(job: Job, until: float = 0.0) -> Iterator[Phase]:
    """The stages of a job as phases of one velocity; the last one goes on to `until` [s]."""
    for span in Timeline.of(job, until).spans:
        first, last = _first_and_last(span)
        duration = span.ends[span.count] * span.stage.seconds if span.count else 0.0
        yield Phase(duration, first, last, span.stage.velocity, span.jumps)


def _first_and_last(span: Span) -> tuple[float, float]:
    """The first and the last step of a stage [s]; those that it chooses lie between the shortest and the longest."""
    if isinstance(span.ends, ChosenEnds):
        return span.ends.limits.least, span.ends.limits.most
    first, last = (span.interval(n) if n else 0.0 for n in (min(1, span.count), span.count))
    return first, last


def bands(job: Job) -> Iterator[Band]:
    """The waves of a job's surface. Round shapes and files may have every wave from the box to two cells."""
    grid, only = job.grid, _direction_of_all_waves(job.grid)
    longest = 2 * np.pi / max(grid.size)
    finest = max(np.pi / min((cell for cell, n in _cells_and_points(grid) if n > 1), default=np.inf), longest)
    for shape in job.surface:
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


def excited_band(job: Job) -> tuple[float, float] | None:
    """Frequencies [Hz] with which the waves of a job's surface pass a point of the body, over all stages and steady
    velocities; None for a surface that stands."""
    speeds = [math.hypot(*phase.velocity) for phase in phases(job)] + [math.hypot(*job.initial.velocity)]
    speeds = [speed for speed in (*speeds, *(job.steady.velocities if job.steady else ())) if speed > 0.0]
    waves = [(band.low, band.high) for band in bands(job)]
    if not speeds or not waves:
        return None
    low, high = min(low for low, _ in waves), max(high for _, high in waves)
    return min(speeds) * low / (2 * math.pi), max(speeds) * high / (2 * math.pi)


def _cells_and_points(grid: Grid) -> Iterator[tuple[float, int]]:
    return zip((grid.dx, grid.dy), grid.points, strict=True)


def _direction_of_all_waves(grid: Grid) -> tuple[float, float] | None:
    """The direction of all waves on a grid of one line of points; None on a true one."""
    if grid.nx == 1:
        return 0.0, 1.0
    return (1.0, 0.0) if grid.ny == 1 else None
