"""Jobs as they come from Python: a file or a mapping, found sound by root and known to every rank."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any

from .. import job as jobs
from .. import sanity
from ..effects.measured_range import describe_beyond
from ..job import Job
from ..parallel.mpi import MPI
from ..parallel.root import on_root
from ..scene import Frame

Given = str | os.PathLike[str] | Mapping[str, Any] | Job
SOMEWHERE = {"points": 2, "size": 1.0}  # a grid for what needs none
ANYTHING = {"model": "elastic", "shear_modulus": 1.0e6}
A_TOUCH = [{"pressure": 1.0}]


def read(given: Given, changes: Mapping[str, Any] | None = None, comm: MPI.Intracomm | None = None) -> Job:
    """The job of a file or mapping with some keys changed, on every rank of `comm`; collective. Raises JobError."""
    if isinstance(given, Job):
        return given
    made: list[Job] = []

    def load() -> Job:
        made.append(jobs.load(given, changes or {}))
        return made[0]

    sent = on_root(comm or MPI.COMM_WORLD, load)
    return made[0] if made else sent  # root's has the arrays of heights, which are not sent


def of_parts(**parts: Any) -> Job:
    """A job of which some sections matter, on this rank alone. Raises JobError."""
    rest = {"grid": SOMEWHERE, "surface": {"shape": "flat"}, "material": ANYTHING, "history": A_TOUCH}
    return jobs.load(rest | parts)


def warn_of(job: Job, frame: Frame) -> None:
    """Warn, on root, of what is allowed but means little; collective."""
    for text in (*job.warnings, *describe_beyond(job), *sanity.of_surface(frame)):
        if frame.slab.root:
            warnings.warn(text, UserWarning, stacklevel=4)
