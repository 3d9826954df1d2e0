"""`parcontact plan`: what a job will do, and what it will cost, as text.

A plan lists the effects of a job and the memory of a rank. A trial gives the numbers of steps and their times.

The first case of a sweep is planned in full. The last case and one in between are tried. The times of other cases
follow from the nearest tried case in proportion to the work: the number of steps (or steady states) times N log N for N
points.
"""

import math
import re
import resource
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from .. import printed
from ..job import Case, Job
from ..job.history import Timeline
from ..job.listing import find_effects
from ..march.choices import choices
from ..march.curve import request
from ..parallel.slab import Groups, Slab
from . import memory
from .memory import Trial, try_job, warm_up

SUMS_PER_STEP = 1  # sums over ranks per step outside of the march, to decide whether to stop
DAY, YEAR = 86400.0, 365.25 * 86400.0  # [s]
LARGE = 1e10  # least size that is printed in GB [bytes]
OF_STEADY_STATES = ("viscoelasticity", "isolated contact", "surface spectrum", "preconditioner in single precision")
ON_TILES = "more on rank 0 (tiles), at most"
TO_ASK_FOR = "to ask a batch system for"
STEADY_START, STEADY_STATES = "steady start, before", "steady states"


def effects(job: Job) -> Iterator[str]:
    """Yield a line for each effect, on or off, with the reason; for a friction curve only effects of steady states."""
    own = [section for section, effect in find_effects().items() if getattr(effect, "in_curves", False)]
    known = {*OF_STEADY_STATES, *own}
    found = [effect for effect in choices(job).decisions if job.history or effect.name in known]
    width = max(len(effect.name) for effect in found)
    yield "effects"
    for effect in sorted(found, key=lambda effect: not effect.on):
        yield f"  {'on' if effect.on else 'off':3}  {effect.name:{width}}  {effect.why}"


def maps(job: Job, ranks: Sequence[int], program: int) -> Iterator[str]:
    """Yield a table of the memory of a rank by purpose; `program` is the memory of a rank without maps [bytes]."""
    if job.history:
        columns = [memory.holdings(job, count) for count in ranks]
    else:
        columns = [{STEADY_STATES: memory.steady_bytes(job, count)} for count in ranks]
    before = [STEADY_START] * choices(job).steady_start.on
    tiles = memory.on_tiles(job)
    width = max(map(len, (*columns[0], *before, *[ON_TILES] * bool(tiles), TO_ASK_FOR)))
    totals = [sum(column.values()) for column in columns]
    unit, size = unit_of(max(totals))
    yield f"{f'memory per rank [{unit}]':{width + 2}}" + "".join(f" {ranks_text(count):>12}" for count in ranks)
    for what in columns[0]:
        yield f"  {what:{width}}" + "".join(f"{column[what] / size:13.4g}" for column in columns)
    yield f"  {'in all':{width}}" + "".join(f"{total / size:13.4g}" for total in totals)
    if before:
        held = (memory.steady_start(job, count) / size for count in ranks)
        yield f"  {STEADY_START:{width}}" + "".join(f"{number:13.4g}" for number in held)
    if tiles:
        yield f"  {ON_TILES:{width}}" + f"{tiles / size:13.4g}" * len(ranks)
    yield f"  {'program without maps':{width}}" + f"{program / size:13.4g}" * len(ranks)
    asked = ((program + memory.most_bytes(job, count)) / size for count in ranks)
    yield f"  {TO_ASK_FOR:{width}}" + "".join(f"{number:13.4g}" for number in asked)
    if job.history:
        yield f"a checkpoint has {_bytes(memory.saved(job))}"


def steps(trial: Trial) -> Iterator[str]:
    """Yield lines on the number of steps, or steady states, and on the work of each step."""
    job, word = trial.job, "step" if trial.job.history else "state"
    whole = trial.tried >= trial.steps
    if job.steady and not job.history:
        yield f"parcontact steady: {trial.steps} steady states, {len(job.steady.velocities)} velocities"
    else:
        names = (f"{stage.name} {seen.steps}" for stage, seen in zip(job.history, trial.stages, strict=True))
        most = "" if whole else "about " if choices(job).chosen_steps.on else "at most " * choices(job).short_rest.on
        yield f"{most}{trial.steps} steps: {', '.join(names)}"
    calls, transforms, sums = (trial.total(name) / trial.steps for name in ("operator", "fft", "allreduce"))
    sums += SUMS_PER_STEP
    yield f"per {word}: {calls:.3g} operator calls, {transforms:.3g} transforms and {sums:.3g} sums over all ranks"
    if job.history and choices(job).fields.on:
        size = len(job.output.maps) * job.grid.nx * job.grid.ny * 8
        yield f"fields are saved {-(-trial.steps // job.output.every)} times, {_bytes(size)} each"
    nx, ny = trial.points
    grid = "" if (nx, ny) == job.grid.points else f" ({nx} x {ny} points instead)"
    rest = "" if whole else "; the others are assumed to cost the same"
    yield f"tried: {trial.tried} {word}s on {ranks_text(trial.ranks)}{grid}{rest}"


