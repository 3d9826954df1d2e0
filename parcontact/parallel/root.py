"""Decisions of root, signals to all ranks, and ranks that wait for each other.

* Work of root alone, whose result or exception every rank receives.
* Signals to stop or save, stored until all ranks have agreed.
* Ranks wait for each other before a collective call, so that no rank hangs if another rank makes another call, or has
  ended. Every rank sends a checksum of 16 bytes of its next call to the others, and waits until all have done so. A
  rank that ends continues to answer the others until all have ended. If a rank ends with an exception while others wait
  for it in the middle of a call, it aborts all ranks.
"""

from __future__ import annotations

import atexit
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import blake2b
from itertools import groupby
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import RunError

if TYPE_CHECKING:
    from .slab import MPI, Array, Slab

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


def with_whole_maps(slab: Slab, act: Callable[..., T], *fields: Array) -> T:
    """Return or raise on every rank what `act` returns or raises on root. The arguments of `act` are the whole maps of
    `fields`, shape (ny, nx). Collective."""
    whole = [slab.to_root(field) for field in fields]
    return on_root(slab.comm, lambda: act(*whole))


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
    """Record of the signals to stop or save that this rank has received; a second Ctrl-C ends the process at once."""

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


WAIT_SECONDS = 5.0  # tuning: time that a rank with an exception waits for the others
TELL_SECONDS = 60.0  # tuning: waiting time after which a rank reports it
SPIN_SECONDS, NAP_SECONDS = 1e-3, 1e-3  # tuning: waiting time before sleeping, and sleep
ENDED = "has ended the program"
ADVICE = "every rank must make the same calls and as many steps: see 'From several ranks' in parcontact manual python. "
ADVICE += "A rank that works alone (mpi4py.futures) passes comm=MPI.COMM_SELF"

_known: list[MPI.Intracomm] = []


class _Exchange:
    """The call of this rank, sent to all ranks of a communicator, and their calls."""

    def __init__(self, comm: MPI.Intracomm, what: str) -> None:
        self.comm, self.what = comm, what
        self._own = blake2b(what.encode(errors="replace"), digest_size=16).digest()
        self._all = bytearray(16 * comm.size)
        self._request = comm.Iallgather(self._own, self._all)

    def done(self) -> bool:
        return bool(self._request.Test())

    def found(self) -> list[str]:
        """Return what each rank is about to do (`what`), once all ranks have sent this; collective."""
        return [self.what] if self._all == self._own * self.comm.size else self.comm.allgather(self.what)


def wait_for_all(comm: MPI.Intracomm, what: str) -> None:
    """Wait until all ranks of `comm` are about to do `what`, such as "makes step 3"; collective. Raises RunError on all
    ranks if one of them is about to do something else, or has ended the program."""
    if comm.size == 1:
        return
    if not _known:
        atexit.register(_leave)
    if not any(known is comm for known in _known):
        _known.append(comm)
    exchange, began, reported = _Exchange(comm, what), time.monotonic(), False
    while not exchange.done():
        waited = time.monotonic() - began
        if waited > TELL_SECONDS and not reported:
            _say(f"rank {comm.rank} {what} and has waited {waited:.0f} s for the others: {ADVICE}")
            reported = True
        if waited > SPIN_SECONDS:
            time.sleep(NAP_SECONDS)
    found = exchange.found()
    if len(set(found)) > 1:
        raise RunError(f"the ranks make different calls: {_ranks_of(found)}; {ADVICE}")


def _ranks_of(found: list[str]) -> str:
    """Return a sentence on the calls of all ranks; consecutive ranks with the same call are combined."""
    parts = []
    for what, group in groupby(enumerate(found), key=lambda pair: pair[1]):
        first, *rest = [rank for rank, _ in group]
        parts.append(f"rank{f's {first} to {rest[-1]} each' if rest else f' {first}'} {what}")
    return ", ".join(parts[:4]) + (", ..." if len(parts) > 4 else "")


def _leave() -> None:
    """Answer the other ranks at the end of the program, until all have ended."""
    from .slab import MPI

    error = getattr(sys, "last_value", None)  # an uncaught exception
    what = ENDED + (f" with {type(error).__name__}: {str(error)[:200]}" if error is not None else "")
    exchanges = [_Exchange(comm, what) for comm in _known if comm != MPI.COMM_NULL]
    deadline = time.monotonic() + WAIT_SECONDS
    while exchanges:
        for number, exchange in enumerate(exchanges):
            if not exchange.done():
                continue
            deadline = time.monotonic() + WAIT_SECONDS
            if all(each.startswith(ENDED) for each in exchange.found()):
                del exchanges[number]
            else:
                exchanges[number] = _Exchange(exchange.comm, what)
            break
        else:
            if error is not None and time.monotonic() > deadline:
                _say(
                    f"rank {MPI.COMM_WORLD.rank} {what}, and other ranks wait for it or continue alone: all are aborted"
                )
                sys.stdout.flush()
                MPI.COMM_WORLD.Abort(1)
            time.sleep(NAP_SECONDS)


def _say(text: str) -> None:
    print(f"parcontact: {text}", file=sys.stderr, flush=True)
