"""A job tried out: some of its steps are made in memory, the rest are taken to be like them.

Every stage is looked at in blocks, evenly spaced: one long step up to the block, one step to settle, and then two whose
cost is taken for all steps of the block's part of the stage. The jump of a stage, and every step of a history that is
short enough, is made as it is.
"""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

from .. import scene, steadystart
from ..clock import Step
from ..effects import decisions as calls_for
from ..job import Job
from ..march import March
from ..parallel.slab import Slab, deal

BLOCK = 3  # steps of a block, of which the first settles
CALLS = 12  # operator calls expected of a step that starts from the one before
LONG = 2  # steps that a long step costs
FIRST = 2  # steps that are always made
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
    """What was seen of a job on some ranks: how long its scene took to make [s], and its stages."""

    job: Job
    ranks: int
    building: float
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
        counts = Counter(step.stage for step in calls_for.timeline(job))
        stages = tuple(replace(stage, steps=counts[index]) for index, stage in enumerate(self.stages))
        return replace(self, stages=stages)


def sample(job: Job, slab: Slab, seconds: float) -> Sample:
    """Try a job for about so long; collective. Raises InputError for files that do not fit."""
    began = time.perf_counter()
    numerics = job.numerics.model_copy(update={"accept_unconverged": True})  # a long step may start from far away
    march = March(scene.build(job.model_copy(update={"numerics": numerics}), slab))
    if calls_for.steady_start(job).on:
        steadystart.begin(march)
    building = time.perf_counter() - began
    return Sample(job, slab.comm.size, building, tuple(_try(march, tuple(calls_for.timeline(job)), seconds)))


def _try(march: March, timeline: Sequence[Step], seconds: float) -> list[Stage]:
    """The first steps tell how many can be afforded; root's clock decides for all ranks."""
    slab, began = march.scene.slab, time.perf_counter()
    groups = [list(group) for _, group in groupby(timeline, key=lambda step: step.stage)]
    stages = [Stage(len(group)) for group in groups]
    per_call = float("inf")
    for step in groups[0][:FIRST]:
        cost = _made(march, step)
        stages[0].add(1.0, cost)
        per_call = min(per_call, cost["seconds"] / max(cost["operator"], 1.0))
    del groups[0][:FIRST]
    left = max(seconds - (time.perf_counter() - began), 0.0)
    affordable = slab.agree(left / (CALLS * per_call)) / max(sum(map(len, groups)), 1)
    for stage, group in zip(stages, groups, strict=True):
        for step, weight in chosen(group, affordable):
            if slab.agree(time.perf_counter() - began > LATE * seconds):
                return stages
            cost = _made(march, step)
            if weight:
                stage.add(weight, cost)
    return stages


def _made(march: March, step: Step) -> dict[str, float]:
    """Make a step; what it cost."""
    tally, began = march.scene.slab.tally, time.perf_counter()
    before = tally.copy()
    march.advance(step)
    counts = {"operator": 0, **tally.since(before)}
    return {**counts, "seconds": time.perf_counter() - began}


def chosen(steps: Sequence[Step], share: float) -> Iterator[tuple[Step, float]]:
    """The steps to make in place of those of a stage, and for how many each stands; about a `share` of them."""
    jumps = [step for step in steps if step.jump]
    lasting = [step for step in steps if not step.jump]
    yield from ((step, 1.0) for step in jumps)
    count = max(1, int(share * len(lasting) / (BLOCK + LONG)))
    if count * (BLOCK + LONG) >= len(lasting):
        yield from ((step, 1.0) for step in lasting)
        return
    done = 0
    for part in deal(len(lasting), count):
        first = part.start + (part.stop - part.start - BLOCK) // 2
        yield _leap(lasting, done, first), 0.0
        yield lasting[first], 0.0
        done = first + BLOCK
        yield from ((step, (part.stop - part.start) / (BLOCK - 1)) for step in lasting[first + 1 : done])
    if done < len(lasting):
        yield _leap(lasting, done, len(lasting)), 0.0


def _leap(steps: Sequence[Step], first: int, stop: int) -> Step:
    """Some steps in one."""
    start = steps[first].time - steps[first].dt
    return steps[stop - 1]._replace(dt=steps[stop - 1].time - start, growth=0.0)
