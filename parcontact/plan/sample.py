"""A job tried out: some of its steps are made in memory, the rest are taken to be like them.

Every stage is looked at in blocks, evenly spaced: one long step up to the block, some to settle after it, and then
some whose cost is taken for all steps of the block's part of the stage. The jump of a stage, and every step of a
history that is short enough, is made as it is.
"""

import resource
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

from .. import scene
from ..effects import decisions
from ..job import Job
from ..job.timeline import Step, Timeline
from ..march.rest import steps_to_make
from ..march.step import March
from ..parallel.slab import Slab, deal
from ..steady_sliding import start as steadystart

SETTLING = 4  # steps after a long one until solves take as many iterations as ever
BLOCK = 8  # steps of a block, these among them
CALLS = 12  # operator calls expected of a step that starts from the one before
LONG = 4  # steps that a long step costs, with what settling costs more
FIRST = 2  # steps that are always made
KILO = 1024  # bytes in what the system counts resident memory in
LATE = 2.0  # times the time given: then no more steps are made


@dataclass
class Stage:
    """What the steps of a stage cost: their number, how many were tried, sums over all that those stand for."""

    steps: int
    tried: int = 0
    weight: float = 0.0
    sums: dict[str, float] = field(default_factory=dict)

    def add(self, weight: float, cost: dict[str, float]) -> None:
        self.tried += 1
        self.weight += weight
        for name, value in cost.items():
            self.sums[name] = self.sums.get(name, 0.0) + weight * value


@dataclass(frozen=True)
class Sample:
    """What was seen of a job on some ranks: its stages, and how long all of it took [s].

    `starting` the program, `building` the scene; `resident` is the memory of root that is not in maps [bytes].
    """

    job: Job
    ranks: int
    starting: float
    building: float
    took: float
    resident: int
    stages: tuple[Stage, ...]

    @property
    def steps(self) -> int:
        return sum(stage.steps for stage in self.stages)

    @property
    def tried(self) -> int:
        return sum(stage.tried for stage in self.stages)

    def total(self, name: str) -> float:
        """Of all steps: `seconds`, or a count by its name in the tally. A stage not tried is like the others."""
        weight = sum(stage.weight for stage in self.stages)
        mean = sum(stage.sums.get(name, 0.0) for stage in self.stages) / max(weight, 1.0)
        return sum(
            stage.steps * (stage.sums.get(name, 0.0) / stage.weight if stage.weight else mean) for stage in self.stages
        )

    def of(self, job: Job) -> "Sample":
        """What this says of the same job on another grid: its number of steps may be another one in each stage."""
        if job.grid == self.job.grid:
            return self
        spans = job.timeline().spans
        stages = (replace(stage, steps=span.jumps + span.count) for stage, span in zip(self.stages, spans, strict=True))
        return replace(self, stages=tuple(stages))


def sample(job: Job, slab: Slab, seconds: float, starting: float = 0.0) -> Sample:
    """Try a job for about so long; `starting` [s] has passed before. Collective.

    Raises InputError for files that do not fit.
    """
    began = time.perf_counter()
    numerics = job.numerics.model_copy(update={"accept_unconverged": True})  # a long step may start from far away
    march = March(scene.build(job.model_copy(update={"numerics": numerics}), slab))
    if decisions.steady_start(job).on:
        steadystart.begin(march)
    building = time.perf_counter() - began
    stages = tuple(_try(march, job.timeline(), seconds))
    took = time.perf_counter() - began
    resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILO - slab.tally["map bytes at most"]
    return Sample(job, slab.comm.size, starting, building, took, slab.agree(resident), stages)


def _try(march: March, timeline: Timeline, seconds: float) -> list[Stage]:
    """The first steps tell how many can be afforded; root's clock decides for all ranks."""
    slab, began = march.scene.slab, time.perf_counter()
    stages = [Stage(span.jumps + span.count) for span in timeline.spans]
    per_call = float("inf")
    as_run = steps_to_make(march, timeline)
    for step in islice(as_run, FIRST):
        cost = _as_run(march, step, stages)
        per_call = min(per_call, cost["seconds"] / max(cost["operator"], 1.0))
    left = max(seconds - (time.perf_counter() - began), 0.0)
    affordable = slab.agree(left / (CALLS * per_call)) / len(timeline)
    if affordable >= 1.0:
        for step in as_run:
            if slab.agree(_late(began, seconds, stages)):
                break
            _as_run(march, step, stages)
        return stages
    for span, stage in zip(timeline.spans, stages, strict=True):
        for step, weight in chosen(timeline, range(max(span.before, march.row.step) + 1, span.last + 1), affordable):
            if slab.agree(_late(began, seconds, stages)):
                return stages
            cost = _made(march, step)
            if weight:
                stage.add(weight, cost)
    return stages


def _late(began: float, seconds: float, stages: list[Stage]) -> bool:
    """Whether to stop, but not before there is more than the first steps, which start from nothing."""
    return time.perf_counter() - began > LATE * seconds and sum(stage.tried for stage in stages) > FIRST


def _as_run(march: March, step: Step, stages: list[Stage]) -> dict[str, float]:
    """Make a step of the run, which stands for itself, and for others that the run does not make."""
    cost = _made(march, step)
    stages[step.stage].steps -= step.passed
    stages[step.stage].add(1.0, cost)
    return cost


def _made(march: March, step: Step) -> dict[str, float]:
    """Make a step; what it cost."""
    tally, began = march.scene.slab.tally, time.perf_counter()
    before = tally.copy()
    march.advance(step)
    counts = {"operator": 0, **tally.since(before)}
    return {**counts, "seconds": time.perf_counter() - began}


def chosen(timeline: Timeline, numbers: range, share: float) -> Iterator[tuple[Step, float]]:
    """The steps to make in place of those of a stage, and for how many each stands; about a `share` of them."""
    if numbers and timeline[numbers[0]].jump:
        yield timeline[numbers[0]], 1.0
        numbers = numbers[1:]
    count = max(1, int(share * len(numbers) / (BLOCK + LONG)))
    if count * (BLOCK + LONG) >= len(numbers):
        yield from ((timeline[number], 1.0) for number in numbers)
        return
    done = 0
    for part in deal(len(numbers), count):
        first = part.start + (part.stop - part.start - BLOCK) // 2
        yield _leap(timeline, numbers[done:first]), 0.0
        settled, done = first + SETTLING, first + BLOCK
        yield from ((timeline[number], 0.0) for number in numbers[first:settled])
        weight = (part.stop - part.start) / (BLOCK - SETTLING)
        yield from ((timeline[number], weight) for number in numbers[settled:done])
    if numbers[done:]:
        yield _leap(timeline, numbers[done:]), 0.0


def _leap(timeline: Timeline, numbers: range) -> Step:
    """Some steps in one."""
    first, last = timeline[numbers[0]], timeline[numbers[-1]]
    return last._replace(dt=last.time - (first.time - first.dt), growth=0.0)
