"""Trials of jobs: some steps are made in memory, and the others are assumed to cost the same.

Each stage has an equal share of the time. When it is used up, one long step leads to the end of the stage. The first
steps of a stage, where the load may jump, are not used for the others. If a job is too large to reach its steps in half
of the time, its steps are counted and timed on a quarter of the points along each side, and the price of transforms on
its own grid is known from what it did. Times are those of the processor, so that other programs disturb them little.
"""

import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any

from pydantic import ValidationError

from .. import scene
from ..errors import InputError, RunError
from ..history.timeline import Timeline
from ..job import Job
from ..job.sections.listing import plain_data
from ..march.loop import March
from ..parallel.slab import Slab
from ..parallel.tally import Tally
from ..scene import choices
from ..steady_sliding import start
from ..steady_sliding.curve import request
from ..steady_sliding.sliding import SteadySliding
from ..storage import wisdom
from . import memory

FIRST = 2  # tuning: first steps of a stage that are not used for the cost of others
FEWEST = 8  # tuning: least steps of a stage before a long one ends it
FEW, FLAT = 16, 1e-3  # tiny scene: most points along a side; amplitude of its wave over the side
COARSER, LEAST = 4, 32  # ratio of the points along a side in successive trials, and their least number


class OutOfTimeError(Exception):
    """The time of a trial is over."""


class TimedSlab(Slab):
    """A slab whose sums over ranks raise OutOfTimeError once, on all ranks, after one of them has reached the instant
    `end` of its `process_time`.

    It remembers the time of the processor and the counts before the first solve.
    """

    end = math.inf
    begun: tuple[float, Tally] | None = None

    def reduce(self, sums: Sequence[float], maxima: Sequence[float]) -> list[float]:
        if self.begun is None and self.tally["operator"]:
            self.begun = time.process_time(), self.tally.copy()
        *found, late = super().reduce(sums, [*maxima, float(time.process_time() > self.end)])
        if late:
            self.end = math.inf
            raise OutOfTimeError
        return found

    @property
    def price(self) -> float:
        """Return the time of a transform since the first solve over its N log N [s]; 0 if there was none."""
        if self.begun is None:
            return 0.0
        before, tally = self.begun
        work = 0.0
        for name, count in self.tally.since(tally).items():
            if match := re.match(r"fft (\d+)x(\d+) ", name):
                work += count * _work(int(match[1]), int(match[2]))
        return (time.process_time() - before) / work if work else 0.0


def _work(nx: int, ny: int) -> float:
    return nx * ny * math.log(nx * ny + 1)


@dataclass
class StageCost:
    """Cost of a stage: numbers of steps and of tried steps, and sums over the FIRST tried steps and over later ones."""

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
        """Return the sum over all steps; 0 if none was tried."""
        first, later = min(self.tried, FIRST), max(self.tried - FIRST, 0)
        sums = self.later if later else self.first
        each = sums.get(name, 0.0) / max(later or first, 1)
        return self.first.get(name, 0.0) + (self.steps - first) * each


@dataclass(frozen=True)
class Trial:
    """Costs of a `job` by a trial on `ranks` ranks: those of its stages, or of its steady states as one stage.

    `points` are those of the grid that was tried, `building` is the time in which its scene was set up [s], and `price`
    the time of its transforms over their N log N, in the end relative to that on the grid of the job.
    """

    job: Job
    ranks: int
    points: tuple[int, int]
    building: float
    stages: tuple[StageCost, ...]
    price: float = 1.0

    @property
    def steps(self) -> int:
        return sum(stage.steps for stage in self.stages)

    @property
    def tried(self) -> int:
        return sum(stage.tried for stage in self.stages)

    def total(self, name: str) -> float:
        """Return the sum of `seconds`, or of a count in the tally, over all steps; untried stages cost the mean."""
        tried = [stage for stage in self.stages if stage.tried]
        steps = sum(stage.steps for stage in tried)
        return sum(stage.total(name) for stage in tried) * self.steps / steps if steps else 0.0

    def share(self, ranks: int) -> float:
        """Return the work of a rank, if `ranks` share the grid of the job, over that of a rank in the trial."""
        return self.price * _work(*self.job.grid.points) / _work(*self.points) * self.ranks / ranks

    def step(self, ranks: int, overhead: float) -> float:
        """Return the mean time of a step [s], if an operator call on a few points takes `overhead` [s]."""
        each, calls = (self.total(name) / max(self.steps, 1) for name in ("seconds", "operator"))
        fixed = min(overhead * calls, each) if ranks > self.ranks else 0.0
        alone = each * self.share(self.ranks)
        return fixed + (alone - fixed) * self.ranks / ranks

    def case(self, ranks: int, overhead: float) -> float:
        """Return the time of a run without the start of the program [s]."""
        return self.building * self.share(ranks) + self.steps * self.step(ranks, overhead)


