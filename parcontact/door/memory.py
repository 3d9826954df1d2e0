"""Memory of a job's run and costs of its steps, for a plan.

The memory of a rank in maps, and the size of a checkpoint [bytes], are exact.

The constructors of a run are called on a slab that counts memory without allocating it (`parallel.slab.Slab.planned`).

In a trial of a job some steps are made in memory, and all others are assumed to cost the same.

Each stage has an equal share of the time. When the share is used up, one long step leads to the end of the stage. The
load may jump at the start of a stage: the cost of later steps is that of the tried steps without the first ones. If
half of the time is over before a job has made enough steps, its steps are counted and timed on a quarter of the points
along each side. The transforms that the job has made on its own grid so far give the ratio of times of both grids.

Times are processor times. They contain the waits of a rank for others, in which MPI is busy.
"""

import math
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from pydantic import ValidationError

from ..contact.starts import BLOCKS, LARGEST_SHARE, SHARE, WORTHWHILE
from ..contact.starts import LEAST as STARTS_LEAST
from ..effects.effect import EXTRAPOLATION
from ..errors import InputError, RunError
from ..files import wisdom
from ..job import Job
from ..job.history import MadeStep, Timeline
from ..job.limits import machines
from ..job.listing import plain_data
from ..march import scene, steady
from ..march.choices import choices
from ..march.controller import tolerance_before
from ..march.curve import request
from ..march.loop import March
from ..march.rigid_surface import highest_waves
from ..march.scene import Scene, build_on, outline, solver_on_tiles
from ..march.state import parts_of
from ..march.steady import SteadySliding
from ..parallel.slab import Slab, Tally
from ..physics.convolution import SIDE, Convolution, MirroredConvolution, Tiles
from ..physics.loops import shape_of

FREE_SHARE = 0.7  # tuning: share of the free memory that jobs may take
MEMINFO = Path("/proc/meminfo")
MOST_POINTS = 2**20  # tuning: largest number of points of a case that runs on one rank of a sweep
SPARE = 2.0  # tuning: memory of the first contact or steady state on nested grids, over the memory of steps
NESTED = 2.5  # accuracy: largest number of maps of a first solve on coarser grids, in addition to maps of steps
SPECTRUM = "surface spectrum"


# names of parts of a run in a plan
NAMES = {"contact": "pressures", "material": "body", "energy": "memory of energies", "law": "gaps"}


