"""The sections about where results come from: what they cost, warnings, program, machine and runs, what to cite."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py

from ..job import Job
from ..storage import hdf5, provenance
from . import log
from .parts import Section, Table


def cost(columns: dict[str, Any], found: log.Log) -> Section:
    """Wall time, operator calls and what was counted."""
    rows = [("steps or points", str(len(columns["seconds"])))]
    rows.append(("wall time of all of them", f"{math.fsum(columns['seconds']):.4g} s"))
    calls = [value for value in columns["operator_calls"] if value == value]
    rows.append(("operator calls", f"{math.fsum(calls):.6g}"))
    tables = [Table(("cost", "value"), rows)]
    if found.counts:
        tables.append(Table(("counted on one rank in the last run", "number"), found.counts))
    return Section("Cost", tables=tables)


def warnings(job: Job, complete: bool, found: log.Log) -> Section:
    """Those of the log, else those of the job alone."""
    told = found.warnings or (list(job.warnings) if complete else [])
    return Section("Warnings", told or ["There was no warning."])


def section(directory: Path, found: log.Log) -> Section:
    """Of the newest file in a directory that says where it comes from."""
    for path in _files(directory):
        try:
            with h5py.File(path, "r", locking=False) as file:
                rows = [("said by", str(path.relative_to(directory))), *_rows(file)]
                runs = [_run(link) for link in provenance.read_chain(file)]
        except (*hdf5.FAILURES, KeyError, ValueError):
            continue
        chain = Table(("run", "program", "ranks", "started", "from step"), runs, "runs that made the results")
        return Section("Provenance", found.machine, [Table(("of", "value"), rows), chain])
    return Section("Provenance", found.machine or [f"This report was made by {provenance.PROGRAM}."])


def to_cite() -> Section:
    """What a paper that uses the results should cite."""
    return Section("What to cite", [f"{provenance.PROGRAM}", *provenance.REFERENCES])


def _files(directory: Path) -> Iterator[Path]:
    for name in ("fields.h5", "steady.h5"):
        if (directory / name).is_file():
            yield directory / name
    yield from sorted(directory.glob("checkpoint/step-*.h5"), key=lambda path: path.stat().st_mtime, reverse=True)


def _rows(file: h5py.File) -> Iterator[tuple[str, str]]:
    yield "program", str(file.attrs["program"])
    yield "ranks", str(file.attrs["ranks"])
    yield "seeds", ", ".join(str(seed) for seed in file.attrs["seeds"]) or "none"
    yield from json.loads(file.attrs["libraries"]).items()


def _run(link: provenance.Link) -> Sequence[str]:
    count = "once" if link.runs == 1 else f"{link.runs} times"
    return count, link.program, str(link.ranks), link.started, str(link.from_step)
