"""Runs of a job in its output directory: a march through a timeline with records, checkpoints and early stops.

A run begins at the start of its history, or continues from the newest undamaged checkpoint of the same job.
"""

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ..effects.effect import Detached, columns_of
from ..errors import DONE, STOPPED_EARLY, Doubt, InputError, RunError
from ..job import Job, Rough, RoughSpectrum, Stage, listing
from ..job.advice import describe_sample
from ..job.history import ChosenSteps, Step, Timeline, reached
from ..job.listing import answers, plain_data
from ..march import loop, sanity, scene, steady
from ..march.choices import choices
from ..march.laws import StepError
from ..march.loop import March
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..physics.body import states_errors
from ..physics.records import Saved, part_of
from ..printed import quantity
from ..results import slide
from ..results.results import Results
from . import checkpoint, hdf5, outputs, recorder, tables, wisdom
from .checkpoint import Contents, Facts
from .hdf5 import Link, Provenance, cite_lines, extend_chain
from .outputs import ADVICE, Claim, Directory
from .recorder import Recorder, Recording, machine_lines
from .stopping import Options, Watch, watching

SAME_STEP = 1e-9  # rounding: relative difference below which steps of two histories are the same


@dataclass(frozen=True)
class RestartPoint:
    """An undamaged checkpoint from which a run continues; `own` is True if it is in the run's output directory."""

    contents: Contents
    own: bool


class Run:
    """A run of a job: a march through its history, with files; methods are collective.

    `facts` are stored in all checkpoints (`checkpoint.Facts`).
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
        """Run to the end of the history, from its start or from the checkpoint `saved`. Return the exit code. Raises
        RunError."""
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
        """Write the row of the last step, and the maps after this step if they are due. Warn about the contact."""
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
        """Write a checkpoint if it is due. Return True if the run is to end after this step."""
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
        """Write a checkpoint. Raises RunError if results were lost or cannot be written."""
        self._write(last)
        self._refuse_lost_results()

    def _refuse_lost_results(self) -> None:
        if problem := self.slab.agree(self.recorder.problem):
            raise RunError(problem + self._leave_checkpoint())

    def _leave_checkpoint(self) -> str:
        """Write a checkpoint of the last good step. Return a message."""
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
        """Report the end of the run and its errors, and note the end in its directory. Return the exit code."""
        row, console, errors = self.march.row, self.console, self.march.state.errors
        slides = any(stage.slides for stage in self.job.history)
        self._log_counts()
        if self.slab.root and (slides or self.march.scene.law is not None) and not self.stop:
            with suppress(OSError, InputError):  # an unreadable table does not end a run
                run = Results(self.directory.path, "run", self.job, self.march.detached)
                history, grid = self.job.history, self.job.grid
                about = slide.describe_slide(history, self.job.initial, grid.dx, run.table, run.free_area)
                sentences = list(about)
                for said in answers("results", "said_at_end"):
                    sentences += said(run)
                for text in sentences:
                    console.say(text)
        self._log_cycles()
        if self.march.scene.energy is not None:
            within = (
                f"each ± {quantity(row.error_energy, 'J', 2)}" if math.isfinite(row.error_energy) else "errors unknown"
            )
            console.say(f"work {quantity(row.work, 'J', 4)}, dissipated {quantity(row.dissipated, 'J', 4)}, {within}")
        for text in errors.lines(self.job.numerics.asked.both, chosen_by_accuracy(self.job)):
            console.say(text)
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
            for line in effect.last_lines(self.march.state.memories[name]):
                if isinstance(line, Doubt):
                    console.warn(str(line), shown=self.options.shows(line))
                else:
                    console.say(line)
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
            for text in slide.write_cycles(self.directory.path, self.job, rows):
                self.console.say(text)
        except (OSError, InputError) as error:
            self.console.warn(f"cycles.csv cannot be written: {error}")


def chosen_by_accuracy(job: Job) -> set[str]:
    """Return the parts of the error budget that a smaller `numerics.accuracy` reduces, because the accuracy chose their
    settings.

    The part "time" is among them if the accuracy chooses the steps of all stages that slide. In a job that does not
    slide, this refers to all stages with a duration.
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
    """End of a run: its exit code `code`, and its last state. This state is the `march`. If an earlier run had finished
    the job, nothing was left to march, and the state is in `contents`, the checkpoint of the earlier run."""

    code: int
    march: March | None
    contents: Contents | None = None


def run_job(job: Job, slab: Slab, options: Options) -> int:
    """Run a job. Collective. Return the exit code. Nothing is written before the whole job is checked."""
    return run_to_end(job, slab, options).code


