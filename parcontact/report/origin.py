"""The sections about where results come from: errors and costs, program, machine and runs, what to cite."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import h5py

from ..storage import hdf5, provenance
from ..storage.tables import read as read_table
from . import budget, log
from .parts import Section, Table


def costs(table: Path, found: log.Log, accuracy: float) -> Iterator[Section]:
    """Yield the errors of a run or a curve, given by its table, then wall time, operator calls and what was counted."""
    columns = read_table(table)
    yield budget.section(columns, found.estimates, accuracy, table.name == "steady.csv")
    calls = [value for value in columns["operator_calls"] if value == value]
    rows = [
        ("steps or points", str(len(columns["seconds"]))),
        ("wall time of all of them", f"{math.fsum(columns['seconds']):.4g} s"),
        ("operator calls", f"{math.fsum(calls):.6g}"),
    ]
    tables = [Table(("cost", "value"), rows)]
    if found.counts:
        tables.append(Table(("counted on one rank in the last run", "number"), found.counts))
    yield Section("Cost", tables=tables)


def section(directory: Path, found: log.Log) -> Section:
    """Return what the newest file in a directory that knows it says about its origin."""
    there = [directory / name for name in ("fields.h5", "steady.h5") if (directory / name).is_file()]
    there += sorted(directory.glob("checkpoint/step-*.h5"), key=lambda path: path.stat().st_mtime, reverse=True)
    for path in there:
        try:
            with h5py.File(path, "r", locking=False) as file:
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
        chain = Table(("run", "program", "ranks", "started", "from step"), runs, "runs that made the results")
        return Section("Provenance", found.machine, [Table(("of", "value"), rows), chain])
    return Section("Provenance", found.machine or [f"This report was made by {provenance.PROGRAM}."])


def list_citations() -> Section:
    """Return what a paper that uses the results should cite."""
    return Section("What to cite", [f"{provenance.PROGRAM}", *provenance.REFERENCES])
