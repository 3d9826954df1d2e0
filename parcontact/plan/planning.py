"""Plans of jobs: effects, memory per rank, and steps and times by a trial.

The first case of a sweep is planned in full. The last case and one between are tried. The times of the others follow
from the nearest tried case in proportion to their work, which is steps (or steady states) times N log N.
"""

import math
import re
import resource
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from .. import progress
from ..history.timeline import Timeline
from ..job import Case, Job
from ..parallel.groups import Groups
from ..parallel.slab import Slab
from ..steady_sliding.curve import request
from . import printed_plan
from .trial import Trial, try_job, warm_up

TRIED_CASES = 3  # tuning: most cases of a sweep that are tried
KILO = 1024  # unit of resident memory in `getrusage` [bytes]


@dataclass
class Planner:
    """Plans jobs for the numbers of `ranks`, within about `seconds` [s] of the processor since the program began,
    of which the first half may be used up before a trial; `started` [s] is the time that the program took to start.

    Trials are appended to `found`, and `overhead` is the time of an operator call on a few points [s].
    """

    ranks: Sequence[int]
    seconds: float
    started: float
    found: list[Trial] = field(default_factory=list)
    overhead: float = 0.0

    def plan(self, job: Job, slab: Slab, trials: int = 1) -> Iterator[str]:
        """Yield the plan of a job as lines, which is one of several trials; collective: all ranks must exhaust the
        iterator."""
        yield from printed_plan.effects(job)
        parts = [job] * bool(job.history) + [only_steady_states(job)] * (job.steady is not None)
        for part in parts:
            self.overhead = warm_up(part, slab)
            yield ""
            yield from printed_plan.maps(part, self.ranks, measure_program(slab))
            yield ""
            yield from self._describe(part, slab, trials * len(parts))

    def plan_sweep(self, cases: Sequence[Case], groups: Groups) -> Iterator[str]:
        """Yield the plan of all cases, of which each group of ranks runs one at a time; collective like `plan`."""
        first, slab, tries = cases[0], Slab(groups.comm, *cases[0].job.grid.points), cases_to_try(len(cases))
        yield f"first of {len(cases)} cases: {', '.join(f'{key} = {value}' for key, value in first.settings.items())}"
        yield ""
        yield from self.plan(first.job, slab, len(tries))
        if not self.found:
            return
        yield ""
        tried = {0: self.found[0]}
        for place, index in enumerate(tries[1:], 1):
            if found := try_job(cases[index].job, slab, self._left(slab, len(tries) - place)):
                tried[index] = found
        known = {index: found.case(groups.comm.size, self.overhead) for index, found in tried.items()}
        times = case_times(cases, known)
        whole = self.started + max(sum(times) / groups.count, *times)
        yield f"sweep of {len(cases)} cases: {', '.join(str(cases[index].number) for index in tried)} were tried"
        others = "times of the others follow from their work; " if len(tried) < len(cases) else ""
        yield f"{others}the longest case takes {max(times) / times[0]:.3g} times as long as the first"
        how = f"{groups.count} cases at a time" if groups.count > 1 else "one case after the other"
        on = printed_plan.ranks_text(groups.everyone.size)
        yield f"on {on}: {printed_plan.duration_text(whole)} in all, {how}"

    def _left(self, slab: Slab, trials: int) -> float:
        """Return the time of the next of some trials [s]; collective."""
        return slab.agree(max(self.seconds - time.process_time(), self.seconds / 2.0) / trials)

    def _describe(self, job: Job, slab: Slab, trials: int) -> Iterator[str]:
        """Yield lines on the costs of the steps of a job, or of its steady states; collective."""
        bar = progress.Bar(1, "trying some steps of the job", "trial", slab.root)
        try:
            found = try_job(job, slab, self._left(slab, trials))
        finally:
            bar.close()
        if found is None:
            yield "the job is too large for a trial in this time: its time is unknown; give more, --seconds 60"
            return
        self.found.append(found)
        yield from printed_plan.steps(found)
        yield from printed_plan.times(found, self.ranks, self.started, self.overhead)


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


def measure_program(slab: Slab) -> int:
    """Return the largest number of bytes that a rank has taken so far: libraries and loops, if no large maps were made.

    Collective.
    """
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
