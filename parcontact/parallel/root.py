"""Work of root alone, whose result or exception every rank receives."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import RunError

if TYPE_CHECKING:
    from .mpi import MPI

T = TypeVar("T")


def on_root(comm: MPI.Intracomm, act: Callable[[], T]) -> T:
    """Return or raise on every rank what `act` returns or raises on root; collective. If an exception cannot be
    pickled, the other ranks raise RunError with its text."""
    if comm.size == 1:
        return act()
    problem: Exception | None = None
    sent = b""
    if comm.rank == 0:
        try:
            value = act()
            sent = pickle.dumps((value, None))
        except Exception as error:
            problem, sent = error, _packed(error)
    sent = comm.bcast(sent)
    if comm.rank > 0:
        value, problem = pickle.loads(sent)
    if problem is not None:
        raise problem
    return value


def _packed(error: Exception) -> bytes:
    found: Any = None
    try:
        packed = pickle.dumps((None, error))
        found = pickle.loads(packed)[1]
    except Exception:  # pickling may raise anything
        packed = b""
    if isinstance(found, Exception):
        return packed
    return pickle.dumps((None, RunError(f"{type(error).__name__} on rank 0: {error}")))
