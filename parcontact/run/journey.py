"""A march through its timeline, with what is done on the way: it is recorded, saved, stopped if asked to."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

from .. import scene
from ..errors import InputError, RunError
from ..history.chosen import reached
from ..history.timeline import Timeline
from ..job.checks.sample import describe_sample
from ..march import loop
from ..march.failure import StepError
from ..march.loop import March
from ..scene import sanity
from ..storage import measures
from ..storage.checkpoint import Facts
from ..storage.console import always
from ..storage.directory import Directory
from ..storage.recorder import Recorder
from ..summary import slide
from .errors_so_far import chosen_by_accuracy
from .restart import Origin
from .watch import Watch

DONE, AGAIN = 0, 3  # exit codes: as asked; stopped early with a good checkpoint, run again


class Journey:
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
        contacts: sanity.ContactWatch,
        shows: Callable[[str], bool] = always,
    ) -> None:
        self.march, self.timeline, self.directory, self.recorder = marching, timeline, directory, recorder
        self.watch, self.facts, self.until = watching, facts, until
        self.slab, self.job = marching.scene.slab, marching.scene.job
        self.console = recorder.console
        self.first, self.saved, self.failed = marching.row.step, -1, False
        self.watch.state_bytes = sum(entry.nbytes for entry in marching.entries().values()) * self.slab.comm.size
        self.contacts, self.shows = contacts, shows
        self.stop = ""
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
        self._bring_up_to_date()
        if problem := self.slab.agree(self.recorder.problem):
            raise RunError(problem + self._left())
        if self.slab.root:
            self.directory.prune(0)

    def _bring_up_to_date(self) -> None:
        """What was recorded is on the disk then, with the error budget so far."""
        budget = self.march.state.errors.facts(self.job.numerics.accuracy)
        self.facts = replace(self.facts, provenance=replace(self.facts.provenance, budget=budget))
        self.recorder.sync(self.facts.provenance)

    def _march(self) -> None:
        try:
            loop.run(self.march, [self.record, self.decide], self.march.steps(self.timeline, self.until))
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
        total = len(self.timeline) if self.timeline.chooses else 0
        self.recorder.write(marching.row, marching.field, total)
        try:
            doubts = self.contacts.judge(marching.row.step, marching.row.measures)
        except RunError as error:
            raise RunError(f"{error}{self._left()}") from error
        if doubts:
            self._doubt(doubts)

    def _doubt(self, texts: list[str]) -> None:
        """Warn, in the files too; all ranks have the same doubts."""
        for text in texts:
            self.console.warn(text, shown=self.shows(text))
        provenance = self.facts.provenance
        provenance = replace(provenance, warnings=(*provenance.warnings, *texts))
        self.facts = replace(self.facts, provenance=provenance)
        self.recorder.renew(provenance)

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
        self._bring_up_to_date()
        try:
            self.march.save(path, replace(self.facts, table=self.recorder.table))
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

    @property
    def _slides(self) -> bool:
        return any(stage.speed for stage in self.job.history)

    def _tell_slide(self) -> None:
        """What sweeps collect of a run; a table that cannot be read now ends no run."""
        if self.slab.root and self._slides:
            with suppress(OSError, InputError):
                rows = measures.read(self.directory.path / "measures.csv")
                for text in slide.describe(self.job.history, self.job.initial, self.job.grid.dx, rows):
                    self.console.say(text)

    def _farewell(self) -> int:
        row, console = self.march.row, self.console
        self._log_counts()
        for line in self.march.state.errors.lines(self.job.numerics.accuracy, chosen_by_accuracy(self.job)):
            console.say(line)
        if self.march.state.errors.area is not None and (text := describe_sample(self.job, self._slides)):
            console.say(text)
        if self.stop:
            of = f"at least {len(self.timeline)}" if self.timeline.chooses else str(len(self.timeline))
            console.say(f"stopped after step {row.step} of {of}: {self.stop}; run again to go on")
            return AGAIN
        self._tell_slide()
        finished = row.step >= len(self.timeline)
        if self.slab.root and finished:
            self.directory.note(saved=True, finished=(row.step, row.time))
        how = "done" if finished else f"stopped at t = {row.time:g} s as asked for, run again to go on"
        console.say(f"{how}: results in {self.directory.path}")
        return DONE
