"""Plan of a job in bands: the numbers of its contacts or marches, and their time, which a short trial measures."""

import time
from collections.abc import Iterator

from ..contact.problem import Box
from ..job import Job
from ..march.curve import request
from ..parallel.slab import Slab
from .cascade import Cascade, Task
from .choice import FEWEST, cut_bands, describe_cut
from .road_history import RoadHistory


def plan_bands(job: Job, slab: Slab) -> Iterator[str]:
    """Yield lines on the bands of a job and on the time of its points or marches; collective: all ranks must take every
    line."""
    if job.history:
        yield from _plan_history(job, slab)
        return
    wanted, cut = request(job), cut_bands(job)
    yield from describe_cut(cut, job)
    cascade = Cascade(job, cut, slab)
    fastest = max(wanted.velocities)
    began, contacts = time.perf_counter(), 0
    cascade.press(wanted.velocity(fastest), wanted.pressures[0])
    for number in sorted({0, cut.count // 2, cut.count - 1}):
        rungs = range(len(cascade.ladders[number].rungs))
        cascade.solve_tasks([Task(number, 0, rung, Box()) for rung in rungs])
        contacts += len(rungs)
    each = slab.agree((time.perf_counter() - began) / contacts)
    samples = cut.samples or FEWEST
    of_point = (samples + 1) * sum(len(ladder.rungs) for ladder in cascade.ladders)
    points = len(wanted.points)
    yield f"parcontact steady: {points} steady states of {of_point} contacts or more, {each * 1e3:.3g} ms each"
    yield f"on {slab.comm.size} rank{'s' * (slab.comm.size > 1)}: {points * of_point * each:.3g} s or more in all"


def _plan_history(job: Job, slab: Slab) -> Iterator[str]:
    """Yield lines on the marches of a history, from the march of a middle rung of the finest band."""
    road = RoadHistory(job, slab)
    yield from road.notes()
    tasks, steps = road.tasks(), road.steps()
    began = time.process_time()
    road.try_march()
    each = slab.agree((time.process_time() - began) / steps[-1])
    for of_band in tasks:
        number, count = of_band[0].band, len(of_band)
        long, short = road.cut.wavelengths(number)
        yield f"band from {long:.3g} to {short:.3g} m: {count} march{'es' * (count > 1)} of {steps[number]} steps"
    rounds = sum(-(-len(of_band) // slab.comm.size) * steps[of_band[0].band] for of_band in tasks)
    ranks = f"{slab.comm.size} rank{'s' * (slab.comm.size > 1)}"
    yield f"parcontact: {sum(map(len, tasks))} marches, {each * 1e3:.3g} ms a step; on {ranks}: {rounds * each:.3g} s"
