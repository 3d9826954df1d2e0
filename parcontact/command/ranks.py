"""The ranks of this program: which one is root, and the start of MPI for verbs that need it.

Root is known from the launcher's environment variables, so verbs without MPI start at once; the other ranks then print
nothing and exit with code 0.
"""

from __future__ import annotations

import os
import resource
import sys
from functools import wraps
from typing import TYPE_CHECKING

from ..errors import InputError
from ..parallel.root import on_root

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from ..parallel.mpi import MPI

    Verb = Callable[[argparse.Namespace], int]

BLANK = " \0"  # characters that may follow the name of an MPI library
LEAST_FILES, LEAST_MEMORY = 32, 520e6  # tuning: open files, and memory [bytes], that MPI needs to start
RANKS = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")  # variables that hold the rank
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")  # number of ranks


def is_root() -> bool:
    """Return True on the rank that prints."""
    return rank() == 0


def rank() -> int:
    """Return the rank of this process, by MPI if it has started, else by the launcher."""
    if (world := started()) is not None:
        return world.rank
    return next((int(text) for name in RANKS if (text := os.environ.get(name, "")).isdecimal()), 0)


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def launched() -> int:
    """Return the number of ranks that a launcher has started."""
    return max((int(os.environ.get(name) or 1) for name in LAUNCHERS), default=1)


def started() -> MPI.Intracomm | None:
    """Return the communicator of all ranks if MPI has started, else None."""
    module = sys.modules.get("mpi4py.MPI")
    return None if module is None else module.COMM_WORLD


def start_ranks() -> MPI.Intracomm:
    """Start MPI, and return the communicator of all ranks. Raises InputError if the launcher belongs to another MPI."""
    _refuse_surroundings()
    from ..parallel.mpi import MPI

    world, count = MPI.COMM_WORLD, launched()
    if world.size == 1 and count > 1:
        raise InputError(
            f"{count} ranks were started but each is alone: the launcher belongs to another MPI than mpi4py "
            f"({MPI.Get_library_version().splitlines()[0].strip(BLANK)}). Use the mpirun in the directory of this "
            "parcontact (see parcontact manual install)."
        )
    return world


def _refuse_surroundings() -> None:
    """Raise InputError for limits and settings of the shell that would make MPI abort without a message."""
    files, memory = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_NOFILE, resource.RLIMIT_AS))
    if 0 <= files < LEAST_FILES:
        raise InputError(f"only {files} files may be open: set a limit of {LEAST_FILES} or more, by ulimit -n")
    if scratch := os.environ.get("TMPDIR"):
        try:
            os.makedirs(scratch, exist_ok=True)  # as MPI does
        except OSError as error:
            text = (
                f"TMPDIR is {scratch}, which cannot be created ({error.strerror}): give a directory that you may write"
            )
            raise InputError(text) from None
    if 0 <= memory < LEAST_MEMORY:
        raise InputError(f"only {memory >> 20} MB of memory may be used: set a limit of 1 GB or more, by ulimit -v")


def root_alone(verb: Verb) -> Verb:
    """Return a verb that only root executes; MPI starts if there are several ranks, as imports on root may start it."""

    @wraps(verb)
    def act(options: argparse.Namespace) -> int:
        if launched() > 1:
            return on_root(start_ranks(), lambda: verb(options))
        return verb(options) if is_root() else 0

    return act
