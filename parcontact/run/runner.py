"""A run from a job to its output directory: it begins or goes on, saves what it remembers, and ends well."""

import time
from dataclasses import dataclass, replace

from .. import sanity, scene
from ..effects import decisions
from ..errors import InputError, RunError
from ..job import Job, Rough, RoughSpectrum
from ..job.timeline import Timeline, reached
from ..march import loop
from ..march.failure import StepError
from ..march.rest import steps_to_make
from ..march.step import March
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..physics.budget import Summary
from ..physics.entries import Entry
from ..record import checkpoint, header, marker, wisdom
from ..record.checkpoint import Contents, Facts, Table
from ..record.directory import Directory
from ..record.marker import Claim
from ..record.provenance import Link, Provenance, extended
from ..record.recorder import Recorder
from ..record.row import Row
from ..scene import Scene
from ..steady_sliding import start as steadystart
from . import restart, watch
from .restart import Origin
from .watch import Watch

DONE, AGAIN = 0, 3  # exit codes: as asked; stopped early with a good checkpoint, run again


@dataclass(frozen=True)
class Options:
    """What the command line adds to a job: where to begin, `until` in s of the history, `wall` in s of this program."""

    quiet: bool = False
    restart: str = "auto"
    until: float | None = None
    wall: float | None = None


@dataclass(frozen=True)
class Ended:
    """How a run has ended: its exit code, and where it was left; or the checkpoint at which there was nothing to do."""

    code: int
    march: March | None
    contents: Contents | None = None


def run(job: Job, slab: Slab, options: Options) -> int:
    """Run a job; collective. Returns the exit code. Nothing is written before the whole job has proved sound."""
    return run_to_end(job, slab, options).code


def run_to_end(job: Job, slab: Slab, options: Options) -> Ended:
    """As `run`; what can be gone on from in memory."""
    directory = Directory(job.output.directory, slab)
    with directory.claimed():
        plain = marker.plain_job(job) if slab.root else {}
        timeline = job.timeline(options.until or 0.0)
        finished = restart.finished_before(job, plain, slab, directory, options.restart, len(timeline))
        origin, warnings = (None, []) if finished else restart.choose(job, plain, slab, directory, options.restart)
        _refuse_no_end(timeline, options.until)
        sanity.refuse_impossible(job, timeline)
        reason = _nothing_to_do(origin, timeline, options.until) if origin else finished
        if reason:
            if slab.root and not options.quiet:
                print(f"{directory.path}: {reason}", flush=True)
            return Ended(DONE, None, origin.contents if origin else None)
        wisdom.recall(job, slab, origin.wisdom if origin else None)
        marching = steadystart.first(job, slab, options.until or 0.0, origin.contents if origin else None)
        doubts = (*job.warnings, *sanity.of_surface(marching.scene.frame))
        wisdom.keep(job, slab)
        provenance = provenance_of(job, slab, origin.contents if origin else None, doubts)
        claim = restart.claim(plain, origin)
        recorder = _begin(marching.scene, directory, claim, provenance, origin, len(timeline), options.quiet)
        try:
            for text in header.lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for text in (*doubts, *warnings, *recorder.warnings):
                recorder.console.warn(text)
            limit = watch.limit(options.wall) if slab.root else None
            facts = Facts(0, 0.0, plain, provenance, claim.id)
            with Signals().noted() as signals:
                watching = Watch(slab, job.checkpoint, directory.stop_file, signals, limit)
                journey = _Journey(marching, timeline, directory, recorder, watching, facts, options.until)
                return Ended(journey.go(origin), marching)
        finally:
            recorder.close()


def _refuse_no_end(timeline: Timeline, until: float | None) -> None:
    if until is not None and not reached(timeline.end, until):
        raise InputError(
            f"--until {until:g} is beyond the end of the history, t = {timeline.end:g} s, and its last stage is one "
            "solve: there is no time step to go on with"
        )


def _nothing_to_do(origin: Origin, timeline: Timeline, until: float | None) -> str:
    contents = origin.contents
    if contents.step >= len(timeline):
        return f"finished before, at t = {contents.time:g} s (--restart never: run it afresh; --until T: go on)"
    if until is not None and reached(contents.time, until):
        return f"is at t = {contents.time:g} s, not before --until {until:g}"
    return ""


