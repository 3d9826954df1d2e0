"""One scene of `scripts/coverage.py`: its run, its reference, and how far apart they are beside what the run said.

Errors are those of which the sentences of the budget speak: of friction and of the corrected area in the mean over the
distance slid, over time where nothing slides, with the weights of `physics.budget.Summary`. A reference is read at the
instants of the run. Friction of an elastic body is 0. Series of references are kept in a directory, and read again.
"""

import json
import math
import time
import warnings
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from coverage_scenes import FINER, Json, Sketch, sketch
from mpi4py import MPI

from parcontact import job as jobs
from parcontact import scene
from parcontact.errors import InputError, RunError
from parcontact.march import loop
from parcontact.parallel.slab import Slab
from parcontact.physics.budget import NAMES, Parts
from parcontact.run.half_mesh import place_of
from parcontact.steady_sliding import curve, start
from parcontact.steady_sliding.sliding import SteadySliding
from parcontact.storage.row import Row

SHARPER = 10.0  # times the accuracy is asked of a reference
SAME_TIME = 1e-9
QUANTITIES = ("friction", "area")


@dataclass
class Series:
    """What a run has found: time, place among the rows of one time, weights and values of each row; and in the mean
    how wrong it says that it is, in absolute terms, by part."""

    rows: list[list[float]]  # time, place, weight, friction, area; the weight of friction is 0 before something slides
    within: dict[str, dict[str, float]]
    seconds: float
    steps: int

    def mean(self, column: int, other: "Series | None" = None) -> float:
        """Of friction (3) or area (4), with the weights of this one, of its own values or another's at its instants."""
        weights = [row[2] for row in self.rows]
        total = sum(weights)
        values = [row[column] if other is None else other.at(column, row[0], int(row[1])) for row in self.rows]
        return sum(w * v for w, v in zip(weights, values, strict=True)) / total if total else math.nan

    def at(self, column: int, instant: float, place: int) -> float:
        times = [row[0] for row in self.rows]
        first = bisect_left(times, instant * (1.0 - SAME_TIME))
        there = bisect_right(times, instant * (1.0 + SAME_TIME)) - first
        if there > 0:
            return self.rows[first + min(place, there - 1)][column]
        if not 0 < first < len(times):
            return self.rows[min(first, len(times) - 1)][column]
        share = (instant - times[first - 1]) / (times[first] - times[first - 1])
        return (1.0 - share) * self.rows[first - 1][column] + share * self.rows[first][column]


def run(plain: Json) -> Series:
    """March a job in this process, or solve its steady state."""
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        job = jobs.Job.model_validate(plain)
        found = _march(job) if job.history else _steady(job)
    found.seconds = time.process_time() - began
    return found


def _march(job: jobs.Job) -> Series:
    march = start.first(job, Slab(MPI.COMM_SELF, *job.grid.points))
    before, rows = march.row, []

    def note(now: Any) -> None:
        nonlocal before
        row: Row = now.row
        seconds, slid = row.time - before.time, row.distance - before.distance
        before = row
        m = row.measures
        far = slid or seconds * 1e-100 or 1e-200
        place = place_of(now.timeline(), row.step)
        friction = m.friction if row.distance > 0.0 else 0.0
        rows.append([row.time, place, far if row.errors else 0.0, friction, m.contact_area_corrected])

    loop.run(march, [note])
    friction, area = march.state.errors.friction, march.state.errors.area
    mean = [sum(row[2] * row[column] for row in rows) / max(sum(row[2] for row in rows), 1e-300) for column in (3, 4)]
    return Series(rows, _within((friction, area), mean), 0.0, len(rows) - 1)


def _within(budgets: tuple[Parts | None, Parts | None], means: list[float]) -> dict[str, dict[str, float]]:
    """Absolute errors by part, and the relative one in all, as it is printed."""
    found = {}
    for name, parts, mean in zip(QUANTITIES, budgets, means, strict=True):
        if parts is not None:
            found[name] = {part: getattr(parts, part) * mean for part in NAMES} | {"printed": parts.total}
    return found


def _steady(job: jobs.Job) -> Series:
    wanted = curve.request(job)
    sliding = SteadySliding(scene.set_up(job, Slab(MPI.COMM_SELF, *job.grid.points)))
    speed, pressure, _ = wanted.points[0]
    point = sliding.solve(wanted.velocity(speed), pressure)
    area = point.measures.contact_area_corrected
    within = _within((point.errors.friction, point.errors.area), [point.friction, area])
    return Series([[0.0, 0.0, 1.0, point.friction, area]], within, 0.0, 1)


def compare(number: int, references: Path) -> Json:
    """A line of the table: what the scene is, what its run says, and what is true."""
    made = sketch(number)
    line: Json = {"scene": number, **made.kind, "points": "x".join(map(str, made.plain["grid"]["points"]))}
    try:
        with TemporaryDirectory() as directory:
            own = run(made.job(Path(directory)))
            other = reference(made, Path(directory), references)
    except (RunError, InputError, ValueError) as error:
        return {**line, "failure": " ".join(str(error).split())[:300]}
    line |= {"steps": own.steps, "seconds": round(own.seconds, 3), "reference_seconds": round(other.seconds, 3)}
    for column, name in zip((3, 4), QUANTITIES, strict=True):
        line |= _judge(name, column, own, other, made.kind["body"] == "elastic")
    return line


def _judge(name: str, column: int, own: Series, other: Series, elastic: bool) -> Json:
    if name not in own.within:
        return {}
    parts = own.within[name]
    mean, true = own.mean(column), own.mean(column, other)
    resolution = sum(other.within.get(name, {}).get(part, 0.0) for part in NAMES)
    if name == "friction" and elastic:
        true = resolution = 0.0
    found = {
        "": mean,
        "true": true,
        "error": abs(mean - true),
        "estimate": sum(parts[part] for part in NAMES),
        "printed": parts["printed"],
        "resolution": resolution,
        **{part: parts[part] for part in NAMES},
    }
    return {f"{name}_{key}".rstrip("_"): value for key, value in found.items()}


def reference(made: Sketch, directory: Path, kept: Path) -> Series:
    """The series on the finer grid, made now or kept before."""
    path = kept / f"{made.number}.json"
    if path.exists():
        return Series(**json.loads(path.read_text()))
    found = run(made.job(directory, FINER, SHARPER))
    kept.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"rows": found.rows, "within": found.within, "seconds": found.seconds, "steps": found.steps})
    new = path.with_suffix(".new")
    new.write_text(text)
    new.replace(path)
    return found
