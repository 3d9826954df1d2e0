"""What one case of a study gives and costs: friction, area, seconds, transforms."""

import math
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

from .. import scene
from ..job import Job
from ..march import loop
from ..march.step import March
from ..parallel.slab import Slab
from ..parallel.tally import Tally
from ..steady_sliding import start
from ..storage.row import Row

FIRST_STEPS = 2
LAST_SHARE = 0.25  # of the last stage that slides (or lasts): its mean is taken for what has settled


@dataclass(frozen=True)
class Outcome:
    """Of one run: the largest friction, its mean and those of the contact area over the last quarter of the last stage
    that slides, and what it cost on all ranks.

    `transform_work` is the number of transforms times `N log2 N` of their N points, which no machine changes.
    """

    mu_max: float
    mu_dyn: float
    area: float
    area_corrected: float
    steps: int
    operator_calls: int
    transform_work: float
    cpu_seconds: float


QUANTITIES = ("mu_max", "mu_dyn", "area", "area_corrected")
NAMES = tuple(field.name for field in fields(Outcome))


def warm_up(job: Job, slab: Slab) -> None:
    """Make the first steps of a job, so that no case pays for compiled loops and transform plans; collective."""
    loop.run(March(scene.build(job, slab)), [lambda state: state.row.step >= FIRST_STEPS])


def run(job: Job, slab: Slab, stopped: Callable[[], bool]) -> Outcome | None:
    """March through a job, writing nothing; None if `stopped` says so after a step; collective."""
    marching = start.first(job, slab)
    rows: list[Row] = []

    def note(state: March) -> bool:
        rows.append(state.row)
        return slab.reduce((), [float(stopped())])[0] > 0.0

    began, tally = time.process_time(), slab.tally.copy()
    if loop.run(marching, [note]):
        return None
    counted = Tally(slab.tally.since(tally))
    seconds = slab.sum(time.process_time() - began)[0]
    return Outcome(*settled(job, rows), len(rows) - 1, counted["operator"], transform_work(counted), seconds)


def settled(job: Job, rows: Sequence[Row]) -> tuple[float, float, float, float]:
    """mu_max, mu_dyn, area and corrected area of a run, from its rows."""
    end = rows[-1].time
    lasting = [stage for stage in job.history if stage.seconds > 0.0]
    sliding = [stage for stage in lasting if stage.speed > 0.0]
    last = (sliding or lasting or job.history)[-1]
    for stage in reversed(job.history):  # what comes after the last stage that slides does not count
        if stage is last:
            break
        end -= stage.seconds
    start = end - LAST_SHARE * last.seconds
    inside = [(row, row.time - before.time) for before, row in pairwise(rows) if start <= row.time]
    inside = [(row, dt) for row, dt in inside if row.time <= end * (1.0 + 1e-9)] or [(rows[-1], 1.0)]
    weights = [dt or 1e-300 for _, dt in inside]

    def mean(name: str) -> float:
        values = [getattr(row.measures, name) for row, _ in inside]
        return math.fsum(w * v for w, v in zip(weights, values, strict=True)) / math.fsum(weights)

    largest = max(row.measures.friction for row in rows)
    return largest, mean("friction"), mean("contact_area"), mean("contact_area_corrected")


def transform_work(counted: Tally) -> float:
    """Transforms times `N log2 N`, from counts like `fft 2048x2048 float64`."""
    total = 0.0
    for name, count in counted.items():
        if match := re.match(r"fft (\d+)x(\d+) ", name):
            points = int(match[1]) * int(match[2])
            total += count * points * math.log2(max(points, 2))
    return total
