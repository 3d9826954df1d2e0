"""Tables of a sweep: sweep.csv has a row for each case, sweep_curves.csv one for each point of friction curves.

sweep_mean.csv and sweep_curves_mean.csv have means over seeds.
"""

import csv
import fcntl
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from ..columns import SWEEP, SWEEP_RESULTS, added_names, choose_columns, names_of, to_csv
from ..errors import InputError
from ..history.timeline import Timeline
from ..job import Case, Steady
from ..job.reading import CASES
from ..storage import curve_points, files, marker, read_back, tables
from . import pull_off, slide

TABLE = "sweep.csv"
CURVES = "sweep_curves.csv"
PLACES = ("velocity", "pressure", "temperature")  # of a point of a curve
CURVE_RESULTS = ("friction", "contact_area", "contact_area_corrected")
CURVE_COLUMNS = ("state", *PLACES, *CURVE_RESULTS, *slide.ERRORS, "residual")
RESULTS = names_of(SWEEP_RESULTS)
SECTIONS = {section: added_names(SWEEP, section) for section in ("adhesion", "output.energy", "leakage")}
FRICTION_ERRORS = ("mu_max_error", "mu_dyn_error")
THEORY = tuple(name for name in names_of(SWEEP) if name.startswith("theory_"))
NUMBERS = {*names_of(SWEEP), *CURVE_COLUMNS} - {"state"}
MEND = "run the sweep again, which writes the table anew"
MEANS = "mean", "std", "sem"
SAMPLES = "seed", "centre"  # last words of keys over whose values means are taken: samples of one surface
FIRST = {"measures.csv": ("step", "time"), "steady.csv": ("velocity", "pressure")}  # columns that tables have
DAMAGED = "damaged"
FAILURE = ".failure"  # why a case has failed


def write_sweep_tables(directory: Path, cases: Sequence[Case]) -> None:
    """Write all tables in the directory of a sweep, from what its cases have left in theirs; root only.

    Several programs, each with a case, may do so at a time.
    """
    with _alone(directory):
        keys, seeded = list(cases[0].settings), any(key.split(".")[-1] in SAMPLES for key in cases[0].settings)
        rows, points = [_row(case) for case in cases], [row for case in cases for row in _points(case)]
        there = {section for case in cases for section in SECTIONS if _asks_for(case, section)}
        more = [name for section in SECTIONS if section in there for name in SECTIONS[section]]
        names = names_of(choose_columns(SWEEP, when=there))[1:]
        if not any(case.job.history for case in cases):  # results of curves are in the table of their points
            names = tuple(name for name in names if any(name in row for row in rows))
        save_cases(directory / TABLE, ["case", *keys, *names], rows)
        if points:
            save_cases(directory / CURVES, ["case", *keys, *CURVE_COLUMNS], points)
        if seeded and any(case.job.history for case in cases):
            save_cases(directory / "sweep_mean.csv", *_means(rows, keys, [*RESULTS, *more, *THEORY]))
        if seeded and points:
            save_cases(directory / "sweep_curves_mean.csv", *_means(points, [*keys, *PLACES], CURVE_RESULTS))


def _asks_for(case: Case, section: str) -> bool:
    """Return whether a case has a section, or energies."""
    return case.job.output.energy if section == "output.energy" else case.job.section(section) is not None


def results(directory: Path) -> Path:
    """Return the table with the results of a sweep: of its cases, or of the points of its friction curves where the
    cases have none."""
    curves, table = directory / CURVES, directory / TABLE
    if not curves.is_file() or (
        table.is_file() and any(math.isfinite(row.get("residual", math.nan)) for row in read_cases(table))
    ):
        return table
    return curves


def read_cases(path: Path) -> list[dict[str, Any]]:
    """Read the rows of a table, numbers as such, an empty field as nan; raises InputError for what is no such table."""
    try:
        text = path.read_text(encoding="utf-8")
        names, *lines = list(csv.reader(StringIO(text, newline=""))) or [[]]
        if names[:1] != ["case"] or "state" not in names or not text.endswith("\n"):
            raise ValueError("it must name its columns, from case to state on, and end with a whole line")
        rows = [dict(zip(names, line, strict=True)) for line in lines]
        begun = [int(one.name) for one in path.parent.glob(f"{CASES}/*") if one.name.isdecimal()]
        if path.name == TABLE and max(begun, default=-1) > max((int(row["case"]) for row in rows), default=-1):
            raise ValueError(f"it lacks rows: case {max(begun)} has been begun")
        return [
            {name: float(cell or "nan") if name in NUMBERS else _number(cell) for name, cell in row.items()}
            for row in rows
        ]
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path} cannot be read: {error}; {MEND}") from error


def sweep_errors(cases: Sequence[Case]) -> Iterator[dict[int, float]]:
    """Yield of each column of errors the largest one of each case that is done, by its number, as far as known."""
    rows = [row for case in cases for row in ([_row(case)] if case.job.history else _points(case))]
    for name in slide.ERRORS:
        found: dict[int, float] = {}
        for row in rows:
            if row["state"] == "done" and (error := row.get(name, math.nan)) == error:
                found[row["case"]] = max(error, found.get(row["case"], 0.0))
        yield found


def fail(case: Case, reason: str) -> None:
    """Leave in the directory of a case why it has failed, or that it has not; root only."""
    path = case.job.output.directory / FAILURE
    with suppress(OSError):
        if reason:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{reason}\n")
        else:
            path.unlink(missing_ok=True)


