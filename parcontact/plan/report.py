"""The text of a plan."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .. import scene
from ..effects import decisions
from ..history.timeline import Timeline
from ..job import Job
from . import machine, memory
from .scaling import SUMS_PER_STEP, Scaling

MEGA = 1e6
DAY, YEAR = 86400.0, 365.25 * 86400.0  # seconds
LARGE = 1e10  # bytes from which on there are told GB
HALF_MESH = 0.3  # of the time of a run, that on half the mesh: a quarter of the points, some more calls
HALF_MESH_CHOSEN = 0.2  # the same in steps that are chosen, half as many
STEADY_STARTS = (("steady start, before", False), ("steady start, with sets", True))  # and whether by sets of points
MARK = "*"  # of figures that were taken while other programs were at work


@dataclass(frozen=True)
class Costs:
    """What a job costs: `scaling` of its steps, `write_rate` [byte/s] of the disk."""

    scaling: Scaling
    write_rate: float

    @property
    def job(self) -> Job:
        return self.scaling.job

    def held(self, ranks: int) -> float:
        """Bytes that a rank holds in maps at once: those of steps, to the byte, or more while a first contact or steady
        state is found on nested grids, which was seen when the job was tried."""
        known = (memory.total(self.job, ranks), memory.steady_start(self.job, ranks)) if self.job.history else (0,)
        return max(float(max(known)), self.scaling.held(ranks))

    def marching(self, ranks: int) -> float:
        """Seconds of all steps, or steady states; with those on half the mesh, which comes first."""
        part = HALF_MESH_CHOSEN if Timeline.of(self.job).chooses else HALF_MESH
        beside = part if self.job.history and decisions.mesh_check(self.job).on else 0.0
        return self.scaling.steps * self.scaling.step(ranks) * (1.0 + beside)

    def writing(self, ranks: int) -> float:
        """Seconds of all checkpoints and fields."""
        if not self.job.history:
            return 0.0
        written = self.checkpoints(ranks) * memory.saved(self.job) + self.instants * self.instant_bytes
        return written / self.write_rate

    def whole(self, ranks: int) -> float:
        """Seconds of the whole run."""
        return (
            self.scaling.sample(ranks).starting
            + self.scaling.building(ranks)
            + self.marching(ranks)
            + self.writing(ranks)
        )

    def checkpoints(self, ranks: int) -> int:
        rules, count = self.job.checkpoint, self.scaling.steps
        if rules.every is not None:
            return -(-count // rules.every)
        return int(self.marching(ranks) / (60.0 * (rules.minutes or float("inf")))) + 1

    @property
    def instants(self) -> int:
        """How often fields are saved."""
        saved = self.job.history and decisions.fields(self.job).on
        return -(-self.scaling.steps // self.job.output.every) if saved else 0

    @property
    def instant_bytes(self) -> int:
        return len(self.job.output.fields) * self.job.grid.nx * self.job.grid.ny * 8


def effects(job: Job) -> Iterator[str]:
    """Every effect, on or off, and why."""
    found = scene.effects(job)
    width = max(len(effect.name) for effect in found)
    yield "effects"
    for effect in sorted(found, key=lambda effect: not effect.on):
        yield f"  {'on' if effect.on else 'off':3}  {effect.name:{width}}  {effect.why}"


def maps(job: Job, ranks: Sequence[int]) -> Iterator[str]:
    """Bytes that a rank holds, for what."""
    columns = [memory.holdings(job, count) for count in ranks]
    before = STEADY_STARTS if decisions.steady_start(job).on else ()
    width = max(len(what) for what in (*(holding.what for holding in columns[0]), *(what for what, _ in before)))
    totals = [sum(holding.bytes for holding in column) for column in columns]
    unit, size = unit_of(max(totals))
    yield f"{f'memory per rank [{unit}]':{width + 2}}" + "".join(f" {ranks_text(count):>12}" for count in ranks)
    for row in zip(*columns, strict=True):
        yield f"  {row[0].what:{width}}" + "".join(f"{holding.bytes / size:13.4g}" for holding in row)
    yield f"  {'in all':{width}}" + "".join(f"{total / size:13.4g}" for total in totals)
    for what, sets in before:
        held = (memory.steady_start(job, count, sets=sets) / size for count in ranks)
        yield f"  {what:{width}}" + "".join(f"{number:13.4g}" for number in held)
    yield f"a checkpoint has {_bytes(memory.saved(job))}"


def steps(costs: Costs) -> Iterator[str]:
    """How many steps, or steady states, and what is in one."""
    samples = costs.scaling.samples
    word = "step" if costs.job.history else "state"
    yield from _numbers(costs)
    calls, transforms, sums = (
        samples[0].total(name) / costs.scaling.steps for name in ("operator", "fft", "allreduce")
    )
    sums += SUMS_PER_STEP
    yield f"a {word} has {calls:.3g} operator calls, {transforms:.3g} transforms and {sums:.3g} sums over all ranks"
    if costs.instants:
        yield f"fields are saved {costs.instants} times, {_bytes(costs.instant_bytes)} each"
    for sample in samples:
        tried = sample.job.grid.points
        grid = "" if tried == costs.job.grid.points else f" ({tried[0]} x {tried[1]} points instead)"
        where = f"on {ranks_text(sample.ranks)}{grid}"
        yield f"tried: {sample.tried} {word}s {where} in {sample.took:.3g} s; the others are taken to be like them"


def _numbers(costs: Costs) -> Iterator[str]:
    """How many steps in all and in each stage, or how many steady states."""
    job, sample = costs.job, costs.scaling.samples[0]
    if not job.history and job.steady:
        yield f"parcontact steady: {sample.steps} steady states, {len(job.steady.velocities)} velocities"
        return
    names = (f"{stage.name} {seen.steps}" for stage, seen in zip(job.history, sample.stages, strict=True))
    most = "at most " if decisions.short_rest(job).on and sample.tried < sample.steps else ""
    if decisions.chosen_steps(job).on and sample.tried < sample.steps:
        most = "about "
    yield f"{most}{sample.steps} steps: {', '.join(names)}"


def times(costs: Costs, ranks: Sequence[int]) -> Iterator[str]:
    """Seconds on some numbers of ranks, and where scaling ends; what other programs have disturbed is marked."""
    scaling = costs.scaling
    yield from _disturbance(scaling)
    unit, size = unit_of(max(costs.held(count) for count in ranks))
    word = "step" if costs.job.history else "state"
    yield f"  ranks  most maps [{unit}]  resident [{unit}] {f'{word} [s]':>9}   messages   at work   whole run"
    for count in ranks:
        step, held = scaling.step(count), costs.held(count)
        resident = held + scaling.sample(count).resident + costs.instant_bytes // count
        mark = MARK if scaling.sample(count).disturbed else " "
        shares = f"{scaling.messages(count) / step:8.0%} {scaling.efficiency(count):9.0%}"
        memory_text = f"{held / size:13.4g} {resident / size:14.4g}"
        yield f"{count:7d} {memory_text} {step:12.3g}{mark} {shares} {duration_text(costs.whole(count)):>11}"
    mark = MARK if any(sample.disturbed for sample in scaling.samples) else ""
    end = f"{ranks_text(scaling.end)}{mark}"
    yield f"scaling ends at {end}: with twice as many they would work for less than half of the time"
    yield from _assumptions(costs, max(ranks))


def _disturbance(scaling: Scaling) -> Iterator[str]:
    """What other programs have taken of the machine, if it matters."""
    disturbed = [sample for sample in scaling.samples if sample.disturbed]
    if disturbed:
        shares = ", ".join(f"{sample.share:.0%} of a core each on {ranks_text(sample.ranks)}" for sample in disturbed)
        load = f"load {machine.load():.2g} on {machine.cores()} cores"
        yield (
            f"warning: this machine is busy with other programs ({load}), and the trial had only {shares}; "
            f"times marked {MARK} are too long, and what follows from them is unsure"
        )


def _assumptions(costs: Costs, many: int) -> Iterator[str]:
    scaling, nodes = costs.scaling, costs.scaling.machine
    yield (
        f"assumed: {scaling.sample(many).starting:.2g} s to start and {scaling.building(many):.2g} s for the scene on "
        f"{ranks_text(many)}, "
        f"{costs.write_rate / MEGA:.3g} MB/s to disk; nodes of {nodes.cores} cores, {nodes.crowding:.2f} times "
        f"slower when all work; {1e6 * nodes.per_call:.2g} us per operator call on any number of ranks"
    )
    yield (
        f"between ranks: messages of {1e6 * nodes.near_latency:.2g} us within a node, {1e6 * nodes.latency:.2g} us "
        f"and {nodes.bandwidth / 1e9:.3g} GB/s per node between nodes, copies at {nodes.copy_rate / 1e9:.2g} GB/s"
    )


def unit_of(most: float) -> tuple[str, float]:
    """In which to tell of so many bytes and less: its name and its bytes."""
    return ("GB", 1e9) if most >= LARGE else ("MB", 1e6)


def _bytes(count: float) -> str:
    unit, size = unit_of(count)
    return f"{count / size:.4g} {unit}"


def ranks_text(count: int) -> str:
    """So many ranks, in words."""
    return "1 rank" if count == 1 else f"{count} ranks"


def duration_text(seconds: float) -> str:
    """A time as people tell it."""
    if seconds < 600.0:
        return f"{seconds:.3g} s"
    if seconds < DAY:
        return time.strftime("%Hh%Mm", time.gmtime(seconds))
    return f"{seconds / DAY:.3g} days" if seconds < 1000 * DAY else f"{seconds / YEAR:.3g} years"
