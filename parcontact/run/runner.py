"""A run from a job to its output directory: it begins or goes on, saves what it remembers, and ends well."""

from dataclasses import dataclass

from .. import sanity
from ..effects import decisions
from ..errors import InputError
from ..job import Job, Rough, RoughSpectrum
from ..job.chosen import ChosenSteps, reached
from ..job.timeline import Timeline
from ..march.step import March
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..record import header, marker, wisdom
from ..record.checkpoint import Contents, Facts, Table
from ..record.directory import Directory
from ..record.marker import Claim
from ..record.provenance import Link, Provenance, extended
from ..record.recorder import Recorder
from ..scene import Scene
from ..steady_sliding import start as steadystart
from . import restart, watch
from .journey import DONE, Journey
from .restart import Origin
from .watch import Watch


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
        finished = restart.finished_before(job, plain, slab, directory, options.restart, timeline)
        origin, warnings = (None, []) if finished else restart.choose(job, plain, slab, directory, options.restart)
        if origin:
            timeline = job.timeline(options.until or 0.0, ChosenSteps.restored(origin.contents.numbers))
        _refuse_no_end(timeline, options.until)
        sanity.refuse_impossible(job, timeline)
        reason = _nothing_to_do(origin, timeline, options.until) if origin else finished
        if reason:
            if slab.root and not options.quiet:
                print(f"{directory.path}: {reason}", flush=True)
            return Ended(DONE, None, origin.contents if origin else None)
        wisdom.recall(job, slab, origin.wisdom if origin else None)
        marching = steadystart.first(job, slab, options.until or 0.0, origin.contents if origin else None)
        timeline = marching.timeline(options.until or 0.0)
        doubts = (*job.warnings, *sanity.of_surface(marching.scene.frame))
        wisdom.keep(job, slab)
        provenance = provenance_of(job, slab, origin.contents if origin else None, doubts)
        claim = restart.claim(plain, origin)
        recorder = _begin(marching.scene, directory, claim, provenance, origin, timeline, options.quiet)
        try:
            for text in header.lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for text in (*doubts, *warnings, *recorder.warnings):
                recorder.console.warn(text)
            limit = watch.limit(options.wall) if slab.root else None
            facts = Facts(0, 0.0, plain, provenance, claim.id)
            with Signals().noted() as signals:
                watching = Watch(slab, job.checkpoint, directory.stop_file, signals, limit)
                journey = Journey(marching, timeline, directory, recorder, watching, facts, options.until, origin)
                return Ended(journey.go(), marching)
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
    timeline: Timeline,
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
    total, chooses = len(timeline), timeline.chooses
    return Recorder(job, built.slab, directory, provenance, total, after, then, dissipated, quiet, added, chooses)