def provenance_of(job: Job, slab: Slab, saved: Contents | None, doubts: tuple[str, ...] = ()) -> Provenance:
    """Where the files of a run come from that begins, or goes on from a checkpoint."""
    link = Link(job.resolved(), slab.comm.size, saved.step if saved else 0)
    seeds = tuple(shape.seed for shape in job.surface if isinstance(shape, Rough | RoughSpectrum))
    chain = extended(saved.chain if saved else (), link)
    return Provenance(chain, seeds, str(job.included) if job.included else "", doubts)


def _begin(
    built: Scene,
    directory: Directory,
    claim: Claim,
    provenance: Provenance,
    origin: Origin | None,
    total: int,
    quiet: bool,
) -> Recorder:
    """Make the output directory ready, and its files; collective."""
    job = built.job
    directory.make(job.path, job.resolved(), claim)
    if origin and origin.own:
        directory.go_back(origin.contents.step)
    elif origin is None:
        directory.clear()
    split = decisions.branch_dissipation(job).on
    dissipated = len(built.energy.balance.dissipated) if split and built.energy else 0
    after, then = (origin.contents.step, origin.contents.table) if origin else (None, Table())
    added = [name for follower in built.followers.values() for name in follower.columns]
    return Recorder(job, built.slab, directory, provenance, total, after, then, dissipated, quiet, added)


