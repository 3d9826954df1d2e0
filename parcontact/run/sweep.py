"""The cases of a sweep, one after the other; those that have finished are passed over."""

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import InputError, RunError
from ..job import Case, Job
from ..job.reading import CASES
from ..parallel.slab import Slab
from ..record import marker, sweep_table
from ..record.directory import BESIDE, SHOWN
from . import watch
from .journey import AGAIN, DONE

FAILED = 1
STOP = "stop"  # a file of this name in the directory of the sweep ends it after the case that runs


def run(
    cases: Sequence[Case],
    chosen: Sequence[Case],
    slab_of: Callable[[Job], Slab],
    act: Callable[[Job, Slab], int],
    quiet: bool = False,
    runs: bool = True,
    limit: float | None = None,
) -> int:
    """Do `act` with each of the chosen cases, and collect what all have come to; collective. Returns the exit code.

    A case that fails does not stop the others: the code is 1 in the end. One that stops early with a checkpoint stops
    the sweep, with its code: the same command goes on with it. So do a stop file, and the end of the wall time, `limit`
    in the time of `time.time`, before a case begins. Unless `act` runs the case, its failure is not noted.
    """
    directory, code = _directory(cases), DONE
    for case in chosen:
        slab = slab_of(case.job)
        if reason := slab.agree(_reason_to_stop(directory, limit) if slab.root else ""):
            if slab.root and not quiet:
                print(f"stopped before case {case.number}: {reason}; run again to go on", flush=True)
            return AGAIN
        if slab.root and not quiet:
            print(f"{case} (of {len(cases)})", flush=True)
        ended = _attempt(case, slab, act, runs)
        if slab.root:
            sweep_table.write(directory, cases)
        if ended == AGAIN:
            return AGAIN
        code = max(code, ended)
    if slab.root and not quiet:
        print(f"results of all cases: {directory / sweep_table.TABLE}", flush=True)
    return code


def warn_once(cases: Sequence[Case]) -> list[str]:
    """Warn of what is doubtful about the jobs of cases, each text once with the cases that it holds for; root only.

    Returns the texts.
    """
    found: dict[str, list[int]] = {}
    for case in cases:
        for text in dict.fromkeys(case.job.warnings):
            found.setdefault(text, []).append(case.number)
    for text, numbers in found.items():
        which = "all cases" if len(numbers) == len(cases) else f"case{'s' * (len(numbers) > 1)} {_ranges(numbers)}"
        print(f"warning: {text} ({which})", file=sys.stderr, flush=True)
    return list(found)


def _ranges(numbers: Sequence[int]) -> str:
    """Ascending numbers as `0, 2-5`."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def refuse_foreign(cases: Sequence[Case]) -> None:
    """Raise InputError where the files of others, or of another job, are in the directory of a sweep; root only."""
    directory, first = _directory(cases), cases[0]
    try:
        claims = marker.read(directory)
        entries = [path.name for path in directory.iterdir()] if directory.is_dir() else []
    except (OSError, ValueError) as error:
        raise InputError(f"the output directory {directory} cannot be used: {error}") from error
    for verb, claim in claims.items():
        if found := "; ".join(marker.differences(claim.job, marker.plain_job(first.job), marker.SCENE)):
            raise InputError(
                f"the output directory {directory} holds {marker.VERBS[verb]} of another job: {found}; give --out for "
                "another directory"
            )
    foreign = sorted(name for name in entries if not name.startswith(".") and name not in BESIDE)
    if foreign and not claims and not {CASES, sweep_table.TABLE} & set(foreign):
        names = ", ".join(foreign[:SHOWN]) + (f" and {len(foreign) - SHOWN} more" * (len(foreign) > SHOWN))
        raise InputError(
            f"the output directory {directory} is not empty and not of this program: it holds {names}; give --out for "
            "another directory"
        )


def _directory(cases: Sequence[Case]) -> Path:
    return cases[0].job.output.directory.parent.parent


def _attempt(case: Case, slab: Slab, act: Callable[[Job, Slab], int], runs: bool) -> int:
    reason = ""
    try:
        code = act(case.job, slab)
    except (InputError, RunError) as error:
        code, reason = FAILED, str(error)
    if slab.root and runs:
        sweep_table.fail(case, reason or ("some points have failed" if code == FAILED else ""))
    if slab.root and reason:
        print(f"parcontact: case {case.number}: {reason}", file=sys.stderr, flush=True)
    return code


def _reason_to_stop(directory: Path, limit: float | None) -> str:
    if limit is not None and time.time() + watch.RESERVE_SECONDS > limit:
        return watch.REASONS[watch.WALL]
    file = directory / STOP
    found = file.exists()
    file.unlink(missing_ok=True)
    return watch.REASONS[watch.FILE] if found else ""
