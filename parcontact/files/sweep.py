"""Sweeps: runs of their cases, one after the other or at the same time, and tables of their results.

Finished cases are skipped. sweep.csv has a row per case, and sweep_curves.csv a row per point of friction curves;
sweep_mean.csv and sweep_curves_mean.csv contain means over seeds.
"""

import fcntl
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from statistics import fmean, stdev
from typing import Any, TextIO

from ..columns import SWEEP, SWEEP_RESULTS, added_names, choose_columns, names_of, to_csv
from ..errors import BAD_INPUT, DONE, FAILED, STOPPED_EARLY, Doubt, InputError, InUseError, RunError, SweepWarnings
from ..job import Case, Job
from ..job.history import Timeline
from ..job.listing import answers, plain_job
from ..job.reading import CASES, sentences_of
from ..march.budget import exceeds
from ..parallel.root import Signals
from ..parallel.slab import Groups, Slab
from ..printed import name_cases, per_cent
from ..results import slide
from ..results.results import CURVE_COLUMNS, CURVE_RESULTS, FAILURE, PLACES, SAMPLES, Results
from . import files, outputs, stopping, tables
from .outputs import refuse_files, refuse_other_jobs
from .stopping import StopFile

ELSEWHERE = -1  # in place of an exit code: another program runs the case
ENDS = {DONE: "done", STOPPED_EARLY: "stopped early", FAILED: "failed", BAD_INPUT: "refused", ELSEWHERE: "passed over"}

RESULTS = names_of(SWEEP_RESULTS)
SECTIONS = {column.when: added_names(SWEEP, column.when) for column in SWEEP if column.when}
FRICTION_ERRORS = ("mu_max_error", "mu_dyn_error")
THEORY = tuple(name for name in names_of(SWEEP) if name.startswith("theory_"))
MEANS = "mean", "std", "sem"
FIRST = {outputs.RUN.table: ("step", "time"), outputs.STEADY.table: ("velocity", "pressure")}  # first columns of tables
DAMAGED = "damaged"
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
        """Run the selected cases and collect the results of all cases. Return the exit code.

        A failed case does not stop the others, but gives exit code 1; if all cases are refused as bad input, the code
        is 2. Finished cases, and cases that another program runs, are skipped. If the only selected case runs in
        another program, InUseError is raised. A case that stops early with a checkpoint stops the sweep with the cases
        that run at the same time, but no other program. So do signals and the end of the wall time. The file `stop`
        also stops other programs and is not removed. The same command continues the sweep.
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
        """Record that cases were refused, by their numbers, if `act` runs them. Root only."""
        if refusals and self.runs:
            for number, reason in refusals.items():
                note_failure(self.cases[number], reason)
            self._collect()

    def _report_errors(self, chosen: Sequence[Case]) -> None:
        """Print the largest estimated errors, and warn about cases whose errors exceed their accuracy. Root only."""
        asked = {case.number: (*case.job.numerics.asked.both, math.inf) for case in chosen}
        for k, (what, found) in enumerate(sweep_errors(chosen).items()):
            if not found:
                continue
            worst = max(found, key=lambda number: found[number])
            if not self.quiet:
                print_line(f"largest estimated error of {what}: {per_cent(found[worst], 3)}, in case {worst}")
            if beyond := [number for number, error in found.items() if exceeds(error, asked[number][k])]:
                more = f"the estimated error of {what} exceeds numerics.accuracy in {name_cases(beyond)}"
                print_line(f"warning: {more}; the log of each case says how to reduce it", sys.stderr)

    def _take(self, own: Sequence[Case], signals: Signals) -> list[int]:
        """Run the cases of this group. Return their exit codes. If it stops early, the other groups stop too."""
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
        """Write the tables of the sweep. Return the exit code, FAILED if they cannot be written. Root only."""
        directory = _directory(self.cases)
        try:
            write_sweep_tables(directory, self.cases)
        except OSError as error:
            reason = error.strerror or error
            print_line(
                f"parcontact: cannot write the tables of {directory}: {reason}; run again to write them", sys.stderr
            )
            return FAILED
        return DONE

    def _reason_to_stop(self, slab: Slab, signals: Signals) -> str:
        """Return why no further case begins, or ''; signals may reach any rank. Collective."""
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
        """Run a case and return its exit code. Raises InUseError if another program runs it and it is `alone`."""
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
            note_failure(case, reason or ("some points have failed" if code == FAILED else ""))
        if slab.root and reason:
            print_line(f"parcontact: case {case.number}: {reason}", sys.stderr)
        return code


def print_line(text: str, file: TextIO | None = None) -> None:
    """Print and flush a line, so that lines of several groups do not mix."""
    print(f"{text}\n", end="", file=file, flush=True)


def _deal(chosen: Sequence[Case], groups: Groups) -> Sequence[Case]:
    """Return the cases of this rank's group; unfinished cases are divided evenly among groups. Collective."""
    if groups.count == 1:
        return chosen
    order: list[int] = groups.agree(unfinished_first(chosen) if groups.root else [])
    return [chosen[index] for index in order[groups.number :: groups.count]]


