"""Stages that choose their own time steps: bounds, chosen steps, and an estimate of the steps to come.

The next step is decided after the one before has been made (`accuracy.controller`). Chosen steps are stored, so that
steps have numbers and a run can restart. Steps to come are estimated as a ladder: they double from the shortest to
the longest that is allowed and then stay constant.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, NamedTuple, Protocol

from ..job.checks.cells import one_cell
from ..job.sections.calculation import Grid, Numerics
from ..job.sections.geometry import Flat, Indenter, Rough, Wave
from ..job.sections.oscillation import PARTS_OF_CYCLE
from ..job.sections.stages import Initial, Stage

SAME_TIME = 1e-9  # accuracy: relative deviation of a duration from a whole number of steps that is ignored
HALVINGS = 10  # tuning: halvings of a cell in the shortest step of a slide
LEAST_SHARE = 2.0**-20  # tuning: shortest step of a stage over its duration
MOST_CELLS = 4  # tuning: largest number of cells slid in a step
WAVE_STEPS = 4  # accuracy: least number of steps in which the shortest wave passes
RAMP_STEPS = 16  # accuracy: least number of steps while a load changes
CYCLE_STEPS = 32  # accuracy: least number of steps in a cycle of an oscillation


def reached(time: float, until: float) -> bool:
    """Return whether a time equals the requested one or is later."""
    return time >= until * (1.0 - SAME_TIME)


class Planned(Protocol):
    """Sections of a job that determine its steps, and whether its body has a memory."""

    grid: Grid
    surface: tuple[Any, ...]
    history: tuple[Stage, ...]
    numerics: Numerics
    initial: Initial

    @property
    def remembers(self) -> bool: ...


@dataclass(frozen=True)
class Bounds:
    """Shortest and longest step of a stage that chooses its own [s]."""

    least: float
    most: float


def most_cells(job: Planned) -> int:
    """Return the largest number of cells slid in a step: the largest power of two up to a quarter of the shortest wave.
    It is one cell if a quarter wave is shorter, or if a file may have any wave."""
    grid, waves = job.grid, [2.0 * MOST_CELLS * WAVE_STEPS]
    cells = [one_cell(stage, grid) * stage.speed for stage in job.history if stage.speed]
    for shape in job.surface:
        if isinstance(shape, Wave):
            waves += [n / abs(count) for n, count in zip(grid.points, shape.waves, strict=True) if count]
        elif isinstance(shape, Rough):
            waves.append(shape.short_wavelength / max(cells, default=max(grid.dx, grid.dy)))
        elif not isinstance(shape, Indenter | Flat):
            return 1
    return int(min(MOST_CELLS, 2 ** max(0, math.floor(math.log2(min(waves) / WAVE_STEPS * (1.0 + SAME_TIME))))))


def longest_change(stage: Stage) -> float:
    """Return the longest step [s] that follows the load, or the phase of an oscillation."""
    if stage.frequency:
        return 1.0 / (CYCLE_STEPS * stage.frequency)
    return stage.seconds if stage.constant else stage.seconds / RAMP_STEPS


def bounds(stage: Stage, grid: Grid, cells: int = 1) -> Bounds:
    """Return the bounds of steps that slide by at most `cells`; at rest the longest is the whole stage."""
    most = longest_change(stage)
    if not stage.speed:
        return Bounds(min(LEAST_SHARE * stage.seconds, most), most)
    cell = one_cell(stage, grid)
    most = min(cells * cell, most)
    halvings = max(HALVINGS, math.ceil(math.log2(cell / (LEAST_SHARE * stage.seconds))))
    return Bounds(min(cell / 2.0**halvings, most), most)


@dataclass(frozen=True)
class StepLadder:
    """Steps that double from `first` to `most` [s] and then stay constant, for `seconds`."""

    first: float
    most: float
    seconds: float

    @property
    def doublings(self) -> int:
        return max(0, math.ceil(math.log2(self.most / self.first) * (1.0 - SAME_TIME)))

    @property
    def count(self) -> int:
        if self.seconds <= 0.0:
            return 0
        top = self.first * 2.0**self.doublings
        if self.seconds <= top:
            return 1 + max(0, math.ceil(math.log2(self.seconds / self.first) * (1.0 - SAME_TIME)))
        return self.doublings + math.ceil(self.seconds / top * (1.0 - SAME_TIME))

    def end(self, index: int) -> float:
        """Return the end of step `index`, counted from 1 [s]; 0 is the start."""
        if index <= 0:
            return 0.0
        doubled = min(index - 1, self.doublings)
        return min(self.first * 2.0**doubled * (1 + max(0, index - 1 - self.doublings)), self.seconds)


@dataclass(frozen=True)
class ChosenEnds:
    """Ends of the steps of a stage: those that were `made` [s after its start], followed by a ladder.

    The stage ends at the first of `stops` [s]; a later one is the end of a longer run. Steps also end with each `part`
    of a cycle [s], if that is not 0.
    """

    made: Sequence[float]
    stops: tuple[float, ...]
    ladder: StepLadder
    limits: Bounds
    part: float = 0.0

    def next_stop(self, now: float) -> float:
        """Return the first instant after `now` at which a step has to end [s]."""
        stop = next(stop for stop in self.stops if not reached(now, stop))
        if not self.part:
            return stop
        part = (math.floor(now / self.part * (1.0 + SAME_TIME)) + 1) * self.part
        return stop if reached(part, stop) else part

    @property
    def count(self) -> int:
        return len(self.made) + self.ladder.count

    def elapsed(self, index: int) -> float:
        """Return the end of the step [s after the start of the stage]."""
        if index <= len(self.made):
            return self.made[index - 1] if index > 0 else 0.0
        now = self.made[-1] if self.made else 0.0
        return self.stops[-1] if index >= self.count else now + self.ladder.end(index - len(self.made))

    def interval(self, index: int, since: int | None = None) -> float:
        """Return the length of the step [s], or of all steps since another one."""
        return self.elapsed(index) - self.elapsed(index - 1 if since is None else since)

    def __getitem__(self, index: int) -> float:
        """Return the end of step `index` as a fraction of the stage."""
        return self.elapsed(index) / self.stops[0]


class MadeStep(NamedTuple):
    """An accepted step that a stage has chosen: its stage, its end [s after the start of the stage], and the length of
    the next one [s]."""

    stage: int
    end: float
    next: float


@dataclass
class ChosenSteps:
    """The steps that the stages of a history have chosen so far: their `ends` [s after the start of the stage] by the
    number of the stage, and the length of the `next` one [s], 0 if undecided. None slides by more than `cells`."""

    cells: int = 1
    ends: dict[int, list[float]] = field(default_factory=dict)
    next: float = 0.0

    @classmethod
    def from_job(cls, job: Planned, saved: Mapping[str, Any] | None = None) -> "ChosenSteps":
        """Return the steps of a job, with those chosen when a checkpoint with the arrays `saved` was written."""
        found = cls(most_cells(job))
        if saved is not None and "ends" in saved:
            ends = iter(saved["ends"].tolist())
            for stage, count in zip(saved["stages"], saved["counts"], strict=True):
                found.ends[int(stage)] = list(islice(ends, int(count)))
            found.next = float(saved["next"])
        return found

    def add(self, step: "MadeStep") -> None:
        """Add a step that has been made."""
        self.ends.setdefault(step.stage, []).append(step.end)
        self.next = step.next

    @property
    def count(self) -> int:
        return sum(map(len, self.ends.values()))

    def of_stage(self, index: int, stage: Stage, grid: Grid, until: float = 0.0) -> ChosenEnds:
        """Return the steps of a stage that may continue to `until` [s after its start]."""
        made, limits = self.ends.get(index, []), bounds(stage, grid, self.cells)
        stops = (stage.seconds, *([until] if not reached(stage.seconds, until) else []))
        now = made[-1] if made else 0.0
        left = 0.0 if reached(now, stops[-1]) else stops[-1] - now
        first = min(self.next if made and self.next else limits.least, limits.most)
        longest = min(limits.most, one_cell(stage, grid)) if stage.speed else limits.most
        part = 1.0 / (PARTS_OF_CYCLE * stage.frequency) if stage.frequency else 0.0
        return ChosenEnds(made, stops, StepLadder(first, max(first, longest), left), limits, part)

    def numbers(self) -> dict[str, tuple[list[float] | float, str]]:
        """Return all data with units, by their names in checkpoints."""
        stages = sorted(self.ends)
        return {
            "stages": ([float(stage) for stage in stages], "1"),
            "counts": ([float(len(self.ends[stage])) for stage in stages], "1"),
            "ends": ([end for stage in stages for end in self.ends[stage]], "s"),
            "next": (self.next, "s"),
        }


def describe_steps(job: Planned) -> str:
    """Return a text on the stages that choose their own time steps, with the reason; '' if there are none."""
    names = ", ".join(stage.name for stage in job.history if stage.chooses)
    if not names:
        return ""
    if not job.remembers:
        return f"{names}, one cell of sliding per step and one step at rest, as an elastic body has no error of time"
    cells = most_cells(job)
    slides = any(stage.chooses and stage.speed for stage in job.history)
    turns = any(stage.chooses and stage.frequency for stage in job.history)
    limits = f", at most {cells} cell{'s' * (cells > 1)} of sliding" * slides
    limits += f", at least {CYCLE_STEPS} in a cycle" * turns
    return f"{names}, by their estimated error, for numerics.accuracy {job.numerics.asked.of_steps:g}{limits}"
