"""Jobs given in Python as a file or a mapping: read on root, and sent to all ranks."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from .. import mesh
from ..doubts import Doubt, ParcontactWarning
from ..errors import InputError, JobError
from ..history.timeline import Timeline
from ..job import Job
from ..parallel.lockstep import wait_for_all
from ..parallel.mpi import MPI
from ..parallel.root import on_root
from ..scene import Setup, sanity
from .wording import python_words

Given = str | os.PathLike[str] | Mapping[str, Any] | Job
SOMEWHERE = {"points": 2, "size": 1.0}  # grid of a job that needs none
ANYTHING = {"model": "elastic", "shear_modulus": 1.0e6}
A_TOUCH = [{"pressure": 1.0}]
DEEPEST = 50  # deepest nesting of mappings and lists
SHOWN = 60  # most characters of a value in a message
PACKAGE = str(Path(__file__).parents[1]) + os.sep


def read_job_here(given: Given, changes: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None) -> Job:
    """Return the job of a file or mapping with changed keys, on every rank of `comm`; collective.

    Raises JobError, also if ranks give different jobs, and InputError for a run that cannot begin.
    """
    world = all_ranks(comm)
    agree(world, given, changes)
    made: list[Job] = []

    def load() -> Job:
        made.append(_sound(given if isinstance(given, Job) else mesh.load(given, changes or {})))
        return made[0]

    with python_words():
        sent = on_root(world, load)
    return made[0] if made else sent  # only root's job has arrays of heights


def _sound(job: Job) -> Job:
    sanity.refuse_impossible(job, Timeline.from_job(job))
    return job


def all_ranks(comm: MPI.Intracomm | None) -> MPI.Intracomm:
    """Return the communicator (default: all ranks). Raises InputError for other objects."""
    if comm is not None and not isinstance(comm, MPI.Intracomm):
        raise InputError(f"comm must be a communicator of mpi4py, got {comm!r:.60}")
    return MPI.COMM_WORLD if comm is None else comm


def agree(comm: MPI.Intracomm, given: object, changes: object = None) -> None:
    """Raise JobError unless all ranks give the same job; collective."""
    if comm.size == 1:
        return
    wait_for_all(comm, "gives a job")
    own = dict([*_flat(given, ""), *_flat(changes, "set")])
    if len(set(comm.allgather(blake2b(repr(own).encode(errors="replace"), digest_size=16).digest()))) == 1:
        return
    everyone = comm.allgather(own)
    for rank, other in enumerate(everyone):
        for key in sorted({*everyone[0], *other}):
            first, here = (values.get(key, "not there") for values in (everyone[0], other))
            if first != here:
                text = f"{key or 'the job'} is {first:.{SHOWN}} on rank 0 and {here:.{SHOWN}} on rank {rank}"
                raise JobError([f"ranks give different jobs: {text}; give all of them the same"])


def _flat(value: Any, key: str, depth: int = 0) -> Iterator[tuple[str, str]]:
    """Yield key and value of all values of a job as text."""
    if isinstance(value, Job):
        value = value.resolved()
    if isinstance(value, np.ndarray) and value.dtype != object:
        digest = blake2b(np.ascontiguousarray(value).tobytes(), digest_size=8).hexdigest()
        yield key, f"an array of shape {value.shape} and checksum {digest}"
    elif isinstance(value, Mapping | list | tuple) and len(value) > 0 and depth < DEEPEST:
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, item in items:
            yield from _flat(item, f"{key}.{name}" if key else str(name), depth + 1)
    elif isinstance(value, os.PathLike):
        yield key, repr(os.fspath(value))
    else:
        value = value.item() if isinstance(value, np.generic) else value
        known = isinstance(value, str | int | float | range | None)
        yield key, repr(value) if known else f"of type {type(value).__name__}"


def path_of(path: object) -> Path:
    """Return a path. Raises InputError for other objects."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"a path must be a text or a pathlib.Path, got {path!r:.60}")
    try:
        usable = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        usable = False
    if not usable:
        raise InputError(f"a path must be a name that the file system can store, got {path!r:.60}")
    return Path(os.fsdecode(path))


def of_parts(**parts: Any) -> Job:
    """Return a job from some sections, on this rank only. Raises JobError."""
    rest = {"grid": SOMEWHERE, "surface": {"shape": "flat"}, "material": ANYTHING, "history": A_TOUCH}
    return _sound(mesh.load(rest | parts))


def warn_of(setup: Setup, temperatures: Sequence[float] = ()) -> None:
    """Warn on root about implausible values, also at `temperatures` [deg C]; collective."""
    for doubt in sanity.find_doubts(setup, temperatures):
        if setup.slab.root:
            warn(doubt)


def warn(doubt: Doubt) -> None:
    """Issue a warning at the line of the user's script that called this package."""
    level, frame = 1, inspect.currentframe()
    while frame is not None and frame.f_code.co_filename.startswith(PACKAGE):
        level, frame = level + 1, frame.f_back
    warnings.warn(ParcontactWarning(doubt), stacklevel=level)
