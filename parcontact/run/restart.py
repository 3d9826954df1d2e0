"""The beginning of a run: at the start, or after the newest sound checkpoint that belongs to its job."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ..errors import InputError
from ..history.chosen import ChosenSteps, reached
from ..history.timeline import Step, Timeline
from ..job import Job, Stage
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..storage import checkpoint, marker
from ..storage.checkpoint import Contents
from ..storage.directory import ADVICE, Directory
from ..storage.marker import Claim

NUMERICS = tuple(f"numerics.{key}" for key in ("integrator", "kernel", "precision", "slope"))
SAME = (*marker.SCENE, *marker.EFFECTS, "initial", *NUMERICS)  # sections and keys that must not change
SAME_STEP = 1e-9  # accuracy: relative: steps of two histories this close are the same


@dataclass(frozen=True)
class RestartPoint:
    """A sound checkpoint to go on from; `own` if it lies in the run's own output directory."""

    contents: Contents
    own: bool


def choose_origin(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str
) -> tuple[RestartPoint | None, list[str]]:
    """Return where to begin, and warnings about checkpoints that were skipped; collective.

    `plain` is the job as plain data, on root; `restart` is `auto`, `never` or the path of a checkpoint. Raises
    InputError when there are checkpoints and none will do, or when results would be lost.
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
            return RestartPoint(found, own), [f"passed over: {text}" for text in problems]
        problems.append(found)
    if problems:
        raise InputError("\n".join(problems) + ("" if given else f"; {ADVICE}"))
    on_root(slab.comm, lambda: _refuse_loss(directory, plain))
    return None, []


def claim(plain: Mapping[str, Any], origin: RestartPoint | None) -> Claim:
    """Return what a run says of itself in the marker: its id stays as long as it goes on in its own directory."""
    new = Claim(marker.kept(plain))
    return replace(new, id=origin.contents.run or new.id, saved=True) if origin and origin.own else new


def finished_before(
    job: Job, plain: Mapping[str, Any], slab: Slab, directory: Directory, restart: str, timeline: Timeline
) -> str:
    """Return what to say of a run of this job that has finished and was to keep no checkpoint, or ''; collective."""

    def look() -> str:
        claim = directory.claim
        if restart != "auto" or job.checkpoint.keep or claim is None or claim.finished is None or directory.saved():
            return ""
        steps, at = claim.finished
        whole = reached(at, timeline.end) if timeline.chooses else steps == len(timeline)
        other = any(marker.differences(claim.job, plain, SAME))
        if other or not whole or not (directory.path / "measures.csv").exists():
            return ""
        return f"finished before, at t = {at:g} s, without a checkpoint (--restart never: run it afresh)"

    return on_root(slab.comm, look)


def sound(path: Path, job: Job, plain: Mapping[str, Any], slab: Slab) -> Contents | str:
    """Return a checkpoint from which a job can go on, without its maps, or why it cannot; collective.

    Raises InputError for a job whose history was another one up to there.
    """
    found = on_root(slab.comm, lambda: _attempt(path, plain))
    if isinstance(found, str):
        return found
    if problem := checkpoint.verify(found, slab):
        return problem
    if difference := on_root(slab.comm, lambda: find_changed_step(found, job)):
        other = "to go on otherwise, end the running stage where it is and add another; or"
        raise InputError(f"{path}: {difference}; {other} {ADVICE}, --restart PATH goes on from an earlier checkpoint")
    return found


def _is_own(contents: Contents, directory: Directory) -> bool:
    """Return whether a checkpoint is of the run in the directory: by its id, or as one of its files under any name.

    Raises InputError for that of another run, if the directory holds results; root only.
    """
    if directory.claim is not None and contents.run:
        own = contents.run == directory.claim.id
    else:
        own = any(contents.path.samefile(path) for _, path in directory.saved())
    if not own and (found := directory.results()):
        there = f"{directory.path}, which holds {', '.join(found[:3])}"
        raise InputError(f"{contents.path} is of another run than {there}; --out chooses another directory")
    return own


def _refuse_loss(directory: Directory, plain: Mapping[str, Any]) -> None:
    """Raise InputError for results that a new run would replace, though no checkpoint can make them; root only.

    A run of this job that ended before its first checkpoint has nothing that this one does not make again.
    """
    claim, found = directory.claim, directory.results()
    if claim is None or not found:
        return
    there = f"{directory.path} holds {', '.join(found)}"
    if different := marker.list_differences(marker.differences(claim.job, plain, SAME)):
        raise InputError(f"{there} of another job: {different}; {ADVICE}")
    if claim.saved:
        how = f"a run that has finished at t = {claim.finished[1]:g} s" if claim.finished else "a run"
        raise InputError(f"{there} of {how}, but its checkpoints are missing; {ADVICE}")


def _attempt(path: Path, plain: Mapping[str, Any]) -> Contents | str:
    """Return a checkpoint without its maps, or why it will not do; root only."""
    try:
        contents = checkpoint.inspect(path)
        if found := marker.list_differences(marker.differences(contents.job, plain, SAME)):
            return f"{path} belongs to another job: {found}"
        return contents
    except (InputError, OSError) as error:
        return str(error)


def find_changed_step(contents: Contents, job: Job) -> str:
    """Return which of the steps already made would be another one in this job, or ''; those to come may be others."""
    number, until = contents.step, contents.time
    history = TypeAdapter(tuple[Stage, ...]).validate_python(contents.job["history"])
    old, new = (
        Timeline.from_job(each, until, ChosenSteps.from_job(each, contents.numbers))
        for each in (job.model_copy(update={"history": history}), job)
    )
    count = min(number, len(old), len(new))
    for step in range(old.shared(new) + 1, count + 1):
        if difference := next(_apart(old[step], new[step]), ""):
            return f"step {step} of the {number} already made {difference}"
    return f"{number} steps were made, and the job has {count} up to t = {until:g} s" if count < number else ""


def _apart(old: Step, new: Step) -> Iterator[str]:
    """Yield in what two steps differ."""
    size = math.hypot(*old.position)
    if old.jump != new.jump:
        yield "was a jump of the load, and is none now" if old.jump else "was no jump of the load, and is one now"
    if not math.isclose(old.time, new.time, rel_tol=SAME_STEP):
        yield f"ended at t = {old.time!r} s, ends at {new.time!r} s"
    if old.control != new.control or not math.isclose(old.load, new.load, rel_tol=SAME_STEP):
        yield f"had {old.control} {old.load!r}, has {new.control} {new.load!r}"
    if math.dist(old.position, new.position) > SAME_STEP * size:
        yield f"ended with the surface at {old.position} m, ends at {new.position} m"
