"""Tables for finite element programs: friction by slip rate, pressure and temperature, as csv or for Abaqus.

Points of a friction curve are omitted, and named, if waves of the surface excite the rubber beyond its measured
frequencies or temperatures there. Effects export tables of runs.
"""

import math
import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from ..bands.choice import cut_bands, on_one_grid_of_all
from ..columns import to_csv
from ..doubts import Doubt
from ..errors import InputError
from ..files import files, hdf5, tables
from ..files.provenance import PROGRAM
from ..files.tables import Wanted
from ..job import Job, load
from ..job.listing import answers
from ..march.measured_range import doubt_band
from .results import ExportedTable, Results

HEAD = ("friction [-]", "slip rate [m/s]", "pressure [Pa]", "temperature [deg C]", "relative error [-]")
SUFFIX = {"csv": ".csv", "abaqus": ".inp"}
WIDTH = 76  # letters in a line of a comment
SHOWN = 4  # tuning: most points of one reason in a sentence
OUTSIDE = ("frequencies", "temperatures")  # kinds of warnings for which a point is left out


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
        first = partial(_begins_with, text.partition("\n")[0].encode())
        try:
            with files.replaced(path, first) as file:
                file.write(text.encode())
        except OSError as error:
            raise InputError(f"{path} cannot be written: {hdf5.reason(error)}") from error
        yield f"{table.name}: {len(table.rows)} rows in {path}"
        yield from table.sentences


def _begins_with(first: bytes, path: Path) -> bool:
    """Return True if a file begins with a line, as a table of this program does; raises OSError."""
    return path.read_bytes().startswith(first)


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
    if not rows:
        raise InputError(f"{directory}: no point of the curve lies within the measured range of the rubber")
    rows.sort(key=lambda row: (row[3] if row[3] == row[3] else 0.0, *row[2:0:-1]))
    missing = [f"not solved: {text}" for text in curve.unfinished]
    return ExportedTable("friction", HEAD, rows, [*_name_outside(outside, len(points)), *missing])


def _outside(directory: Path, points: Sequence[Wanted]) -> dict[Wanted, str]:
    """Return the points at which the rubber is excited outside of its measured range, with the reason."""
    path = Results(directory, "steady").job_file
    try:
        job = load(path) if path else None
        job = on_one_grid_of_all(job, cut_bands(job)) if job and job.bands is not None else job
    except InputError:  # its files no longer exist
        job = None
    found = {}
    for point in points if job and job.steady else ():
        doubts = [str(doubt) for doubt in _doubts(job, point) if doubt.kind in OUTSIDE] if job else []
        if doubts:
            found[point] = doubts[0].partition("; ")[0]
    return found


def _doubts(job: Job, point: Wanted) -> Iterator[Doubt]:
    """Yield warnings about the rubber in one state of steady sliding."""
    degrees = None if math.isnan(point.temperature) else (point.temperature,)
    state = {"velocities": (point.speed,), "pressures": (point.pressure,), "temperatures": degrees}
    steady = job.steady.model_copy(update=state) if job.steady else None
    yield from doubt_band(job.model_copy(update={"steady": steady, "history": ()}), degrees or ())


def _name_outside(outside: dict[Wanted, str], count: int) -> Iterator[str]:
    if outside:
        more = [f"and {len(outside) - SHOWN} more"] * (len(outside) > SHOWN)
        named = "; ".join([*map(str, list(outside)[:SHOWN]), *more])
        yield f"left out, {len(outside)} of {count} points outside of the measured range of the rubber: {named}"
        yield f"the first of them: {next(iter(outside.values()))}"


def _to_abaqus(table: ExportedTable) -> str:
    """Return friction as a table of Abaqus, whose slip rates vary fastest; without known temperatures it has none."""
    warm = all(row[3] == row[3] for row in table.rows)
    lines = [f"** {table.name} by {PROGRAM}: {', '.join(table.head[: 4 if warm else 3])}"]
    lines += [f"** {text}" for sentence in table.sentences for text in textwrap.wrap(sentence, WIDTH)]
    lines.append("*FRICTION")
    lines += [", ".join(f"{value:.6g}" for value in row[: 4 if warm else 3]) for row in table.rows]
    return "\n".join(lines) + "\n"
