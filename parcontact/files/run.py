"""A run from its start or checkpoint to its end.

Reasons to stop a run early or to save: signals, a stop file, limits of wall time.

Any rank may receive a signal; root knows the rest. One small message per step makes the decision common.

A run: a march through a timeline with records, checkpoints and early stops.

Runs of a job in its output directory, from the start or from a checkpoint.
"""

import math
import os
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..doubts import Doubt
from ..effects.effect import Detached, columns_of
from ..errors import InputError, RunError
from ..job import Checkpoint, Job, Rough, RoughSpectrum, listing
from ..job.advice import describe_sample
from ..job.history import ChosenSteps, Timeline, reached
from ..job.listing import answers, plain_data
from ..march import loop, sanity, scene, steady
from ..march.choices import choices
from ..march.laws import StepError
from ..march.loop import March
from ..parallel.root import Signals, on_root
from ..parallel.slab import Slab
from ..physics.body import states_errors
from ..physics.entries import Saved, part_of
from ..printed import quantity
from ..results import cycles, slide
from ..results.results import Results
from . import checkpoint, hdf5, outputs, provenance, recorder, restart, tables, wisdom
from .checkpoint import Contents, Facts
from .directory import Directory
from .provenance import Link, Provenance, cite_lines, extend_chain
from .recorder import Recorder, Recording, StepRow, always
from .restart import RestartPoint
from .tables import Claim, StopFile

LOOK_SECONDS = 0.2  # tuning: least time between checks for the stop file [s]
RESERVE_SECONDS = 5.0  # tuning: wall time reserved for the end of MPI and of files [s]
FIRST_WRITE = 50e6  # tuning: expected writing rate of the first checkpoint [bytes/s]
RECENT = 50  # tuning: number of recent steps, the longest of which is expected for the next one

GO, WALL, FILE, SIGNAL = range(4)  # the largest reason on any rank decides
REASONS = {WALL: "the wall time is nearly used up", FILE: "the stop file was found", SIGNAL: "a signal was received"}


@dataclass(frozen=True)
class Verdict:
    """Common decision after a step: why the run stops early (`stop`) or fails (`problem`), or ''."""

    stop: str = ""
    save: bool = False
    problem: str = ""


@dataclass
class Watch:
    """Decides after every step. `limit` is the time (of `time.monotonic`) at which the run must have ended, if any;
    `sweep_stop_file` is shared by all cases of a sweep; it is not removed."""

    slab: Slab
    rules: Checkpoint
    stop_file: Path
    signals: Signals
    limit: float | None = None
    sweep_stop_file: StopFile | None = None
    state_bytes: int = 0
    _saved: float = field(default_factory=time.monotonic)
    _looked: float = 0.0
    _made: int = 0
    _last: float = field(default_factory=time.monotonic)  # or the first step would be as long as the machine is up
    _write: float = -1.0
    _steps: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))

    def decide(self, step: int, began: bool, problem: str = "") -> Verdict:
        """Return whether the run stops or saves after a step; collective. `began`: this run has made a step.
        `problem`: a failure on root."""
        now = time.monotonic()
        if began:
            self._steps.append(now - self._last)
        self._last = now
        codes = [SIGNAL * self.signals.stop, self.signals.save, 0]
        self.signals.save = False
        if self.slab.root:
            codes = [max(codes[0], self._stop(now, began)), codes[1] or self._due(step, now, began), bool(problem)]
        self._made = step
        stop, save, failed = self.slab.reduce((), codes)
        if failed:
            return Verdict(problem=self.slab.agree(problem))
        if stop == FILE and (problem := self.slab.agree(tables.remove(self.stop_file) if self.slab.root else "")):
            return Verdict(problem=problem)
        return Verdict(REASONS.get(int(stop), ""), bool(save))

    def saved(self, seconds: float) -> None:
        """Record that a checkpoint was written in `seconds` [s]."""
        self._write = seconds
        self._saved = self._last = time.monotonic()

    def _stop(self, now: float, began: bool) -> int:
        if began and self.limit is not None and now + self.reserve > self.limit:
            return WALL
        if now - self._looked > LOOK_SECONDS:
            self._looked = now
            asked = os.path.lexists(self.stop_file) or (self.sweep_stop_file is not None and self.sweep_stop_file.asks)
            return FILE if asked else GO
        return GO

    def _due(self, step: int, now: float, began: bool) -> bool:
        if not began:
            return False
        if self.rules.every is not None:
            return step // self.rules.every > self._made // self.rules.every  # a multiple may be skipped
        return self.rules.minutes is not None and now - self._saved >= 60.0 * self.rules.minutes

    @property
    def reserve(self) -> float:
        """Return the wall time [s] for one more step and a checkpoint, each twice as long as seen so far."""
        write = self._write if self._write >= 0.0 else self.state_bytes / FIRST_WRITE
        return RESERVE_SECONDS + 2.0 * (max(self._steps, default=0.0) + write)


