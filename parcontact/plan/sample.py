"""Trials of jobs: some steps are made in memory, and the others are assumed to cost the same.

Each stage has an equal share of the time. When it is used up, one long step leads to the end of the stage. The first
steps of a stage, where the load may jump, are not used for the others.
"""

import re
import resource
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path

from .. import scene
from ..errors import InputError, RunError
from ..job import Job
from ..march.loop import March
from ..parallel.slab import Slab
from ..steady_sliding import start
from ..steady_sliding.curve import request
from ..steady_sliding.sliding import SteadySliding
from .trial_grids import make_tiny

FIRST = 2  # tuning: first steps of a stage that are not used for the cost of others
FEWEST = 8  # tuning: least steps of a stage before a long one ends it
KILO = 1024  # unit of resident memory in `getrusage` [bytes]
UNDISTURBED = 0.9  # tuning: least share of the time that a rank has a core if no other programs run
LATE = 2.0  # tuning: limit on the time of a trial, over the given time


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
class Sample:
    """Results of a trial of a job: costs of its stages, or of its steady states as one stage.

    Times [s]: `starting` the program, `building` the scene, `took` for the whole trial. Memory [bytes]: `resident`
    memory of root outside of maps, largest memory in maps `held`. `share` is the smallest share of the time that a rank
    had a core; it falls if other programs run.
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
        """Return True if other programs made the times unreliable."""
        return self.share < UNDISTURBED

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


def sample(job: Job, slab: Slab, seconds: float, starting: float = 0.0) -> Sample:
    """Try a job for about `seconds` [s], after `starting` [s] for the start of the program; collective.

    Raises InputError for files that do not match the job.
    """
    warm_up(job, slab)
    began, worked = time.perf_counter(), time.process_time()
    if job.history:
        building, stages = _march(job, slab, seconds)
    else:
        building, stages = _slide_steadily(job, slab, seconds)
    took = time.perf_counter() - began
    idle = slab.reduce((), [1.0 - (time.process_time() - worked) / took])[0]
    held = slab.tally["map bytes at most"]
    resident = peak_memory() - held
    return Sample(
        job, slab.comm.size, starting, building, took, slab.agree(resident), tuple(stages), slab.agree(held), 1.0 - idle
    )


def measure_program(job: Job, slab: Slab) -> int:
    """Return the bytes that a rank of the program takes without its maps: libraries, and the loops of the job.

    Collective.
    """
    warm_up(job, slab)
    return int(slab.reduce((), [float(peak_memory())])[0])


def peak_memory() -> int:
    """Return the largest resident memory of this process so far [bytes].

    The kernel's `VmHWM` begins with the program; `ru_maxrss`, for systems without it, also counts the process that
    started the program.
    """
    with suppress(OSError):
        found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
        if found:
            return int(found[1]) * KILO
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILO


def warm_up(job: Job, slab: Slab) -> None:
    """Make the first steps, or a steady state, of a tiny scene, so that the trial includes no compilation."""
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
    """Return the time to set up the scene [s], and the costs of the stages; collective."""
    began = time.perf_counter()
    numerics = job.numerics.model_copy(update={"accept_unconverged": True})  # a long step may not converge
    march = start.first(job.model_copy(update={"numerics": numerics}), slab)
    building = time.perf_counter() - began
    return building, _try(march, seconds)


def _slide_steadily(job: Job, slab: Slab, seconds: float) -> tuple[float, list[StageCost]]:
    """Return the time to set up the scene [s], and the costs of some steady states as one stage; collective."""
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
        stage.add(_cost(slab, partial(_solve, sliding, wanted.velocity(speed), pressure)))
    return building, [stage]


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
        stage.add(_cost(slab, partial(march.advance, step)))
    for stage, span in zip(stages, timeline.spans, strict=True):
        if timeline.chooses and span.stage.chooses:  # steps chosen so far, and an estimate of the others
            stage.steps = span.jumps + span.count
    return stages


def _cost(slab: Slab, call: Callable[[], object]) -> dict[str, float]:
    """Return the time [s] and the counts of a call."""
    before, began = slab.tally.copy(), time.perf_counter()
    call()
    return {"operator": 0, **slab.tally.since(before), "seconds": time.perf_counter() - began}
