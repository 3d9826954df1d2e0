"""A plan is made: the job is tried for a moment on the ranks at hand, and the machine too."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..job import Job
from ..parallel.slab import Slab
from ..record import plans
from . import machine, report, trial
from .report import Costs
from .sample import Sample, sample
from .scaling import Machine, Scaling


@dataclass(frozen=True)
class Wanted:
    """What is asked of a plan: for how many `ranks`, tried for how many `seconds`.

    Of the machine that the job is for, as far as it is not this one: `cores` of a node, and the `latency` [s] and
    `bandwidth` [byte/s] of its network.
    """

    ranks: tuple[int, ...]
    seconds: float = 10.0
    cores: int | None = None
    network: tuple[float, float] | None = None


def plan(job: Job, slab: Slab, alone: Slab, wanted: Wanted, started: float) -> Iterator[str]:
    """Lines of the plan of a job; collective, all ranks must take every line.

    `alone` is a slab of one rank; `started` the seconds of the program so far.
    """
    ranks = wanted.ranks
    yield from report.effects(job)
    yield ""
    yield from report.maps(job, ranks)
    yield ""
    if not job.history:
        yield "there is no history, and steady states are not planned"
        return
    tried = slab.agree(trial.grid_for(job, slab.comm.size, wanted.seconds) if slab.root else None)
    if tried is None:
        yield "too large to be tried here: no time can be told"
        return
    began = time.perf_counter()
    seen = attempt(tried, slab, wanted.seconds)
    took = time.perf_counter() - began
    costs = Costs(
        Scaling.of(job, seen, describe(tried, alone, wanted)), started, machine.write_rate(job.output.directory)
    )
    yield from report.steps(costs, took)
    yield ""
    yield from report.times(costs, ranks)


def attempt(job: Job, slab: Slab, seconds: float) -> Sample:
    """Try a job with the transform plans that its run will have; collective."""
    own = slab.resized(*job.grid.points)
    plans.recall(job, own, None)
    found = sample(job, own, seconds)
    plans.keep(job, own)
    return found


def describe(job: Job, alone: Slab, wanted: Wanted) -> Machine:
    """The machine that a job is for: nodes like this one, but for what is known of it."""
    crowding = machine.crowding(job.grid.points) if max(wanted.ranks) > 1 else 1.0
    this = Machine(machine.cores(), crowding, machine.per_call(alone), machine.copy_rate())
    other = replace(this, cores=wanted.cores or this.cores)
    return replace(other, latency=wanted.network[0], bandwidth=wanted.network[1]) if wanted.network else other
