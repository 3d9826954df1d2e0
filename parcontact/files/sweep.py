"""The cases of a sweep, one after the other or at the same time; finished ones are skipped."""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TextIO

from ..errors import BAD_INPUT, DONE, FAILED, STOPPED_EARLY, Doubt, InputError, InUseError, RunError, SweepWarnings
from ..job import Case, Job
from ..job.listing import plain_job
from ..job.reading import CASES, sentences_of
from ..march.budget import exceeds
from ..parallel.root import Signals
from ..parallel.slab import Groups, Slab
from ..printed import name_cases, per_cent
from ..results import sweep_table
from ..results.results import Results
from . import files, outputs, stopping
from .outputs import refuse_files, refuse_other_jobs
from .stopping import StopFile

ELSEWHERE = -1  # in place of an exit code: another program runs the case
ENDS = {DONE: "done", STOPPED_EARLY: "stopped early", FAILED: "failed", BAD_INPUT: "refused", ELSEWHERE: "passed over"}

Shows = Callable[[Doubt], bool]
Act = Callable[[Job, Slab, Shows], int]


@dataclass(frozen=True)
class SweepRun:
    """A sweep of `cases`, to each of which `act` is applied; the constructor and all methods are collective.

    Groups of ranks take cases in turn, one at a time. `act` gets a job, the slab of the group, and a function that
    returns True if a warning is to be shown. `limit` is the latest end (time of `time.monotonic`); `shown` are warnings
    that were already shown. `runs` is True if `act` runs the cases; otherwise failures are not recorded.
    """

    cases: Sequence[Case]
    groups: Groups
    act: Act
    stop: StopFile
    quiet: bool = False
    limit: float | None = None
    shown: Sequence[Doubt] = ()
    runs: bool = True

    @cached_property
    def doubts(self) -> SweepWarnings:
        """Return the warnings about the cases of this group of ranks."""
        return SweepWarnings(self.shown, at_once=self.groups.count == 1)

    @cached_property
    def _refusals(self) -> dict[int, str]:
        """Return why cases of this group were refused, by their numbers."""
        return {}

    def run(self, chosen: Sequence[Case]) -> int:
        """Run the selected cases and collect the results of all cases; returns the exit code.

        A failed case does not stop the others, but gives exit code 1; if all cases are refused as bad input, it is 2.
        Finished cases, and cases that another program runs, are skipped; if only such a running case is selected,
        InUseError is raised. A case that stops early with a checkpoint stops the sweep with the cases that run at the
        same time, but no other program. So do signals and the end of the wall time. The file `stop` also stops other
        programs and is not removed. The same command continues the sweep.
        """
        directory = _directory(self.cases)
        new = [path for path in (directory / CASES, directory, *directory.parents) if not path.exists()]
        with Signals().noted() as signals:  # also on waiting ranks, whose end would end the others
            ends = self._take(_deal(chosen, self.groups), signals)
            found = self.groups.from_all((ends, self._refusals, self.doubts.kinds))
        codes = [code for ends, *_ in found for code in ends]
        refused = set(codes) == {BAD_INPUT}
        if self.groups.root:
            self.stop.forget_own()
            if refused and not (directory / outputs.SWEEP.table).is_file():  # nothing is written if no case ever ran
                with suppress(OSError):
                    for path in new:
                        path.rmdir()
            else:
                self._record_refusals({number: reason for _, some, _ in found for number, reason in some.items()})
            for text in self.doubts.summary([kinds for *_, kinds in found]):
                print_line(f"warning: {text}", sys.stderr)
            if STOPPED_EARLY not in codes and not self.quiet and not refused:
                print_line(f"results of all cases: {Results(directory, 'sweep').points}")
            elif STOPPED_EARLY in codes and self.groups.count > 1 and not self.quiet:
                print_line("stopped early; run again to go on")
            if self.runs and STOPPED_EARLY not in codes and len(chosen) > 1:
                self._report_errors(chosen)
        if STOPPED_EARLY in codes:
            return STOPPED_EARLY
        return BAD_INPUT if refused else FAILED if {FAILED, BAD_INPUT} & set(codes) else DONE

    def _record_refusals(self, refusals: Mapping[int, str]) -> None:
        """Record that cases were refused, by their numbers, if `act` runs them; root only."""
        if refusals and self.runs:
            for number, reason in refusals.items():
                sweep_table.fail(self.cases[number], reason)
            self._collect()

    def _report_errors(self, chosen: Sequence[Case]) -> None:
        """Print the largest estimated errors, and warn about cases whose errors exceed their accuracy; root only."""
        asked = {case.number: case.job.numerics.asked.both for case in chosen}
        for k, found in enumerate(sweep_table.sweep_errors(chosen)):
            if not found:
                continue
            worst, what = max(found, key=lambda number: found[number]), ("friction", "the corrected contact area")[k]
            if not self.quiet:
                print_line(f"largest estimated error of {what}: {per_cent(found[worst], 3)}, in case {worst}")
            if beyond := [number for number, error in found.items() if exceeds(error, asked[number][k])]:
                more = f"the estimated error of {what} exceeds numerics.accuracy in {name_cases(beyond)}"
                print_line(f"warning: {more}; the log of each case says how to reduce it", sys.stderr)

    def _take(self, own: Sequence[Case], signals: Signals) -> list[int]:
        """Run the cases of this group; returns their exit codes. If it stops early, the other groups stop too."""
        codes, side_by_side = list[int](), self.groups.count > 1
        for case in own:
            slab = Slab(self.groups.comm, *case.job.grid.points)
            speaks = slab.root and not self.quiet
            if reason := self._reason_to_stop(slab, signals):
                if slab.root and self.runs:
                    self._collect()
                if speaks:
                    print_line(f"stopped before case {case.number}: {reason}; run again to go on")
                return [*codes, self._stop_others(slab)]
            if speaks:
                print_line(f"{case} (of {len(self.cases)})")
            ended = self._attempt(case, slab, alone=not side_by_side and len(own) == 1)
            codes.append(ended)
            if slab.root and ended != BAD_INPUT and self._collect() == FAILED:
                codes.append(FAILED)
            if speaks and side_by_side:
                print_line(f"case {case.number}: {ENDS[ended]}")
            if ended == STOPPED_EARLY:
                return [*codes, self._stop_others(slab)]
        return codes

    def _collect(self) -> int:
        """Write the tables of the sweep; returns the exit code, FAILED if they cannot be written. Root only."""
        directory = _directory(self.cases)
        try:
            sweep_table.write_sweep_tables(directory, self.cases)
        except OSError as error:
            reason = error.strerror or error
            print_line(
                f"parcontact: cannot write the tables of {directory}: {reason}; run again to write them", sys.stderr
            )
            return FAILED
        return DONE

    def _reason_to_stop(self, slab: Slab, signals: Signals) -> str:
        """Return why no further case begins, or ''; signals may reach any rank; collective."""
        if slab.reduce((), [float(signals.stop)])[0]:
            return stopping.REASONS[stopping.SIGNAL]
        used_up = self.limit is not None and time.monotonic() + stopping.RESERVE_SECONDS > self.limit
        why = stopping.WALL if used_up else stopping.FILE if self.stop.asks else stopping.GO
        return stopping.REASONS.get(slab.agree(why), "")

    def _stop_others(self, slab: Slab) -> int:
        if slab.root and self.groups.count > 1:
            self.stop.ask_own()
        return STOPPED_EARLY

    def _attempt(self, case: Case, slab: Slab, alone: bool) -> int:
        """Run a case and return its exit code; raises InUseError if another program runs it and it is `alone`."""
        self.doubts.begin(case.number)
        reason = ""
        try:
            code = self.act(case.job, slab, self.doubts.shows)
        except InUseError as error:
            if alone:
                raise
            if slab.root:
                print_line(f"parcontact: case {case.number} is being run by another program: {error}", sys.stderr)
            return ELSEWHERE
        except (InputError, RunError) as error:
            code, reason = BAD_INPUT if isinstance(error, InputError) else FAILED, str(error)
        if code == BAD_INPUT:
            self._refusals[case.number] = reason
        elif slab.root and self.runs:
            sweep_table.fail(case, reason or ("some points have failed" if code == FAILED else ""))
        if slab.root and reason:
            print_line(f"parcontact: case {case.number}: {reason}", sys.stderr)
        return code


