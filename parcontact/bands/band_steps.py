"""Time steps of one band: each stage of a job becomes stages whose steps follow the cell and the waves of the band.

After a change of velocity the steps of a slide grow from a small part of a cell to half a cell. Then each has exactly
half a cell, so that solves start from the pressures of the step before the last, moved by a cell (`march.laws`).
After a slip of SETTLED longest waves a band slides steadily, and makes no steps until the next stage: fine bands
settle within micrometres. So a band's own history is shorter than the job's, and a step is placed by the number of
the job's stage and by the time since this stage began.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..effects.branches import relaxation_of
from ..job import Grid, Job
from ..job.history import Step, Timeline
from ..job.stages import GeometricStep, Stage

FIRST, GROWTH, LONGEST = 0.02, 1.35, 0.5  # accuracy: cells of the first step of a slide, growth, cells of the longest
SETTLED = 1.5  # accuracy: slip of a stage over the longest wave of a band, after which the band is steady
OF_REST, GROWTH_OF_REST = 1e-6, 2.0  # accuracy: first step of a rest over its duration, and growth
ROUNDING = 1e-9  # rounding: of a number of steps
BEFORE = -1.0  # time since the start of a steady state before all steps
OF_FASTEST = 0.1  # accuracy: the same over the shortest relaxation time, if that is longer


class Place(NamedTuple):
    """An instant of a job's history: the number of the stage, and the time since the stage began [s]."""

    stage: int
    elapsed: float


def parts_of_history(job: Job, grid: Grid, longest: float) -> list[tuple[Stage, int]]:
    """Return the stages of a band with this grid and `longest` wave [m], each with the number of its stage in the
    job."""
    found = list[tuple[Stage, int]]()
    for number, stage in enumerate(job.history):
        found += [(part, number) for part in _parts(job, stage, grid.dx, longest)]
    return found


def _parts(job: Job, stage: Stage, cell: float, longest: float) -> Iterator[Stage]:
    if stage.seconds == 0.0:
        yield stage
    elif not stage.speed:
        yield _timed(stage, stage.seconds, rest_step(job, stage), GROWTH_OF_REST)
    else:
        most, first = LONGEST * cell, FIRST * cell
        way = min(stage.seconds * stage.speed, SETTLED * longest)
        growing = min(way, (most - first) / (1.0 - 1.0 / GROWTH))  # steps from `first` to `most`
        steady = math.ceil((way - growing) / most - ROUNDING) * most
        yield _timed(stage, (way - steady) / stage.speed, first / stage.speed, GROWTH)
        if steady:
            yield _timed(stage, steady / stage.speed, most / stage.speed, 1.0)


def rest_step(job: Job, stage: Stage) -> float:
    """Return the length [s] of the first step of a stage at rest."""
    times = relaxation_of(job.material)[2]
    return min(max(OF_REST * stage.seconds, OF_FASTEST * float(min(times, default=0.0))), stage.seconds / 4.0)


def _timed(stage: Stage, seconds: float, first: float, growth: float) -> Stage:
    """Return a stage of this duration [s] with steps that grow from the `first` one [s]."""
    steps = GeometricStep(first=first, growth=growth)
    return stage.model_copy(update={"duration": seconds, "distance": None, "time_step": steps, "cells_per_step": None})


class BandClock:
    """Finds the place of a band's steps in the job's history; `parts` is the result of `parts_of_history`."""

    def __init__(self, job: Job, parts: list[tuple[Stage, int]]) -> None:
        timeline = Timeline(job.history, job.grid, pressure=job.initial.pressure)
        self._owners = [number for _, number in parts]
        self._slides = {number for stage, number in parts if stage.speed}
        self._starts = dict[int, float]()
        for span, number in zip(timeline.spans, self._owners, strict=True):
            self._starts.setdefault(number, span.start)
        begins = [Place(0, BEFORE)] if job.initial.state == "steady" else []  # before all steps
        self.places = [*begins, *map(self.place, timeline)]

    def place(self, step: Step) -> Place:
        """Return the place of a step of the band in the history of the job."""
        number = self._owners[step.stage]
        return Place(number, step.time - self._starts[number])

    def between(self, at: Place) -> tuple[int, int, float]:
        """Return the numbers of the steps before and after a place, and the share of the step after.

        Results vary linearly with the slip of a slide, and with the logarithm of the time of a rest. Beyond the last
        step of a stage results are constant; before the first step they are the last results of the stage before.
        """
        own = [index for index, place in enumerate(self.places) if place.stage == at.stage]
        after = next((index for index in own if self.places[index].elapsed >= at.elapsed), own[-1])
        before = max(after - 1, 0)
        begin = max(self.places[before].elapsed, 0.0) if before in own else 0.0
        end = self.places[after].elapsed
        if at.elapsed >= end or end <= begin:
            return after, after, 0.0
        if at.stage in self._slides or begin <= 0.0:
            return before, after, (at.elapsed - begin) / (end - begin)
        return before, after, float(np.log(at.elapsed / begin) / np.log(end / begin))
