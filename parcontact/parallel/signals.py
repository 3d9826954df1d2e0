"""Signals that ask a program to stop, or to save, noted until all ranks have agreed on what to do."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOP = (signal.SIGUSR1, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
SAVE = signal.SIGCONT  # the first that mpirun sends when it was told to end, long before SIGTERM and SIGKILL


class Signals:
    """Notes that a signal has come to this rank; a second Ctrl-C ends the process at once."""

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
    def noted(self) -> Iterator["Signals"]:
        """Note signals meanwhile; before and after, they end the process at once, as there is nothing to save.

        Where another one notes them already, as that of a sweep around its cases, it is the one to ask. In a thread
        beside the main one none can be noted.
        """
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
