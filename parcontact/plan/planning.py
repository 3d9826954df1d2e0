"""A plan is made: effects, memory per rank, and a trial of the job that says what it costs.

Of a sweep the first case is planned in full, the last and one between are tried too, and the others are taken to be as
long for their work, steps or steady states times N log N of their grids, as the next one that was tried.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from .. import progress
from ..history.timeline import Timeline
from ..job import Case, Job
from ..parallel.groups import Groups
from ..parallel.slab import Slab
from ..scene import choices
from ..steady_sliding.curve import request
from ..storage import wisdom
from . import price, printed_plan
from .costs import Costs, costs_of, measure_write_rate
from .sample import measure_program, sample
from .trial_grids import choose_grid

TRIED_CASES = 3  # tuning: cases that are tried at most: the first, the last, and between them


@dataclass
class Planner:
    """Plans jobs: memory for some numbers of `ranks`, each tried for about so many `seconds`; the program has run for
    `started` seconds so far. What the jobs that were tried cost is in `found`."""

    ranks: Sequence[int]
    seconds: float
    started: float
    found: list[Costs] = field(default_factory=list)

    def plan(self, job: Job, slab: Slab) -> Iterator[str]:
        """Lines of the plan of a job, its run and its steady states; collective, all ranks must take every line."""
        yield from printed_plan.effects(job)
        yield ""
        if job.history:
            yield from printed_plan.maps(job, self.ranks, measure_program(job, slab))
            yield ""
            yield from self._tell(job, slab, job)
        if job.steady:
            yield from [""] * bool(job.history)
            yield from self._tell(only_steady_states(job), slab, job)

    def plan_sweep(self, cases: Sequence[Case], groups: Groups) -> Iterator[str]:
        """Lines of the plan of all cases, of which each group of ranks runs one at a time; collective like `plan`."""
        first = cases[0]
        slab = Slab(groups.comm, *first.job.grid.points)
        yield f"first of {len(cases)} cases: {', '.join(f'{key} = {value}' for key, value in first.settings.items())}"
        yield ""
        yield from self.plan(first.job, slab)
        if not self.found:
            return
        yield ""
        tried = {0: self.found[0]}
        for index in cases_to_try(len(cases))[1:]:
            job = cases[index].job
            if costs := self.try_job(job, slab.resized(*job.grid.points)):
                tried[index] = costs
        times = case_times(cases, {index: costs.case for index, costs in tried.items()})
        whole = tried[0].sample.starting + max(sum(times) / groups.count, *times)
        yield f"sweep of {len(cases)} cases: {', '.join(str(cases[index].number) for index in tried)} were tried"
        others = "the others are assumed to be like them; " if len(tried) < len(cases) else ""
        yield f"{others}the longest takes {max(times) / times[0]:.3g} times the first"
        how = f"{groups.count} cases at a time" if groups.count > 1 else "one case after the other"
        on = printed_plan.ranks_text(groups.everyone.size)
        yield f"on {on}: {printed_plan.duration_text(whole)} in all, {how}"

    def try_job(self, job: Job, slab: Slab) -> Costs | None:
        """Try a job, or the same on a grid that is coarse enough, with the transforms its run will have; collective."""
        tried = slab.agree(choose_grid(job, slab.comm.size, self.seconds) if slab.root else None)
        if tried is None:
            return None
        own = slab.resized(*tried.grid.points)
        wisdom.recall(choices(tried).transforms, own, None)
        seen = sample(tried, own, self.seconds, self.started)
        wisdom.keep(choices(tried).transforms, own)
        return costs_of(job, seen, slab.agree(measure_write_rate(job.output.directory) if slab.root else 0.0))

    def _tell(self, job: Job, slab: Slab, whole: Job) -> Iterator[str]:
        """Lines on the costs of the steps, or the steady states, of a `whole` job; collective."""
        bar = progress.Bar(1, f"trying the job for some {self.seconds:g} s", "trial", slab.root)
        try:
            costs = self.try_job(job, slab)
        finally:
            bar.close()
        if costs is None:
            yield "too large to be tried here: its time is unknown"
            return
        self.found.append(costs)
        yield from printed_plan.steps(costs)
        yield from printed_plan.times(costs)
        yield ""
        yield from price.table(costs, whole)


def only_steady_states(job: Job) -> Job:
    """The job of `parcontact steady`."""
    section = job.steady.model_copy(update={"pressures": request(job).pressures}) if job.steady else None
    return job.model_copy(update={"history": (), "steady": section, "initial": type(job.initial)()})


def cases_to_try(count: int) -> list[int]:
    """Return the numbers of the first case, the last, and some between them."""
    few = min(TRIED_CASES, count)
    return sorted({round(number * (count - 1) / max(few - 1, 1)) for number in range(few)})


def case_times(cases: Sequence[Case], tried: dict[int, float]) -> list[float]:
    """The seconds of each case from those of some, by the work of each and the nearest that was tried."""
    nearest = [min(tried, key=lambda index: abs(index - place)) for place in range(len(cases))]
    return [
        tried[index] * _work(case.job) / _work(cases[index].job) for index, case in zip(nearest, cases, strict=True)
    ]


def _work(job: Job) -> float:
    """Return the work of a case, in proportion."""
    points = job.grid.nx * job.grid.ny
    steps = Timeline.from_job(job).count if job.history else len(request(job).points)
    return max(steps, 1) * points * math.log(points + 1)