def run_to_end(job: Job, slab: Slab, options: Options) -> Ended:
    """Run a job like `run_job`. Return the end of the run, from which another run can continue in memory."""
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
        claim = claim_of(plain, origin)
        facts = Facts(plain, provenance_of(job, slab, saved, tuple(map(str, doubts))), claim.id)
        recorder = _open_files(march, directory, claim, facts, origin, options)
        try:
            for text in machine_lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for doubt in doubts:
                recorder.console.warn(str(doubt), shown=options.shows(doubt))
            for text in (*warnings, *recorder.warnings):
                recorder.console.warn(text)
            with watching(directory, job.checkpoint, options) as watch:
                return Ended(Run(march, directory, recorder, watch, facts, options).go(saved), march)
        finally:
            recorder.close()


def _find_origin(
    job: Job, plain: dict[str, Any], directory: Directory, options: Options
) -> tuple[RestartPoint | None, list[str], str]:
    """Return the checkpoint to continue from, or None; warnings; and why there is nothing to do, or ''. Collective."""
    slab, until = directory.slab, options.until
    timeline = Timeline.from_job(job, until or 0.0)
    asked = timeline.end
    reason = finished_before(job, plain, slab, directory, options.restart, timeline)
    origin, warnings = (None, []) if reason else choose_origin(job, plain, slab, directory, options.restart)
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
        beyond = "" if reached(asked, origin.contents.time) else f", beyond the end of the history at t = {asked:g} s"
        when = f"at t = {origin.contents.time:g} s{beyond}"
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
    """Return the provenance for the files of a run that begins, or continues from the checkpoint `saved`."""
    link = Link(job.resolved(), slab.comm.size, saved.step if saved else 0)
    seeds = tuple(shape.seed for shape in job.surface if isinstance(shape, Rough | RoughSpectrum))
    links = extend_chain(saved.chain if saved else (), link)
    return Provenance(links, seeds, job.included, doubts, references=cite_lines(listing.plain_data(job)))


def _open_files(
    march: March, directory: Directory, claim: Claim, facts: Facts, origin: RestartPoint | None, options: Options
) -> Recorder:
    """Prepare the output directory, and open its files. Collective."""
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
    """Return the end of a run in the entries of its law in a checkpoint, or None if it goes on."""
    return next(filter(None, (ended(job, saved) for ended in job.asked("ended"))), None)


# -- where a run begins ------------------------------------------------------------------------------------------------


def choose_origin(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str
) -> tuple[RestartPoint | None, list[str]]:
    """Return the checkpoint to continue from, or None, and warnings about skipped checkpoints. Collective.

    `plain` is the job as plain data, on root; `restart` is `auto`, `never` or the path of a checkpoint. Raises
    InputError if no existing checkpoint is usable, or if a start from the beginning would replace results.
    """
    directory.refuse_foreign(job.path, plain, restart == "never")
    if restart == "never":
        return None, []
    given = None if restart == "auto" else Path(restart)
    candidates = [given] if given else [path for _, path in on_root(slab.comm, directory.saved)]
    problems: list[str] = []
    for path in candidates:
        found = sound_checkpoint(path, job, plain, slab)
        if isinstance(found, Contents):
            own = on_root(slab.comm, partial(_is_own, found, directory))
            return RestartPoint(found, own), [f"skipped: {text}" for text in problems]
        problems.append(found)
    if problems:
        raise InputError("\n".join(problems) + ("" if given else f"; {ADVICE}"))
    on_root(slab.comm, lambda: _refuse_loss(directory, plain))
    return None, []


def claim_of(plain: Mapping[str, Any], origin: RestartPoint | None) -> Claim:
    """Return the record of a run for the marker file. A run that continues in its own directory keeps its id."""
    new = Claim(outputs.kept(plain))
    return replace(new, id=origin.contents.run or new.id, saved=True) if origin and origin.own else new


def finished_before(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str, timeline: Timeline
) -> str:
    """Return a message if a run of this job finished earlier without keeping a checkpoint, else ''. Collective."""

    def look() -> str:
        claim = directory.claim
        if restart != "auto" or job.checkpoint.keep or claim is None or claim.finished is None or directory.saved():
            return ""
        steps, at = claim.finished
        whole = reached(at, timeline.end) if timeline.chooses else steps == len(timeline)
        if outputs.RUN.changes(claim.job, plain) or not whole or not (directory.path / outputs.RUN.table).exists():
            return ""
        return f"finished before, at t = {at:g} s, without a checkpoint (--restart never: run it again)"

    return on_root(slab.comm, look)