def print_line(text: str, file: TextIO | None = None) -> None:
    """Print and flush a line, so that lines of several groups do not mix."""
    print(f"{text}\n", end="", file=file, flush=True)


def _deal(chosen: Sequence[Case], groups: Groups) -> Sequence[Case]:
    """Return the cases of this rank's group; unfinished cases are divided evenly among groups; collective."""
    if groups.count == 1:
        return chosen
    order: list[int] = groups.agree(unfinished_first(chosen) if groups.root else [])
    return [chosen[index] for index in order[groups.number :: groups.count]]


def unfinished_first(chosen: Sequence[Case]) -> list[int]:
    """Return the indices of cases, unfinished ones first; root only."""
    finished = [sweep_table.state(case) == "done" for case in chosen]
    return sorted(range(len(chosen)), key=lambda index: (finished[index], index))


def to_do(chosen: Sequence[Case], afresh: bool) -> list[Job]:
    """Return the jobs of the cases that still have to run, which are all of them if the sweep starts `afresh`; root
    only."""
    return [case.job for case in chosen if afresh or sweep_table.state(case) != "done"]


def refuse_foreign_sweep(cases: Sequence[Case]) -> None:
    """Raise InputError if the directory of a sweep has foreign files or files of another job, or a link in place of a
    case's directory; root only."""
    directory, first = _directory(cases), cases[0]
    for path in (directory / CASES, *(case.job.output.directory for case in cases)):
        if path.is_symlink():
            raise InputError(f"{path} is a symbolic link, which is not followed: remove it, or give --out")
    files.refuse_pipes(directory)
    try:
        claims = outputs.read_claims(directory)
        entries = [path.name for path in directory.iterdir()] if directory.is_dir() else []
    except (OSError, ValueError) as error:
        raise InputError(f"the output directory {directory} cannot be used: {error}") from error
    refuse_other_jobs(directory, claims, plain_job(first.job))
    for case in cases:
        there = case.job.output.directory
        refuse_other_jobs(there, outputs.sound_claims(there), plain_job(case.job))
    if not claims and not {CASES, outputs.SWEEP.table} & set(entries):
        refuse_files(directory, entries)


def warn_once(cases: Sequence[Case]) -> list[Doubt]:
    """Print the warnings about the jobs of cases, one per subject; root only. Returns all warnings."""
    for text in sentences_of(cases, lambda job: job.doubts):
        print(f"warning: {text}", file=sys.stderr, flush=True)
    return [doubt for case in cases for doubt in case.job.doubts]


def stop_file(cases: Sequence[Case]) -> StopFile:
    """Return the stop file of a sweep."""
    return StopFile.from_now_on(_directory(cases) / outputs.STOP)


def _directory(cases: Sequence[Case]) -> Path:
    return cases[0].job.output.directory.parent.parent