def try_job(job: Job, slab: Slab, seconds: float) -> Trial | None:
    """Try a job for about `seconds` [s]; None if it is too large for that; collective.

    Raises InputError for files that do not match the job.
    """
    prices = list[float]()
    for tried in slab.agree([*_coarser(job)] if slab.root else []):
        fits = memory.total_bytes(tried, slab.comm.size) * slab.comm.size <= memory.FREE_SHARE * memory.free_bytes()
        if not slab.agree(fits):
            continue
        seconds /= 2.0
        own = TimedSlab(slab.comm, *tried.grid.points)
        found, price = _attempt(tried, own, seconds), slab.agree(own.price)
        if found:
            ratio = prices[0] / price if prices and price else 1.0
            return replace(found, job=job, stages=_all_steps(job, found), price=ratio)
        prices += [price] * (price > 0.0)
    return None


def _attempt(job: Job, slab: TimedSlab, seconds: float) -> Trial | None:
    """Try a job on its grid; None if too few steps are reached to stand for the others; collective."""
    wisdom.recall(choices(job).transforms, slab, None)
    slab.end = time.process_time() + seconds
    try:
        building, stages = _march(job, slab, seconds) if job.history else _slide_steadily(job, slab)
    except OutOfTimeError:
        return None
    finally:
        wisdom.keep(choices(job).transforms, slab)
    made = Trial(job, slab.comm.size, job.grid.points, building, tuple(stages))
    return made if made.tried >= (min(made.steps, FIRST + 1) if job.history else 1) else None


def _all_steps(job: Job, found: Trial) -> tuple[StageCost, ...]:
    """Return the costs of stages with the numbers of steps on the grid of the job."""
    if job.grid.points == found.points or not job.history:
        return found.stages
    spans = Timeline.from_job(job).spans
    return tuple(replace(stage, steps=s.jumps + s.count) for stage, s in zip(found.stages, spans, strict=True))


