"""Ranks wait for each other before a collective call, so that a rank with another call, or an ended one, blocks none.

Every rank sends a checksum of 16 bytes of its next call to the others, and waits until all have. A rank that ends
continues to answer the others until all have ended. If it ends with an exception while others wait for it within a
step, it aborts them all.
"""

from __future__ import annotations

import atexit
import sys
import time
from hashlib import blake2b
from itertools import groupby

import numpy as np

from ..errors import RunError
from .mpi import MPI

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
        self._own = np.frombuffer(blake2b(what.encode(errors="replace"), digest_size=16).digest(), np.uint8)
        self._all = np.empty((comm.size, 16), np.uint8)
        self._request = comm.Iallgather(self._own, self._all)

    def done(self) -> bool:
        return bool(self._request.Test())

    def found(self) -> list[str]:
        """Return the call of each rank, once all have been received; collective."""
        return [self.what] if (self._all == self._own).all() else self.comm.allgather(self.what)


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
