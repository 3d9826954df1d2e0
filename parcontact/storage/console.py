"""What a run says: one line per step on root, a progress bar on a terminal, the same lines in run.log."""

import re
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from tqdm import tqdm

from ..streams import printable
from .row import Row

HEAD = "    step        time [s]    load [Pa]      area  friction   iter  residual"
STAMP = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d+ ")
WARNING = "warning: "
EVERY_SECONDS = 0.5  # a bar is redrawn, and lines are shortened to a bar, at most this often
LEFT_SECONDS = 30.0  # between two lines with the time left, where there is no terminal for a bar


def line(row: Row) -> str:
    m = row.measures
    return (
        f"{row.step:8d} {row.time:15.8g} {m.pressure:12.5g} {m.contact_area:9.5f} {m.friction:9.6f} "
        f"{row.iterations:6d} {row.certificate.worst:9.2e}"
    )


def warnings_of(log: Path) -> list[str]:
    """Return the warnings in a log, each once and in their order; none where there is no log."""
    lines = [STAMP.sub("", line) for line in log.read_text(errors="replace").splitlines()] if log.is_file() else []
    return list(dict.fromkeys(line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)))


def always(text: str) -> bool:
    """Every warning is shown."""
    return True


class Console:
    """Root's voice; the other ranks have `Silence` instead, so that no caller asks who it is."""

    def __init__(self, log: Path | None, quiet: bool, total: int) -> None:
        self._log = log.open("ab", buffering=0) if log is not None else None
        self._quiet, self._total = quiet, total
        self._first, self._began, self._told = 0, 0.0, 0.0
        self._bar: tqdm[None] | None = None
        self._headed = False

    def say(self, text: str) -> None:
        """A message for the user and the log."""
        self.log(text)
        if not self._quiet:
            self._write(text)

    def log(self, text: str) -> None:
        """For run.log only, which no run ends for."""
        if self._log is not None:
            now = time.time()
            stamp = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
            with suppress(OSError):
                self._log.write(f"{stamp},{int(now % 1.0 * 1000):03d} {printable(text)}\n".encode())

    def warn(self, text: str, shown: bool = True) -> None:
        """A message that is shown even to those who asked for quiet, or is for run.log only."""
        self.log(f"{WARNING}{text}")
        if shown:
            self._write(f"warning: {printable(text)}", sys.stderr)

    def step(self, row: Row) -> None:
        """One line per step."""
        text = line(row)
        self.log(text)
        if self._quiet:
            return
        if not self._headed:
            self._headed = True
            print(HEAD)
            self._first, self._began = row.step, time.monotonic()
            self._told = self._began
            if sys.stderr.isatty() and self._total > 1:
                self._bar = tqdm(
                    total=self._total, initial=row.step, unit="step", leave=False, mininterval=EVERY_SECONDS
                )
        self._write(text)
        if self._bar is not None:
            self._bar.update(row.step - self._bar.n)
        else:
            self._tell_time_left(row.step)

    def _tell_time_left(self, step: int) -> None:
        """Now and then, if steps go on to take as long as they did."""
        now = time.monotonic()
        if now - self._told >= LEFT_SECONDS and self._first < step < self._total:
            self._told = now
            left = (now - self._began) / (step - self._first) * (self._total - step)
            clock = f"{int(left // 3600)}:{int(left // 60) % 60:02d}:{int(left) % 60:02d}"
            self._write(f"# step {step} of {self._total}, about {clock} left")

    def expect(self, total: int) -> None:
        """So many steps are there to be, as far as is known by now."""
        self._total = total
        if self._bar is not None:
            self._bar.total = total

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._log is not None:
            self._log.close()

    def _write(self, text: str, file: TextIO | None = None) -> None:
        if self._bar is not None:
            self._bar.write(text, file=file)
        else:
            print(text, file=file, flush=True)


class Silence:
    """The console of every other rank."""

    def say(self, text: str) -> None: ...

    def log(self, text: str) -> None: ...

    def warn(self, text: str, shown: bool = True) -> None: ...

    def step(self, row: Row) -> None: ...

    def expect(self, total: int) -> None: ...

    def close(self) -> None: ...