def unfinished_first(chosen: Sequence[Case]) -> list[int]:
    """Return the indices of the cases. Unfinished cases come first. Root only."""
    finished = [state_of(case) == "done" for case in chosen]
    return sorted(range(len(chosen)), key=lambda index: (finished[index], index))


def to_do(chosen: Sequence[Case], afresh: bool) -> list[Job]:
    """Return the jobs of the cases that still have to run. If the sweep starts `afresh`, these are all cases. Root
    only."""
    return [case.job for case in chosen if afresh or state_of(case) != "done"]


def refuse_foreign_sweep(cases: Sequence[Case]) -> None:
    """Raise InputError if the directory of a sweep has foreign files or files of another job, or a link in place of a
    case's directory. Root only."""
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
    """Print the warnings about the jobs of cases, one per subject. Root only. Return all warnings."""
    for text in sentences_of(cases, lambda job: job.doubts):
        print(f"warning: {text}", file=sys.stderr, flush=True)
    return [doubt for case in cases for doubt in case.job.doubts]


def stop_file(cases: Sequence[Case]) -> StopFile:
    """Return the stop file of a sweep."""
    return StopFile.from_now_on(_directory(cases) / outputs.STOP)


def _directory(cases: Sequence[Case]) -> Path:
    return cases[0].job.output.directory.parent.parent


# -- tables -----------------------------------------------------------------------------------------------------------


def write_sweep_tables(directory: Path, cases: Sequence[Case]) -> None:
    """Write all tables of a sweep from the results of its cases. Root only. Several programs may write them at the same
    time."""
    with _alone(directory):
        keys, seeded = list(cases[0].settings), any(key.split(".")[-1] in SAMPLES for key in cases[0].settings)
        rows, points = [_row(case) for case in cases], [row for case in cases for row in _points(case)]
        there = {section for case in cases for section in SECTIONS if _asks_for(case, section)}
        more = [name for section in SECTIONS if section in there for name in SECTIONS[section]]
        names = names_of(choose_columns(SWEEP, when=there))[1:]
        if not any(case.job.history for case in cases):  # curves have a table of points instead
            names = tuple(name for name in names if any(name in row for row in rows))
        save_cases(directory / outputs.SWEEP.table, ["case", *keys, *names], rows)
        if points:
            save_cases(directory / outputs.SWEPT_CURVES, ["case", *keys, *CURVE_COLUMNS], points)
        if seeded and any(case.job.history for case in cases):
            save_cases(directory / "sweep_mean.csv", *_means(rows, keys, [*RESULTS, *more, *THEORY]))
        if seeded and points:
            save_cases(directory / "sweep_curves_mean.csv", *_means(points, [*keys, *PLACES], CURVE_RESULTS))


def _asks_for(case: Case, section: str) -> bool:
    """Return True if a case has a section, `output.energy`, or cycles."""
    if section == "cycles":
        return any(stage.frequency for stage in case.job.history)
    return case.job.output.energy if section == "output.energy" else case.job.section(section) is not None


def sweep_errors(cases: Sequence[Case]) -> dict[str, dict[int, float]]:
    """Return the largest errors of the finished cases. The result maps the name of a quantity (friction, area and loss)
    to a mapping from the number of a case to the largest error of this quantity in the case.

    If the cases do not slide, the error of the area is that of its last value, as in the table of the sweep.
    """
    rows = [row for case in cases for row in ([_row(case)] if case.job.history else _points(case))]
    slides = any("mu_dyn" in row or "friction" in row for row in rows)
    area = "the corrected contact area" if slides else "the last value of the corrected contact area"
    out: dict[str, dict[int, float]] = {}
    for name, what in zip((*slide.ERRORS, "error_loss"), ("friction", area, "the loss"), strict=True):
        found = out.setdefault(what, {})
        for row in rows:
            if row["state"] == "done" and (error := row.get(name, math.nan)) == error:
                found[row["case"]] = max(error, found.get(row["case"], 0.0))
    return out


def note_failure(case: Case, reason: str) -> None:
    """Store the reason why a case failed in the directory of the case. If `reason` is '', a stored reason is removed.
    Root only."""
    path = case.job.output.directory / FAILURE
    with suppress(OSError):
        if reason:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{reason}\n")
        else:
            path.unlink(missing_ok=True)


def _row(case: Case) -> dict[str, Any]:
    head = {"case": case.number, **case.settings}
    try:
        return head | {"state": state_of(case)} | _results(case)
    except InputError:  # the table lacks a column
        return head | {"state": DAMAGED}