def why_failed(directory: Path, number: int) -> str:
    """Return the first sentence of why a case of a sweep has failed, '' if that is not known."""
    with suppress(OSError):
        return (directory / CASES / f"{number:03d}" / FAILURE).read_text(encoding="utf-8").strip().split("; ")[0]
    return ""


def _row(case: Case) -> dict[str, Any]:
    head = {"case": case.number, **case.settings}
    try:
        return head | {"state": state(case)} | _results(case)
    except InputError:  # a table without a column that is read here
        return head | {"state": DAMAGED}


def _results(case: Case) -> dict[str, Any]:
    directory, row = case.job.output.directory, dict[str, Any]()
    for prefix, name in (("", "measures.csv"), ("theory_", "theory.csv")):
        columns = _columns(directory / name) or {"time": []}
        if len(columns["time"]) < 2 and not prefix:  # nothing but the start
            continue
        if columns["time"]:
            found = slide.measure_slide(case.job.history, columns)
            ends = {name: columns[name][-1] for name in RESULTS if name in columns}
            known = ends if found is None else {key: value for key, value in found._asdict().items() if value == value}
            row |= {f"{prefix}{key}": value for key, value in known.items()}
        if not prefix:
            row |= _pull_off(case, columns) if case.job.section("adhesion") else {}
            asked = [name for key in ("output.energy", "leakage") if _asks_for(case, key) for name in SECTIONS[key]]
            row |= {name: _last(columns[name]) for name in asked if name in columns}
            row["seconds"] = math.fsum(columns["seconds"])
            row["residual"] = slide.largest(columns["residual"])
            row |= slide.mean_errors(case.job.history, columns)
            within = slide.absolute_errors(case.job.history, columns, case.job.grid.dx)
            row |= {name: within.get(name.removesuffix("_error"), math.nan) for name in FRICTION_ERRORS}
    return row


def _last(values: Sequence[float]) -> float:
    """Return the last value that is known; NaN without one."""
    return next((value for value in reversed(values) if value == value), math.nan)


def _pull_off(case: Case, columns: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the last pull-off of a case and its error [N], and its approach [m]; nothing where contact holds."""
    lost = [each for each in pull_off.find(columns, bool(marker.detached(case.job.output.directory))) if each.lost]
    if not lost:
        return {}
    area, pull, approach = case.job.grid.lx * case.job.grid.ly, lost[-1], columns["approach"][lost[-1].row]
    error = pull.error(case.job.numerics.tolerance)
    return dict(zip(SECTIONS["adhesion"], (-pull.pressure * area, error * area, approach), strict=True))


def _points(case: Case) -> Iterator[dict[str, Any]]:
    """Yield the rows of a friction curve as far as it has come."""
    if columns := _columns(case.job.output.directory / "steady.csv"):
        head = {"case": case.number, **case.settings, "state": state(case)}
        numbers = [name for name in CURVE_COLUMNS if name in columns and name not in PLACES]
        for k, place in enumerate(curve_points.of_table(columns)):
            places = {name: float(f"{value:.9g}") for name, value in zip(PLACES, place, strict=True)}  # not of rounding
            yield head | places | {name: columns[name][k] for name in numbers}


def _columns(path: Path) -> dict[str, list[float]]:
    """Return the columns of a table by name; none where there is no table, or a damaged one: it concerns its case
    alone, which fails for it."""
    with suppress(InputError):
        columns = tables.read_columns(path) if path.is_file() else {}
        return columns if {*columns} >= {*FIRST.get(path.name, ())} else {}
    return {}


def state(case: Case) -> str:
    """Return how far a case has come: done | failed | begun | -, or that its table is damaged."""
    directory = case.job.output.directory
    if case.job.history and read_back.find_lost_rows(directory):
        return DAMAGED
    if (directory / FAILURE).is_file():
        return "failed"
    table = directory / ("measures.csv" if case.job.history else "steady.csv")
    if not table.is_file():
        return "-"
    if not (columns := _columns(table)):
        return DAMAGED
    if not case.job.history:
        return "begun" if _points_lack(case.job.steady, columns) else "done"
    steps = [int(step) for step in columns["step"]]
    timeline = Timeline.from_job(case.job).follow(dict(zip(steps, columns["time"], strict=True)))
    return "done" if steps and (steps[-1] >= len(timeline) or marker.detached(directory)) else "begun"


def _points_lack(section: Steady | None, columns: Mapping[str, Sequence[float]]) -> bool:
    """Return whether a friction curve lacks points that its job asks for."""
    asked = (
        curve_points.asked(section.velocities, section.pressures or (), section.temperatures or ()) if section else ()
    )
    return bool(curve_points.lacking(asked, curve_points.of_table(columns)))


def _means(
    rows: Sequence[dict[str, Any]], keys: Sequence[str], names: Sequence[str]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return the columns and rows of the means of some results over the cases that differ by their sample only.

    With them are the standard deviation of a single case, the standard error of the mean, and the number of cases.
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


def _number(text: str) -> Any:
    with suppress(ValueError):
        return float(text or "nan")
    return text


@contextmanager
def _alone(directory: Path) -> Iterator[None]:
    """Let one program write at a time, where the file system has locks: the last one sees what all others left."""
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / ".sweep.lock").open("w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