def times(trial: Trial, ranks: Sequence[int], started: float, overhead: float) -> Iterator[str]:
    """Yield a table of times; for other numbers of ranks than in the trial, each rank has its share of the work."""
    word = "a step" if trial.job.history else "a state"
    rows = {
        f"{word} [s]": [f"{trial.step(count, overhead):.3g}" for count in ranks],
        "in all": [duration_text(started + trial.case(count, overhead)) for count in ranks],
    }
    width = max(map(len, rows))
    yield f"{'time':{width + 2}}" + "".join(f" {ranks_text(count):>12}" for count in ranks)
    for name, cells in rows.items():
        yield f"  {name:{width}}" + "".join(f" {cell:>12}" for cell in cells)
    if {*ranks} != {trial.ranks}:
        yield f"tried on {ranks_text(trial.ranks)}; others share the work, without the time of messages between nodes"


def unit_of(most: float) -> tuple[str, float]:
    """Return the name and the size [bytes] of a unit that suits values up to `most` [bytes]."""
    return ("GB", 1e9) if most >= LARGE else ("MB", 1e6)


def _bytes(count: float) -> str:
    unit, size = unit_of(count)
    return f"{count / size:.4g} {unit}"


def ranks_text(count: int) -> str:
    """Return the number of ranks as text."""
    return "1 rank" if count == 1 else f"{count} ranks"


def duration_text(seconds: float) -> str:
    """Return a time [s] as text in s, hours and minutes, days or years."""
    if seconds < 600.0:
        return f"{seconds:.3g} s"
    if seconds < DAY:
        return time.strftime("%Hh%Mm", time.gmtime(seconds))
    return f"{seconds / DAY:.3g} days" if seconds < 1000 * DAY else f"{seconds / YEAR:.3g} years"


TRIED_CASES = 3  # tuning: most cases of a sweep that are tried
KILO = 1024  # unit of resident memory in `getrusage` [bytes]


@dataclass
class Planner:
    """Plans jobs for each number of ranks in `ranks`, within about `seconds` [s] of processor time since the program
    began. A trial gets at least half of this time. `started` [s] is the time that the program took to start.

    Trials are appended to `found`, and `overhead` is the time of an operator call on a few points [s].
    """

    ranks: Sequence[int]
    seconds: float
    started: float
    found: list[Trial] = field(default_factory=list)
    overhead: float = 0.0

    def plan(self, job: Job, slab: Slab, trials: int = 1) -> Iterator[str]:
        """Yield the lines of the plan of a job; collective: all ranks must exhaust the iterator. The planner divides
        its time between several `trials`; this trial is the first of them."""
        yield from effects(job)
        parts = [job] * bool(job.history) + [only_steady_states(job)] * (job.steady is not None)
        for part in parts:
            self.overhead = warm_up(part, slab)
            yield ""
            from ..files import run  # noqa: F401  # libraries and loops of a run count as memory of the program

            yield from maps(part, self.ranks, int(slab.reduce((), [float(peak_memory())])[0]))
            yield ""
            yield from self._describe(part, slab, trials * len(parts))

    def plan_sweep(self, cases: Sequence[Case], groups: Groups) -> Iterator[str]:
        """Yield the lines of a plan for all cases of a sweep; collective like `plan`. Each group of ranks runs one case
        at a time."""
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
        on = ranks_text(groups.everyone.size)
        yield f"on {on}: {duration_text(whole)} in all, {how}"

    def _left(self, slab: Slab, trials: int) -> float:
        """Return the time of the next of some trials [s]; collective."""
        return slab.agree(max(self.seconds - time.process_time(), self.seconds / 2.0) / trials)

    def _describe(self, job: Job, slab: Slab, trials: int) -> Iterator[str]:
        """Yield lines on the costs of the steps of a job, or of its steady states; collective."""
        bar = printed.Bar(1, "trying some steps of the job", "trial", slab.root)
        try:
            found = try_job(job, slab, self._left(slab, trials))
        finally:
            bar.close()
        if found is None:
            yield "the job is too large for a trial in this time: its time is unknown; give more, --seconds 60"
            return
        self.found.append(found)
        yield from steps(found)
        yield from times(found, self.ranks, self.started, self.overhead)


def only_steady_states(job: Job) -> Job:
    """Return the job without its history, with only its steady states."""
    section = job.steady.model_copy(update={"pressures": request(job).pressures}) if job.steady else None
    return job.model_copy(update={"history": (), "steady": section, "initial": type(job.initial)()})


def cases_to_try(count: int) -> list[int]:
    """Return the indices of the first case, the last, and some between them."""
    few = min(TRIED_CASES, count)
    return sorted({round(number * (count - 1) / max(few - 1, 1)) for number in range(few)})


def case_times(cases: Sequence[Case], tried: dict[int, float]) -> list[float]:
    """Return the time of each case [s] from the nearest tried case, in proportion to the work of both."""
    nearest = [min(tried, key=lambda index: abs(index - place)) for place in range(len(cases))]
    return [
        tried[index] * _work(case.job) / _work(cases[index].job) for index, case in zip(nearest, cases, strict=True)
    ]


def _work(job: Job) -> float:
    """Return the relative work of a case."""
    points = job.grid.nx * job.grid.ny
    steps = Timeline.from_job(job).count if job.history else len(request(job).points)
    return max(steps, 1) * points * math.log(points + 1)


def peak_memory() -> int:
    """Return the largest resident memory of this process so far [bytes].

    The kernel's `VmHWM` begins with the program. On systems without `VmHWM`, `ru_maxrss` is taken, which also counts
    the process that started the program.
    """
    with suppress(OSError):
        found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
        if found:
            return int(found[1]) * KILO
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * KILO
