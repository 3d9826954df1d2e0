"""What a run says: one line per step on root, a progress bar on a terminal, the same lines in run.log."""

import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from tqdm import tqdm

from .row import Row

HEAD = "    step        time [s]    load [Pa]      area  friction   iter  residual"
EVERY_SECONDS = 0.5  # a bar is redrawn, and lines are shortened to a bar, at most this often


def line(row: Row) -> str:
    m = row.measures
    return (
        f"{row.step:8d} {row.time:15.8g} {m.pressure:12.5g} {m.contact_area:9.5f} {m.friction:9.6f} "
        f"{row.iterations:6d} {row.certificate.worst:9.2e}"
    )


class Console:
    """Root's voice; the other ranks have `Silence` instead, so that no caller asks who it is."""

    def __init__(self, log: Path | None, quiet: bool, total: int) -> None:
        self._file = log.open("a") if log is not None else None
        self._quiet, self._total = quiet, total
        self._bar: tqdm[None] | None = None
        self._headed = False

    def say(self, text: str) -> None:
        """A message for the user and the log."""
        self.log(text)
        if not self._quiet:
            self._write(text)

    def log(self, text: str) -> None:
        """For run.log only, which no run ends for."""
        if self._file is not None:
            now = time.time()
            stamp = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
            with suppress(OSError):
                self._file.write(f"{stamp},{int(now % 1.0 * 1000):03d} {text}\n")
                self._file.flush()

    def warn(self, text: str) -> None:
        """A message that is shown even to those who asked for quiet."""
        self.log(f"warning: {text}")
        self._write(f"warning: {text}", sys.stderr)

    def step(self, row: Row) -> None:
        """One line per step."""
        text = line(row)
        self.log(text)
        if self._quiet:
            return
        if not self._headed:
            self._headed = True
            print(HEAD)
            if sys.stderr.isatty() and self._total > 1:
                self._bar = tqdm(
                    total=self._total, initial=row.step, unit="step", leave=False, mininterval=EVERY_SECONDS
                )
        self._write(text)
        if self._bar is not None:
            self._bar.update(row.step - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._file is not None:
            with suppress(OSError):
                self._file.close()

    def _write(self, text: str, file: TextIO | None = None) -> None:
        if self._bar is not None:
            self._bar.write(text, file=file)
        else:
            print(text, file=file, flush=True)


class Silence:
    """The console of every other rank."""

    def say(self, text: str) -> None: ...

    def log(self, text: str) -> None: ...

    def warn(self, text: str) -> None: ...

    def step(self, row: Row) -> None: ...

    def close(self) -> None: ...
