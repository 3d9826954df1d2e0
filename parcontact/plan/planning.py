"""Plans of jobs: effects, memory per rank, and the costs by a trial.

The first case of a sweep is planned in full. The last case and some between are tried. The times of the others follow
from the nearest tried case in proportion to their work, which is steps (or steady states) times N log N.
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
from . import printed_plan
from .costs import Costs, costs_of, measure_write_rate
from .sample import measure_program, sample
from .trial_grids import choose_grid

TRIED_CASES = 3  # tuning: most cases of a sweep that are tried


@dataclass
class Planner:
    """Plans jobs: memory for the numbers of `ranks`, and a trial of about `seconds` [s] per job; `started` [s] is the
    time that the program took to start. The costs of tried jobs are appended to `found`."""

    ranks: Sequence[int]
    seconds: float
    started: float
    found: list[Costs] = field(default_factory=list)

    def plan(self, job: Job, slab: Slab) -> Iterator[str]:
        """Yield the plan of a job as lines; collective: all ranks must exhaust the iterator."""
        yield from printed_plan.effects(job)
        yield ""
        if job.history:
            yield from printed_plan.maps(job, self.ranks, measure_program(job, slab))
            yield ""
            yield from self._describe(job, slab)
        if job.steady:
            yield from [""] * bool(job.history)
            yield from self._describe(only_steady_states(job), slab)

    def plan_sweep(self, cases: Sequence[Case], groups: Groups) -> Iterator[str]:
        """Yield the plan of all cases, of which each group of ranks runs one at a time; collective like `plan`."""
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
        others = "times of the others follow from their work; " if len(tried) < len(cases) else ""
        yield f"{others}the longest case takes {max(times) / times[0]:.3g} times as long as the first"
        how = f"{groups.count} cases at a time" if groups.count > 1 else "one case after the other"
        on = printed_plan.ranks_text(groups.everyone.size)
        yield f"on {on}: {printed_plan.duration_text(whole)} in all, {how}"

    def try_job(self, job: Job, slab: Slab) -> Costs | None:
        """Return the costs of a job by a trial on its grid or a coarser one, or None if it is too large; collective."""
        tried = slab.agree(choose_grid(job, slab.comm.size, self.seconds) if slab.root else None)
        if tried is None:
            return None
        own = slab.resized(*tried.grid.points)
        wisdom.recall(choices(tried).transforms, own, None)
        seen = sample(tried, own, self.seconds, self.started)
        wisdom.keep(choices(tried).transforms, own)
        return costs_of(job, seen, slab.agree(measure_write_rate(job.output.directory) if slab.root else 0.0))

    def _describe(self, job: Job, slab: Slab) -> Iterator[str]:
        """Yield lines on the costs of the steps of a job, or of its steady states; collective."""
        bar = progress.Bar(1, f"trying the job for about {self.seconds:g} s", "trial", slab.root)
        try:
            costs = self.try_job(job, slab)
        finally:
            bar.close()
        if costs is None:
            yield "the job is too large for a trial on this machine: its time is unknown"
            return
        self.found.append(costs)
        yield from printed_plan.steps(costs)
        yield from printed_plan.times(costs)


def only_steady_states(job: Job) -> Job:
    """Return the job with its steady states only."""
    section = job.steady.model_copy(update={"pressures": request(job).pressures}) if job.steady else None
    return job.model_copy(update={"history": (), "steady": section, "initial": type(job.initial)()})


def cases_to_try(count: int) -> list[int]:
    """Return the indices of the first case, the last, and some between them."""
    few = min(TRIED_CASES, count)
    return sorted({round(number * (count - 1) / max(few - 1, 1)) for number in range(few)})


def case_times(cases: Sequence[Case], tried: dict[int, float]) -> list[float]:
    """Return the time of each case [s] from the nearest tried case, in proportion to its work."""
    nearest = [min(tried, key=lambda index: abs(index - place)) for place in range(len(cases))]
    return [
        tried[index] * _work(case.job) / _work(cases[index].job) for index, case in zip(nearest, cases, strict=True)
    ]


def _work(job: Job) -> float:
    """Return the relative work of a case."""
    points = job.grid.nx * job.grid.ny
    steps = Timeline.from_job(job).count if job.history else len(request(job).points)
    return max(steps, 1) * points * math.log(points + 1)
