"""A job tried out: some of its steps are made in memory, the rest are taken to be like them.

Every stage is looked at in blocks, evenly spaced: one long step up to the block, some to settle after it, and then
some whose cost is taken for all steps of the block's part of the stage. The jump of a stage, and every step of a
history that is short enough, is made as it is.
"""

import resource
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import TypeVar

from .. import scene
from ..errors import InputError, RunError
from ..history.timeline import Step, Timeline
from ..job import Job
from ..march.loop import March
from ..parallel.slab import Slab, deal
from ..physics.budget import ErrorBudget, weight_of
from ..steady_sliding import start
from ..steady_sliding.curve import request
from ..steady_sliding.sliding import Point, SteadySliding
from .trial import make_tiny

T = TypeVar("T")
SETTLING = 4  # steps after a long one until solves take as many iterations as ever
BLOCK = 8  # steps of a block, these among them
CALLS = 12  # operator calls expected of a step that starts from the one before
LONG = 4  # steps that a long step costs, with what settling costs more
FIRST = 2  # steps that are always made
KILO = 1024  # bytes in what the system counts resident memory in
UNDISTURBED = 0.9  # of the time a rank has a core, where nothing else is at work
LATE = 2.0  # times the time given: then no more steps are made


@dataclass
class StageCost:
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

    `starting` the program, `building` the scene; `resident` is the memory of root that is not in maps, `held` that in
    maps at most [bytes]. `share` is how much of its time a rank had a core, at least: less than all of it where other
    programs are at work. Where the job has no history, its steady states stand in place of steps.
    """

    job: Job
    ranks: int
    starting: float
    building: float
    took: float
    resident: int
    stages: tuple[StageCost, ...]
    held: int = 0
    share: float = 1.0

    @property
    def disturbed(self) -> bool:
        """Whether other programs have taken so much of the machine that times say little."""
        return self.share < UNDISTURBED

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


def sample(job: Job, slab: Slab, seconds: float, starting: float = 0.0) -> Sample:
    """Try a job for about so long; `starting` [s] has passed before. Collective.

    Raises InputError for files that do not fit.
    """
    _warm_up(job, slab)
    began, worked = time.perf_counter(), time.process_time()
    if job.history:
        building, stages = _march(job, slab, seconds)
    else:
        building, stages = _slide_steadily(job, slab, seconds)
    took = time.perf_counter() - began
    idle = slab.reduce((), [1.0 - (time.process_time() - worked) / took])[0]
    held = slab.tally["map bytes at most"]
    resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILO - held
    return Sample(
        job, slab.comm.size, starting, building, took, slab.agree(resident), tuple(stages), slab.agree(held), 1.0 - idle
    )


def _warm_up(job: Job, slab: Slab) -> None:
    """Make the first steps, or the first steady state, of a tiny scene: compiling is no part of what a job costs."""
    small = make_tiny(job)
    if small is None:
        return
    own = Slab(slab.comm, *small.grid.points)
    with suppress(RunError, InputError):
        if not small.history:
            wanted = request(small)
            SteadySliding(scene.set_up(small, own)).solve((wanted.points[0][0], 0.0), wanted.points[0][1])
            return
        march = start.first(small, own)
        for step in islice(march.steps(), FIRST):
            march.advance(step)


def _march(job: Job, slab: Slab, seconds: float) -> tuple[float, list[StageCost]]:
    """Seconds that the scene took, and the stages of the history; collective."""
    began = time.perf_counter()
    numerics = job.numerics.model_copy(update={"accept_unconverged": True})  # a long step may start from far away
    march = start.first(job.model_copy(update={"numerics": numerics}), slab)
    building = time.perf_counter() - began
    return building, _try(march, seconds)


def _slide_steadily(job: Job, slab: Slab, seconds: float) -> tuple[float, list[StageCost]]:
    """Seconds that the scene took, and the steady states, some far apart tried, as one stage; collective."""
    began = time.perf_counter()
    sliding = SteadySliding(scene.set_up(job, slab))
    building = time.perf_counter() - began
    wanted = request(job)
    states = wanted.points
    stage = StageCost(len(states))
    for index in _spread(len(states)):
        if stage.tried and slab.agree(time.perf_counter() - began - building > seconds):
            break
        speed, pressure, temperature = states[index]
        if temperature == temperature:
            sliding.heat(temperature)
        point, cost = _cost(slab, partial(_solve, sliding, wanted.velocity(speed), pressure))
        stage.add(1.0, cost | (dict(_errors(point.errors, 1.0, 1.0)) if point else {}))
    return building, [stage]


def _solve(sliding: SteadySliding, velocity: tuple[float, float], pressure: float) -> Point | None:
    """The state; one that cannot be solved costs what it has cost."""
    with suppress(RunError):
        return sliding.solve(velocity, pressure)
    return None


def _spread(count: int) -> list[int]:
    """The numbers below a count, in an order in which the first ones are already spread over all (van der Corput)."""
    digits = max(count - 1, 1).bit_length()
    turned = (int(f"{index:0{digits}b}"[::-1], 2) for index in range(1 << digits))
    return [index for index in turned if index < count]


def _try(march: March, seconds: float) -> list[StageCost]:
    """The first steps tell how many can be afforded; root's clock decides for all ranks."""
    slab, began, timeline = march.scene.slab, time.perf_counter(), march.timeline()
    stages = [StageCost(span.jumps + span.count) for span in timeline.spans]
    per_call = float("inf")
    as_run = march.steps(timeline)
    for step in islice(as_run, FIRST):
        cost = _make_as_run(march, step, stages)
        per_call = min(per_call, cost["seconds"] / max(cost["operator"], 1.0))
    left = max(seconds - (time.perf_counter() - began), 0.0)
    affordable = slab.agree(left / (CALLS * per_call)) / len(timeline)
    if affordable >= 1.0:
        for step in as_run:
            if slab.agree(_is_late(began, seconds, stages)):
                break
            _make_as_run(march, step, stages)
        _count_anew(stages, timeline)
        return stages
    _count_anew(stages, timeline)
    for span, stage in zip(timeline.spans, stages, strict=True):
        for step, weight in chosen(timeline, range(max(span.before, march.row.step) + 1, span.last + 1), affordable):
            if slab.agree(_is_late(began, seconds, stages)):
                return stages
            cost = _make(march, step)
            if weight:
                stage.add(weight, cost)
    return stages


