"""The text of a plan."""

import time
from collections.abc import Iterator, Sequence

from ..job import Job
from ..scene import choices
from . import memory
from .trial import Trial

SUMS_PER_STEP = 1  # sums over ranks per step outside of the march, to decide whether to stop
DAY, YEAR = 86400.0, 365.25 * 86400.0  # [s]
LARGE = 1e10  # least size that is printed in GB [bytes]
OF_STEADY_STATES = (
    *("viscoelasticity", "isolated contact", "layer", "surface spectrum", "preconditioner in single precision"),
    *("interface", "thermal", "counterbody", "softening"),
)
ON_TILES = "more on rank 0 (tiles), at most"
TO_ASK_FOR = "to ask a batch system for"
STEADY_START, STEADY_STATES = "steady start, before", "steady states"


def effects(job: Job) -> Iterator[str]:
    """Yield a line for each effect, on or off, and why; for a friction curve only effects of steady states."""
    found = [effect for effect in choices(job).decisions if job.history or effect.name in OF_STEADY_STATES]
    width = max(len(effect.name) for effect in found)
    yield "effects"
    for effect in sorted(found, key=lambda effect: not effect.on):
        yield f"  {'on' if effect.on else 'off':3}  {effect.name:{width}}  {effect.why}"


def maps(job: Job, ranks: Sequence[int], program: int) -> Iterator[str]:
    """Yield a table of the memory of a rank by purpose; `program` is its memory without maps [bytes]."""
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
    """Yield lines on the number of steps, or steady states, and on the work of each."""
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
    """Yield a table of times; on other numbers of ranks than those of the trial each has its share of the work."""
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
    """Return the name and the size [bytes] of the unit for values up to `most` [bytes]."""
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
