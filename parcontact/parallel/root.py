"""Decisions of root, and signals to all ranks.

* Work of root alone, whose result or exception every rank receives.
* Signals to stop or save, stored until all ranks have agreed.
"""

from __future__ import annotations

import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import RunError

if TYPE_CHECKING:
    from .mpi import MPI

T = TypeVar("T")


def on_root(comm: MPI.Intracomm, act: Callable[[], T]) -> T:
    """Return or raise on every rank what `act()` returns or raises on root; collective. If an exception cannot be
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


STOP = (signal.SIGUSR1, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
SAVE = signal.SIGCONT  # the first signal of mpirun when it ends a job, long before SIGTERM and SIGKILL


class Signals:
    """Record of the signals of this rank; a second Ctrl-C ends the process at once."""

    def __init__(self) -> None:
        self.stop = self.save = False

    def note(self, number: int, frame: FrameType | None) -> None:
        if number == SAVE:
            self.save = True
            return
        if self.stop and number == signal.SIGINT:
            raise KeyboardInterrupt
        self.stop = True

    @contextmanager
    def noted(self) -> Iterator[Signals]:
        """Record signals within this context; outside, they end the process at once. An outer context, such as the
        context of a sweep, keeps recording. Signals are recorded in the main thread only."""
        outer = getattr(signal.getsignal(SAVE), "__self__", None)
        if isinstance(outer, Signals) or threading.current_thread() is not threading.main_thread():
            yield outer if isinstance(outer, Signals) else self
            return
        before = {number: signal.signal(number, self.note) for number in (*STOP, SAVE)}
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
