"""Runs of jobs in bands with a history, in their output directories.

A march is the calculation of one band, step by step, through the history. Marches are made in rounds. The rows of the
run exist when the coarsest band is done, and are then written at once. Until then finished marches are stored in a file
(`bands.cascade.ContactStore`), so that a stopped or killed run goes on with the next march. `--until T` ends the
history at T; a longer history needs new marches.
"""

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..bands.road_history import RoadHistory, RungTask
from ..columns import BANDS_OVER_TIME, added_by, names_of, to_csv
from ..errors import DONE, STOPPED_EARLY, InputError
from ..job import Job, listing
from ..job.history import reached
from ..march.budget import SHOWN, exceeds, find_remedy
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..printed import Bar
from ..results import slide
from ..results.results import Results
from . import files, hdf5, outputs, recorder
from .outputs import ADVICE, Claim, Directory
from .recorder import HEAD, Console, StepRow, machine_lines, step_line
from .stopping import Options, watching

RENEWED = "a run in bands goes on by itself, from checkpoint/marches.json in its output directory"


class _StopError(Exception):
    """The reason to stop early, raised between marches on all ranks."""


def run_history(job: Job, slab: Slab, options: Options) -> int:
    """Run a job, or continue it. Collective. Return the exit code. Nothing is written before the job is checked."""
    if options.restart not in ("auto", "never"):
        raise InputError(f"--restart: auto or never was expected for a job in bands, got {options.restart}: {RENEWED}")
    job = ended(job, options.until)
    directory = Directory(job.output.directory, slab)
    with directory.claimed():
        plain = listing.plain_job(job) if slab.root else {}
        goes_on, done = _look(directory, job, plain, options.restart == "never")
        if done:
            if slab.root and not options.quiet:
                print(f"{directory.path}: {done}", flush=True)
            return DONE
        road = RoadHistory(job, slab)
        doubts = road.doubts(())
        directory.make(job.path, job.resolved(), Claim({**outputs.kept(plain), "history": plain.get("history")}))
        if not goes_on:
            directory.clear()
        console = Console(directory.path / outputs.RUN.log, options.quiet) if slab.root else Console(speaks=False)
        try:
            for text in machine_lines(slab.comm) if slab.root else ():
                console.log(text)
            for doubt in doubts:
                console.warn(str(doubt), shown=options.shows(doubt))
            return _Run(road, directory, console, options).go()
        finally:
            console.close()


def ended(job: Job, until: float | None) -> Job:
    """Return the job with its history cut at `until` [s]. Raises InputError if the history ends earlier."""
    if until is None:
        return job
    kept, start = [], 0.0
    for stage in job.history:
        left = until - start
        if stage.seconds and reached(left, stage.seconds):
            left = stage.seconds
        if left > 0.0 or not stage.seconds:
            shorter = {} if left >= stage.seconds else {"duration": left, "distance": None}
            kept.append(stage.model_copy(update=shorter))
        start += stage.seconds
    if not reached(start, until):
        raise InputError(f"--until {until:g} is beyond the end of the history, t = {start:g} s, in a job in bands")
    return job.model_copy(update={"history": tuple(kept)})


def _look(directory: Directory, job: Job, plain: dict[str, Any], afresh: bool) -> tuple[bool, str]:
    """Return whether a run of the same job is to go on, and why there is nothing to do, or ''. Collective. Raises
    InputError for a directory of another job."""
    directory.refuse_foreign(job.path, plain, afresh)

    def look() -> tuple[bool, str]:
        claim = directory.claim
        if afresh or claim is None:
            return False, ""
        if different := outputs.RUN.changes(claim.job, plain):
            raise InputError(f"{directory.path} has a run of another job: {different}; {ADVICE}")
        if claim.finished is None or claim.job.get("history") != plain["history"]:
            if claim.finished and not reached(sum(stage.seconds for stage in job.history), claim.finished[1]):
                raise InputError(
                    f"{directory.path} has the results up to t = {claim.finished[1]:g} s, which those of a shorter "
                    f"history would replace; {ADVICE}"
                )
            if claim.finished and not _continues(claim.job["history"], plain["history"]):
                different = outputs.differences(claim.job, plain, ["history"])
                raise InputError(f"{directory.path} has the results of another history: {different}; {ADVICE}")
            return True, ""
        if not all((directory.path / name).exists() for name in (outputs.RUN.table, outputs.BANDS)):
            return False, ""
        return True, f"finished before, at t = {claim.finished[1]:g} s (--restart never: run it again)"

    return on_root(directory.slab.comm, look)


