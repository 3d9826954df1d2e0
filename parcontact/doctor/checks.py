"""Checks of an installation that have exact answers, and the table of what came out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ..errors import RunError
from . import exact
from .bench import Bench, Finding


@dataclass(frozen=True)
class Check:
    """A small calculation with an exact answer: `run` makes it on a bench and tells the bench what is expected."""

    name: str
    expected: str
    run: Callable[[Bench], None]


CHECKS = (
    Check("0.99, 1 and 1.01 of full contact", "Westergaard; 60 iterations", exact.nearly_full),
    Check("vanishing load", "Hertz, then one cell, then nothing", exact.vanishing_load),
    Check("sphere pulled back", "Ting: lift-off while still deep", exact.retraction),
    Check("full contact of many waves, sliding", "sum over the waves", exact.closed_by_load),
    Check("12 branches of 5 ns to 500 s, one step", "discrete moduli", exact.many_decades),
)


@dataclass(frozen=True)
class CheckResult:
    """Result of a check: all findings, the worst residual and the most iterations of its solves."""

    check: Check
    findings: tuple[Finding, ...]
    residual: float
    iterations: int
    failure: str = ""

    @property
    def wrong(self) -> list[str]:
        """Sentences on what is not as it should be; none if all is well."""
        return [*([self.failure] if self.failure else []), *(str(found) for found in self.findings if not found.ok)]

    @property
    def text(self) -> str:
        """The finding that is nearest to its limit, or beyond."""
        return self.failure or str(max(self.findings, key=lambda found: found.share))


def run_check(check: Check, bench: Bench) -> CheckResult:
    """Run a check on a bench of its own; collective. A solve that fails is a finding too."""
    failure = ""
    try:
        check.run(bench)
    except RunError as error:
        failure = str(error)
    return CheckResult(check, tuple(bench.findings.values()), bench.residual, bench.iterations, failure)


def markdown(results: Iterable[CheckResult]) -> str:
    """The table of results, numbered from 1."""
    head = ("", "case", "expected", "came out, nearest to its limit [SI]", "residual", "iterations", "")
    lines: list[tuple[str, ...]] = [head]
    for number, result in enumerate(results, start=1):
        check, verdict = result.check, "WRONG" if result.wrong else "ok"
        cost = f"{result.residual:.0e}", str(result.iterations)
        lines.append((str(number), check.name, check.expected, result.text, *cost, verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)
