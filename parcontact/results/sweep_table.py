"""Tables of a sweep: sweep.csv with a row per case, sweep_curves.csv with a row per point of friction curves.

sweep_mean.csv and sweep_curves_mean.csv contain means over seeds.
"""

import fcntl
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from ..columns import SWEEP, SWEEP_RESULTS, added_names, choose_columns, names_of, to_csv
from ..errors import InputError
from ..files import files, outputs, tables
from ..job import Case
from ..job.history import Timeline
from ..job.listing import answers
from . import slide
from .results import CURVE_COLUMNS, CURVE_RESULTS, FAILURE, PLACES, Results

RESULTS = names_of(SWEEP_RESULTS)
SECTIONS = {column.when: added_names(SWEEP, column.when) for column in SWEEP if column.when}
FRICTION_ERRORS = ("mu_max_error", "mu_dyn_error")
THEORY = tuple(name for name in names_of(SWEEP) if name.startswith("theory_"))
MEANS = "mean", "std", "sem"
SAMPLES = "seed", "centre"  # last words of keys that choose samples of one surface, over which means are taken
FIRST = {outputs.RUN.table: ("step", "time"), outputs.STEADY.table: ("velocity", "pressure")}  # first columns of tables
DAMAGED = "damaged"


def write_sweep_tables(directory: Path, cases: Sequence[Case]) -> None:
    """Write all tables of a sweep from the results of its cases; root only. Several programs may do so at the same
    time."""
    with _alone(directory):
        keys, seeded = list(cases[0].settings), any(key.split(".")[-1] in SAMPLES for key in cases[0].settings)
        rows, points = [_row(case) for case in cases], [row for case in cases for row in _points(case)]
        there = {section for case in cases for section in SECTIONS if _asks_for(case, section)}
        more = [name for section in SECTIONS if section in there for name in SECTIONS[section]]
        names = names_of(choose_columns(SWEEP, when=there))[1:]
        if not any(case.job.history for case in cases):  # curves have a table of points instead
            names = tuple(name for name in names if any(name in row for row in rows))
        save_cases(directory / outputs.SWEEP.table, ["case", *keys, *names], rows)
        if points:
            save_cases(directory / outputs.SWEPT_CURVES, ["case", *keys, *CURVE_COLUMNS], points)
        if seeded and any(case.job.history for case in cases):
            save_cases(directory / "sweep_mean.csv", *_means(rows, keys, [*RESULTS, *more, *THEORY]))
        if seeded and points:
            save_cases(directory / "sweep_curves_mean.csv", *_means(points, [*keys, *PLACES], CURVE_RESULTS))


def _asks_for(case: Case, section: str) -> bool:
    """Return True if a case has a section, `output.energy`, or cycles."""
    if section == "cycles":
        return any(stage.frequency for stage in case.job.history)
    return case.job.output.energy if section == "output.energy" else case.job.section(section) is not None


def sweep_errors(cases: Sequence[Case]) -> Iterator[dict[int, float]]:
    """Yield a mapping for each column of errors. It has the largest error of each finished case by the number of the
    case."""
    rows = [row for case in cases for row in ([_row(case)] if case.job.history else _points(case))]
    for name in slide.ERRORS:
        found: dict[int, float] = {}
        for row in rows:
            if row["state"] == "done" and (error := row.get(name, math.nan)) == error:
                found[row["case"]] = max(error, found.get(row["case"], 0.0))
        yield found


def fail(case: Case, reason: str) -> None:
    """Store the reason why a case failed in the directory of the case; an empty `reason` removes a stored one. Root
    only."""
    path = case.job.output.directory / FAILURE
    with suppress(OSError):
        if reason:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{reason}\n")
        else:
            path.unlink(missing_ok=True)


def _row(case: Case) -> dict[str, Any]:
    head = {"case": case.number, **case.settings}
    try:
        return head | {"state": state(case)} | _results(case)
    except InputError:  # the table lacks a column
        return head | {"state": DAMAGED}