def _coarser(job: Job) -> Iterator[Job]:
    """Yield the job, and with fewer and fewer points as long as its surface allows it."""
    yield job
    data: dict[str, Any] = plain_data(job)
    while min(n for n in data["grid"]["points"] if n > 1) >= COARSER * LEAST:
        data["grid"]["points"] = [max(n // COARSER, 1) for n in data["grid"]["points"]]
        cell = max(length / n for length, n in zip(data["grid"]["size"], data["grid"]["points"], strict=True) if n > 1)
        for shape in data["surface"]:
            if "short_wavelength" in shape:
                shape["short_wavelength"] = max(shape["short_wavelength"], 2.0 * cell)
        try:
            yield Job.model_validate(data)
        except ValidationError:  # the grid is too coarse for its waves, or its heights are in a file
            return


def warm_up(job: Job, slab: Slab) -> float:
    """Make the first steps, or steady states, of a tiny scene, so that later ones include no compilation. Return the
    time of an operator call there [s]; collective."""
    small = _tiny(job)
    if small is None:
        return 0.0
    own, costs = slab.resized(*small.grid.points), list[dict[str, float]]()
    with suppress(RunError, InputError):
        if small.history:
            march = start.first(small, own)
            for step in islice(march.steps(), FEWEST):
                costs.append(_cost(own, partial(march.advance, step)))
        else:
            wanted, sliding = request(small), SteadySliding(scene.set_up(small, own))
            for _ in range(FIRST):
                costs.append(_cost(own, partial(sliding.solve, (wanted.points[0][0], 0.0), wanted.points[0][1])))
    return slab.agree(min((cost["seconds"] / cost["operator"] for cost in costs if cost["operator"]), default=0.0))


def _tiny(job: Job) -> Job | None:
    """Return the job with a single wave, or a sphere, on few points; None if not possible."""
    data: dict[str, Any] = plain_data(job)
    free, long = choices(job).isolated.on, max(job.grid.size)
    data["grid"]["points"] = [min(n, FEW) for n in job.grid.points]
    wave = {"shape": "wave", "amplitude": FLAT * long, "waves": [1, 0] if job.grid.nx > 1 else [0, 1]}
    data["surface"] = [{"shape": "sphere", "radius": long} if free else wave]
    data["numerics"]["accept_unconverged"] = True
    try:
        return Job.model_validate(data)
    except ValidationError:
        return None


def _march(job: Job, slab: Slab, seconds: float) -> tuple[float, list[StageCost]]:
    """Return the time to set up the scene [s], and the costs of the stages; collective."""
    numerics = job.numerics.model_copy(update={"accept_unconverged": True})  # a long step may not converge
    made = list[March]()
    cost = _cost(slab, lambda: made.append(start.first(job.model_copy(update={"numerics": numerics}), slab)))
    return cost["seconds"], _try(made[0], seconds)


def _slide_steadily(job: Job, slab: Slab) -> tuple[float, list[StageCost]]:
    """Return the time to set up the scene [s], and the costs of some steady states as one stage; collective."""
    made = list[SteadySliding]()
    cost = _cost(slab, lambda: made.append(SteadySliding(scene.set_up(job, slab))))
    wanted = request(job)
    stage = StageCost(len(wanted.points))
    with suppress(OutOfTimeError):
        for index in _spread(stage.steps):
            speed, pressure, temperature = wanted.points[index]
            if temperature == temperature:
                made[0].set_temperature(temperature)
            stage.add(_cost(slab, partial(_solve, made[0], wanted.velocity(speed), pressure)))
    return cost["seconds"], [stage]


def _solve(sliding: SteadySliding, velocity: tuple[float, float], pressure: float) -> None:
    """Solve a steady state; a failure counts, too."""
    with suppress(RunError):
        sliding.solve(velocity, pressure)


def _spread(count: int) -> list[int]:
    """Return the numbers below `count` in van der Corput's order, whose first ones are spread over the whole range."""
    digits = max(count - 1, 1).bit_length()
    turned = (int(f"{index:0{digits}b}"[::-1], 2) for index in range(1 << digits))
    return [index for index in turned if index < count]


def _try(march: March, seconds: float) -> list[StageCost]:
    """Return the costs of all stages; root's clock decides for all ranks."""
    slab, began, timeline = march.scene.slab, time.process_time(), march.timeline()
    stages = [StageCost(span.jumps + span.count) for span in timeline.spans]
    with suppress(OutOfTimeError):
        for step in march.steps(timeline):
            stage, span = stages[step.stage], timeline.spans[step.stage]
            took = slab.agree(time.process_time() - began)
            if took > seconds * (step.stage + 1) / (len(stages) + 1) and stage.tried >= FEWEST:
                if step.stage + 1 == len(stages):
                    break
                march.advance(span.leap(step.number, span.last))
                continue
            stage.steps -= step.passed
            stage.add(_cost(slab, partial(march.advance, step)))
    for stage, span in zip(stages, timeline.spans, strict=True):
        if timeline.chooses and span.stage.chooses:  # steps chosen so far, and an estimate of the others
            stage.steps = span.jumps + span.count
    return stages


def _cost(slab: Slab, call: Callable[[], object]) -> dict[str, float]:
    """Return the time [s] and the counts of a call."""
    before, began = slab.tally.copy(), time.process_time()
    call()
    return {"operator": 0, **slab.tally.since(before), "seconds": time.process_time() - began}
