"""One scene: its run, its reference, and how far apart they are beside what the run said.

Errors are those of which the sentences of the budget speak: of friction and of the corrected area in the mean over the
distance slid, over time where nothing slides. A reference is read at the instants of the run. Friction of an elastic
body is 0. References are kept in a directory, and read again.
"""

import json
import math
import time
import warnings
from bisect import bisect_left, bisect_right
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import runs

from parcontact import scene
from parcontact.errors import InputError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.march.loop import March
from parcontact.parallel.slab import Slab
from parcontact.physics.budget import NAMES, Parts, weight_of
from parcontact.steady_sliding import curve
from parcontact.steady_sliding.sliding import SteadySliding

from .scenes import FINER, Json, Sketch, sketch

SHARPER = 10.0  # times the accuracy is asked of a reference
SAME_TIME = 1e-9
COLUMNS = {"friction": 3, "area": 4}  # of the rows of a series


@dataclass
class Series:
    """Results of a run: a row of time, place among the rows of that time, weight, friction and area for each
    instant; the weight is 0 where nothing touches. And how wrong it says that it is in the mean, by part, in absolute
    terms; `printed` is the relative error in all."""

    rows: list[list[float]]
    within: dict[str, dict[str, float]]
    steps: int
    seconds: float = 0.0

    def mean(self, column: int, other: "Series | None" = None) -> float:
        """The mean of a column with the weights of this series, of its own values or another's at its instants."""
        total = sum(row[2] for row in self.rows)
        of = self if other is None else other
        return sum(row[2] * of.at(column, row[0], int(row[1])) for row in self.rows) / total if total else math.nan

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
    with warnings.catch_warnings(action="ignore"):
        job = Job.model_validate(plain)
        found = _march(job) if job.history else _steady(job)
    found.seconds = time.process_time() - began
    return found


def _march(job: Job) -> Series:
    march = runs.begun(job)
    rows, before = list[list[float]](), march.row

    def note(now: March) -> None:
        nonlocal before
        row, timeline = now.row, now.timeline()
        far = weight_of(row.distance - before.distance, row.time - before.time)
        before = row
        friction = row.measures.friction if row.distance > 0.0 else 0.0
        weight = far if row.errors else 0.0
        rows.append([row.time, place_of(timeline, row.step), weight, friction, row.measures.contact_area_corrected])

    runs.marched(march, note)
    total = max(sum(row[2] for row in rows), 1e-300)
    means = [sum(row[2] * row[column] for row in rows) / total for column in COLUMNS.values()]
    return Series(rows, _within(march.state.errors, means), len(rows) - 1)


def place_of(timeline: Timeline, step: int) -> int:
    """Return how many rows before that of a step have its time; the initial state is one, at 0."""
    time, place = timeline[step].time if step else 0.0, 0
    while place < step and (timeline[step - place - 1].time if step > place + 1 else 0.0) == time:
        place += 1
    return place


def _within(errors: object, means: list[float]) -> dict[str, dict[str, float]]:
    """Absolute errors by part, and the relative one in all, as it is printed."""
    found = {}
    for name, mean in zip(COLUMNS, means, strict=True):
        parts: Parts | None = getattr(errors, name)
        if parts is not None:
            found[name] = {part: getattr(parts, part) * mean for part in NAMES} | {"printed": parts.total}
    return found


def _steady(job: Job) -> Series:
    wanted = curve.request(job)
    sliding = SteadySliding(scene.set_up(job, Slab.alone(*job.grid.points)))
    speed, pressure, _ = wanted.points[0]
    point = sliding.solve(wanted.velocity(speed), pressure)
    means = [point.friction, point.measures.contact_area_corrected]
    return Series([[0.0, 0.0, 1.0, *means]], _within(point.errors, means), 1)


def compare(number: int, references: Path) -> Json:
    """A line of the table: what the scene is, what its run says, and what is true."""
    made = sketch(number)
    line: Json = {"scene": number, **made.kind, "points": "x".join(map(str, made.plain["grid"]["points"]))}
    try:
        with TemporaryDirectory() as directory:
            own = run(made.job(Path(directory)))
            other = reference(made, Path(directory), references / f"{number}.json")
    except (RunError, InputError, ValueError) as error:
        return {**line, "failure": " ".join(str(error).split())[:300]}
    line |= {"steps": own.steps, "seconds": round(own.seconds, 3), "reference_seconds": round(other.seconds, 3)}
    for name, column in COLUMNS.items():
        if parts := own.within.get(name):
            mean, true = own.mean(column), own.mean(column, other)
            resolution = sum(other.within.get(name, {}).get(part, 0.0) for part in NAMES)
            if name == "friction" and made.kind["body"] == "elastic":
                true = resolution = 0.0
            estimate = sum(parts[part] for part in NAMES)
            found = {"true": true, "error": abs(mean - true), "estimate": estimate, "resolution": resolution, **parts}
            line |= {name: mean, **{f"{name}_{key}": value for key, value in found.items()}}
    return line


def reference(made: Sketch, directory: Path, kept: Path) -> Series:
    """The series on the finer grid, made now or kept before."""
    if kept.exists():
        return Series(**json.loads(kept.read_text()))
    found = run(made.job(directory, FINER, SHARPER))
    kept.parent.mkdir(parents=True, exist_ok=True)
    new = kept.with_suffix(".new")
    new.write_text(json.dumps(asdict(found)))
    new.replace(kept)
    return found
