"""The price of accuracy: the mesh, the steps and the time of a job at other accuracies, from a trial of it at its own.

Nothing more is tried. All parts of the error budget together keep the accuracy: the mesh may have MESH_SHARE of it,
time steps TIME_SHARE, the solver the rest; steps that are chosen make CHOSEN_SHARE, whatever the mesh makes. The mesh
has the cells per shortest wave that this takes, along the sliding and across it (`job.checks.cells`). The parts that
the mesh makes, which the trial saw, go with the power of the cell that the budget knows (`physics.budget`). Heights
from a file stay on their mesh. The part that time steps make, seen too, goes with the power 1.7 of the step for the
exponential integrator, with the first for backward Euler; where a slide has cells per step they are one, a half, a
third, ... as it needs. A step has as many operator calls as seen, times what a smaller tolerance and fractions of a
cell add, and each takes as long as seen, in proportion to N log N.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from ..history.chosen import ChosenEnds
from ..history.timeline import Timeline
from ..job import GeometricStep, Job, OnOneMesh, Rough, Stage
from ..job.checks.advice import STEPS_PER_WAVE
from ..job.checks.cells import ASIDE, cells_across, cells_per_wave, fast_length, one_cell
from ..job.sections.listing import plain
from ..mesh import points_for
from ..physics.mesh_error import SPOTS_ORDER
from ..physics.time_error import TIME_ORDER
from ..printed import per_cent
from .costs import Costs
from .report import duration_text, ranks_text, unit_of
from .sample import Sample, StageCost

ACCURACIES = (0.05, 0.01, 3e-3, 1e-3)
MESH_SHARE, TIME_SHARE = 0.6, 0.35  # of the accuracy, for the mesh and for time steps; the rest is the solver's
ACROSS_SHARE = 0.2  # accuracy: of that of the mesh, for the cells across the sliding
CHOSEN_SHARE = 0.65  # accuracy: of the accuracy, what time steps make that follow it, in the mean of a stage
EDGE_ORDER = 1.0  # accuracy: of the cell, in which the error of the contact area falls, and what edges lose
CALLS_PER_DECADE = 1.5  # tuning: for a tenth of the tolerance: 1.4 to 1.7 in eight scenes, 1 near full contact
BETWEEN_CELLS = 1.4  # times the calls of steps of whole cells: their start is not moved with the surface exactly
LONGER, COARSER, FINER = 4.0, 8.0, 16.0  # times the own steps, and the own cells, at most: no trial tells of more
NAMES = {"friction": "friction", "area": "the contact area"}
SAME = 1e-9  # rounding: relative: numbers this close are the same


def offer(costs: Costs, accuracy: float, whole: Job | None = None) -> Costs:
    """Return the costs of the job, or of a part of the `whole` job, at another accuracy."""
    own, sample, given = costs.job, costs.sample, whole or costs.job
    points = points_for(given, accuracy) if given.origin.mesh else mesh_for(own, sample, accuracy)
    job = _on_mesh(own, accuracy, points)
    return Costs(job, _scaled(sample, own, job), costs.write_rate)


def mesh_for(job: Job, sample: Sample, accuracy: float) -> tuple[int, int]:
    """Points along x and y."""
    grid, factors = job.grid, (_finer(job, sample, accuracy, axis) for axis in (0, 1))
    nx, ny = (
        1 if n == 1 else n if factor == 1.0 else fast_length(n * factor)
        for n, factor in zip(grid.points, factors, strict=True)
    )
    return nx, ny


def _finer(job: Job, sample: Sample, accuracy: float, axis: int) -> float:
    """Return the points needed along an axis over those of the job; 1 where its surface has one mesh, or the mesh makes
    no error."""
    if any(isinstance(shape, OnOneMesh) for shape in job.surface):
        return 1.0
    error, order, waves = mesh_error(sample, "friction"), SPOTS_ORDER, shortest_wave(job)
    share, across = MESH_SHARE * accuracy, mesh_error(sample, "friction", "across") or 0.0
    slides = not job.directions or any(abs(way[axis]) > ASIDE for way in job.directions)
    cells = cells_per_wave(share) if slides else cells_across(share)
    of_waves = cells * (job.grid.dx, job.grid.dy)[axis] / waves if waves else 0.0
    if error is None:
        error, order = mesh_error(sample, "area") or 0.0, EDGE_ORDER
    elif across:
        error, share = (error - across, (1.0 - ACROSS_SHARE) * share) if slides else (across, ACROSS_SHARE * share)
        edges = min(error, mesh_error(sample, "friction", "edges") or 0.0) if slides else 0.0
        order += (EDGE_ORDER - order) * edges / error
    factor = (error / share) ** (1.0 / order) * sample.job.grid.points[axis] / job.grid.points[axis]
    return max(of_waves, min(max(factor, 1.0 / COARSER), FINER)) if factor else of_waves or 1.0


def mesh_error(sample: Sample, name: str, which: str = "mesh") -> float | None:
    """Return the part of the error of friction or area that the mesh of a sample makes, or its cells `across` the
    sliding, or its `edges`; None where there is none, and for friction that cannot be told from none, which no mesh
    makes exact to a share of it."""
    weight = sample.total(f"{name} weight")
    error = sample.total(f"{name} {which} error") / weight if weight else None
    return None if name == "friction" and error is not None and error >= 1.0 else error


def area_error(sample: Sample, job: Job) -> float:
    """Return the part of the error of the contact area that the mesh of a job makes, in the first order of its mean
    cell."""
    own, tried = (grid.dx + grid.dy if 1 not in grid.points else grid.dx for grid in (job.grid, sample.job.grid))
    return (mesh_error(sample, "area") or 0.0) * (own / tried) ** EDGE_ORDER


def shortest_wave(job: Job) -> float | None:
    """Return that of the rough surfaces of a job [m], None without one."""
    return min((shape.short_wavelength for shape in job.surface if isinstance(shape, Rough)), default=None)


def _on_mesh(job: Job, accuracy: float, points: tuple[int, int]) -> Job:
    """The job with the numerics of an accuracy; on its own mesh if its surface cannot be put on another."""
    data: dict[str, Any] = plain(job)
    data["numerics"] |= {"accuracy": accuracy, "tolerance": None, "branch_error": None}
    try:
        return Job.model_validate({**data, "grid": {**data["grid"], "points": list(points)}})
    except ValidationError:
        return Job.model_validate(data)


# -- steps and calls ---------------------------------------------------------------------------------------------------


def _scaled(sample: Sample, own: Job, job: Job) -> Sample:
    """A sample of the own job as one of the job at another accuracy."""
    times = float(CALLS_PER_DECADE ** math.log10(own.numerics.tolerance / job.numerics.tolerance))
    if not own.history:
        return replace(sample, stages=tuple(_with_calls(stage, times) for stage in sample.stages))
    order = TIME_ORDER if own.numerics.integrator == "exponential" else 1.0
    waves = (shortest_wave(sample.job) or 1.0) / (shortest_wave(own) or 1.0)
    stages = []
    spans = Timeline.of(sample.job).spans, Timeline.of(own).spans
    for cost, tried, span in zip(sample.stages, *spans, strict=True):
        share = CHOSEN_SHARE if isinstance(span.ends, ChosenEnds) else TIME_SHARE
        error = time_error(cost, sample) / (share * job.numerics.asked.of_steps)
        more = max(error ** (1.0 / order) * (tried.count / max(span.count, 1)) * waves, 1.0 / LONGER)
        count, between = steps_of(span.stage, cost.steps - span.jumps, more, own, job)
        stages.append(_with_calls(replace(cost, steps=count + span.jumps), times * between))
    return replace(sample, stages=tuple(stages))


def time_error(cost: StageCost, sample: Sample) -> float:
    """The part that time steps make, in a stage, or in all where it was not tried."""
    for total in (cost.total, sample.total):
        for name in ("friction", "area"):
            if weight := total(f"{name} weight"):
                return total(f"{name} time error") / weight
    return 0.0


def steps_of(stage: Stage, count: int, more: float, own: Job, job: Job) -> tuple[int, float]:
    """Return the steps of a stage instead of its own `count` that last if these are to be `more` times as many, and how
    many times the calls one of them takes."""
    if count == 0:
        return 0, 1.0
    longest = stage.seconds / (more * count)
    if stage.speed and (wave := shortest_wave(own)):
        longest = min(longest, wave / STEPS_PER_WAVE / stage.speed)
    if not stage.speed or stage.chooses or isinstance(stage.time_step, GeometricStep):
        return math.ceil(stage.seconds / longest * (1.0 - SAME)), 1.0
    way, cell, before = stage.seconds * stage.speed, *(one_cell(stage, each.grid) * stage.speed for each in (job, own))
    cells = 1.0 / math.ceil(max(1.0, cell / (longest * stage.speed)) * (1.0 - SAME))
    whole = way >= count * before * (1.0 - SAME)
    return math.ceil(way / (cells * cell) * (1.0 - SAME)), BETWEEN_CELLS if cells < 1.0 and whole else 1.0


def _with_calls(cost: StageCost, times: float) -> StageCost:
    first, later = ({name: value * times for name, value in sums.items()} for sums in (cost.first, cost.later))
    return replace(cost, first=first, later=later)


# -- text --------------------------------------------------------------------------------------------------------------


def table(costs: Costs, whole: Job | None = None) -> Iterator[str]:
    """Mesh, steps, precision, memory and time of each accuracy on these ranks, and how far to trust them."""
    chosen = bool((whole or costs.job).origin.mesh)
    rows = [("this job", costs), *((per_cent(accuracy), offer(costs, accuracy, whole)) for accuracy in ACCURACIES)]
    unit, size = unit_of(max(each.held for _, each in rows))
    sample = costs.sample
    slides = sample.total("friction weight") > 0.0
    both = "friction and the contact area" if chosen else "friction"
    yield "cost of an accuracy of " + (
        f"{both} (area: error of the contact area then)" if slides else "the contact area"
    )
    heads = (("area", 9), ("mesh", 14), ("steps" if costs.job.history else "states", 9))
    head = "".join(f"{text:>{width}}" for text, width in heads if slides or text != "area")
    yield f"  {'accuracy':9}{head}  precision{f'maps [{unit}]':>11} {ranks_text(sample.ranks):>11}"
    for name, each in rows:
        grid, lasts = each.job.grid, duration_text(each.whole)
        area = f"{per_cent(area_error(sample, each.job)):>9}" if slides else ""
        numbers = f"{f'{grid.nx} x {grid.ny}':>14}{each.sample.steps:9d}  {each.job.numerics.precision:9}"
        yield f"  {name:9}{area}{numbers}{each.held / size:11.4g} {lasts:>11}"
    found = " and ".join(filter(None, (_errors(sample, *names) for names in NAMES.items())))
    errors = f"errors of {found}" if found else "errors unknown"
    points, word = " x ".join(map(str, sample.job.grid.points)), "step" if sample.job.history else "state"
    calls = sample.total("operator") / max(sample.steps, 1)
    yield f"measured on {points} points: times, {calls:.3g} operator calls a {word}, {errors}"
    how = "as points: auto takes it" if chosen else "by the shortest wave or contact spot"
    yield (
        f"estimated from these: the mesh {how}, the number of steps by the order of the integrator, "
        f"{CALLS_PER_DECADE:g} times the calls for a tenth of the tolerance, time in proportion to N log N"
    )


def _errors(sample: Sample, name: str, what: str) -> str:
    """Return what time steps and the mesh of a sample make wrong with friction or the area, empty if there is none."""
    weight, mesh = sample.total(f"{name} weight"), mesh_error(sample, name)
    if not weight:
        return ""
    steps = f"time steps {per_cent(sample.total(f'{name} time error') / weight)}, " if sample.job.history else ""
    return f"{what} ({steps}{'mesh unknown' if mesh is None else f'mesh {per_cent(mesh)}'})"
