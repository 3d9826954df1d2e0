"""Tables for finite element programs: friction by slip rate, pressure and temperature, as csv or for Abaqus.

A point of a friction curve is left out if the waves of the surface excite the rubber there beyond its measured
frequencies or temperatures. Sentences name these points. Effects may add tables of runs, such as the leakage over the
load.
"""

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..bands.choice import on_one_grid_of_all
from ..columns import to_csv
from ..errors import Doubt, InputError
from ..files import files, tables
from ..files.hdf5 import PROGRAM
from ..files.tables import Wanted
from ..job import load
from ..job.listing import answers
from ..march.sanity import doubt_band
from ..printed import quantity
from .results import ExportedTable, Results

HEAD = ("friction [-]", "slip rate [m/s]", "pressure [Pa]", "temperature [deg C]", "relative error [-]")
SUFFIX = {"csv": ".csv", "abaqus": ".inp"}
WIDTH = 76  # letters in a line of a comment
OUTSIDE = ("frequencies", "temperatures")  # kinds of warnings for which a point is left out
OUT_OF_RANGE = "outside of its measured range"
BY_SHIFT = (
    ": at these frequencies, or at temperatures whose shift reaches them",
    ", or at several temperatures and give material.shift",
)  # how to measure them with a shift, and without one


def export_results(directory: Path, form: str, out: Path | None = None) -> Iterator[str]:
    """Write the tables of a directory in the form `csv` or `abaqus`, each to a file in this directory, or a single
    table to `out`; yield sentences. Raises InputError if there is no table of this form, or a file cannot be
    written."""
    if not directory.is_dir():
        raise InputError(f"{directory} is not a directory")
    results = Results(directory)
    found = [_friction(directory)] if "steady" in results.kinds else []
    for offered in answers("results", "exported"):
        found += offered(results) if form == "csv" and "run" in results.kinds else ()
    if not found:
        what = "a friction curve (steady.csv)" + " or leakage (leak.csv, by parcontact leak)" * (form == "csv")
        raise InputError(f"{directory} has no table for {form}: it needs {what}")
    if out is not None and (len(found) > 1 or out.suffix != SUFFIX[form]):
        raise InputError(f"--out must end in {SUFFIX[form]}, and is for one table; got {out} for {len(found)}")
    for table in found:
        path = out or directory / f"{table.name}{SUFFIX[form]}"
        text = to_csv(table.head, table.rows) if form == "csv" else _to_abaqus(table)
        files.write_own(path, text)
        yield f"{table.name}: {len(table.rows)} rows in {path}"
        yield from table.sentences


def _friction(directory: Path) -> ExportedTable:
    """Return the friction of a curve by temperature, pressure and slip rate, which varies fastest."""
    curve = Results(directory, "steady")
    columns, given = curve.table, curve.temperature
    points = tables.of_table(columns)
    outside = _outside(curve.path, points)
    rows = []
    for k, point in enumerate(points):
        if point not in outside:
            degrees = given if math.isnan(point.temperature) else point.temperature
            error = columns.get("error_friction", [math.nan] * len(points))[k]
            speed, pressure = (float(f"{value:.9g}") for value in point[:2])  # without rounding errors
            rows.append((columns["friction"][k], speed, pressure, degrees, error))
    left_out = list(_name_outside(outside, len(points), given))
    if not rows:
        none = f"{directory}: no point of the curve lies within the measured range of the rubber"
        raise InputError("; ".join([none, *left_out[1:]]))
    rows.sort(key=lambda row: (row[3] if row[3] == row[3] else 0.0, *row[2:0:-1]))
    missing = [f"not solved: {text}" for text in curve.unfinished]
    return ExportedTable("friction", HEAD, rows, [*left_out, *missing])


def _outside(directory: Path, points: Sequence[Wanted]) -> dict[Wanted, Doubt]:
    """Return the points at which the rubber is excited outside of its measured range, each with the first reason."""
    path, found = Results(directory, "steady").job_file, dict[Wanted, Doubt]()
    try:
        job = load(path) if path else None
        job = on_one_grid_of_all(job) if job else None
    except InputError:  # its files no longer exist
        return found
    if job is None or job.steady is None:
        return found
    for point in points:
        degrees = () if math.isnan(point.temperature) else (point.temperature,)
        state = {"velocities": (point.speed,), "pressures": (point.pressure,), "temperatures": degrees or None}
        changed = job.model_copy(update={"steady": job.steady.model_copy(update=state), "history": ()})
        if doubt := next((one for one in doubt_band(changed, degrees) if one.kind in OUTSIDE), None):
            found[point] = doubt
    return found


def _name_outside(outside: Mapping[Wanted, Doubt], count: int, given: float) -> Iterator[str]:
    """Yield sentences on the points that are left out, those of one temperature and reason together, with the needed
    and the measured frequencies, and on how to keep the points. The rubber's own temperature is `given` [deg C]; NaN if
    it has no shift."""
    groups: dict[tuple[str, Any], list[Wanted]] = {}
    for point, doubt in outside.items():
        degrees = given if math.isnan(point.temperature) else point.temperature
        at = "" if math.isnan(degrees) else f" at {degrees:g} C"
        groups.setdefault((at, doubt.numbers.get("side")), []).append(point)
    if groups:
        yield f"left out: {len(outside)} of {count} points, at which the surface excites the rubber {OUT_OF_RANGE}"
    ends, reduced = list[Any](), "" if math.isnan(given) else " (reduced to the reference temperature)"
    for (at, side), points in sorted(groups.items(), key=str):
        speeds = [quantity(end.speed, "m/s") for end in (min(points), max(points))]
        who = f"{' to '.join(dict.fromkeys(speeds))}{at} ({len(points)} point{'s' * (len(points) > 1)})"
        first, *_ = numbers = [dict[str, Any](outside[one].numbers) for one in points]
        if side is None:  # a temperature
            yield f"{who}: {outside[points[0]].body.partition(':')[0]}"
            continue
        own = [each[end] for each in numbers for end in ("low", "high")]
        far = f"{max(each['decades'] for each in numbers):.1f} decades {side}"
        measured = _range([first["first"], first["last"]])
        yield f"{who} needs moduli at {_range(own)}{reduced}, {far} the measured {measured}"
        ends += own
    if ends:
        yield f"to keep these points, measure the moduli from {_range(ends)}{reduced}{BY_SHIFT[math.isnan(given)]}"


def _range(values: Sequence[float]) -> str:
    """Return a range of frequencies [Hz] as text."""
    return " to ".join(dict.fromkeys(quantity(end, "Hz") for end in (min(values), max(values))))


def _to_abaqus(table: ExportedTable) -> str:
    """Return friction as a table of Abaqus, whose slip rates vary fastest; without known temperatures it has none."""
    warm = all(row[3] == row[3] for row in table.rows)
    lines = [f"** {table.name} by {PROGRAM}: {', '.join(table.head[: 4 if warm else 3])}"]
    lines += [f"** {text}" for sentence in table.sentences for text in textwrap.wrap(sentence, WIDTH)]
    lines.append("*FRICTION")
    lines += [", ".join(f"{value:.6g}" for value in row[: 4 if warm else 3]) for row in table.rows]
    return "\n".join(lines) + "\n"
