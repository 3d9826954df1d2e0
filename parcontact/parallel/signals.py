"""Signals to stop or save, stored until all ranks have agreed."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

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
    def noted(self) -> Iterator["Signals"]:
        """Record signals within this context; outside it, they end the process at once. An outer context, such as the
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
