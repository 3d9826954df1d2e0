"""Price of accuracy: mesh, steps, memory and time of a job at other accuracies, from the errors in a trial.

Errors fall with the orders of their fits (`accuracy.constants`) until each is its share (`accuracy.shares`). Meshes of
surfaces with a shortest wave are chosen as by `points: auto`.
"""

import math
from collections.abc import Iterator

from ..accuracy.constants import AREA, VIEWS
from ..accuracy.shares import FRICTION
from ..accuracy.time_error import order_of_time_error
from ..errors import InputError
from ..history.timeline import Timeline
from ..job import Job, OnOneMesh
from ..job.checks.cells import fast_length
from ..mesh import points_for
from ..printed import per_cent
from .costs import Costs
from .printed_plan import duration_text, unit_of
from .sample import Sample

ACCURACIES = (0.05, 0.01, 3e-3, 1e-3)
CHOSEN = 2.1  # accuracy: error of chosen steps over their share: 0.8 of the allowed error (TIME_MEDIAN)
CALLS = 0.18  # tuning: power of 1/accuracy with which calls grow: 1.4 to 1.7 times for a tenth in eight scenes
MOST = 16.0  # tuning: largest factor between the mesh or steps and the trial, either way


def error_of(sample: Sample, name: str, source: str) -> float:
    """Return the error of friction or area by the `mesh` or `time` steps of a trial, 0 if unknown."""
    weight = sample.total(f"{name} weight")
    return sample.total(f"{name} {source} error") / weight if weight else 0.0


def refine(sample: Sample, source: str, share: float, *orders: float) -> float:
    """Return the factor by which `mesh` or `time` steps must be finer than in the trial for an error `share` of
    friction, or of the area if friction is unknown. `orders` are the orders of convergence of friction and area."""
    for name, order in zip(("friction", "area"), orders, strict=True):
        if 0.0 < (error := error_of(sample, name, source)) < 1.0:
            return min(max((error / share) ** (1.0 / order), 1.0 / MOST), MOST)
    return 1.0 / MOST


def points_at(costs: Costs, whole: Job, accuracy: float) -> tuple[int, int]:
    """Return the points along x and y at an accuracy, from the costs of the `whole` job or of a part of it."""
    try:
        return points_for(whole, accuracy)
    except InputError:  # the surface has one mesh, or no shortest wave
        if any(isinstance(shape, OnOneMesh) for shape in whole.surface):
            return costs.job.grid.points
    finer = refine(costs.sample, "mesh", FRICTION.mesh * accuracy, VIEWS.order, AREA.order)
    nx, ny = (fast_length(n * finer) if n > 1 else n for n in costs.sample.job.grid.points)
    return nx, ny


def steps_at(costs: Costs, accuracy: float, points: tuple[int, int]) -> int:
    """Return the number of steps at an accuracy. If the job gives its steps, they are at most as many cells long."""
    job, sample = costs.job, costs.sample
    if not any(stage.seconds for stage in job.history):  # single solves, or steady states
        return sample.steps
    chosen, order = any(stage.chooses for stage in job.history), order_of_time_error(job.numerics.integrator, True)
    finer = refine(sample, "time", FRICTION.time * accuracy * (CHOSEN if chosen else 1.0), order, order)
    least = 0.0 if chosen else sample.steps * max(points) / max(job.grid.points)
    return math.ceil(max(Timeline.from_job(sample.job).count * finer, least))


def table(costs: Costs, whole: Job) -> Iterator[str]:
    """Yield mesh, steps, memory of maps and time of a job, and of each accuracy, on the ranks of the trial."""
    own, sample = costs.job.numerics.asked.of_steps, costs.sample
    rows = [("this job", own, costs.job.grid.points, sample.steps)]
    for accuracy in ACCURACIES:
        points = points_at(costs, whole, accuracy)
        rows.append((per_cent(accuracy), accuracy, points, steps_at(costs, accuracy, points)))
    unit, size = unit_of(costs.held)
    word = "steps" if costs.job.history else "states"
    yield f"{'accuracy':11}{'mesh':>14}{word:>9}{f'maps [{unit}]':>11} {'time':>11}"
    for name, accuracy, (nx, ny), steps in rows:
        there = costs.on_mesh(nx, ny)
        seconds = sample.starting + there.building + there.step * steps * (own / accuracy) ** CALLS
        yield f"{name:11}{f'{nx} x {ny}':>14}{steps:9d}{there.held / size:11.4g} {duration_text(seconds):>11}"
    errors = [
        f"{name} {per_cent(error)} by {source}"
        for name in ("friction", "area")
        for source in ("mesh", "time")
        if (error := error_of(sample, name, source))
    ]
    yield f"from the errors of the trial: {', '.join(errors) or 'unknown'}"