def _continues(then: Sequence[Mapping[str, Any]], now: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether one of two histories (plain data) is the beginning of the other; it may end within a stage."""
    shared = min(len(then), len(now)) - 1
    last = ({**stages[shared], "duration": None, "distance": None} for stages in (then, now))
    return list(then[:shared]) == list(now[:shared]) and next(last) == next(last)


class _Run:
    """Marches of a road with their files; methods are collective."""

    def __init__(self, road: RoadHistory, directory: Directory, console: Console, options: Options) -> None:
        self.road, self.directory, self.console, self.options = road, directory, console, options
        self.slab, self.job = road.slab, road.job
        each = [len(tasks) for tasks in road.tasks()]
        self._ends, self._made = np.cumsum(each).tolist(), 0
        self._bar = Bar(sum(each), "marches of bands", "march", self.slab.root and not options.quiet)
        self._began = time.monotonic()

    def go(self) -> int:
        """Make all marches, then write the results; return the exit code."""
        road = self.road
        ranks = "1 rank" if self.slab.comm.size == 1 else f"{self.slab.comm.size} ranks"
        self._say(
            f"{self.job.title or self.job.path.stem}: {self._ends[-1]} march{'es' * (self._ends[-1] > 1)} of "
            f"{road.cut.count} band{'s' * (road.cut.count > 1)} on {ranks}"
        )
        for text in filter(None, (*self.road.notes(), self.road.keep_in(self.directory.path))):
            self._say(text)
        try:
            with watching(self.directory, self.job.checkpoint, self.options) as self.watch:
                self.road.march(self._after)
        except _StopError as why:
            text = f"stopped after {self._made} of {self._ends[-1]} marches: {why}; run again to go on"
            self._say(text)
            return STOPPED_EARLY
        finally:
            self._bar.close()
        rows = hdf5.write_on_root(self.slab, self._write, f"cannot write {self.directory.path / outputs.RUN.table}")
        self.road.forget()
        if self.slab.root:
            with suppress(OSError, InputError):  # an unreadable table does not end a run
                table = Results(self.directory.path, "run", self.job).table
                for text in slide.describe_slide(self.job.history, self.job.initial, self.job.grid.dx, table):
                    self._say(text)
        for text in sum_up_errors(rows, self.job.numerics.asked.both):
            self._say(text)
        self._say(f"done: results in {self.directory.path}")
        return DONE

    def _after(self, task: RungTask, made: int, known: int) -> None:
        """Count a round of marches, of which some were `known`; raise _StopError to stop."""
        self._made += made
        for _ in range(made):
            self._bar.step()
        if self._made in self._ends:
            low, high = (f"{length:.3g}" for length in self.road.cut.wavelengths(task.band)[::-1])
            passed = time.monotonic() - self._began
            number = self.road.cut.count - task.band
            self._say(f"band {number} of {len(self._ends)}, waves from {low} to {high} m, is done after {passed:.3g} s")
        verdict = self.watch.decide(self._made, known < made)
        if verdict.stop and self._made < self._ends[-1]:
            raise _StopError(verdict.stop)

    def _say(self, text: str) -> None:
        self.console.log(text)
        if self.slab.root and not self.options.quiet:
            self._bar.print(text)

    def _write(self) -> list[StepRow]:
        """Write both tables, and return the rows. Root only."""
        self._say(HEAD)
        rows, bands = list[StepRow](), list[list[float]]()
        for row, of_bands in self.road.records():
            rows.append(row)
            bands += of_bands
            self._say(step_line(row))
        added = added_by("interface") if self.job.section("interface") is not None else ()
        of_rows = (recorder.row_numbers(row if added else replace(row, added=()), 0) for row in rows)
        path = self.directory.path
        files.replace_file(path / outputs.BANDS, to_csv(names_of(BANDS_OVER_TIME), bands))
        files.replace_file(path / outputs.RUN.table, to_csv(recorder.columns(0, added), of_rows))
        self.directory.note(saved=True, finished=(rows[-1].step, rows[-1].time))
        return rows


def sum_up_errors(rows: Sequence[StepRow], asked: tuple[float, float]) -> Iterable[str]:
    """Yield a sentence on the errors of friction, and a sentence on the errors of area, in the rows of sliding.

    Each sentence states the mean error, which should not exceed the accuracy `asked` of friction or of area, and the
    largest error with its sources and, where the mean is too large, a remedy.
    """
    slides = [row for before, row in pairwise(rows) if row.distance > before.distance] or list(rows)
    budgets = [(row, row.errors) for row in slides if row.errors is not None]
    slid = rows[-1].distance > 0.0
    frictions = [(row, errors.friction) for row, errors in budgets if slid and errors.friction is not None]
    areas = [(row, errors.area) for row, errors in budgets]
    for name, known, accuracy in zip(("friction", "contact area"), (frictions, areas), asked, strict=True):
        if not known:
            continue
        row, worst = max(known, key=lambda one: one[1].total)
        parts = ", ".join(f"{SHOWN[part]} {100 * value:.2g} %" for part, value in worst._asdict().items() if value)
        mean = sum(one.total for _, one in known) / len(known)
        more, remedy = "", ""
        if exceeds(mean, accuracy):
            more = f", more than the {100 * accuracy:g} % that numerics.accuracy asks for"
            remedy = f"; try {find_remedy(worst, ('time',))}"
        yield (
            f"error of {name}: {100 * mean:.2g} % on average{more}, at most {100 * worst.total:.2g} % "
            f"(t = {row.time:.4g} s, slip {row.distance:.3g} m: {parts}){remedy}"
        )
