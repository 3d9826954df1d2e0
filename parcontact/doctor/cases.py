"""The hard cases: what makes each hard, what must come out, and the table of what did."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import RunError
from . import contacts, sliding, times, unloading
from .bench import ALWAYS, Bench, Finding

if TYPE_CHECKING:
    from mpi4py import MPI


@dataclass(frozen=True)
class Case:
    """A hard case: `examine` runs it on a bench and tells the bench what is expected."""

    name: str
    expected: str
    examine: Callable[[Bench], None]


CASES = (
    Case("steps of 1e6 to 1e323 relaxation times", "elastic, long-term modulus", times.long_steps),
    Case("steps of 1e-6 to 1e-15 relaxation times", "elastic, modulus at once", times.short_steps),
    Case("moduli 1e3 : 1 and 1e6 : 1", "creep J(t); long-term after creep time only", times.moduli_far_apart),
    Case("0.99, 1 and 1.01 of full contact", "Westergaard, Johnson; 60 iterations", contacts.nearly_full),
    Case("flat surface, with and without load", "uniform pressure, no gap, no force", contacts.flat_surface),
    Case("vanishing load", "Hertz, then one cell, then nothing", contacts.vanishing_load),
    Case("single point, sliding", "area one cell, force p h^2 dH/dx", contacts.single_point),
    Case("waves of two cells", "discrete modulus, no slope", sliding.shortest_wave),
    Case("box of 1e4 : 1", "as in one dimension", sliding.long_box),
    Case("load taken away and put back", "recovery with the creep time, memory", unloading.load_again),
    Case("sphere pulled back", "Ting: lift-off while still deep", unloading.retraction),
    Case("reversal of sliding", "force continuous, then overshoots", sliding.reversal),
    Case("stop of sliding", "force relaxes, area grows", sliding.stop),
    Case("velocities of 1e-9 and 1e9", "no friction, elastic areas", sliding.extreme_velocities),
    Case("full contact of many waves, sliding", "sum over the waves", contacts.closed_by_load),
    Case("branches with G1 = 0, eta1 = 0, eta1 = inf", "G(t) of what they are", times.odd_branches),
    Case("12 branches of 5 ns to 500 s, one step", "discrete moduli", times.many_decades),
)


@dataclass(frozen=True)
class Outcome:
    """What came out of a case: all findings, the worst residual and the most iterations of its solves."""

    case: Case
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
        if self.failure:
            return self.failure
        own = [found for found in self.findings if found.what not in ALWAYS or not found.ok]
        return str(max(own, key=lambda found: found.share))


def examine(case: Case, comm: "MPI.Intracomm", precision: str = "double") -> Outcome:
    """Run a case; collective. A solve that fails is a finding too."""
    bench, failure = Bench(comm, precision), ""
    try:
        case.examine(bench)
    except RunError as error:
        failure = str(error)
    return Outcome(case, tuple(bench.findings.values()), bench.residual, bench.iterations, failure)


def table(outcomes: Iterable[Outcome]) -> str:
    """In Markdown; numbered from 1."""
    head = ("", "case", "expected", "came out, nearest to its limit [SI]", "residual", "iterations", "")
    lines = [head, tuple("-" * len(word) for word in head)]
    for number, outcome in enumerate(outcomes, start=1):
        case, verdict = outcome.case, "WRONG" if outcome.wrong else "ok"
        cost = f"{outcome.residual:.0e}", str(outcome.iterations)
        lines.append((str(number), case.name, case.expected, outcome.text, *cost, verdict))
    widths = [max(len(line[column]) for line in lines) for column in range(len(head))]
    lines[1] = tuple("-" * width for width in widths)
    return "\n".join("| " + " | ".join(map(str.ljust, line, widths)) + " |" for line in lines)
