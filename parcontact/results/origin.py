"""Sections on errors and costs, program, machine and runs, and references to cite."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..job import Job
from ..job.sections.listing import plain_data
from ..storage import hdf5, provenance
from . import log
from .page_parts import ReportSection, ReportTable
from .results import Results
from .slide import ERRORS

FRICTION = ERRORS[0]


def costs(results: Results, found: log.Log, job: Job) -> Iterator[ReportSection]:
    """Yield the errors of a run or a curve, then wall time, operator calls and counts."""
    columns = results.table
    yield describe_errors(columns, found, job, results.kind == "curve")
    calls = [value for value in columns["operator_calls"] if value == value]
    rows = [
        ("steps or points", str(len(columns["seconds"]))),
        ("total wall time", f"{math.fsum(columns['seconds']):.4g} s"),
        ("operator calls", f"{math.fsum(calls):.6g}"),
    ]
    tables = [ReportTable(("cost", "value"), rows)]
    if found.counts:
        tables.append(ReportTable(("counted on one rank in the last run", "number"), found.counts))
    yield ReportSection("Cost", tables=tables)


def describe_errors(columns: Mapping[str, Sequence[float]], found: log.Log, job: Job, of_curve: bool) -> ReportSection:
    """Return the errors of a friction curve at its worst and best point, or of a run at its end, with the sentences of
    its log; friction only if something slides. The section is empty for a table without errors."""
    rows = []
    for column, name, asked in zip(ERRORS, ("friction", "contact area"), job.numerics.asked.both, strict=True):
        known = [error for error in columns.get(column, ()) if error == error]
        if known and (of_curve or job.directions or column != FRICTION):
            errors = (max(known), min(known)) if of_curve else (known[-1],)
            rows.append((name, *(f"{100 * error:.3g} %" for error in errors), f"{100 * asked:g} %"))
    ends = ("at the worst point", "at the best point") if of_curve else ("at the end",)
    tables = [ReportTable(("estimated error of", *ends, "numerics.accuracy"), rows)] if rows else []
    return ReportSection("Error budget", [f"{text}." for text in found.estimates] if rows else (), tables)


def origin_section(directory: Path, found: log.Log) -> ReportSection:
    """Return the provenance by the newest file of a directory that has it."""
    there = [directory / name for name in ("fields.h5", "steady.h5") if (directory / name).is_file()]
    there += sorted(directory.glob("checkpoint/step-*.h5"), key=lambda path: path.stat().st_mtime, reverse=True)
    for path in there:
        try:
            with Results(directory).open_maps(str(path.relative_to(directory))) as file:
                rows = [
                    ("said by", str(path.relative_to(directory))),
                    ("program", str(file.attrs["program"])),
                    ("ranks", str(file.attrs["ranks"])),
                    ("seeds", ", ".join(map(str, file.attrs["seeds"])) or "none"),
                    *json.loads(file.attrs["libraries"]).items(),
                ]
                runs = [
                    (str(one.runs), one.program, str(one.ranks), one.started, str(one.from_step))
                    for one in provenance.read_chain(file)
                ]
        except (*hdf5.FAILURES, KeyError, ValueError):
            continue
        chain = ReportTable(("runs", "program", "ranks", "started", "from step"), runs, "runs that made the results")
        return ReportSection("Provenance", found.machine, [ReportTable(("of", "value"), rows), chain])
    return ReportSection("Provenance", found.machine or [f"This report was made by {provenance.PROGRAM}."])


def list_citations(job: Job | None) -> ReportSection:
    """Return the references to cite for the results of a job."""
    return ReportSection(
        "References to cite", [provenance.PROGRAM, *(provenance.cite_lines(plain_data(job)) if job else ())]
    )
