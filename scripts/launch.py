#!/usr/bin/env python3
"""Start an MPI launcher so that signals make its ranks save and stop; installed as .venv/bin/mpirun.

    launch.py LAUNCHER ARGUMENT...

After TERM or INT launchers kill their ranks within a few seconds, and end with their own exit code. This program sends
USR1 instead of TERM, INT, HUP and USR1, which launchers forward to the ranks; a run of parcontact then saves and ends
with 3. The launcher is terminated by a second signal, or 10 minutes after the first one. The exit code is the exit code
of the launcher.
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
SECONDS_TO_START = 1.0  # within which the launcher starts its ranks
SECONDS_TO_SAVE = 600.0  # for the present step and a checkpoint
SECONDS_TO_END = 15.0  # for the launcher to end its ranks, after two waits of 2 s each
PR_SET_PDEATHSIG = 1


class Launched:
    """The launcher, in a process group of its own: Ctrl-C reaches only this program."""

    def __init__(self) -> None:
        self.pid, self.asked, self.began = 0, False, time.monotonic()

    def start(self, words: list[str]) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, ASKS)  # signals wait until the launcher exists
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            os.setpgid(0, 0)
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)  # the launcher ends when this program is killed
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
        """Make the ranks save and stop; end the launcher at once without ranks, or at the second signal."""
        young = self.began + SECONDS_TO_START - time.monotonic()
        if self.asked or not self.has_ranks():
            self.end(number, frame)
        elif young > 0.0:  # Open MPI may hang if a signal reaches a rank that is just starting
            self.after(young, self.ask)
        else:
            self.asked = True
            self.after(SECONDS_TO_SAVE, self.end)
            os.kill(self.pid, signal.SIGUSR1)

    def end(self, number: int, frame: FrameType | None) -> None:
        """Make the launcher end its ranks; kill it if it does not: its ranks then end, too."""
        self.after(SECONDS_TO_END, self.kill)
        os.kill(self.pid, signal.SIGTERM)

    def kill(self, number: int, frame: FrameType | None) -> None:
        os.kill(self.pid, signal.SIGKILL)

    def after(self, seconds: float, act: Callable[[int, FrameType | None], None]) -> None:
        signal.signal(signal.SIGALRM, act)
        signal.setitimer(signal.ITIMER_REAL, seconds)

    def has_ranks(self) -> bool:
        """Return True if the launcher has started a process, or if the system does not say so."""
        try:
            return bool(Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text())
        except OSError:
            return True

    def wait(self) -> int:
        os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)  # signals are handled during the wait
        signal.pthread_sigmask(signal.SIG_BLOCK, (*ASKS, signal.SIGALRM))  # its number may be used again soon
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
