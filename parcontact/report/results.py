"""The sections about results: of a run, a friction curve, a sweep, a study."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from ..plotting import histories, steady, sweep
from ..plotting.run import Run
from ..storage import measures
from ..storage.row import UNITS
from ..summary import slide, sweep_table, theory_settings
from . import browse
from .parts import Section, Table, of_chart, uri_of

STUDY_PICTURES = {"convergence.png": "errors over refinement", "work_precision.png": "error over cost"}
INTERFACE = ("friction_viscous", "friction_interface")
SHOWN = ("friction", "contact_area", "approach", "mean_gap", "max_pressure", *INTERFACE)
POINTS = (
    *("velocity", "temperature", "pressure", "friction", "error_friction", *INTERFACE),
    *("contact_area_corrected", "error_area", "mean_gap", "max_pressure"),
)
DIGITS = 5
MOST_ROWS = 200  # of a table: the whole is in the data


def of_run(directory: Path) -> Section:
    """Return histories, the largest and last values, and the maps over time."""
    run, columns = Run(directory), measures.read(directory / "measures.csv")
    known = {name: [value for value in columns.get(name, ()) if value == value] for name in SHOWN}
    rows = [
        (_words(name), *map(cell, (values[-1], min(values), max(values))), UNITS.get(name, ""))
        for name, values in known.items()
        if values
    ]
    numbers = Table(("measure", "in the end", "smallest", "largest", "unit"), rows)
    told = [
        *slide.describe(run.job.history, run.job.initial, run.job.grid.dx, columns),
        theory_settings.describe(directory),
    ]
    pictures = [of_chart(chart) for chart in histories.charts(run)]
    return Section("Results of the run", list(filter(None, told)), [numbers], pictures, browse.of_run(run))


def of_curve(directory: Path) -> Section:
    """Return the points of a friction curve, and their maps."""
    columns = measures.read(directory / "steady.csv")
    names = [name for name in POINTS if name in columns]
    units = {**UNITS, "velocity": "m/s", "temperature": "°C"}
    head = [f"{_words(name)} [{units[name]}]" if name in units else _words(name) for name in names]
    table = _shortened(head, list(zip(*(columns[name] for name in names), strict=True)))
    pictures = [of_chart(chart) for chart in steady.charts(directory)]
    return Section("Friction curve", (), [table], pictures, browse.of_curve(directory))


def of_sweep(directory: Path) -> Section:
    """Return what the cases have come to."""
    rows = sweep_table.read(directory / "sweep.csv")
    used = [name for name in (rows[0] if rows else ()) if any(cell(row[name]) not in ("", "–") for row in rows)]
    table = _shortened(used, [[row[name] for name in used] for row in rows])
    told = list(filter(None, [theory_settings.describe(directory)]))
    return Section("Sweep", told, [table], [of_chart(chart) for chart in sweep.charts(directory)])


def of_study(directory: Path) -> Section:
    """Return settings, their errors and costs."""
    with (directory / "study.csv").open(newline="") as file:
        names, *rows = list(csv.reader(file)) or [[]]
    kept = [k for k, name in enumerate(names) if name != "fingerprint"]
    table = _shortened([names[k] for k in kept], [[_number(row[k]) for k in kept] for row in rows])
    told = directory / "study.txt"
    sentences = told.read_text(errors="replace").splitlines() if told.is_file() else ["The study is not finished."]
    pictures = [
        (uri_of((directory / name).read_bytes(), "image/png"), caption)
        for name, caption in STUDY_PICTURES.items()
        if (directory / name).is_file()
    ]
    return Section("What accuracy costs", sentences, [table], pictures)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _shortened(head: Sequence[str], rows: Sequence[Sequence[object]]) -> Table:
    """Return a table that can be read: its first rows, if there are too many."""
    more = f"the first {MOST_ROWS} of {len(rows)} rows; all are in the data" if len(rows) > MOST_ROWS else ""
    return Table(head, [[cell(value) for value in row] for row in rows[:MOST_ROWS]], more)


def cell(value: object) -> str:
    """Return a number in few digits, a dash for what is not known, or a word."""
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.{DIGITS}g}"
    return str(value)


def _number(text: str) -> object:
    try:
        return float(text or "nan")
    except ValueError:
        return text