def limit_time(wall: float | None, environment: Mapping[str, str] = os.environ) -> float | None:
    """Return the time (of `time.monotonic`) by which a run must end: after `wall` seconds, or with its batch job.

    The end of a batch job is SLURM_JOB_END_TIME or PARCONTACT_END_TIME [s since 1970], or PBS_WALLTIME after the start
    of this program, slightly too late. An end before that start belongs to another job and is ignored. The clock is
    read once, as it may be changed later.
    """
    now = time.monotonic()
    born, epoch = now - age(), now - time.time()
    limits = [] if wall is None else [born + wall]
    for name, start in (("PARCONTACT_END_TIME", epoch), ("SLURM_JOB_END_TIME", epoch), ("PBS_WALLTIME", born)):
        with suppress(KeyError, ValueError):
            end = start + float(environment[name])
            limits += [end] if end > born else []
    return min(limits, default=None)


def age() -> float:
    """Return the age of this process [s]."""
    try:
        ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
        return max(time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK"), 0.0)
    except (OSError, ValueError, IndexError):
        return 0.0


DONE, STOPPED_EARLY = 0, 3  # exit codes: success; stopped early with a good checkpoint, run again


@dataclass(frozen=True)
class Options:
    """Options of a run: `restart`, `until` [s of the history], `wall` [s since the start of the program].

    `sweep_stop_file` is a stop file shared by all cases of a sweep; it is not removed. Warnings for which `shows` is
    False go into run.log only.
    """

    quiet: bool = False
    restart: str = "auto"
    until: float | None = None
    wall: float | None = None
    sweep_stop_file: StopFile | None = None
    shows: Callable[[Doubt], bool] = always


class Run:
    """A march through its history, with its files; methods are collective.

    `facts` are stored in its checkpoints.
    """

    def __init__(
        self, march: March, directory: Directory, recorder: Recorder, watch: Watch, facts: Facts, options: Options
    ) -> None:
        self.march, self.directory, self.recorder, self.watch = march, directory, recorder, watch
        self.facts, self.options, self.console = facts, options, recorder.console
        self.slab, self.job = march.scene.slab, march.scene.job
        self.timeline = march.timeline(options.until or 0.0)
        self.contacts = sanity.ContactWatch.of(self.job, self.timeline)
        self.watch.state_bytes = sum(entry.nbytes for entry in march.entries().values()) * self.slab.comm.size
        self.first, self.saved, self.failed, self.stop = march.row.step, -1, False, ""
        self.began, self.saving = time.monotonic(), 0.0

    def go(self, saved: Contents | None) -> int:
        """Run to the end, from the start or from a checkpoint; returns the exit code. Raises RunError."""
        self._log_start(saved)
        if saved:
            self.recorder.catch_up(self.march.row, self.march.field)
        try:
            if not loop.run_tasks(self.march, [self.decide] if saved else [self.record, self.decide]):
                steps = self.march.steps(self.timeline, self.options.until)
                loop.run_steps(self.march, [self.record, self.decide], steps)
        except StepError as error:
            text = f"{error}{self._leave_checkpoint()}"
            self._log_counts()
            self.console.log(text)
            raise RunError(text) from error
        if self.job.checkpoint.keep == 0 and self.march.row.step >= len(self.timeline):
            self._sync()
            self._refuse_lost_results()
            if self.slab.root:
                self.directory.prune(0)
        elif self.saved != self.march.row.step or self.march.detached:
            self.save(last=True)
        return self._log_summary()

    # -- after every step -------------------------------------------------------------------------------------------

    def record(self, march: March) -> None:
        """Write the row of the last step, and its maps if they are due, and warn about its contact."""
        row = march.row
        if row.remark:
            self.console.say(row.remark)
        self.recorder.write(row, march.field, len(self.timeline) if self.timeline.chooses else 0)
        try:
            doubts = self.contacts.check_step(row.step, row.measures)
        except RunError as error:
            raise RunError(f"{error}{self._leave_checkpoint()}") from error
        for doubt in doubts:
            self.console.warn(str(doubt), shown=self.options.shows(doubt))
        if doubts:
            provenance = self.facts.provenance
            provenance = replace(provenance, warnings=(*provenance.warnings, *map(str, doubts)))
            self.facts = replace(self.facts, provenance=provenance)
            self.recorder.renew(provenance)

    def decide(self, march: March) -> bool:
        """Save if a checkpoint is due; return True if the run ends."""
        row = march.row
        verdict = self.watch.decide(row.step, row.step > self.first, self.recorder.problem)
        if verdict.problem:
            raise RunError(verdict.problem + self._leave_checkpoint())
        self.stop = verdict.stop if row.step < len(self.timeline) else ""
        ends = bool(self.stop) or (self.options.until is not None and reached(row.time, self.options.until))
        if verdict.save and not ends and row.step < len(self.timeline):
            self.save()
        return ends

    # -- saving -----------------------------------------------------------------------------------------------------

    def save(self, last: bool = False) -> None:
        """Write a checkpoint; raises RunError if results were lost or cannot be written."""
        self._write(last)
        self._refuse_lost_results()

    def _refuse_lost_results(self) -> None:
        if problem := self.slab.agree(self.recorder.problem):
            raise RunError(problem + self._leave_checkpoint())

    def _leave_checkpoint(self) -> str:
        """Write a checkpoint of the last good step; returns a message."""
        try:
            if self.saved != self.march.row.step:
                self._write(last=True)
        except RunError as error:
            return f"; {error}"
        return self._newest()

    def _write(self, last: bool) -> None:
        """Write a checkpoint. One failure gives a warning; two in a row, or one at the end, raise RunError.

        Records are flushed first, so that no checkpoint is ahead of them.
        """
        began, step = time.monotonic(), self.march.row.step
        self._sync()
        try:
            self.march.save(self.directory.checkpoint(step), replace(self.facts, table=self.recorder.table))
        except RunError as error:
            if last or self.failed:
                raise RunError(f"{error}{self._newest()}") from error
            self.failed = True
            self.console.warn(f"no checkpoint after step {step}: {error}; the run ends if the next one fails too")
            return
        self.saved, self.failed = step, False
        if self.slab.root:
            self.directory.note(saved=True)
            self.directory.prune(max(self.job.checkpoint.keep, 1))
        seconds = time.monotonic() - began
        self.saving += seconds
        self.watch.saved(seconds)
        self.console.log(f"checkpoint after step {step} in {seconds:.3g} s")

    def _sync(self) -> None:
        """Flush all records to disk, with the error budget so far."""
        budget = self.march.state.errors.facts(plain_data(self.job.numerics.accuracy))
        self.facts = replace(self.facts, provenance=replace(self.facts.provenance, budget=budget))
        self.recorder.sync(self.facts.provenance)

    def _newest(self) -> str:
        saved = self.slab.agree(self.directory.saved() if self.slab.root else [])
        return f"; the newest checkpoint is {saved[0][1]}" if saved else "; there is no checkpoint"

    # -- what run.log says ------------------------------------------------------------------------------------------

    def _log_start(self, saved: Contents | None) -> None:
        grid, ranks = self.job.grid, "1 rank" if self.slab.comm.size == 1 else f"{self.slab.comm.size} ranks"
        title = self.job.title or self.job.path.stem
        self.console.say(f"{title}: {grid.nx} x {grid.ny} points on {ranks}")
        if self.job.included:
            self.console.say(self.job.included)
        if self.job.origin.mesh:
            self.console.say(self.job.origin.mesh)
        for fact in scene.describe_scene(self.march.scene):
            self.console.say(fact)
        if saved:
            self.console.say(f"continues after step {self.first} from {saved.path}")

    def _log_counts(self) -> None:
        spent = time.monotonic() - self.began
        self.console.log(f"checkpoints took {self.saving:.3g} s of {spent:.4g} s")
        counts = ", ".join(f"{name} {count}" for name, count in sorted(self.slab.tally.items()))
        self.console.log(f"counts on root: {counts}")

    def _log_summary(self) -> int:
        """Report the end of the run and its errors, and note the end in its directory; returns the exit code."""
        row, console, errors = self.march.row, self.console, self.march.state.errors
        slides = any(stage.slides for stage in self.job.history)
        self._log_counts()
        if self.slab.root and (slides or self.march.scene.law is not None) and not self.stop:
            with suppress(OSError, InputError):  # an unreadable table does not end a run
                run = Results(self.directory.path, "run", self.job, self.march.detached)
                sentences = list(slide.describe_slide(self.job.history, self.job.initial, self.job.grid.dx, run.table))
                for said in answers("results", "said_at_end"):
                    sentences += said(run)
                for text in sentences:
                    console.say(text)
        self._log_cycles()
        if self.march.scene.energy is not None:
            console.say(_describe_energies(row))
        for line in errors.lines(self.job.numerics.asked.both, chosen_by_accuracy(self.job)):
            console.say(line)
        sample = describe_sample(self.job.grid, self.job.surface, slides)
        if errors.area is not None and (text := sample):
            console.say(text)
        if not states_errors(self.march.scene.material):
            console.say("the body has no estimate of the error by the time steps: no errors are stated")
        if "edge" in self.contacts.seen:
            console.say(
                "no error is stated for steps whose contact reaches the edge of the box: their results are wrong"
            )
        if "below a cell" in self.contacts.seen:
            console.say("no error is stated for steps whose spots of contact may be smaller than a cell")
        for name, effect in self.march.scene.effects.items():
            for text in effect.last_lines(self.march.state.memories[name]):
                console.say(text)
        if self.stop:
            of = f"at least {len(self.timeline)}" if self.timeline.chooses else str(len(self.timeline))
            console.say(f"stopped after step {row.step} of {of}: {self.stop}; run again to go on")
            return STOPPED_EARLY
        detached = self.march.detached
        finished = row.step >= len(self.timeline) or bool(detached)
        if self.slab.root and finished:
            self.directory.note(saved=True, finished=(row.step, row.time), detached=detached)
        how = detached or "done" if finished else f"stopped at t = {row.time:g} s as requested; run again to go on"
        console.say(f"{how}: results in {self.directory.path}")
        return DONE

    def _log_cycles(self) -> None:
        """Write cycles.csv of a history that oscillates, also of a run that stops early, and describe its cycles."""
        if not self.slab.root or not any(stage.frequency for stage in self.job.history):
            return
        try:
            rows = tables.read_columns(self.directory.path / outputs.RUN.table)
            for text in cycles.write_cycles(self.directory.path, self.job, rows):
                self.console.say(text)
        except (OSError, InputError) as error:
            self.console.warn(f"cycles.csv cannot be written: {error}")


def _describe_energies(row: StepRow) -> str:
    """Return a sentence on the energies since the start, with their error."""
    within = f"each ± {quantity(row.error_energy, 'J', 2)}" if math.isfinite(row.error_energy) else "errors unknown"
    return f"work {quantity(row.work, 'J', 4)}, dissipated {quantity(row.dissipated, 'J', 4)}, {within}"


def chosen_by_accuracy(job: Job) -> set[str]:
    """Return the parts of the error budget that a smaller `numerics.accuracy` reduces, because it chose their settings.

    Time is such a part if all stages of the slide (without a slide, all stages with a duration) choose their steps.
    """
    numerics = job.numerics
    lasting = [stage for stage in job.history if stage.seconds > 0.0]
    stages = [stage for stage in lasting if stage.speed > 0.0] or lasting
    chosen = {
        "solver": "tolerance" in numerics.chosen,
        "time": bool(stages) and all(stage.chooses for stage in stages),
        "mesh": bool(job.origin.mesh),
        "folded": "branch_error" in numerics.chosen,
    }
    return {name for name, by_accuracy in chosen.items() if by_accuracy}


@dataclass(frozen=True)
class Ended:
    """End of a run: its exit code and its last march, or the checkpoint if there was nothing to do."""

    code: int
    march: March | None
    contents: Contents | None = None


def run_job(job: Job, slab: Slab, options: Options) -> int:
    """Run a job; collective. Returns the exit code. Nothing is written before the whole job is checked."""
    return run_to_end(job, slab, options).code


def run_to_end(job: Job, slab: Slab, options: Options) -> Ended:
    """Run a job, as `run_job`; returns its end, from which it can continue in memory."""
    directory = Directory(job.output.directory, slab)
    with directory.claimed():
        plain = listing.plain_job(job) if slab.root else {}
        origin, warnings, reason = _find_origin(job, plain, directory, options)
        saved = origin.contents if origin else None
        if reason:
            if slab.root and not options.quiet:
                print(f"{directory.path}: {reason}", flush=True)
            return Ended(DONE, None, saved)
        transforms = choices(job).transforms
        wisdom.recall(transforms, slab, saved.numbers.get("plans/all") if saved else None)
        march = steady.first(job, slab, options.until or 0.0, saved)
        doubts = tuple(sanity.find_doubts(march.scene.setup))
        wisdom.keep(transforms, slab)
        claim = restart.claim(plain, origin)
        facts = Facts(plain, provenance_of(job, slab, saved, tuple(map(str, doubts))), claim.id)
        recorder = _open_files(march, directory, claim, facts, origin, options)
        try:
            for text in provenance.lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for doubt in doubts:
                recorder.console.warn(str(doubt), shown=options.shows(doubt))
            for text in (*warnings, *recorder.warnings):
                recorder.console.warn(text)
            limit = limit_time(options.wall) if slab.root else None
            with Signals().noted() as signals:
                watching = Watch(slab, job.checkpoint, directory.stop_file, signals, limit, options.sweep_stop_file)
                code = Run(march, directory, recorder, watching, facts, options).go(saved)
                return Ended(code, march)
        finally:
            recorder.close()


def _find_origin(
    job: Job, plain: dict[str, Any], directory: Directory, options: Options
) -> tuple[RestartPoint | None, list[str], str]:
    """Return the checkpoint to continue from, or None; warnings; and why there is nothing to do, or ''; collective."""
    slab, until = directory.slab, options.until
    timeline = Timeline.from_job(job, until or 0.0)
    reason = restart.finished_before(job, plain, slab, directory, options.restart, timeline)
    origin, warnings = (None, []) if reason else restart.choose_origin(job, plain, slab, directory, options.restart)
    if origin:
        timeline = Timeline.from_job(
            job, until or 0.0, ChosenSteps.from_job(job, part_of("steps", origin.contents.numbers))
        )
    if until is not None and not reached(timeline.end, until):
        raise InputError(
            f"--until {until:g} is beyond the end of the history, t = {timeline.end:g} s, but its last stage is one "
            "solve without a time step to continue"
        )
    sanity.refuse_impossible(job, timeline)
    if origin and origin.contents.step >= len(timeline):
        when = f"at t = {origin.contents.time:g} s"
        reason = f"finished before, {when} (--restart never: run it again; --until T: continue it)"
    elif origin and (end := _end_of(job, part_of("law", origin.contents.numbers))):
        reason = f"detached before, at t = {end.time:g} s (--restart never: run it again)"
    elif origin and until is not None and reached(origin.contents.time, until):
        reason = f"has already reached t = {origin.contents.time:g} s, and --until {until:g} is not later"
    if reason:
        on_root(slab.comm, lambda: _refuse_damaged(directory.path))
    return origin, warnings, reason


def _refuse_damaged(directory: Path) -> None:
    """Raise InputError if the results of a finished run are incomplete."""
    if lost := tables.find_lost_rows(directory):
        raise InputError(lost)
    with suppress(FileNotFoundError):
        hdf5.open_results(directory / outputs.RUN.maps).close()


def provenance_of(job: Job, slab: Slab, saved: Contents | None, doubts: tuple[str, ...] = ()) -> Provenance:
    """Return the provenance of the files of a run that begins or continues from a checkpoint."""
    link = Link(job.resolved(), slab.comm.size, saved.step if saved else 0)
    seeds = tuple(shape.seed for shape in job.surface if isinstance(shape, Rough | RoughSpectrum))
    chain = extend_chain(saved.chain if saved else (), link)
    return Provenance(chain, seeds, job.included, doubts, references=cite_lines(listing.plain_data(job)))


def _open_files(
    march: March, directory: Directory, claim: Claim, facts: Facts, origin: RestartPoint | None, options: Options
) -> Recorder:
    """Prepare the output directory, and open its files; collective."""
    job, slab, added = march.scene.job, march.scene.slab, columns_of(march.scene.effects)
    timeline = march.timeline(options.until or 0.0)
    recorder.columns(0, added)  # raises InputError for repeated names
    directory.make(job.path, job.resolved(), claim)
    checkpoint.store(job.surface, directory.path, slab)
    if origin and origin.own:
        directory.go_back(origin.contents.step)
    elif origin is None:
        directory.clear()
    recording = Recording(
        total=len(timeline),
        branches=len(march.row.branch_dissipation) if march.scene.choices.branch_dissipation.on else 0,
        added=added,
        maps=job.output.maps,
        size=job.grid.size,
        every=job.output.every,
        open_ended=timeline.chooses,
    )
    return Recorder(directory, recording, facts.provenance, origin.contents if origin else None, options.quiet)


def _end_of(job: Job, saved: Saved) -> Detached | None:
    """Return the end of a run in the entries of its law in a checkpoint; None if it goes on."""
    return next(filter(None, (ended(job, saved) for ended in job.asked("ended"))), None)
