"""A plan is made: the job is tried for a moment, and the machine too."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from .. import progress
from ..job import Job
from ..parallel.slab import Slab
from ..steady_sliding.curve import request
from ..storage import wisdom
from . import machine, other_ranks, price, report, trial
from .report import Costs
from .sample import Sample, sample
from .scaling import Machine, Scaling


@dataclass(frozen=True)
class Wanted:
    """What is asked of a plan: for how many `ranks`, tried for how many `seconds` by each number that this machine has.

    Of the machine that the job is for, as far as it is not this one: `cores` of a node, and the `latency` [s] and
    `bandwidth` [byte/s] of its network. `words` name the job for another process.
    """

    ranks: tuple[int, ...]
    words: Sequence[str] = ()
    seconds: float = 10.0
    cores: int | None = None
    network: tuple[float, float] | None = None


def plan(
    job: Job, slab: Slab, alone: Slab, wanted: Wanted, started: float, found: list[Costs] | None = None
) -> Iterator[str]:
    """Lines of the plan of a job, its run and its steady states; collective, all ranks must take every line.

    `alone` is a slab of one rank; `started` the seconds of the program so far. The costs are left in `found`.
    """
    found = [] if found is None else found
    yield from report.effects(job)
    yield ""
    if job.history:
        yield from report.maps(job, wanted.ranks)
        yield ""
        yield from _costs(job, slab, alone, wanted, started, found)
    if job.steady:
        steady, changes = only_steady_states(job)
        yield from [""] * bool(job.history)
        yield from _costs(steady, slab, alone, replace(wanted, words=[*wanted.words, *changes]), started, found)


def only_steady_states(job: Job) -> tuple[Job, list[str]]:
    """The job of `parcontact steady`, and the words that make it of this one for another process."""
    pressures = request(job).pressures
    section = job.steady.model_copy(update={"pressures": pressures}) if job.steady else None
    listed = ", ".join(map(repr, pressures))
    changes = ["--set", f"steady.pressures=[{listed}]", "--set", "history=[]", "--set", "initial={state: virgin}"]
    return job.model_copy(update={"history": (), "steady": section, "initial": type(job.initial)()}), changes


def _costs(job: Job, slab: Slab, alone: Slab, wanted: Wanted, started: float, found: list[Costs]) -> Iterator[str]:
    """What the steps, or the steady states, of a job cost; collective."""
    bar = progress.Bar(1, f"trying the job for some {wanted.seconds:g} s", "trial", slab.root)
    try:
        seen = try_job(job, slab, wanted.seconds, started)
    finally:
        bar.close()
    if seen is None:
        yield "too large to be tried here: its time is unknown"
        return
    others = [count for count in wanted.ranks if 1 < count <= machine.cores()] if slab.comm.size == 1 else []
    more = other_ranks.samples(seen.job, wanted.words, sorted(others), wanted.seconds)
    scaling = Scaling.of(job, [seen, *more], describe(seen.job, alone, wanted))
    costs = Costs(scaling, machine.write_rate(job.output.directory))
    found.append(costs)
    yield from report.steps(costs)
    yield ""
    yield from report.times(costs, wanted.ranks)
    yield ""
    yield from price.table(costs, wanted.ranks)


def costs_on(like: Costs, job: Job, seen: Sample) -> Costs:
    """Of another job, on the machine of one that was planned."""
    return replace(like, scaling=Scaling.of(job, [seen], like.scaling.machine))


def try_job(job: Job, slab: Slab, seconds: float, started: float, points: Sequence[int] = ()) -> Sample | None:
    """Try a job, or the same on a grid that is coarse enough, or has so many points, with the transforms its run will
    have; collective."""
    tried = slab.agree(_grid_to_try(job, slab.comm.size, seconds, points) if slab.root else None)
    if tried is None:
        return None
    own = slab.resized(*tried.grid.points)
    wisdom.recall(tried, own, None)
    found = sample(tried, own, seconds, started)
    wisdom.keep(tried, own)
    return found


def _grid_to_try(job: Job, ranks: int, seconds: float, points: Sequence[int]) -> Job | None:
    return trial.on_grid(job, points) if points else trial.grid_for(job, ranks, seconds)


def leave_sample(job: Job, slab: Slab, wanted: Wanted, path: Path, points: Sequence[int]) -> None:
    """Try a job, on the same grid, for a program that has started this one; collective."""
    found = try_job(job, slab, wanted.seconds, 0.0, points)
    if slab.root and found:
        other_ranks.save(path, found)


def describe(job: Job, alone: Slab, wanted: Wanted) -> Machine:
    """The machine that a job is for: nodes like this one, but for what is known of it."""
    crowding = machine.crowding(job.grid.points) if max(wanted.ranks) > 1 else 1.0
    this = Machine(machine.cores(), crowding, machine.per_call(alone), machine.copy_rate())
    other = replace(this, cores=wanted.cores or this.cores)
    return replace(other, latency=wanted.network[0], bandwidth=wanted.network[1]) if wanted.network else other
