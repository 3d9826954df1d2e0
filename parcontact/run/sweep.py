"""The cases of a sweep, one after the other or side by side; those that have finished are passed over."""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError, InUseError, RunError
from ..job import Case, Job, identity
from ..job.reading import CASES
from ..parallel.groups import Groups
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..storage import marker, stopfile
from ..storage.directory import refuse_files, refuse_other_jobs
from ..storage.stopfile import StopFile
from ..summary import sweep_table
from . import watch
from .run import DONE, STOPPED_EARLY
from .sweep_warnings import SweepWarnings, warn

FAILED = 1
ELSEWHERE = -1  # no exit code: of a case that another program runs
ENDS = {
    DONE: "done",
    STOPPED_EARLY: "stopped early",
    FAILED: "failed",
    ELSEWHERE: "passed over",
}

Shows = Callable[[str], bool]
Act = Callable[[Job, Slab, Shows], int]


@dataclass(frozen=True)
class Manner:
    """How a sweep is done: `quiet`; until when at most, `limit` in the time of `time.monotonic`; `told`, the warnings
    that were shown before. Unless it `runs` its cases, their failures are not noted."""

    quiet: bool = False
    limit: float | None = None
    told: Sequence[str] = ()
    runs: bool = True


def run(
    cases: Sequence[Case],
    chosen: Sequence[Case],
    groups: Groups,
    act: Act,
    stop: StopFile,
    manner: Manner = Manner(),
) -> int:
    """Do `act` with each of the chosen cases, and collect what all have come to; collective. Returns the exit code.

    Several groups of ranks take the cases by turns, each group one at a time. `act` has a job, the slab of the group,
    and what says whether a warning is shown.

    A case that fails does not stop the others: the code is 1 in the end. One that another program runs is passed over,
    like those that have finished; if it is the only one, InUseError is raised. One that stops early with a checkpoint
    stops the sweep, with its code, and the cases beside it, but no other program: the same command goes on with them.
    So do the file `stop`, which stops other programs too, and the end of the wall time. The file stays: others may not
    have seen it yet, and it stops no later one.
    """
    doubts = SweepWarnings(manner.told, at_once=groups.count == 1)
    code = _go(cases, dealt(chosen, groups), groups, act, stop, manner, doubts)
    with Signals().noted():  # one that ends the ranks that wait here would end the others with them
        found = groups.from_all((code, doubts.kinds))
    codes = [one for one, _ in found]
    if groups.root:
        stop.forget_own()
        for text in doubts.summary([kinds for _, kinds in found]):
            warn(text)
        if STOPPED_EARLY not in codes and not manner.quiet:
            _say(f"results of all cases: {_directory(cases) / sweep_table.TABLE}")
    return STOPPED_EARLY if STOPPED_EARLY in codes else max(codes)


def dealt(chosen: Sequence[Case], groups: Groups) -> Sequence[Case]:
    """The cases of the group of this rank: every group has as many of those that have not finished as the others, give
    or take one; collective."""
    if groups.count == 1:
        return chosen
    order: list[int] = groups.agree(unfinished_first(chosen) if groups.root else [])
    return [chosen[index] for index in order[groups.number :: groups.count]]


def unfinished_first(chosen: Sequence[Case]) -> list[int]:
    """The places of cases in a list of them, first of those that have not finished; root only."""
    finished = [sweep_table.state(case) == "done" for case in chosen]
    return sorted(range(len(chosen)), key=lambda index: (finished[index], index))


def to_do(chosen: Sequence[Case], afresh: bool) -> list[Job]:
    """The jobs of all cases that something is to be done for; root only."""
    return [case.job for case in chosen if afresh or sweep_table.state(case) != "done"]


def _go(
    cases: Sequence[Case],
    own: Sequence[Case],
    groups: Groups,
    act: Act,
    stop: StopFile,
    manner: Manner,
    doubts: SweepWarnings,
) -> int:
    """The cases of one group of ranks; returns the exit code. If it stops early, so do the others."""
    directory, code = _directory(cases), DONE
    for case in own:
        slab = Slab(groups.comm, *case.job.grid.points)
        speaks = slab.root and not manner.quiet
        if reason := slab.agree(_reason_to_stop(stop, manner.limit) if slab.root else ""):
            if speaks:
                _say(f"stopped before case {case.number}: {reason}; run again to go on")
            return STOPPED_EARLY
        if speaks:
            _say(f"{case} (of {len(cases)})")
        doubts.begin(case.number)
        try:
            ended = _attempt(case, slab, lambda job, slab: act(job, slab, doubts.shows), manner.runs)
        except InUseError as error:
            if groups.count == len(own) == 1:
                raise
            _complain(slab, f"case {case.number} is being run by another program: {error}")
            ended = ELSEWHERE
        if slab.root:
            sweep_table.write(directory, cases)
        if speaks and groups.count > 1:
            _say(f"case {case.number}: {ENDS[ended]}")
        if ended == STOPPED_EARLY:
            if slab.root and groups.count > 1:
                stop.ask_own()
            return STOPPED_EARLY
        code = max(code, ended)
    return code


def refuse_foreign(cases: Sequence[Case]) -> None:
    """Raise InputError where the files of others, or of another job, are in the directory of a sweep; root only."""
    directory, first = _directory(cases), cases[0]
    try:
        claims = marker.read(directory)
        entries = [path.name for path in directory.iterdir()] if directory.is_dir() else []
    except (OSError, ValueError) as error:
        raise InputError(f"the output directory {directory} cannot be used: {error}") from error
    refuse_other_jobs(directory, claims, identity.plain_job(first.job))
    if not claims and not {CASES, sweep_table.TABLE} & set(entries):
        refuse_files(directory, entries)


def _say(text: str) -> None:
    """A line at once: those of several groups do not mingle."""
    print(f"{text}\n", end="", flush=True)


def stop_file(cases: Sequence[Case]) -> StopFile:
    """What stops a sweep, and the cases that run, from now on."""
    return StopFile.from_now_on(_directory(cases) / stopfile.NAME)


def _directory(cases: Sequence[Case]) -> Path:
    return cases[0].job.output.directory.parent.parent


def _attempt(case: Case, slab: Slab, act: Callable[[Job, Slab], int], runs: bool) -> int:
    """Return the code with which a case ends; raises InUseError if another program runs it."""
    reason = ""
    try:
        code = act(case.job, slab)
    except InUseError:
        raise
    except (InputError, RunError) as error:
        code, reason = FAILED, str(error)
    if slab.root and runs:
        sweep_table.fail(case, reason or ("some points have failed" if code == FAILED else ""))
    if reason:
        _complain(slab, f"case {case.number}: {reason}")
    return code


def _complain(slab: Slab, text: str) -> None:
    if slab.root:
        print(f"parcontact: {text}", file=sys.stderr, flush=True)


def _reason_to_stop(stop: StopFile, limit: float | None) -> str:
    if limit is not None and time.monotonic() + watch.RESERVE_SECONDS > limit:
        return watch.REASONS[watch.WALL]
    return watch.REASONS[watch.FILE] if stop.asks else ""