def _results(case: Case) -> dict[str, Any]:
    directory, row = case.job.output.directory, dict[str, Any]()
    for prefix, name in (("", outputs.RUN.table), ("theory_", outputs.THEORY.table)):
        columns = _columns(directory / name) or {"time": []}
        if len(columns["time"]) < 2 and not prefix:  # the initial state only
            continue
        if columns["time"]:
            found = slide.measure_slide(case.job.history, columns)
            ends = {name: columns[name][-1] for name in RESULTS if name in columns}
            known = ends if found is None else {key: value for key, value in found._asdict().items() if value == value}
            row |= {f"{prefix}{key}": value for key, value in known.items()}
        if not prefix:
            run = Results(directory, "run", case.job)
            row |= dict(pair for swept in answers("results", "swept") for pair in swept(run))
            if any(stage.frequency for stage in case.job.history):
                row |= slide.measure_last(case.job, columns)
            asked = [name for key, names in SECTIONS.items() if _asks_for(case, key) for name in names]
            known = {name: [value for value in columns[name] if value == value] for name in asked if name in columns}
            row |= {name: values[-1] if values else math.nan for name, values in known.items()}
            row["seconds"] = math.fsum(columns["seconds"])
            row["residual"] = slide.largest(columns["residual"])
            row |= slide.mean_errors(case.job.history, columns)
            within = slide.absolute_errors(case.job.history, columns, case.job.grid.dx)
            row |= {name: within.get(name.removesuffix("_error"), math.nan) for name in FRICTION_ERRORS}
    return row


def _points(case: Case) -> Iterator[dict[str, Any]]:
    """Yield the rows of the finished points of a friction curve."""
    if columns := _columns(case.job.output.directory / outputs.STEADY.table):
        head = {"case": case.number, **case.settings, "state": state(case)}
        numbers = [name for name in CURVE_COLUMNS if name in columns and name not in PLACES]
        for k, place in enumerate(tables.of_table(columns)):
            values = (float(f"{value:.9g}") for value in place)  # without rounding errors
            places = dict(zip(PLACES, values, strict=True))
            yield head | places | {name: columns[name][k] for name in numbers}


def _columns(path: Path) -> dict[str, list[float]]:
    """Return the columns of a table by name; none for a missing or damaged table, which the case itself reports."""
    with suppress(InputError):
        columns = tables.read_columns(path) if path.is_file() else {}
        return columns if {*columns} >= {*FIRST.get(path.name, ())} else {}
    return {}


def state(case: Case) -> str:
    """Return the state of a case: done | failed | begun | damaged | -."""
    directory = case.job.output.directory
    if case.job.history and tables.find_lost_rows(directory):
        return DAMAGED
    if (directory / FAILURE).is_file():
        return "failed"
    table = directory / (outputs.RUN if case.job.history else outputs.STEADY).table
    if not table.is_file():
        return "-"
    if not (columns := _columns(table)):
        return DAMAGED
    if not case.job.history:
        if section := case.job.steady:
            asked = tables.requested_points(section.velocities, section.pressures or (), section.temperatures or ())
            if tables.lacking_points(asked, tables.of_table(columns)):
                return "begun"
        return "done"
    if case.job.bands is not None:  # its rows are written at the end
        return "done"
    steps = [int(step) for step in columns["step"]]
    timeline = Timeline.from_job(case.job).follow(dict(zip(steps, columns["time"], strict=True)))
    return "done" if steps and (steps[-1] >= len(timeline) or outputs.detached(directory)) else "begun"


def _means(
    rows: Sequence[dict[str, Any]], keys: Sequence[str], names: Sequence[str]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return columns and rows of means over cases that differ by their sample only,

    with the standard deviation of a single case, the standard error of the mean, and the number of cases.
    """
    kept = [key for key in keys if key.split(".")[-1] not in SAMPLES]
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(repr([row[key] for key in kept]), []).append(row)
    table = []
    for group in groups.values():
        out = {key: group[0][key] for key in kept} | {"number": sum(row["state"] == "done" for row in group)}
        for name in names:
            values = [row[name] for row in group if row["state"] == "done" and name in row]
            if values:
                std = stdev(values) if len(values) > 1 else math.nan
                numbers = fmean(values), std, std / math.sqrt(len(values))
                out |= {f"{name}_{what}": number for what, number in zip(MEANS, numbers, strict=True)}
        table.append(out)
    return [*kept, "number", *(f"{name}_{what}" for name in names for what in MEANS)], table


def save_cases(path: Path, columns: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    files.replace_file(path, to_csv(columns, ([row.get(name) for name in columns] for row in rows)))


@contextmanager
def _alone(directory: Path) -> Iterator[None]:
    """Lock the directory, if the file system has locks, so that the last program sees the results of all."""
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / ".sweep.lock").open("w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