def sound_checkpoint(path: Path, job: Job, plain: Mapping[str, Any], slab: Slab) -> Contents | str:
    """Return the contents of a checkpoint from which a job can continue, or a text on why it cannot. Collective.

    Raises InputError if the history before the checkpoint differs.
    """
    found = on_root(slab.comm, lambda: _attempt(path, plain))
    if isinstance(found, str):
        return found
    if problem := checkpoint.verify(found, slab):
        return problem
    on_root(slab.comm, lambda: _refuse_changed_steps(found, job, plain))
    return found


def _refuse_changed_steps(found: Contents, job: Job, plain: Mapping[str, Any]) -> None:
    if difference := find_changed_step(found, job):
        keys = outputs.differences(found.job, plain, ["history"])
        raise InputError(
            f"{found.path}: {difference}{keys and f' ({keys})'}; to change what follows, end the running stage at t = "
            f"{found.time:g} s and add another; or {ADVICE}, give --restart PATH to continue from an earlier checkpoint"
        )


def _is_own(contents: Contents, directory: Directory) -> bool:
    """Return True if a checkpoint belongs to the run in the directory, by its id or its file.

    Raises InputError for a checkpoint of another run if the directory has results. Root only.
    """
    if directory.claim is not None and contents.run:
        own = contents.run == directory.claim.id
    else:
        own = any(contents.path.samefile(path) for _, path in directory.saved())
    if not own and (found := directory.results()):
        there = f"{directory.path}, which has {', '.join(found[:3])}"
        raise InputError(f"{contents.path} belongs to another run than {there}; give --out for another directory")
    return own


def _refuse_loss(directory: Directory, plain: Mapping[str, Any]) -> None:
    """Raise InputError for results that a new run would replace although no checkpoint can restore them. Root only.

    Results of a run of this job that ended before its first checkpoint may be replaced.
    """
    claim, found = directory.claim, directory.results()
    if claim is None or not found:
        return
    there = f"{directory.path} has {', '.join(found)}"
    if different := outputs.RUN.changes(claim.job, plain):
        raise InputError(f"{there} of another job: {different}; {ADVICE}")
    if claim.saved:
        how = f"a run that has finished at t = {claim.finished[1]:g} s" if claim.finished else "a run"
        raise InputError(f"{there} of {how}, but its checkpoints are missing; {ADVICE}")


def _attempt(path: Path, plain: Mapping[str, Any]) -> Contents | str:
    """Return the contents of a checkpoint, or why it cannot be used. Root only."""
    try:
        contents = checkpoint.inspect(path)
        if found := outputs.RUN.changes(contents.job, plain):
            return f"{path} belongs to another job: {found}"
        return contents
    except (InputError, OSError) as error:
        return str(error)


def find_changed_step(contents: Contents, job: Job) -> str:
    """Return a message on the first completed step of a checkpoint that differs from the same step of this job, or ''
    if no completed step differs. Later steps may differ."""
    number, until, chosen = contents.step, contents.time, part_of("steps", contents.numbers)
    kind: Any = type(job).model_fields["history"].annotation
    history = TypeAdapter(kind).validate_python(contents.job["history"])
    old, new = (
        Timeline.from_job(each, until, ChosenSteps.from_job(each, chosen))
        for each in (job.model_copy(update={"history": history}), job)
    )
    count = min(number, len(old), len(new))
    for step in range(old.shared(new) + 1, count + 1):
        stages = [each.history[each[step].stage] for each in (old, new)]
        if difference := next(chain(_step_differences(old[step], new[step]), _added_differences(*stages)), ""):
            return f"step {step} of the {number} completed ones {difference}"
    return f"{number} steps were completed, but the job has {count} up to t = {until:g} s" if count < number else ""


def _added_differences(old: Stage, new: Stage) -> Iterator[str]:
    """Yield the differences of keys that effects add to stages."""
    for key in type(new).model_fields.keys() - Stage.model_fields.keys():
        was, now = (listing.text(getattr(stage, key) or "none") for stage in (old, new))
        if was != now:
            yield f"had {key} {was}, but has {now}"


def _step_differences(old: Step, new: Step) -> Iterator[str]:
    """Yield the differences of two steps."""
    size = math.hypot(*old.position)
    if old.jump != new.jump:
        yield "was a jump of the load, but is not now" if old.jump else "was not a jump of the load, but is now"
    if not math.isclose(old.time, new.time, rel_tol=SAME_STEP):
        yield f"ended at t = {old.time!r} s, but ends at {new.time!r} s"
    if old.control != new.control or not math.isclose(old.load, new.load, rel_tol=SAME_STEP):
        yield f"had {old.control} {old.load!r}, but has {new.control} {new.load!r}"
    if math.dist(old.position, new.position) > SAME_STEP * size:
        yield f"ended with the surface at {old.position} m, but ends at {new.position} m"
