"""What run.log says of a run: its warnings, its counts, and the machine."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..record import files

STAMP = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d+ ")
COUNTS = "counts on root: "
STARTED = ("parcontact ", "in ", "machine: ", "batch job: ")


@dataclass(frozen=True)
class Log:
    """Warnings, each once and in their order; what was counted in the last run; lines about the program and machine."""

    warnings: list[str]
    counts: list[tuple[str, str]]
    machine: list[str]


def read(directory: Path) -> Log:
    """Of a directory; empty where there is no log."""
    path = directory / "run.log"
    lines = [STAMP.sub("", line) for line in files.text(path).splitlines()] if path.is_file() else []
    warnings = [line.removeprefix("warning: ") for line in lines if line.startswith("warning: ")]
    counted = [line.removeprefix(COUNTS) for line in lines if line.startswith(COUNTS)]
    machine = [line for line in lines if line.startswith(STARTED) or re.match(r"\d+ ranks?, ", line)]
    return Log(list(dict.fromkeys(warnings)), list(_counts(counted[-1])) if counted else [], machine)


def _counts(text: str) -> Iterator[tuple[str, str]]:
    """Names and numbers of `allreduce 12, fft 64x64 float64 3`."""
    for part in text.split(", "):
        name, _, number = part.rpartition(" ")
        yield name, number