def _results(case: Case) -> dict[str, Any]:
    directory, row = case.job.output.directory, dict[str, Any]()
    for prefix, name in (("", outputs.RUN.table), ("theory_", outputs.THEORY.table)):
        columns = _columns(directory / name) or {"time": []}
        if len(columns["time"]) < 2 and not prefix:  # the initial state only
            continue
        if columns["time"]:
            found = slide.measure_slide(case.job.history, columns)
            ends = {name: columns[name][-1] for name in RESULTS if name in columns}
            known = ends if found is None else {key: value for key, value in found._asdict().items() if value == value}
            row |= {f"{prefix}{key}": value for key, value in known.items()}
        if not prefix:
            run = Results(directory, "run", case.job)
            row |= dict(pair for swept in answers("results", "swept") for pair in swept(run))
            if any(stage.frequency for stage in case.job.history):
                row |= slide.measure_last(case.job, columns)
            asked = [name for key, names in SECTIONS.items() if _asks_for(case, key) for name in names]
            known = {name: [value for value in columns[name] if value == value] for name in asked if name in columns}
            row |= {name: values[-1] if values else math.nan for name, values in known.items()}
            row["seconds"] = math.fsum(columns["seconds"])
            row["residual"] = slide.largest(columns["residual"])
            row |= slide.mean_errors(case.job.history, columns)
            within = slide.absolute_errors(case.job.history, columns, case.job.grid.dx)
            row |= {name: within.get(name.removesuffix("_error"), math.nan) for name in FRICTION_ERRORS}
    return row


def _points(case: Case) -> Iterator[dict[str, Any]]:
    """Yield the rows of the finished points of a friction curve."""
    if columns := _columns(case.job.output.directory / outputs.STEADY.table):
        head = {"case": case.number, **case.settings, "state": state_of(case)}
        numbers = [name for name in CURVE_COLUMNS if name in columns and name not in PLACES]
        for k, place in enumerate(tables.of_table(columns)):
            values = (float(f"{value:.9g}") for value in place)  # without rounding errors
            places = dict(zip(PLACES, values, strict=True))
            yield head | places | {name: columns[name][k] for name in numbers}


def _columns(path: Path) -> dict[str, list[float]]:
    """Return the columns of a table by name; none for a missing or damaged table, which the case itself reports."""
    with suppress(InputError):
        columns = tables.read_columns(path) if path.is_file() else {}
        return columns if {*columns} >= {*FIRST.get(path.name, ())} else {}
    return {}


def state_of(case: Case) -> str:
    """Return the state of a case: "done", "failed", "begun", "damaged", or "-" for a case that has not begun."""
    directory = case.job.output.directory
    if case.job.history and tables.find_lost_rows(directory):
        return DAMAGED
    if (directory / FAILURE).is_file():
        return "failed"
    table = directory / (outputs.RUN if case.job.history else outputs.STEADY).table
    if not table.is_file():
        return "-"
    if not (columns := _columns(table)):
        return DAMAGED
    if not case.job.history:
        if section := case.job.steady:
            asked = tables.requested_points(section.velocities, section.pressures or (), section.temperatures or ())
            if tables.lacking_points(asked, tables.of_table(columns)):
                return "begun"
        return "done"
    if case.job.bands is not None:  # its rows are written at the end
        return "done"
    steps = [int(step) for step in columns["step"]]
    timeline = Timeline.from_job(case.job).follow(dict(zip(steps, columns["time"], strict=True)))
    return "done" if steps and (steps[-1] >= len(timeline) or outputs.detached(directory)) else "begun"


def _means(
    rows: Sequence[dict[str, Any]], keys: Sequence[str], names: Sequence[str]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return columns and rows of means over cases that differ by their sample only,

    with the standard deviation of a single case, the standard error of the mean, and the number of cases.
    """
    kept = [key for key in keys if key.split(".")[-1] not in SAMPLES]
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(repr([row[key] for key in kept]), []).append(row)
    table = []
    for group in groups.values():
        out = {key: group[0][key] for key in kept} | {"number": sum(row["state"] == "done" for row in group)}
        for name in names:
            values = [row[name] for row in group if row["state"] == "done" and name in row]
            if values:
                std = stdev(values) if len(values) > 1 else math.nan
                numbers = fmean(values), std, std / math.sqrt(len(values))
                out |= {f"{name}_{what}": number for what, number in zip(MEANS, numbers, strict=True)}
        table.append(out)
    return [*kept, "number", *(f"{name}_{what}" for name in names for what in MEANS)], table


def save_cases(path: Path, columns: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    files.replace_file(path, to_csv(columns, ([row.get(name) for name in columns] for row in rows)))


@contextmanager
def _alone(directory: Path) -> Iterator[None]:
    """Lock the directory, if the file system has locks, so that the last program sees the results of all."""
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / ".sweep.lock").open("w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
