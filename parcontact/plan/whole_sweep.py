"""What a whole sweep costs: its first case is planned in full, some others are tried, the rest are taken to be alike.

The work of a case is its steps, or steady states, times N log N of its grid. A case that was not tried is taken to have
as much time for its work as the next one that was. Cases that run side by side (`side_by_side`) have a rank each.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ..history.timeline import Timeline
from ..job import Case, Job
from ..parallel.slab import Slab
from ..steady_sliding.curve import request
from . import planning, side_by_side
from .planning import Wanted
from .report import MARK, Costs, duration_text, ranks_text

TRIED = 3  # cases that are tried at most: the first, the last, and between them


def plan(cases: Sequence[Case], everyone: Slab, alone: Slab, wanted: Wanted, started: float) -> Iterator[str]:
    """Lines of the plan of all cases; collective, all ranks must take every line.

    `everyone` is a slab of all ranks, `alone` one of one rank; `started` the seconds of the program so far.
    """
    first = cases[0]
    words = [*wanted.words, "--case", str(first.number)]
    slab = everyone.resized(*first.job.grid.points)
    yield f"first of {len(cases)} cases: {', '.join(f'{key} = {value}' for key, value in first.settings.items())}"
    yield ""
    found: list[Costs] = []
    yield from planning.plan(first.job, slab, alone, replace(wanted, words=words), started, found)
    if not found:
        return
    yield ""
    yield from _whole(cases, found[0], slab, wanted, started)


def _whole(cases: Sequence[Case], first: Costs, slab: Slab, wanted: Wanted, started: float) -> Iterator[str]:
    rates, marked = {0: 1.0}, any(sample.disturbed for sample in first.scaling.samples)
    for index in places_to_try(len(cases))[1:]:
        job = cases[index].job
        tried = planning.try_job(job, slab.resized(*job.grid.points), wanted.seconds, started)
        if tried is not None:
            costs = planning.costs_on(first, job, tried)
            ranks = tried.ranks
            ratio = costs.marching(ranks) / first.marching(ranks) if first.marching(ranks) else 1.0
            rates[index] = ratio * work(cases[0].job) / work(job)
            marked = marked or tried.disturbed
    times = times_of_first(cases, rates)
    yield f"sweep of {len(cases)} cases: {', '.join(str(cases[index].number) for index in sorted(rates))} were tried"
    yield f"the others are taken to be like them; the longest takes {max(times) / times[0]:.3g} times the first"
    for count in wanted.ranks:
        at_once = side_by_side.count([case.job for case in cases], count)
        how = f"{at_once} cases at a time" if at_once > 1 else "one case after the other"
        seconds = duration_text(whole(first, times, count, at_once))
        yield f"  {ranks_text(count):>9}: {seconds}{MARK * marked} in all, {how}"


def places_to_try(count: int) -> list[int]:
    """Of so many cases: the first, the last, and between them."""
    few = min(TRIED, count)
    return sorted({round(number * (count - 1) / max(few - 1, 1)) for number in range(few)})


def work(job: Job) -> float:
    """Of a case, in proportion."""
    points = job.grid.nx * job.grid.ny
    steps = Timeline.of(job).count if job.history else len(request(job).points)
    return max(steps, 1) * points * math.log(points + 1)


def times_of_first(cases: Sequence[Case], rates: dict[int, float]) -> list[float]:
    """The time of the steps of each case over that of the first one, by the nearest that was tried."""
    unit = work(cases[0].job)
    nearest = [min(rates, key=lambda tried: abs(tried - index)) for index in range(len(cases))]
    return [rates[tried] * work(case.job) / unit for tried, case in zip(nearest, cases, strict=True)]


def whole(first: Costs, times: Sequence[float], ranks: int, at_once: int) -> float:
    """Seconds of all cases; the program starts once."""
    each = max(ranks // at_once, 1)
    starting = first.scaling.sample(ranks).starting
    case = first.whole(each) - first.scaling.sample(each).starting
    crowded = first.scaling.machine.slowed(ranks) / first.scaling.machine.slowed(each)
    return starting + max(sum(times) / at_once, max(times)) * case * crowded
