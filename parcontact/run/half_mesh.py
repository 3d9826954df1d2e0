"""The run on half the mesh beside a run (`output.mesh_check`): what the mesh makes wrong, seen instead of estimated.

It has twice the cell along both directions, and the same waves, loads and numerics. Time steps that are given are the
same, as their error would else be taken for that of the mesh: with a quarter of the points, and steps of half a cell
instead of one, which take some more calls, it is about a third of the work. Where stages choose their steps, it may be
LOOSER times as wrong by them, in half as many steps, an eighth to a quarter of the work: time steps make friction too
small, and what they do to both runs is estimated, and taken back before these are compared.

It has a directory of its own below that of the run, in which it goes on after a stop like any run, and comes first:
then every row of the run can be compared with it at its instant.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..effects.adhesion import chosen_range
from ..history.chosen import SAME_TIME
from ..history.timeline import Timeline
from ..job import Job, Rough
from ..job.sections.listing import plain
from ..parallel.slab import Slab
from ..physics.budget import ErrorBudget, compared_with_half_mesh
from ..storage import tables
from ..storage.row import Row

DIRECTORY = "half_mesh"  # below that of the run
COLUMNS = ("time", "friction", "contact_area_corrected", "error_friction")
LOOSER, LOOSEST = 3.2, 0.05  # times the accuracy of the run, for steps twice as long; and at most, if that is less


def job_on_half_mesh(job: Job) -> Job:
    """Return the job of the run beside another one: no fields, no energies, nothing but its table."""
    data: dict[str, Any] = plain(job)
    data["grid"]["points"] = [max(n // 2, 1) for n in job.grid.points]
    data["output"] = {"directory": str(job.output.directory / DIRECTORY)}
    if (reach := chosen_range(job)) is not None:  # on coarser cells it would be longer
        data["adhesion"]["range"] = reach
    data["numerics"]["strict"] = False
    if Timeline.of(job).chooses:
        own = job.numerics.asked.of_steps
        data["numerics"] |= {"accuracy": min(LOOSER * own, max(LOOSEST, own)), **job.numerics.chosen}
    for stage in data["history"]:
        if "cells_per_step" in stage:
            stage["cells_per_step"] /= 2
    data["title"] = f"{job.title or job.path.stem}, on half the mesh"
    for section in ("steady", "study"):
        data.pop(section, None)
    return Job.model_validate(data).of(job.origin)


@dataclass(frozen=True)
class HalfMesh:
    """Results on half the mesh: friction and corrected contact area at increasing times [s].

    `waves`: whether the surface has a shortest wave; `errors`: by what share friction is wrong by the budget there, if
    its time steps are others than those of the run.
    """

    times: Sequence[float]
    friction: Sequence[float]
    area: Sequence[float]
    waves: bool
    errors: Sequence[float] = ()

    @classmethod
    def read(cls, job: Job, slab: Slab) -> "HalfMesh":
        """Read them from the table of that run; collective. Raises InputError where that cannot be read."""
        found = tables.read(job.output.directory / "measures.csv") if slab.root else {}
        times, friction, area, errors = slab.agree([found.get(name, []) for name in COLUMNS])
        waves = any(isinstance(shape, Rough) for shape in job.surface)
        return cls(times, friction, area, waves, errors if Timeline.of(job).chooses else ())

    def known_better(self, row: Row, timeline: Timeline) -> Row:
        """Return a row of the run with errors that are judged by this one."""
        return replace(row, errors=self.judge(row, place_of(timeline, row.step)))

    def judge(self, row: Row, place: int) -> ErrorBudget | None:
        """Return the error budget of a row of the run; it is the row number `place` of those at its time, from 0."""
        if row.errors is None:
            return None
        m = row.measures
        friction, area = (self._at(series, row.time, place) for series in (self.friction, self.area))
        error = self._at(self.errors, row.time, place) if self.errors else math.nan
        return compared_with_half_mesh(
            row.errors, (m.friction, m.contact_area_corrected), (friction, area), self.waves, error
        )

    def _at(self, series: Sequence[float], time: float, place: int) -> float:
        """Return a value at an instant: of the row there that stands for the same, or between two."""
        first = bisect_left(self.times, time * (1.0 - SAME_TIME))
        there = bisect_right(self.times, time * (1.0 + SAME_TIME)) - first
        if there > 0:
            index = first + min(place, there - 1)
            return series[index]
        return float(np.interp(time, self.times, series))


def place_of(timeline: Timeline, step: int) -> int:
    """Return how many rows have the time of a step before it; the initial state is one, at 0."""
    place = 0
    while place < step and _time(timeline, step - place - 1) == _time(timeline, step):
        place += 1
    return place


def _time(timeline: Timeline, step: int) -> float:
    return timeline[step].time if step else 0.0
