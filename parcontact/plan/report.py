"""The text of a plan."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .. import scene
from ..effects import decisions
from ..job import Job
from . import memory
from .scaling import SUMS_PER_STEP, Scaling

MEGA = 1e6


@dataclass(frozen=True)
class Costs:
    """What a job costs: `scaling` of its steps, `write_rate` [byte/s] of the disk."""

    scaling: Scaling
    write_rate: float

    @property
    def job(self) -> Job:
        return self.scaling.job

    def marching(self, ranks: int) -> float:
        """Seconds of all steps."""
        return self.scaling.steps * self.scaling.step(ranks)

    def writing(self, ranks: int) -> float:
        """Seconds of all checkpoints and fields."""
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
        return -(-self.scaling.steps // self.job.output.every) if decisions.fields(self.job).on else 0

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
    width = max(len(holding.what) for holding in columns[0])
    yield f"{'memory per rank [MB]':{width + 2}}" + "".join(f"{_ranks(count):>13}" for count in ranks)
    for row in zip(*columns, strict=True):
        yield f"  {row[0].what:{width}}" + "".join(f"{holding.bytes / MEGA:13.4g}" for holding in row)
    totals = [sum(holding.bytes for holding in column) for column in columns]
    yield f"  {'in all':{width}}" + "".join(f"{total / MEGA:13.4g}" for total in totals)
    yield f"a checkpoint has {memory.saved(job) / MEGA:.4g} MB"


def steps(costs: Costs) -> Iterator[str]:
    """How many steps, and what is in one."""
    samples = costs.scaling.samples
    names = (f"{stage.name} {seen.steps}" for stage, seen in zip(costs.job.history, samples[0].stages, strict=True))
    most = "at most " if decisions.short_rest(costs.job).on and samples[0].tried < samples[0].steps else ""
    yield f"{most}{costs.scaling.steps} steps: {', '.join(names)}"
    calls, transforms, sums = (
        samples[0].total(name) / costs.scaling.steps for name in ("operator", "fft", "allreduce")
    )
    sums += SUMS_PER_STEP
    yield f"a step has {calls:.3g} operator calls, {transforms:.3g} transforms and {sums:.3g} sums over all ranks"
    if costs.instants:
        yield f"fields are saved {costs.instants} times, {costs.instant_bytes / MEGA:.4g} MB each"
    for sample in samples:
        tried = sample.job.grid.points
        grid = "" if tried == costs.job.grid.points else f" ({tried[0]} x {tried[1]} points instead)"
        where = f"on {_ranks(sample.ranks)}{grid}"
        yield f"tried: {sample.tried} steps {where} in {sample.took:.3g} s; the others are taken to be like them"


def times(costs: Costs, ranks: Sequence[int]) -> Iterator[str]:
    """Seconds on some numbers of ranks, and where scaling ends."""
    scaling, machine = costs.scaling, costs.scaling.machine
    yield "  ranks     maps [MB]  resident [MB]     step [s]   messages   at work   whole run"
    for count in ranks:
        step, held = scaling.step(count), memory.total(costs.job, count)
        resident = held + scaling.sample(count).resident + costs.instant_bytes // count
        shares = f"{scaling.messages(count) / step:9.0%} {scaling.efficiency(count):9.0%}"
        memory_text = f"{held / MEGA:13.4g} {resident / MEGA:14.4g}"
        yield f"{count:7d} {memory_text} {step:12.3g} {shares} {_duration(costs.whole(count)):>11}"
    yield f"scaling ends at {_ranks(scaling.end)}: with twice as many they would work for less than half of the time"
    many = max(ranks)
    yield (
        f"assumed: {scaling.sample(many).starting:.2g} s to start and {scaling.building(many):.2g} s for the scene on "
        f"{_ranks(many)}, "
        f"{costs.write_rate / MEGA:.3g} MB/s to disk; nodes of {machine.cores} cores, {machine.crowding:.2f} times "
        f"slower when all work; {1e6 * machine.per_call:.2g} us per operator call on any number of ranks"
    )
    yield (
        f"between ranks: messages of {1e6 * machine.near_latency:.2g} us within a node, {1e6 * machine.latency:.2g} us "
        f"and {machine.bandwidth / 1e9:.3g} GB/s per node between nodes, copies at {machine.copy_rate / 1e9:.2g} GB/s"
    )


def _ranks(count: int) -> str:
    return "1 rank" if count == 1 else f"{count} ranks"


def _duration(seconds: float) -> str:
    if seconds < 600.0:
        return f"{seconds:.3g} s"
    return time.strftime("%Hh%Mm", time.gmtime(seconds)) if seconds < 86400 else f"{seconds / 86400:.3g} days"
