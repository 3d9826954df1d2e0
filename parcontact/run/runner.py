"""A run from a job to its output directory: it begins or goes on, saves what it remembers, and ends well."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ..effects.effect import columns_of
from ..errors import InputError, RunError
from ..history.chosen import ChosenSteps, reached
from ..history.timeline import Timeline
from ..job import Job, Rough, RoughSpectrum, identity
from ..march.loop import March
from ..parallel.signals import Signals
from ..parallel.slab import Slab
from ..scene import choices, sanity
from ..steady_sliding import start as steadystart
from ..storage import header, heights, row, wisdom
from ..storage.checkpoint import Contents, Facts
from ..storage.console import Console, Silence, always
from ..storage.directory import Directory
from ..storage.marker import Claim
from ..storage.provenance import Link, Provenance, extended
from ..storage.recorder import Recorder, Recording
from ..storage.stopfile import StopFile
from . import half_mesh, restart, watch
from .half_mesh import HalfMesh
from .journey import DONE, Journey
from .restart import Origin
from .watch import Watch


@dataclass(frozen=True)
class Options:
    """What the command line adds to a job: where to begin, `until` in s of the history, `wall` in s of this program.

    A run `beside` another one ends with that one's stop file, and warns of nothing about its scene. One that is a case
    of a sweep ends with the stop file of all, `others_file`, too. Doubts about a scene that are not shown, as `shows`
    says, go into run.log only.
    """

    quiet: bool = False
    restart: str = "auto"
    until: float | None = None
    wall: float | None = None
    stop_file: Path | None = None
    others_file: StopFile | None = None
    beside: bool = False
    shows: Callable[[str], bool] = always


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
        plain = identity.plain_job(job) if slab.root else {}
        timeline = Timeline.of(job, options.until or 0.0)
        finished = restart.finished_before(job, plain, slab, directory, options.restart, timeline)
        origin, warnings = (None, []) if finished else restart.choose(job, plain, slab, directory, options.restart)
        if origin:
            timeline = Timeline.of(job, options.until or 0.0, ChosenSteps.of(job, origin.contents.numbers))
        _refuse_no_end(timeline, options.until)
        sanity.refuse_impossible(job, timeline)
        reason = _nothing_to_do(origin, timeline, options.until) if origin else finished
        if reason:
            if slab.root and not options.quiet:
                print(f"{directory.path}: {reason}", flush=True)
            return Ended(DONE, None, origin.contents if origin else None)
        wisdom.recall(choices(job).transforms, slab, origin.wisdom if origin else None)
        marching = steadystart.first(job, slab, options.until or 0.0, origin.contents if origin else None)
        timeline = marching.timeline(options.until or 0.0)
        found = sanity.find_doubts(marching.scene.setup)
        doubts = () if options.beside else tuple(found)
        wisdom.keep(choices(job).transforms, slab)
        provenance = provenance_of(job, slab, origin.contents if origin else None, doubts)
        claim = restart.claim(plain, origin)
        recorder = _begin(marching, directory, claim, provenance, origin, timeline, options.quiet)
        try:
            for text in header.lines(slab.comm) if slab.root else ():
                recorder.console.log(text)
            for text in doubts:
                recorder.console.warn(text, shown=options.shows(text))
            for text in (*warnings, *recorder.warnings):
                recorder.console.warn(text)
            limit = watch.limit(options.wall) if slab.root else None
            facts = Facts(0, 0.0, plain, provenance, claim.id)
            with Signals().noted() as signals:
                stop_file = options.stop_file or directory.stop_file
                watching = Watch(slab, job.checkpoint, stop_file, signals, limit, options.others_file)
                code, half = _half_mesh(job, slab, options, recorder.console, stop_file)
                if code != DONE:
                    return Ended(code, marching)
                if half is not None:
                    marching.compare_with(partial(half.known_better, timeline=timeline))
                told = set(sanity.ODD_CONTACTS if options.beside else ())
                contacts = sanity.ContactWatch(job.numerics.strict, timeline, told)
                parts = marching, timeline, directory, recorder, watching, facts
                journey = Journey(*parts, options.until, contacts, options.shows)
                return Ended(journey.go(origin), marching)
        finally:
            recorder.close()


def _half_mesh(
    job: Job, slab: Slab, options: Options, console: Console | Silence, stop_file: Path
) -> tuple[int, HalfMesh | None]:
    """Run the job on half the mesh if that is asked for; the exit code, and what was measured there; collective.

    Where that cannot be done the run goes on without it.
    """
    if not choices(job).mesh_check.on:
        return DONE, None
    half = half_mesh.job_on_half_mesh(job)
    grid, where = half.grid, half.output.directory
    console.say(f"mesh check: {grid.nx} x {grid.ny} points first, in {where}")
    beside = replace(options, quiet=True, stop_file=stop_file, beside=True)
    restart = "never" if options.restart == "never" else "auto"
    own = slab.resized(*grid.points)
    try:
        try:
            code = run(half, own, replace(beside, restart=restart))
        except InputError:  # of an earlier run of another job
            code = run(half, own, replace(beside, restart="never"))
        if code != DONE:
            console.say(f"stopped in the run on half the mesh, {where}; run again to go on")
            return code, None
        return DONE, HalfMesh.read(half, slab)
    except (InputError, RunError) as error:
        console.warn(f"mesh check: the run on half the mesh failed, and its errors are estimated: {error}")
        return DONE, None


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
    marching: March,
    directory: Directory,
    claim: Claim,
    provenance: Provenance,
    origin: Origin | None,
    timeline: Timeline,
    quiet: bool,
) -> Recorder:
    """Make the output directory ready, and its files; collective."""
    built = marching.scene
    job, added = built.job, columns_of(built.followers)
    row.columns(0, added)  # refuses names that are taken
    directory.make(job.path, job.resolved(), claim)
    heights.store(job.surface, directory.path, built.slab)
    if origin and origin.own:
        directory.go_back(origin.contents.step)
    elif origin is None:
        directory.clear()
    split = built.choices.branch_dissipation.on
    recording = Recording(
        total=len(timeline),
        branches=len(marching.row.branch_dissipation) if split else 0,
        added=added,
        maps=job.output.fields,
        size=job.grid.size,
        every=job.output.every,
        open_ended=timeline.chooses,
    )
    return Recorder(directory, recording, provenance, origin.contents if origin else None, quiet)
