"""Where a run begins: at the start of its history, or from the newest undamaged checkpoint of the same job."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ..errors import InputError
from ..job import Job, Stage, listing
from ..job.history import ChosenSteps, Step, Timeline, reached
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..physics.records import part_of
from . import checkpoint, outputs
from .checkpoint import Contents
from .outputs import ADVICE, Claim, Directory

SAME_STEP = 1e-9  # rounding: relative difference below which steps of two histories are the same


@dataclass(frozen=True)
class RestartPoint:
    """An undamaged checkpoint from which a run continues; `own` is True if it is in the run's output directory."""

    contents: Contents
    own: bool


def choose_origin(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str
) -> tuple[RestartPoint | None, list[str]]:
    """Return the checkpoint to continue from, or None, and warnings about skipped checkpoints; collective.

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
        found = sound(path, job, plain, slab)
        if isinstance(found, Contents):
            own = on_root(slab.comm, partial(_is_own, found, directory))
            return RestartPoint(found, own), [f"skipped: {text}" for text in problems]
        problems.append(found)
    if problems:
        raise InputError("\n".join(problems) + ("" if given else f"; {ADVICE}"))
    on_root(slab.comm, lambda: _refuse_loss(directory, plain))
    return None, []


def claim(plain: Mapping[str, Any], origin: RestartPoint | None) -> Claim:
    """Return the record of a run for the marker file. A run that continues in its own directory keeps its id."""
    new = Claim(outputs.kept(plain))
    return replace(new, id=origin.contents.run or new.id, saved=True) if origin and origin.own else new


def finished_before(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str, timeline: Timeline
) -> str:
    """Return a message if a run of this job finished earlier without keeping a checkpoint, else ''; collective."""

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


def sound(path: Path, job: Job, plain: Mapping[str, Any], slab: Slab) -> Contents | str:
    """Return the contents of a checkpoint from which a job can continue, or a text on why it cannot; collective.

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

    Raises InputError for a checkpoint of another run if the directory has results; root only.
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
    """Raise InputError for results that a new run would replace although no checkpoint can restore them; root only.

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
    """Return the contents of a checkpoint, or why it cannot be used; root only."""
    try:
        contents = checkpoint.inspect(path)
        if found := outputs.RUN.changes(contents.job, plain):
            return f"{path} belongs to another job: {found}"
        return contents
    except (InputError, OSError) as error:
        return str(error)


def find_changed_step(contents: Contents, job: Job) -> str:
    """Return a message on the first completed step of a checkpoint that differs from the same step of this job, or ''.
    Later steps may differ."""
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
