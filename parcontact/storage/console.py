"""The console and run.log: one line per step, messages and warnings on root, a progress bar on a terminal."""

import re
import sys
import time
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TextIO

from tqdm import tqdm

from ..doubts import Doubt
from ..streams import printable
from . import files
from .step_row import StepRow

HEAD = "    step        time [s]    load [Pa] corr.area  friction   iter  residual"
STAMP = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[.,]\d+ ")
WARNING, MESH = "warning: ", "mesh: "
EVERY_SECONDS = 0.5  # tuning: least time between updates of a progress bar [s]
LEFT_SECONDS = 30.0  # tuning: time between lines with the time left, without a terminal [s]


def step_line(row: StepRow) -> str:
    """Return the line of a step, under `HEAD`."""
    m = row.measures
    return (
        f"{row.step:8d} {row.time:15.8g} {m.pressure:12.5g} {m.contact_area_corrected:9.5f} {m.friction:9.6f} "
        f"{row.iterations:6d} {row.certificate.worst:9.2e}"
    )


def warnings_of(log: Path) -> list[str]:
    """Return the different warnings in a log, in order; none without a log."""
    return list(dict.fromkeys(line.removeprefix(WARNING) for line in log_lines(log) if line.startswith(WARNING)))


def meshes_of(log: Path) -> list[str]:
    """Return the last message of a log on chosen meshes (`mesh.chosen_mesh`), if any."""
    return [line for line in log_lines(log) if line.startswith(MESH)][-1:]


def log_lines(log: Path) -> list[str]:
    """Return the lines of a log without time stamps; none without a log."""
    return [STAMP.sub("", line) for line in log.read_text(errors="replace").splitlines()] if log.is_file() else []


def always(doubt: Doubt) -> bool:
    """Return True: all warnings are shown."""
    return True


class Console:
    """Messages of root to the user and to the log; the consoles of other ranks are silent. Raises OSError if the log
    cannot be written."""

    def __init__(self, log: Path | None = None, quiet: bool = True, total: int = 0, speaks: bool = True) -> None:
        self._log = files.open_to_append(log) if log is not None else None
        self._quiet, self._total, self._speaks = quiet, total, speaks
        self._rows, self._first, self._began, self._last_time_left = 0, 0, 0.0, 0.0
        self._bar: tqdm[None] | None = None

    def say(self, text: str) -> None:
        """Show a message to the user, and log it."""
        self.log(text)
        if not self._quiet:
            self._write(text)

    def log(self, text: str) -> None:
        """Write a message with its time to the log only; errors of writing are ignored."""
        if self._log is not None:
            with suppress(OSError):
                self._log.write(f"{datetime.now().isoformat(' ', 'milliseconds')} {printable(text)}\n".encode())

    def warn(self, text: str, shown: bool = True) -> None:
        """Log a warning; if `shown`, print it also in quiet runs."""
        self.log(f"{WARNING}{text}")
        if shown:
            self._write(f"{WARNING}{printable(text)}", sys.stderr)

    def step(self, row: StepRow) -> None:
        """Print the line of a step, and update the progress."""
        text = step_line(row)
        self.log(text)
        if self._quiet:
            return
        self._rows += 1
        if self._rows <= 2:  # the first step includes allocations
            self._first, self._began = row.step, time.monotonic()
            self._last_time_left = self._began
        if self._rows == 1:
            print(HEAD)
            if sys.stderr.isatty() and self._total > 1:
                self._bar = tqdm(
                    total=self._total, initial=row.step, unit="step", leave=False, mininterval=EVERY_SECONDS
                )
        self._write(text)
        if self._bar is not None:
            self._bar.update(row.step - self._bar.n)
        else:
            self._say_time_left(row.step)

    def _say_time_left(self, step: int) -> None:
        """Print the time left at intervals, extrapolated from the steps after the first."""
        now = time.monotonic()
        if now - self._last_time_left >= LEFT_SECONDS and self._first < step < self._total:
            self._last_time_left = now
            left = (now - self._began) / (step - self._first) * (self._total - step)
            clock = f"{int(left // 3600)}:{int(left // 60) % 60:02d}:{int(left) % 60:02d}"
            self._write(f"# step {step} of {self._total}, about {clock} left")

    def expect(self, total: int) -> None:
        """Set the total number of steps, as far as known."""
        self._total = total
        if self._bar is not None:
            self._bar.total = total

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._log is not None:
            with suppress(OSError):
                self._log.close()

    def _write(self, text: str, file: TextIO | None = None) -> None:
        if self._bar is not None:
            self._bar.write(text, file=file)
        elif self._speaks:
            print(text, file=file, flush=True)