class _Journey:
    """A march through its timeline, and all that is done on the way."""

    def __init__(
        self,
        marching: March,
        timeline: Timeline,
        directory: Directory,
        recorder: Recorder,
        watching: Watch,
        facts: Facts,
        until: float | None,
    ) -> None:
        self.march, self.timeline, self.directory, self.recorder = marching, timeline, directory, recorder
        self.watch, self.facts, self.until = watching, facts, until
        self.slab, self.job = marching.scene.slab, marching.scene.job
        self.console = recorder.console
        self.first, self.saved, self.failed = marching.row.step, -1, False
        self.watch.state_bytes = sum(entry.nbytes for entry in marching.entries().values()) * self.slab.comm.size
        self.contacts = sanity.ContactWatch(self.job, timeline)
        self.stop = ""
        self.errors, self._recorded = Summary(), marching.row.time
        self.began, self.saving = time.monotonic(), 0.0

    def go(self, origin: Origin | None) -> int:
        grid, ranks = self.job.grid, "1 rank" if self.slab.comm.size == 1 else f"{self.slab.comm.size} ranks"
        title = self.job.title or self.job.path.stem
        self.console.say(f"{title}: {grid.nx} x {grid.ny} points on {ranks}")
        if self.job.included:
            self.console.say(str(self.job.included))
        for fact in scene.facts(self.march.scene):
            self.console.say(fact)
        if origin:
            self.console.say(f"goes on after step {self.first} from {origin.contents.path}")
            self.recorder.catch_up(self.march.row, self.march.field)
        ended = loop.run_tasks(self.march, [self.decide] if origin else [self.record, self.decide])
        if not ended:
            self._march()
        if self.job.checkpoint.keep == 0 and self.march.row.step >= len(self.timeline):
            self._finish_without_checkpoint()
        elif self.saved != self.march.row.step:
            self.save(last=True)
        return self._farewell()

    def _finish_without_checkpoint(self) -> None:
        """Remove what a run that has finished does not need, if its results are safe."""
        self.recorder.sync()
        if problem := self.slab.agree(self.recorder.problem):
            raise RunError(problem + self._left())
        if self.slab.root:
            self.directory.prune(0)

    def _march(self) -> None:
        steps = steps_to_make(self.march, self.timeline, self.until)
        try:
            loop.run(self.march, [self.record, self.decide], steps)
        except StepError as error:
            text = f"{error}{self._left()}"
            self._log_counts()
            self.console.log(text)
            raise RunError(text) from error

    def _left(self) -> str:
        """Leave a checkpoint of the last good step; what to say of it."""
        try:
            if self.saved != self.march.row.step:
                self._write(last=True)
        except RunError as error:
            return f"; {error}"
        return self._newest()

    def record(self, marching: March) -> None:
        if marching.row.remark:
            self.console.say(marching.row.remark)
        self.recorder.write(marching.row, marching.field)
        self._weigh_errors(marching.row)
        try:
            doubts = self.contacts.judge(marching.row.step, marching.row.measures)
        except RunError as error:
            raise RunError(f"{error}{self._left()}") from error
        if doubts:
            self._doubt(doubts)

    def _doubt(self, texts: list[str]) -> None:
        """Warn, in the files too; all ranks have the same doubts."""
        for text in texts:
            self.console.warn(text)
        provenance = self.facts.provenance
        provenance = replace(provenance, warnings=(*provenance.warnings, *texts))
        self.facts = replace(self.facts, provenance=provenance)
        self.recorder.renew(provenance)

    def _weigh_errors(self, row: Row) -> None:
        if row.errors is not None:
            self.errors.add(row.errors, row.measures.friction, row.time - self._recorded)
        self._recorded = row.time

    def decide(self, marching: March) -> bool:
        """Save if it is time to; True ends the march."""
        row = marching.row
        verdict = self.watch.judge(row.step, row.step > self.first, self.recorder.problem)
        if verdict.problem:
            raise RunError(verdict.problem + self._left())
        self.stop = verdict.stop if row.step < len(self.timeline) else ""
        ends = bool(self.stop) or (self.until is not None and reached(row.time, self.until))
        if verdict.save and not ends and row.step < len(self.timeline):
            self.save()
        return ends

    def save(self, last: bool = False) -> None:
        """Write a checkpoint; results that were lost, or cannot be written, end the run when its state is saved."""
        self._write(last)
        if problem := self.slab.agree(self.recorder.problem):
            raise RunError(problem + self._left())

    def _write(self, last: bool) -> None:
        """Write a checkpoint; one failure is only warned of, two in a row, or one at the end, are a RunError.

        What was recorded is synchronised first, so that no checkpoint is ahead of it.
        """
        began, row = time.monotonic(), self.march.row
        path = self.directory.checkpoint(row.step)
        self.recorder.sync()
        facts = replace(self.facts, step=row.step, time=row.time, table=self.recorder.table)
        entries = {**self.march.entries(), "plans/all": Entry(wisdom.gather(self.slab))}
        try:
            checkpoint.write(path, self.slab, facts, entries)
        except RunError as error:
            if last or self.failed:
                raise RunError(f"{error}{self._newest()}") from error
            self.failed = True
            self.console.warn(f"no checkpoint after step {row.step}: {error}; the run ends if the next fails too")
            return
        self.saved, self.failed = row.step, False
        if self.slab.root:
            self.directory.note(saved=True)
            self.directory.prune(max(self.job.checkpoint.keep, 1))
        seconds = time.monotonic() - began
        self.saving += seconds
        self.watch.saved(seconds)
        self.console.log(f"checkpoint after step {row.step} in {seconds:.3g} s")

    def _newest(self) -> str:
        saved = self.slab.agree(self.directory.saved() if self.slab.root else [])
        return f"; the newest checkpoint is {saved[0][1]}" if saved else "; there is no checkpoint"

    def _log_counts(self) -> None:
        spent = time.monotonic() - self.began
        self.console.log(f"checkpoints took {self.saving:.3g} s of {spent:.4g} s")
        counts = ", ".join(f"{name} {count}" for name, count in sorted(self.slab.tally.items()))
        self.console.log(f"counts on root: {counts}")

    def _farewell(self) -> int:
        row, console = self.march.row, self.console
        self._log_counts()
        for line in self.errors.lines(self.job.numerics.accuracy):
            console.say(line)
        if self.stop:
            console.say(f"stopped after step {row.step} of {len(self.timeline)}: {self.stop}; run again to go on")
            return AGAIN
        finished = row.step >= len(self.timeline)
        if self.slab.root and finished:
            self.directory.note(saved=True, finished=(row.step, row.time))
        how = "done" if finished else f"stopped at t = {row.time:g} s as asked for, run again to go on"
        console.say(f"{how}: results in {self.directory.path}")
        return DONE