def _count_anew(stages: list[StageCost], timeline: Timeline) -> None:
    """Stages that choose their steps have those that they have chosen by now, and a guess of those to come."""
    for stage, span in zip(stages, timeline.spans, strict=True):
        if timeline.chooses and span.stage.chooses:
            stage.steps = span.jumps + span.count


def _is_late(began: float, seconds: float, stages: list[StageCost]) -> bool:
    """Whether to stop, but not before there is more than the first steps, which start from nothing."""
    return time.perf_counter() - began > LATE * seconds and sum(stage.tried for stage in stages) > FIRST


def _make_as_run(march: March, step: Step, stages: list[StageCost]) -> dict[str, float]:
    """Make a step of the run, which stands for itself, and for others that the run does not make."""
    cost = _make(march, step)
    stages[step.stage].steps -= step.passed
    stages[step.stage].add(1.0, cost)
    return cost


def _make(march: March, step: Step) -> dict[str, float]:
    """Make a step; what it cost, and how wrong it is."""
    _, cost = _cost(march.scene.slab, partial(march.advance, step))
    far = weight_of(march.scene.job.history[step.stage].speed * step.dt, step.dt)
    return cost | dict(_errors(march.row.errors, far, march.row.measures.friction))


def _errors(errors: ErrorBudget | None, far: float, friction: float) -> Iterator[tuple[str, float]]:
    """The parts of the errors of friction and area that time steps and mesh make, and what they weigh in a mean, as in
    that of a run."""
    for name, weight in (("friction", far * friction), ("area", far)):
        if (parts := getattr(errors, name, None)) is not None:
            yield f"{name} weight", weight
            yield f"{name} time error", weight * parts.time
            yield f"{name} mesh error", weight * parts.mesh


def _cost(slab: Slab, call: Callable[[], T]) -> tuple[T, dict[str, float]]:
    """What a call returns, its seconds, and what is counted in it."""
    before, began = slab.tally.copy(), time.perf_counter()
    found = call()
    seconds = time.perf_counter() - began
    return found, {"operator": 0, **slab.tally.since(before), "seconds": seconds}


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
