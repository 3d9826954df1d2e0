"""Runs of a job in its output directory, from the start or from a checkpoint."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..effects.contact_protocol import Detached
from ..effects.effect import columns_of
from ..errors import InputError
from ..history.chosen import ChosenSteps, reached
from ..history.timeline import Timeline
from ..job import Job, Rough, RoughSpectrum
from ..job.sections import listing
from ..march.loop import March
from ..parallel.root import on_root
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..physics.entries import Saved, part_of
from ..scene import choices, sanity
from ..steady_sliding import start as steadystart
from ..storage import hdf5, header, heights, read_back, step_row, wisdom
from ..storage.checkpoint import Contents, Facts
from ..storage.directory import Directory
from ..storage.marker import Claim
from ..storage.provenance import Link, Provenance, cite_lines, extend_chain
from ..storage.recorder import Recorder, Recording
from . import restart, watch
from .restart import RestartPoint
from .run import DONE, Options, Run
from .watch import Watch


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
        march = steadystart.first(job, slab, options.until or 0.0, saved)
        doubts = tuple(sanity.find_doubts(march.scene.setup))
        wisdom.keep(transforms, slab)
        claim = restart.claim(plain, origin)
        facts = Facts(plain, provenance_of(job, slab, saved, tuple(map(str, doubts))), claim.id)
        recorder = _open_files(march, directory, claim, facts, origin, options)
        try:
            for text in header.lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for doubt in doubts:
                recorder.console.warn(str(doubt), shown=options.shows(doubt))
            for text in (*warnings, *recorder.warnings):
                recorder.console.warn(text)
            limit = watch.limit(options.wall) if slab.root else None
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
    if lost := read_back.find_lost_rows(directory):
        raise InputError(lost)
    with suppress(FileNotFoundError):
        hdf5.open_results(directory / "fields.h5").close()


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
    step_row.columns(0, added)  # raises InputError for repeated names
    directory.make(job.path, job.resolved(), claim)
    heights.store(job.surface, directory.path, slab)
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
