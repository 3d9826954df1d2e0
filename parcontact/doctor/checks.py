"""Checks of an installation that have exact answers, and the table of what came out."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ..errors import RunError
from . import exact
from .bench import Bench


@dataclass(frozen=True)
class Check:
    """A small calculation with an exact answer: `run` makes it on a bench and tells the bench what is expected."""

    name: str
    expected: str
    run: Callable[[Bench], None]


CHECKS = (
    Check("0.99, 1 and 1.01 of full contact", "Westergaard; 60 iterations", exact.nearly_full),
    Check("sphere pulled back", "Ting: lift-off while still deep", exact.retraction),
    Check("full contact of many waves, sliding", "sum over the waves", exact.closed_by_load),
)


def run_check(check: Check, bench: Bench) -> Bench:
    """Run a check on a bench of its own, and return that; collective. A solve that fails is a finding too."""
    try:
        check.run(bench)
    except RunError as error:
        bench.failure = str(error)
    return bench


def markdown(results: Iterable[tuple[Check, Bench]]) -> str:
    """Return the table of results, numbered from 1."""
    head = ("", "case", "expected", "came out, nearest to its limit [SI]", "residual", "iterations", "")
    lines: list[tuple[str, ...]] = [head]
    for number, (check, bench) in enumerate(results, start=1):
        cost = f"{bench.residual:.0e}", str(bench.iterations)
        verdict = "WRONG" if bench.wrong else "ok"
        lines.append((str(number), check.name, check.expected, bench.nearest, *cost, verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    lines.insert(1, tuple("-" * width for width in widths))
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)
