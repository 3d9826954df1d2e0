"""The sections about where results come from: errors and costs, program, machine and runs, what to cite."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from ..accuracy.budget import exceeds
from ..job import Job
from ..job.sections.listing import plain_data
from ..storage import hdf5, provenance
from ..storage.read_back import read_results
from ..summary.slide import ERRORS
from . import log
from .page_parts import ReportSection, ReportTable

FRICTION = ERRORS[0]
NAMES = dict(zip(ERRORS, ("friction", "contact area"), strict=True))


def costs(table: Path, found: log.Log, job: Job) -> Iterator[ReportSection]:
    """Yield the errors of a run or a curve of a job, given by its table, then wall time, operator calls and counts."""
    columns = read_results(table)
    yield describe_errors(columns, found.estimates, job, table.name == "steady.csv")
    calls = [value for value in columns["operator_calls"] if value == value]
    rows = [
        ("steps or points", str(len(columns["seconds"]))),
        ("wall time of all of them", f"{math.fsum(columns['seconds']):.4g} s"),
        ("operator calls", f"{math.fsum(calls):.6g}"),
    ]
    tables = [ReportTable(("cost", "value"), rows)]
    if found.counts:
        tables.append(ReportTable(("counted on one rank in the last run", "number"), found.counts))
    yield ReportSection("Cost", tables=tables)


def describe_errors(
    columns: Mapping[str, Sequence[float]], estimates: Sequence[log.LoggedEstimate], job: Job, of_curve: bool
) -> ReportSection:
    """Return nothing for a table without errors, else those of the points of a friction curve, or of the means over a
    run and of its steps. The log has the parts: of a curve those of the worst point, if that misses the accuracy."""
    known = {what: [float(one) for one in columns.get(name, ()) if one == one] for name, what in NAMES.items()}
    if not of_curve:
        known[NAMES[FRICTION]] = _in_motion(columns) if job.directions else []
    known = {what: values for what, values in known.items() if values}
    if not known:
        return ReportSection("Error budget")
    found = {one.name: one for one in estimates if one.of_curve == of_curve}
    said, accuracies = [], dict(zip(NAMES.values(), job.numerics.asked.both, strict=True))
    for name, values in known.items() if of_curve else ((name, [one.total / 100]) for name, one in found.items()):
        if not of_curve:
            said.append(f"{found[name].sentence}.")
        said.append(_judge(name, values, found.get(name), accuracies[name], of_curve))
    where, second = ("at the worst point", "smallest") if of_curve else ("means over the run", "in the end")
    rows = [
        (what, _percent(max(values)), _percent(min(values) if of_curve else values[-1]))
        for what, values in known.items()
    ]
    tables = [ReportTable(("estimated error of", "largest", second), rows)]
    if found:
        names = list(dict.fromkeys(part for one in found.values() for part in one.parts))
        parts = [
            (name, _percent(one.total / 100), *(f"{one.parts.get(part, 0.0):.3g} %" for part in names))
            for name, one in found.items()
        ]
        head = ("estimated error of", "in all", *names)
        tables.insert(0, ReportTable(head, parts, f"parts, {where}"))
    return ReportSection("Error budget", said, tables)


def _in_motion(columns: Mapping[str, Sequence[float]]) -> list[float]:
    """Return the known errors of friction of the rows before which the surface has moved: friction at rest is 0, which
    no error can be compared with. Without a motion all are."""
    places, errors = columns.get("distance", ()), columns.get(FRICTION, ())
    moved = [place != before for before, place in pairwise([*places[:1], *places])]
    kept = zip(errors, moved, strict=True) if any(moved) else ((one, True) for one in errors)
    return [float(error) for error, motion in kept if motion and error == error]


def _judge(
    name: str, errors: Sequence[float], worst: log.LoggedEstimate | None, accuracy: float, of_curve: bool
) -> str:
    """Say whether relative errors are as small as asked for, and what makes most of the worst."""
    asked = f"The accuracy of {100 * accuracy:g} % that was asked for {name} (numerics.accuracy)"
    missed = sum(exceeds(error, accuracy) for error in errors)
    if not missed:
        return f"{asked} is met{' at all points' * of_curve}."
    most = f"most of the error is made by the {worst.largest}" if worst else ""
    where = f" at {missed} of {len(errors)} points" if of_curve else ""
    return f"{asked} is missed{where}{'; ' * bool(most)}{'at the worst of them ' * bool(of_curve and most)}{most}."


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def origin_section(directory: Path, found: log.Log) -> ReportSection:
    """Return what the newest file in a directory that knows it says about its origin."""
    there = [directory / name for name in ("fields.h5", "steady.h5") if (directory / name).is_file()]
    there += sorted(directory.glob("checkpoint/step-*.h5"), key=lambda path: path.stat().st_mtime, reverse=True)
    for path in there:
        try:
            with hdf5.open_results(path) as file:
                rows = [
                    ("said by", str(path.relative_to(directory))),
                    ("program", str(file.attrs["program"])),
                    ("ranks", str(file.attrs["ranks"])),
                    ("seeds", ", ".join(map(str, file.attrs["seeds"])) or "none"),
                    *json.loads(file.attrs["libraries"]).items(),
                ]
                runs = [
                    (
                        "once" if one.runs == 1 else f"{one.runs} times",
                        one.program,
                        str(one.ranks),
                        one.started,
                        str(one.from_step),
                    )
                    for one in provenance.read_chain(file)
                ]
        except (*hdf5.FAILURES, KeyError, ValueError):
            continue
        chain = ReportTable(("run", "program", "ranks", "started", "from step"), runs, "runs that made the results")
        return ReportSection("Provenance", found.machine, [ReportTable(("of", "value"), rows), chain])
    return ReportSection("Provenance", found.machine or [f"This report was made by {provenance.PROGRAM}."])


def list_citations(job: Job | None) -> ReportSection:
    """Return what a paper that uses the results of a job should cite."""
    return ReportSection("What to cite", [provenance.PROGRAM, *(provenance.cite_lines(plain_data(job)) if job else ())])
