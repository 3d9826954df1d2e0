"""What root alone does, and every rank learns: its result, or what a user can put right."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from ..errors import InputError, RunError

if TYPE_CHECKING:
    from .mpi import MPI

T = TypeVar("T")


def on_root(comm: MPI.Intracomm, act: Callable[[], T]) -> T:
    """What root's `act` gives or raises (InputError, RunError), on every rank; collective."""
    if comm.size == 1:
        return act()
    found: tuple[T | None, Exception | None] = (None, None)
    if comm.rank == 0:
        try:
            found = act(), None
        except (InputError, RunError) as error:
            found = None, error
    value, problem = comm.bcast(found)
    if problem is not None:
        raise problem
    return value
