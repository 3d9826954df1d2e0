#!/usr/bin/env python3
"""Starts an MPI launcher so that a wish to stop reaches its ranks as the signal by which they save: .venv/bin/mpirun.

    launch.py LAUNCHER ARGUMENT...

Launchers themselves give their ranks a few seconds after TERM or INT, and end with a code of their own. Here TERM, INT,
HUP and USR1 all become USR1, which launchers hand on to the ranks; a run of parcontact then saves and ends with 3. A
second signal, or 10 minutes after the first one, ends the launcher as it is used to. The code is that of the launcher.
"""

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType

ASKS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1)
SECONDS_TO_START = 1.0  # in which the launcher has started its ranks
SECONDS_TO_SAVE = 600.0  # for the step that is being made, and a checkpoint
SECONDS_TO_END = 15.0  # for the launcher to end its ranks, each of which it gives 3 s and again 3 s
PR_SET_PDEATHSIG = 1


class Launched:
    """The launcher, in a process group of its own: Ctrl-C reaches only this program."""

    def __init__(self) -> None:
        self.pid, self.asked, self.began = 0, False, time.monotonic()

    def start(self, words: list[str]) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, ASKS)  # what comes before the launcher is there waits for it
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            os.setpgid(0, 0)
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)  # nothing goes on when this program is killed
            signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKS)
            if os.getppid() != parent:
                os._exit(1)
            try:
                os.execvp(words[0], words)
            except OSError as error:
                print(f"mpirun: cannot start {words[0]}: {error.strerror}", file=sys.stderr, flush=True)
                os._exit(127)
        for number in ASKS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:  # nohup
                signal.signal(number, self.ask)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKS)

    def ask(self, number: int, frame: FrameType | None) -> None:
        """The ranks save and stop. Before there are ranks, or when asked again, all ends at once."""
        young = self.began + SECONDS_TO_START - time.monotonic()
        if self.asked or not self.has_ranks():
            self.end(number, frame)
        elif young > 0.0:  # Open MPI may hang when a rank is sent a signal that is just being made
            self.after(young, self.ask)
        else:
            self.asked = True
            self.after(SECONDS_TO_SAVE, self.end)
            os.kill(self.pid, signal.SIGUSR1)

    def end(self, number: int, frame: FrameType | None) -> None:
        """The launcher ends its ranks, or is killed if it cannot: they then notice that it is gone."""
        self.after(SECONDS_TO_END, self.kill)
        os.kill(self.pid, signal.SIGTERM)

    def kill(self, number: int, frame: FrameType | None) -> None:
        os.kill(self.pid, signal.SIGKILL)

    def after(self, seconds: float, act: Callable[[int, FrameType | None], None]) -> None:
        signal.signal(signal.SIGALRM, act)
        signal.setitimer(signal.ITIMER_REAL, seconds)

    def has_ranks(self) -> bool:
        """Whether the launcher has started a process; where the system does not say so, it has."""
        try:
            return bool(Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text())
        except OSError:
            return True

    def wait(self) -> int:
        os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)  # signals are handled meanwhile
        signal.pthread_sigmask(signal.SIG_BLOCK, (*ASKS, signal.SIGALRM))  # its number may soon be that of another
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return code if code >= 0 else 128 - code


def main() -> int:
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    launched = Launched()
    launched.start(sys.argv[1:])
    return launched.wait()


if __name__ == "__main__":
    sys.exit(main())
