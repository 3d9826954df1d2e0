"""A job tried out: some of its steps are made in memory, the rest are taken to be like them.

Each stage has an equal share of the time. Its steps are made as a run makes them until that is used up; one long step
then goes to the end of the stage. The first steps of a stage, where the load may jump, stand for themselves alone.
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
from ..accuracy.budget import ErrorBudget, weight_of
from ..errors import InputError, RunError
from ..history.timeline import Step
from ..job import Job
from ..march.loop import March
from ..parallel.slab import Slab
from ..steady_sliding import start
from ..steady_sliding.curve import request
from ..steady_sliding.point import Point
from ..steady_sliding.sliding import SteadySliding
from .trial_grids import make_tiny

T = TypeVar("T")
FIRST = 2  # tuning: steps of a stage that stand for themselves alone
FEWEST = 8  # tuning: steps of a stage that are made before a long one ends it
KILO = 1024  # bytes in what the system counts resident memory in
UNDISTURBED = 0.9  # tuning: of the time a rank has a core, where nothing else is at work
LATE = 2.0  # tuning: times the time given, after which no more steps are made


@dataclass
class StageCost:
    """Cost of the steps of a stage: their number, how many were tried, sums over the FIRST of these and over later
    ones."""

    steps: int
    tried: int = 0
    first: dict[str, float] = field(default_factory=dict)
    later: dict[str, float] = field(default_factory=dict)

    def add(self, cost: dict[str, float]) -> None:
        sums = self.first if self.tried < FIRST else self.later
        self.tried += 1
        for name, value in cost.items():
            sums[name] = sums.get(name, 0.0) + value

    def total(self, name: str) -> float:
        """Sum over all steps; 0 where none was tried."""
        first, later = min(self.tried, FIRST), max(self.tried - FIRST, 0)
        sums = self.later if later else self.first
        each = sums.get(name, 0.0) / max(later or first, 1)
        return self.first.get(name, 0.0) + (self.steps - first) * each


@dataclass(frozen=True)
class Sample:
    """A job as it was tried on some ranks: its stages, and how long all of it took [s].

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
        """Tell that other programs have taken so much of the machine that times say little."""
        return self.share < UNDISTURBED

    @property
    def steps(self) -> int:
        return sum(stage.steps for stage in self.stages)

    @property
    def tried(self) -> int:
        return sum(stage.tried for stage in self.stages)

    def total(self, name: str) -> float:
        """Sum of `seconds`, or of a count by its name in the tally, over all steps; untried stages are like others."""
        tried = [stage for stage in self.stages if stage.tried]
        steps = sum(stage.steps for stage in tried)
        return sum(stage.total(name) for stage in tried) * self.steps / steps if steps else 0.0


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


def measure_program(job: Job, slab: Slab) -> int:
    """Return the bytes that a rank of the program takes without its maps: libraries, and the loops of the job.

    Collective.
    """
    _warm_up(job, slab)
    return int(slab.reduce((), [float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILO)])[0])


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
            sliding.set_temperature(temperature)
        point, cost = _cost(slab, partial(_solve, sliding, wanted.velocity(speed), pressure))
        stage.add(cost | (dict(_errors(point.errors, 1.0, 1.0)) if point else {}))
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
    """Try all stages; root's clock decides for all ranks."""
    slab, began, timeline = march.scene.slab, time.perf_counter(), march.timeline()
    stages = [StageCost(span.jumps + span.count) for span in timeline.spans]
    for step in march.steps(timeline):
        stage, span = stages[step.stage], timeline.spans[step.stage]
        took = slab.agree(time.perf_counter() - began)
        if took > LATE * seconds and sum(stage.tried for stage in stages) > FIRST:
            break
        if took > seconds * (step.stage + 1) / len(stages) and stage.tried >= FEWEST:
            if step.stage + 1 == len(stages):
                break
            march.advance(span.leap(step.number, span.last))
            continue
        stage.steps -= step.passed
        stage.add(_make(march, step))
    for stage, span in zip(stages, timeline.spans, strict=True):
        if timeline.chooses and span.stage.chooses:  # what was chosen by now, and a guess of those to come
            stage.steps = span.jumps + span.count
    return stages


def _make(march: March, step: Step) -> dict[str, float]:
    """Make a step; what it cost, and how wrong it is."""
    _, cost = _cost(march.scene.slab, partial(march.advance, step))
    far = weight_of(march.scene.job.history[step.stage].speed * step.dt, step.dt)
    friction = march.row.measures.friction if march.scene.job.directions else 0.0  # which is noise where nothing slides
    return cost | dict(_errors(march.row.errors, far, friction))


def _errors(errors: ErrorBudget | None, far: float, friction: float) -> Iterator[tuple[str, float]]:
    """The parts of the errors of friction and area that time steps and mesh make, and what they weigh in a mean, as in
    that of a run."""
    for name, weight in (("friction", far * friction), ("area", far)):
        if (parts := getattr(errors, name, None)) is not None:
            yield f"{name} weight", weight
            yield f"{name} time error", weight * parts.time
            yield f"{name} mesh error", weight * parts.mesh


def _cost(slab: Slab, call: Callable[[], T]) -> tuple[T, dict[str, float]]:
    """Return what a call returns, and its seconds and counts."""
    before, began = slab.tally.copy(), time.perf_counter()
    found = call()
    seconds = time.perf_counter() - began
    return found, {"operator": 0, **slab.tally.since(before), "seconds": seconds}
