"""The price of accuracy: mesh, steps and time of a job at other accuracies, from the errors seen in a trial of it.

The mesh may make MESH_SHARE of an accuracy, time steps TIME_SHARE of it, or CHOSEN_SHARE where stages choose them. What
the mesh makes of friction falls with the power SPOTS_ORDER of the cell, and of the contact area with the first; what
time steps make with the order of the integrator (`accuracy.time_error`). Nothing more is tried.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from ..accuracy.mesh_error import SPOTS_ORDER
from ..accuracy.time_error import order_of_time_error
from ..history.chosen import ChosenEnds
from ..history.timeline import Span, Timeline
from ..job import Job, OnOneMesh, Rough
from ..job.checks.cells import cells_per_wave, fast_length, one_cell
from ..job.sections.listing import plain
from ..mesh import points_for
from ..printed import per_cent
from .costs import Costs
from .report import duration_text, ranks_text, unit_of
from .sample import Sample, StageCost

ACCURACIES = (0.05, 0.01, 3e-3, 1e-3)
MESH_SHARE, TIME_SHARE = 0.6, 0.35  # of the accuracy, for the mesh and for time steps; the rest is the solver's
CHOSEN_SHARE = 0.65  # accuracy: of the accuracy, what time steps make that follow it, in the mean of a stage
AREA_ORDER = 1.0  # accuracy: of the cell, in which the error of the contact area falls
CALLS_PER_DECADE = 1.5  # tuning: for a tenth of the tolerance: 1.4 to 1.7 in eight scenes, 1 near full contact
BETWEEN_CELLS = 1.4  # times the calls of steps of whole cells: their start is not moved with the surface exactly
LONGER, COARSER, FINER = 4.0, 8.0, 16.0  # times the own steps, and the own cells, at most: no trial tells of more
SAME = 1e-9  # rounding: relative: numbers this close are the same


def offer(costs: Costs, accuracy: float, whole: Job | None = None) -> Costs:
    """Return the costs of the job, or of a part of the `whole` job, at another accuracy."""
    own, sample, given = costs.job, costs.sample, whole or costs.job
    job = _on_mesh(own, accuracy, points_for(given, accuracy) if given.origin.mesh else mesh_for(own, sample, accuracy))
    calls = float(CALLS_PER_DECADE ** math.log10(own.numerics.tolerance / job.numerics.tolerance))
    spans = Timeline.of(own).spans if own.history else [None] * len(sample.stages)
    stages = [
        _with_calls(cost, calls) if span is None else _with_calls(*_steps_for(cost, span, calls, sample, own, job))
        for cost, span in zip(sample.stages, spans, strict=True)
    ]
    return Costs(job, replace(sample, stages=tuple(stages)), costs.write_rate)


def mesh_for(job: Job, sample: Sample, accuracy: float) -> tuple[int, int]:
    """Return the points along x and y with which the mesh makes its share of an accuracy."""
    grid, share = job.grid, MESH_SHARE * accuracy
    if any(isinstance(shape, OnOneMesh) for shape in job.surface):
        return grid.points
    error, order = mesh_error(sample, "friction"), SPOTS_ORDER
    if error is None:
        error, order = mesh_error(sample, "area") or 0.0, AREA_ORDER
    times = (error / share) ** (1.0 / order) * max(sample.job.grid.points) / max(grid.points)
    times = min(max(times, 1.0 / COARSER), FINER) if error else 0.0
    if wave := shortest_wave(job):
        times = max(times, cells_per_wave(share) * min(grid.dx, grid.dy) / wave)
    nx, ny = (fast_length(n * times) if times and n > 1 else n for n in grid.points)
    return nx, ny


def mesh_error(sample: Sample, name: str) -> float | None:
    """Return the part of the error of friction or area that the mesh of a sample makes; None where there is none, and
    for friction that cannot be told from none, which no mesh makes exact to a share of it."""
    weight = sample.total(f"{name} weight")
    error = sample.total(f"{name} mesh error") / weight if weight else None
    return None if name == "friction" and error is not None and error >= 1.0 else error


def area_error(sample: Sample, job: Job) -> float:
    """Return the part of the error of the contact area that the mesh of a job makes."""
    own, tried = (grid.dx + grid.dy if 1 not in grid.points else grid.dx for grid in (job.grid, sample.job.grid))
    return (mesh_error(sample, "area") or 0.0) * (own / tried) ** AREA_ORDER


def shortest_wave(job: Job) -> float | None:
    """Return the shortest wave of the rough surfaces of a job [m], None without one."""
    return min((shape.short_wavelength for shape in job.surface if isinstance(shape, Rough)), default=None)


def time_error(cost: StageCost, sample: Sample) -> float:
    """Return the part that time steps make, in a stage, or in all where it was not tried."""
    for total in (cost.total, sample.total):
        for name in ("friction", "area"):
            if weight := total(f"{name} weight"):
                return total(f"{name} time error") / weight
    return 0.0


def _steps_for(
    cost: StageCost, span: Span, calls: float, sample: Sample, own: Job, job: Job
) -> tuple[StageCost, float]:
    """Return a stage of the own job with its steps in the job at another accuracy, and how many times the `calls` one
    of them takes. A slide that gives its steps has one for each cell at least."""
    if not span.count:
        return cost, calls
    order = order_of_time_error(own.numerics.integrator, curved=True)
    share = CHOSEN_SHARE if isinstance(span.ends, ChosenEnds) else TIME_SHARE
    error = time_error(cost, sample) / (share * job.numerics.asked.of_steps)
    coarser = Timeline.of(sample.job).spans[span.index].count / span.count  # steps of the trial over the own ones
    waves = (shortest_wave(sample.job) or 1.0) / (shortest_wave(own) or 1.0)
    before = cost.steps - span.jumps
    count = before * max(error ** (1.0 / order) * coarser * waves, 1.0 / LONGER)
    if span.stage.speed and not span.stage.chooses:
        cells, own_cells = (span.stage.seconds / one_cell(span.stage, each.grid) for each in (job, own))
        if count > cells * (1.0 + SAME) and before <= own_cells * (1.0 + SAME):
            calls *= BETWEEN_CELLS
        count = max(count, cells)
    return replace(cost, steps=span.jumps + math.ceil(count * (1.0 - SAME))), calls


def _on_mesh(job: Job, accuracy: float, points: tuple[int, int]) -> Job:
    """Return the job with the numerics of an accuracy; on its own mesh if its surface cannot be put on another."""
    data: dict[str, Any] = plain(job)
    data["numerics"] |= {"accuracy": accuracy, "tolerance": None, "branch_error": None}
    try:
        return Job.model_validate({**data, "grid": {**data["grid"], "points": list(points)}})
    except ValidationError:
        return Job.model_validate(data)


def _with_calls(cost: StageCost, times: float) -> StageCost:
    first, later = ({name: value * times for name, value in sums.items()} for sums in (cost.first, cost.later))
    return replace(cost, first=first, later=later)


def table(costs: Costs, whole: Job | None = None) -> Iterator[str]:
    """Yield mesh, steps, precision, memory and time of each accuracy on these ranks, and how far to trust them."""
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
    found = " and ".join(
        filter(None, (_errors(sample, *names) for names in (("friction", "friction"), ("area", "the contact area"))))
    )
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
