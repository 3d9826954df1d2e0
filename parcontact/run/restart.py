"""Where a run begins: at the start, or after the newest sound checkpoint that belongs to its job."""

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from ..errors import InputError
from ..job import HeightFile, Job, Stage
from ..job.table import plain
from ..job.timeline import Step
from ..parallel.slab import Slab
from ..record import checkpoint
from ..record.checkpoint import Contents
from ..record.directory import Directory

SAME = ("grid", "surface", "material", "initial")  # sections that must not change
SAME_NUMERICS = ("integrator", "kernel", "precision", "slope")
ROUND_OFF = 1e-9  # relative: steps of two histories this close are the same
ADVICE = "--restart never starts afresh, --out chooses another directory"


@dataclass(frozen=True)
class Origin:
    """A sound checkpoint to go on from; `own` if it lies in the run's own output directory."""

    contents: Contents
    own: bool

    @property
    def plans(self) -> NDArray[np.uint8] | None:
        """The transform plans of the run that wrote it."""
        return self.contents.numbers.get("plans/all")


def plain_job(job: Job) -> dict[str, Any]:
    """A job as plain data for a checkpoint; files of heights are known by what they hold, not by their path."""
    data: dict[str, Any] = plain(job)
    for part, shape in zip(data["surface"], job.surface, strict=True):
        if isinstance(shape, HeightFile):
            del part["path"]
            part["content"] = f"{zlib.crc32(shape.path.read_bytes()):08x}"
    return data


def choose(job: Job, slab: Slab, directory: Directory, restart: str) -> tuple[Origin | None, list[str]]:
    """Where to begin, and warnings about checkpoints that were passed over; collective.

    `restart` is `auto`, `never` or the path of a checkpoint. Raises InputError when there are some and none will do.
    """
    if restart == "never":
        return None, []
    given = None if restart == "auto" else Path(restart)
    candidates = [given] if given else [path for _, path in slab.agree(directory.saved() if slab.root else [])]
    problems: list[str] = []
    for path in candidates:
        found = slab.agree(_attempt(path, job) if slab.root else None)
        problem = found if isinstance(found, str) else checkpoint.verify(found, slab) if found else "?"
        if isinstance(found, Contents) and not problem:
            if difference := slab.agree(another_past(found, job) if slab.root else ""):
                raise InputError(f"{path}: {difference}; {ADVICE}, --restart PATH goes on from an earlier checkpoint")
            own = slab.agree(path.absolute().parent == directory.checkpoints.absolute())
            return Origin(found, own), [f"passed over: {text}" for text in problems]
        problems.append(problem)
    if problems:
        raise InputError("\n".join(problems) + ("" if given else f"; {ADVICE}"))
    return None, []


def _attempt(path: Path, job: Job) -> Contents | str:
    """A checkpoint without its maps, or why it will not do; root only."""
    try:
        contents = checkpoint.inspect(path)
        if found := "; ".join(differences(contents.job, plain_job(job))):
            return f"{path} belongs to another job: {found}"
        return contents
    except (InputError, OSError) as error:
        return str(error)


def differences(then: dict[str, Any], now: dict[str, Any]) -> Iterator[str]:
    """What in the job of a checkpoint makes it another one than a job as plain data, with both values."""
    for section in SAME:
        yield from _differences(section, then.get(section), now.get(section))
    for key in SAME_NUMERICS:
        yield from _differences(f"numerics.{key}", then["numerics"].get(key), now["numerics"].get(key))


def _differences(name: str, then: Any, now: Any) -> Iterator[str]:
    if isinstance(then, dict) and isinstance(now, dict):
        for key in [*then, *(key for key in now if key not in then)]:
            yield from _differences(f"{name}.{key}", then.get(key), now.get(key))
    elif _parts(then) and _parts(now) and len(then) == len(now):
        for index, (old, new) in enumerate(zip(then, now, strict=True)):
            yield from _differences(f"{name}.{index}", old, new)
    elif then != now:
        yield f"{name} was {then}, is {now}"


def _parts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(part, dict) for part in value)


def another_past(contents: Contents, job: Job) -> str:
    """Which of the steps already made would be another one in this job, or ''; those to come may be others."""
    number, until = contents.step, contents.time
    history = TypeAdapter(tuple[Stage, ...]).validate_python(contents.job["history"])
    old, new = (each.timeline(until) for each in (job.model_copy(update={"history": history}), job))
    count = min(number, len(old), len(new))
    for step in range(old.shared(new) + 1, count + 1):
        if difference := next(_apart(old[step], new[step]), ""):
            return f"step {step} of the {number} already made {difference}"
    return f"{number} steps were made, and the job has {count} up to t = {until:g} s" if count < number else ""


def _apart(old: Step, new: Step) -> Iterator[str]:
    size = math.hypot(*old.position)
    if old.jump != new.jump:
        yield "was a jump of the load, is none" if old.jump else "was none, is a jump of the load"
    if not math.isclose(old.time, new.time, rel_tol=ROUND_OFF):
        yield f"ended at t = {old.time!r} s, ends at {new.time!r} s"
    if old.control != new.control or not math.isclose(old.load, new.load, rel_tol=ROUND_OFF):
        yield f"had {old.control} {old.load!r}, has {new.control} {new.load!r}"
    if math.dist(old.position, new.position) > ROUND_OFF * size:
        yield f"ended with the surface at {old.position} m, ends at {new.position} m"