def holdings(job: Job, ranks: int = 1, rank: int | None = None) -> dict[str, int]:
    """Return the memory of a rank in maps and transform buffers [bytes], by purpose.

    The default is the last rank, whose maps are the largest. But the entry for the spectrum of the surface is the
    largest of all ranks.
    """
    slab = _slab(job, ranks, rank)
    scene = build_on(outline(job, slab))
    _memories = scene, _completed(scene)
    found = slab.tally.by_purpose
    for name, effect in choices(job).effects.items():
        if name not in scene.effects:
            found[name] = sum(np.dtype(dtype).itemsize for dtype in effect.maps(job)) * math.prod(slab.shape)
    if rank is None and choices(job).spectrum.on:
        count = job.grid.nx // 2 + 1
        rows, columns = shape_of(highest_waves(job), job.grid.points, slice(0, -(-count // min(ranks, count))))
        found[SPECTRUM] = rows * columns * np.dtype(np.complex128).itemsize
    return found


def total_bytes(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    return sum(holdings(job, ranks, rank).values())


def steady_start(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Return the largest memory of a rank in maps [bytes] while the initial steady state is solved, before a run
    allocates the maps of `holdings`; 0 for a run without a steady start. In a free box, the response of the body behind
    the contact may need more memory for a short time."""
    if not choices(job).steady_start.on:
        return 0
    return steady_bytes(job, ranks, rank)


def steady_bytes(job: Job, ranks: int = 1, rank: int | None = None) -> int:
    """Return the largest memory of a rank in maps [bytes] during the initial steady state, or a point of a curve."""
    slab = _slab(job, ranks, rank)
    first = choices(job).steady_start.on
    most = tolerance_before(job, 0, choices(job).viscoelasticity.on) if first else math.inf
    sliding, wanted = SteadySliding(outline(job, slab), most), None if first else request(job)
    held = sliding.hold(wanted.velocity(wanted.velocities[0]) if wanted else job.initial.velocity)
    bytes_held = slab.tally["map bytes"]
    del held
    return bytes_held


def most_bytes(job: Job, ranks: int) -> int:
    """Return the largest memory of rank 0 in maps [bytes]: the larger of the memory of steps, with saved fields and
    with the coarser grids of a first solve, and of the memory of a steady start."""
    (nx, ny), one_map = job.grid.points, 8 * job.grid.nx * job.grid.ny / ranks
    if not job.history:
        return steady_bytes(job, ranks)
    steps = total_bytes(job, ranks) + len(job.output.fields) * one_map + NESTED * one_map * (nx * ny >= WORTHWHILE)
    return int(max(steps, steady_start(job, ranks))) + on_tiles(job)


def on_tiles(job: Job) -> int:
    """Return the additional memory of rank 0 [bytes] if the first contact covers so little of the grid that it is
    solved on small squares of the grid (tiles); 0 for a run that uses no tiles."""
    chosen, (nx, ny) = choices(job), job.grid.points
    cold = bool(job.history) and not chosen.steady_start.on and not chosen.forbidden(EXTRAPOLATION)
    large = nx * ny >= WORTHWHILE and max(nx, ny) > BLOCKS
    if not (cold and large):
        return 0
    setup = outline(job, Slab.planned(nx, ny, 1, 0))
    make = solver_on_tiles(setup)
    if make is None:
        return 0
    count = int(LARGEST_SHARE * nx * ny / SIDE**2)
    places, before = np.zeros(count, np.intp), setup.slab.tally["map bytes"]
    made = make(Tiles((nx, ny), places, places), max(SHARE * job.numerics.tolerance, STARTS_LEAST))
    held = setup.slab.tally["map bytes"] - before
    del made
    return held + 2 * 8 * SIDE**2 * count  # the heights and the start


def saved(job: Job) -> int:
    """Return the size of the maps in a checkpoint [bytes]; each row of a map has a checksum of 4 bytes. Effects declare
    their maps themselves, as some exist only in checkpoints."""
    (nx, ny), scene = job.grid.points, build_on(outline(job, _slab(job, 1, 0)))
    memories = _completed(scene)
    parts = {name: part for name, part in parts_of(scene).items() if name not in scene.effects}
    entries = [entry for name, part in parts.items() for entry in part.entries(memories[name], scene.units).values()]
    itemsizes = [np.asarray(entry.value).itemsize for entry in entries if entry.is_map]
    for effect in choices(job).effects.values():
        itemsizes += [np.dtype(dtype).itemsize for dtype in effect.maps(job)]
    return sum(nx * ny * itemsize + 4 * ny for itemsize in itemsizes)


def _slab(job: Job, ranks: int, rank: int | None) -> Slab:
    """Return the counting slab of a rank, by default of the last one."""
    return Slab.planned(*job.grid.points, ranks, ranks - 1 if rank is None else rank)


def _completed(scene: Scene) -> dict[str, Any]:
    """Return the states of all parts at rest, after the allocations of the first step."""
    scene.slab.tally.purpose = "operators"
    for operator in scene.operators if scene.law is None else scene.operators[:1]:  # laws of effects use one operator
        assert isinstance(operator, Convolution | MirroredConvolution)
        _ = operator.symbols
    memories = {}
    for name, part in parts_of(scene).items():
        scene.slab.tally.purpose = NAMES.get(name, name)
        memories[name] = part.at_rest()
    return memories


def free_bytes() -> int:
    """Return the free memory [bytes], `sys.maxsize` if unknown."""
    try:
        facts = dict(line.split(":") for line in MEMINFO.read_text().splitlines())
        return int(facts["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError, ValueError):
        return sys.maxsize


def count_side_by_side(jobs: Sequence[Job], ranks: int) -> int:
    """Return the number of cases to run at the same time: a case for each rank if the grids have at most MOST_POINTS
    points and all cases fit into the memory, else 1."""
    at_once = min(ranks, len(jobs))
    if at_once < 2:
        return 1
    largest = max(jobs, key=lambda job: job.grid.nx * job.grid.ny)
    if largest.grid.nx * largest.grid.ny > MOST_POINTS:
        return 1
    here = -(-at_once // machines())
    held = here * SPARE * total_bytes(largest, max(1, ranks // at_once))
    return at_once if held <= FREE_SHARE * free_bytes() else 1


FIRST = 2  # tuning: first steps of a stage that are not used for the cost of others
FEWEST = 8  # tuning: least steps of a stage before a long one ends it
FEW, FLAT = 16, 1e-3  # tiny scene: most points along a side; amplitude of its wave over the side
COARSER, LEAST = 4, 32  # ratio of the points along a side in successive trials, and their least number


class OutOfTimeError(Exception):
    """Raised on all ranks when the time of a trial is used up."""


class TimedSlab(Slab):
    """A grid divided among ranks (`Slab`) that ends a trial: when the `process_time` of a rank has passed `end`, the
    next sum over ranks raises OutOfTimeError on all ranks. Later sums do not raise it again.

    `begun` holds the processor time and the counts before the first solve.
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
        """Return the time of a transform since the first solve, divided by its N log N [s]; 0 if there was none."""
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
    """Cost of a stage: its number of steps, how many of them were tried, and the sums of each cost over the `first` few
    tried steps and over `later` tried steps.

    `paces` are the times of an operator call [s] in the later steps. Their median gives the time of a step: on a loaded
    machine single steps take many times as long as the others.
    """

    steps: int
    tried: int = 0
    first: dict[str, float] = field(default_factory=dict)
    later: dict[str, float] = field(default_factory=dict)
    paces: list[float] = field(default_factory=list)

    def add(self, cost: dict[str, float]) -> None:
        sums = self.first if self.tried < FIRST else self.later
        if self.tried >= FIRST and cost.get("operator"):
            self.paces.append(cost.get("seconds", 0.0) / cost["operator"])
        self.tried += 1
        for name, value in cost.items():
            sums[name] = sums.get(name, 0.0) + value

    def total(self, name: str) -> float:
        """Return the sum over all steps; 0 if none was tried."""
        first, later = min(self.tried, FIRST), max(self.tried - FIRST, 0)
        sums = self.later if later else self.first
        each = sums.get(name, 0.0) / max(later or first, 1)
        if name == "seconds" and self.paces:
            each = median(self.paces) * sums["operator"] / later
        return self.first.get(name, 0.0) + (self.steps - first) * each


@dataclass(frozen=True)
class Trial:
    """Costs of a `job`, measured in a trial on `ranks` ranks, for each stage, or for all steady states as one stage.

    `points` are the points of the grid that was tried, and `building` is the time in which its scene was set up [s].
    `price` compares transforms: the time of one, divided by N log N for its N points, on the grid of the job, divided
    by the same number on the tried grid. It is 1 if both grids are the same.
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
        """Return the cost `name` of all steps: `seconds`, or the name of a count in the tally. A step of an untried
        stage has the mean cost of the other stages."""
        tried = [stage for stage in self.stages if stage.tried]
        steps = sum(stage.steps for stage in tried)
        return sum(stage.total(name) for stage in tried) * self.steps / steps if steps else 0.0

    def share(self, ranks: int) -> float:
        """Return how much work a rank has when `ranks` ranks share the grid of the job, divided by its work in the
        trial."""
        return self.price * _work(*self.job.grid.points) / _work(*self.points) * self.ranks / ranks

    def step(self, ranks: int, overhead: float) -> float:
        """Return the mean time of a step [s] on `ranks` ranks, with `overhead` [s] for an operator call on few
        points."""
        each, calls = (self.total(name) / max(self.steps, 1) for name in ("seconds", "operator"))
        fixed = min(overhead * calls, each) if ranks > self.ranks else 0.0
        alone = each * self.share(self.ranks)
        return fixed + (alone - fixed) * self.ranks / ranks

    def case(self, ranks: int, overhead: float) -> float:
        """Return the time of a run on `ranks` ranks [s], without the start of the program."""
        return self.building * self.share(ranks) + self.steps * self.step(ranks, overhead)


def try_job(job: Job, slab: Slab, seconds: float) -> Trial | None:
    """Return the costs of a job from a trial of about `seconds` [s]; None if the job is too large for a trial;
    collective.

    Raises InputError for files that do not match the job.
    """
    prices = list[float]()
    for tried in slab.agree([*_coarser(job)] if slab.root else []):
        fits = total_bytes(tried, slab.comm.size) * slab.comm.size <= FREE_SHARE * free_bytes()
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
    """Make the first steps, or steady states, of a scene of few points, so that later steps include no compilation.
    Return the time of an operator call of this scene [s]; collective."""
    small = _tiny(job)
    if small is None:
        return 0.0
    own, costs = slab.resized(*small.grid.points), list[dict[str, float]]()
    with suppress(RunError, InputError):
        if small.history:
            march = steady.first(small, own)
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
    cost = _cost(slab, lambda: made.append(steady.first(job.model_copy(update={"numerics": numerics}), slab)))
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
    estimates = dict[int, int]()
    with suppress(OutOfTimeError):
        for step in march.steps(timeline):
            stage, span = stages[step.stage], timeline.spans[step.stage]
            took = slab.agree(time.process_time() - began)
            if took > seconds * (step.stage + 1) / (len(stages) + 1) and stage.tried >= FEWEST:
                if step.stage + 1 == len(stages):
                    break
                rest = span.leap(step.number, span.last)
                if timeline.chooses and span.stage.chooses:  # the stage ends with this step, whatever its number
                    estimates[step.stage] = span.jumps + span.count
                    record = MadeStep(step.stage, span.stage.seconds, step.dt)
                    rest = rest._replace(number=step.number, passed=0, decide=lambda *_, made=record: made)
                march.advance(rest)
                continue
            stage.steps -= step.passed
            stage.add(_cost(slab, partial(march.advance, step)))
    for index, (stage, span) in enumerate(zip(stages, timeline.spans, strict=True)):
        if timeline.chooses and span.stage.chooses:  # steps chosen so far, and an estimate of the others
            stage.steps = estimates.get(index, span.jumps + span.count)
    return stages


def _cost(slab: Slab, call: Callable[[], object]) -> dict[str, float]:
    """Return the time [s] and the counts of a call."""
    before, began = slab.tally.copy(), time.process_time()
    call()
    return {"operator": 0, **slab.tally.since(before), "seconds": time.process_time() - began}
