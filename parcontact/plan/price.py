"""The price of accuracy: mesh, steps, calls and time of a job at other accuracies, from the errors seen in a trial.

Mesh and time steps may make their shares of an accuracy (`accuracy.shares`), time steps CHOSEN of what they are allowed
where stages choose them. What the mesh makes of friction and of the area falls with the order of its fit
(`accuracy.constants`); what time steps make with the order of the integrator. Nothing more is tried.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from ..accuracy.constants import AREA, VIEWS
from ..accuracy.shares import FRICTION, TIME_MEDIAN
from ..accuracy.time_error import order_of_time_error
from ..history.chosen import ChosenEnds
from ..history.timeline import Span, Timeline
from ..job import Job, OnOneMesh
from ..job.checks.cells import cells_per_wave, fast_length, needed, one_cell
from ..job.sections.calculation import Accuracy
from ..job.sections.listing import plain_data
from ..mesh import find_shortest_wave, points_for
from ..printed import per_cent
from .costs import Costs
from .printed_plan import duration_text, ranks_text, unit_of
from .sample import Sample

ACCURACIES = (0.05, 0.01, 3e-3, 1e-3)
CHOSEN = 0.8  # accuracy: of what they are allowed, what time steps make that are chosen, in the mean of a stage
CALLS_PER_DECADE = 1.5  # tuning: for a tenth of the tolerance: 1.4 to 1.7 in eight scenes, 1 near full contact
MOST = 16.0  # times finer or coarser than the trial, at most
SAME = 1e-9  # rounding: relative: numbers this close are the same


def offer(costs: Costs, accuracy: float, whole: Job | None = None, wave: float | None = None) -> Costs:
    """Return the costs of the job, or of a part of the `whole` job, at another accuracy; `wave` is the shortest wave
    [m] of its surface."""
    own, sample, given = costs.job, costs.sample, whole or costs.job
    if given.origin.mesh:
        points = points_for(given, accuracy)
    else:
        points = mesh_for(own, sample, accuracy, find_shortest_wave(own) if wave is None else wave)
    job = _on_mesh(own, accuracy, points)
    calls = float(CALLS_PER_DECADE ** math.log10(own.numerics.tolerance / job.numerics.tolerance))
    spans, stages = Timeline.from_job(own).spans if own.history else [None] * len(sample.stages), []
    for cost, span in zip(sample.stages, spans, strict=True):
        first, later = ({name: value * calls for name, value in sums.items()} for sums in (cost.first, cost.later))
        steps = _steps(span, sample, job) if span and span.count else cost.steps
        stages.append(replace(cost, steps=steps, first=first, later=later))
    return Costs(job, replace(sample, stages=tuple(stages)), costs.write_rate)


def mesh_for(job: Job, sample: Sample, accuracy: float, wave: float) -> tuple[int, int]:
    """Return the points along x and y with which the mesh makes its share of an accuracy, and the shortest `wave` [m]
    has the cells without which a run warns."""
    grid, share = job.grid, FRICTION.mesh * accuracy
    if any(isinstance(shape, OnOneMesh) for shape in job.surface):
        return grid.points
    error, order = error_of(sample, "friction", "mesh"), VIEWS.order
    if error is None or error >= 1.0:  # no mesh makes friction exact to a share that cannot be told from none
        error, order = error_of(sample, "area", "mesh") or 0.0, AREA.order
    times = (error / share) ** (1.0 / order) * max(sample.job.grid.points) / max(grid.points)
    times = min(max(times, 1.0 / MOST), MOST) if error else 0.0
    asked, cells = Accuracy(friction=accuracy, area=accuracy), zip(grid.points, (grid.dx, grid.dy), strict=True)
    wanted = [max(cells_per_wave(share), *needed(axis, job.directions, asked)) for axis in range(2)]
    least = [count * cell / wave for count, (n, cell) in zip(wanted, cells, strict=True) if n > 1]
    times = max(times, *least)
    nx, ny = (fast_length(n * times) if times and n > 1 else n for n in grid.points)
    return nx, ny


def error_of(sample: Sample, name: str, source: str) -> float | None:
    """Return the part of the error of friction or area that the mesh or the time steps of a sample make, if any."""
    weight = sample.total(f"{name} weight")
    return sample.total(f"{name} {source} error") / weight if weight else None


def _steps(span: Span, sample: Sample, job: Job) -> int:
    """Return the steps of a stage in the job at another accuracy; a slide with given steps has one a cell at least."""
    error = next((e for name in ("friction", "area") if (e := error_of(sample, name, "time")) is not None), 0.0)
    chosen = CHOSEN * TIME_MEDIAN if isinstance(span.ends, ChosenEnds) else 1.0
    share = FRICTION.time * chosen * job.numerics.asked.of_steps
    tried = Timeline.from_job(sample.job).spans[span.index].count
    order = order_of_time_error(job.numerics.integrator, curved=True)
    count = max(tried * (error / share) ** (1.0 / order), span.count / MOST)
    if span.stage.speed and not span.stage.chooses:
        count = max(count, span.stage.seconds / one_cell(span.stage, job.grid))
    return span.jumps + math.ceil(count * (1.0 - SAME))


def _on_mesh(job: Job, accuracy: float, points: tuple[int, int]) -> Job:
    """Return the job with the numerics of an accuracy; on its own mesh if its surface cannot be put on another."""
    data: dict[str, Any] = plain_data(job)
    data["numerics"] |= {"accuracy": accuracy, "tolerance": None, "branch_error": None}
    try:
        return Job.model_validate({**data, "grid": {**data["grid"], "points": list(points)}})
    except ValidationError:
        return Job.model_validate(data)


def table(costs: Costs, whole: Job | None = None) -> Iterator[str]:
    """Yield mesh, steps, precision, memory and time of each accuracy on these ranks, and how far to trust them."""
    sample, chosen = costs.sample, bool((whole or costs.job).origin.mesh)
    wave = find_shortest_wave(costs.job)
    rows = [("this job", costs), *((per_cent(a), offer(costs, a, whole, wave)) for a in ACCURACIES)]
    unit, size = unit_of(max(each.held for _, each in rows))
    slides = sample.total("friction weight") > 0.0
    both = "friction and the contact area" if chosen else "friction"
    yield f"cost of an accuracy of {both if slides else 'the contact area'}"
    head = f"{'mesh':>14}{'steps' if costs.job.history else 'states':>9}"
    yield f"  {'accuracy':9}{head}  precision{f'maps [{unit}]':>11} {ranks_text(sample.ranks):>11}"
    for name, each in rows:
        mesh = "{} x {}".format(*each.job.grid.points)
        numbers = f"{mesh:>14}{each.sample.steps:9d}  {each.job.numerics.precision:9}{each.held / size:11.4g}"
        yield f"  {name:9}{numbers} {duration_text(each.whole):>11}"
    found = filter(None, (_errors(sample, *of) for of in (("friction", "friction"), ("area", "the contact area"))))
    points, word = " x ".join(map(str, sample.job.grid.points)), "step" if sample.job.history else "state"
    calls = sample.total("operator") / max(sample.steps, 1)
    errors = " and ".join(found)
    said = f"errors of {errors}" if errors else "errors unknown"
    yield f"measured on {points} points: times, {calls:.3g} operator calls a {word}, {said}"
    how = "as points: auto takes it" if chosen else "by the shortest wave or contact spot"
    yield (
        f"estimated from these: the mesh {how}, the number of steps by the order of the integrator, "
        f"{CALLS_PER_DECADE:g} times the calls for a tenth of the tolerance, time in proportion to N log N"
    )


def _errors(sample: Sample, name: str, what: str) -> str:
    """Return what time steps and the mesh of a sample make wrong with friction or the area, empty if there is none."""
    time, mesh = (error_of(sample, name, source) for source in ("time", "mesh"))
    if time is None or mesh is None:
        return ""
    steps = f"time steps {per_cent(time)}, " if sample.job.history else ""
    unknown = name == "friction" and mesh >= 1.0
    return f"{what} ({steps}{'mesh unknown' if unknown else f'mesh {per_cent(mesh)}'})"
