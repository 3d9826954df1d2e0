"""Contents of run.log and steady.log: warnings, estimated errors, counts, and the machine."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..storage.console import WARNING, log_lines
from ..storage.curve_points import LOG

LOGS = ("run.log", LOG)
COUNTS = "counts on root: "
MACHINE = re.compile(r"parcontact |machine: |batch job: |\d+ ranks?, ")  # how lines about it begin
ESTIMATE = re.compile(r"estimated error of ([^:]*): (?:up to )?(\S+) %(?: or more)? \(([^)]*)\)")
PART = re.compile(r"([a-z ]+) (\S+) %")


@dataclass(frozen=True)
class LoggedEstimate:
    """An estimated error of a run or of the worst point of a curve: the sentence of the log, total and parts [%]."""

    name: str
    of_curve: bool
    sentence: str
    total: float
    parts: dict[str, float]

    @property
    def largest(self) -> str:
        """The part that makes most of it."""
        return max(self.parts, key=self.parts.__getitem__)


@dataclass(frozen=True)
class Log:
    """Warnings, each once and in their order; the estimated errors of the last run or curve; what was counted in the
    last run; lines about the program and machine."""

    warnings: list[str]
    estimates: list[LoggedEstimate]
    counts: list[Sequence[str]]
    machine: list[str]


def read_logs(directory: Path) -> Log:
    """Return what the logs of a directory say; nothing where there is none."""
    lines = [line for name in LOGS for line in log_lines(directory / name)]
    warnings = [line.removeprefix(WARNING) for line in lines if line.startswith(WARNING)]
    counted = [line.removeprefix(COUNTS) for line in lines if line.startswith(COUNTS)]  # allreduce 12, fft 64x64 3
    counts: list[Sequence[str]] = [part.rsplit(" ", 1) for part in counted[-1].split(", ")] if counted else []
    machine = [line for line in lines if MACHINE.match(line)]
    return Log(list(dict.fromkeys(warnings)), _find_estimates(lines), counts, machine)


def _find_estimates(lines: list[str]) -> list[LoggedEstimate]:
    """Return the last ones of a run, which says them again when it goes on; of a curve the largest."""
    found: dict[tuple[str, bool], LoggedEstimate] = {}
    for line in lines:
        if match := ESTIMATE.match(line.removeprefix(WARNING)):
            name, of_curve = "friction" if "friction" in match[1] else "contact area", "points" in match[1]
            parts = {part.strip(): float(share) for part, share in PART.findall(match[3])}
            before = found.get((name, of_curve))
            if before is None or not of_curve or float(match[2]) > before.total:
                found[name, of_curve] = LoggedEstimate(name, of_curve, match.string, float(match[2]), parts)
    return list(found.values())
