"""Contents of run.log and steady.log: warnings, estimated errors, counts, and the machine."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..job.reading import CASES
from ..printed import name_cases
from ..storage.console import WARNING, log_lines
from ..storage.curve_points import LOG

LOGS = ("run.log", LOG)
COUNTS = "counts on root: "
ESTIMATE = "estimated error of "
MACHINE = re.compile(r"parcontact |machine: |batch job: |\d+ ranks?, ")  # beginnings of lines about the machine


BEYOND = "; more than the "  # in an estimate that exceeds numerics.accuracy


@dataclass(frozen=True)
class Log:
    """Contents of a log: different warnings in order; sentences on errors and counts of the last run; lines on program
    and machine."""

    warnings: list[str]
    estimates: list[str]
    counts: list[Sequence[str]]
    machine: list[str]


def read_logs(directory: Path) -> Log:
    """Return the contents of the logs of a directory; empty without a log."""
    lines = [line for name in LOGS for line in log_lines(directory / name)]
    warnings = [line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)]
    counted = [line.removeprefix(COUNTS) for line in lines if line.startswith(COUNTS)]  # allreduce 12, fft 64x64 3
    counts: list[Sequence[str]] = [part.rsplit(" ", 1) for part in counted[-1].split(", ")] if counted else []
    machine = [line for line in lines if MACHINE.match(line)]
    estimates = {line.partition(":")[0]: line for line in lines if line.startswith(ESTIMATE)}
    return Log(list(dict.fromkeys(warnings)), list(estimates.values()), counts, machine)


def warnings_of_cases(directory: Path) -> list[str]:
    """Return the warnings in the logs of the cases of a sweep, and the errors beyond numerics.accuracy, each once with
    its cases."""
    found: dict[str, list[int]] = {}
    for path in sorted(directory.glob(f"{CASES}/*")):
        if path.name.isdecimal():
            logs = read_logs(path)
            beyond = [line.partition(":")[0] for line in logs.estimates if BEYOND in line]
            for text in [*logs.warnings, *(f"the {name} exceeds numerics.accuracy" for name in beyond)]:
                found.setdefault(text, []).append(int(path.name))
    return [f"{text} ({name_cases(cases)})" for text, cases in found.items()]
