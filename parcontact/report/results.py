"""The sections about results: of a run, a friction curve, a sweep, a study."""

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..plotting import histories, steady, sweep
from ..plotting.run import Run
from ..storage import measures
from ..storage.row import UNITS
from ..summary import slide, sweep_table, theory_settings
from . import browse
from .parts import Picture, Section, Table, of_chart, uri_of

STUDY_PICTURES = {"convergence.png": "errors over refinement", "work_precision.png": "error over cost"}
SHOWN = ("friction", "contact_area", "approach", "mean_gap", "max_pressure")
INTERFACE = ("friction_viscous", "friction_interface")
POINTS = (
    *("velocity", "temperature", "pressure", "friction", "error_friction", *INTERFACE),
    *("contact_area_corrected", "error_area", "mean_gap", "max_pressure"),
)
DIGITS = 5
MOST_ROWS = 200  # of a table: the whole is in the data


def of_run(directory: Path) -> Section:
    """Histories, the largest and last values, and the maps over time."""
    run, columns = Run(directory), measures.read(directory / "measures.csv")
    names = [name for name in (*SHOWN, *INTERFACE) if name in columns]
    rows = []
    for name in names:
        known = [value for value in columns[name] if value == value]
        if known:
            unit = UNITS.get(name, "")
            rows.append((name.replace("_", " "), number(known[-1]), number(min(known)), number(max(known)), unit))
    numbers = Table(("measure", "in the end", "smallest", "largest", "unit"), rows)
    pictures = [of_chart(chart) for chart in histories.charts(run)]
    job = run.job
    told = [*slide.describe(job.history, job.initial, job.grid.dx, columns), theory_settings.describe(directory)]
    return Section("Results of the run", list(filter(None, told)), [numbers], pictures, browse.of_run(run))


def of_curve(directory: Path) -> Section:
    """The points of a friction curve, and their maps."""
    columns = measures.read(directory / "steady.csv")
    names = [name for name in POINTS if name in columns]
    units = {**UNITS, "velocity": "m/s", "temperature": "°C"}
    head = [f"{name.replace('_', ' ')} [{units[name]}]" if name in units else name.replace("_", " ") for name in names]
    rows = [[number(value) for value in row] for row in zip(*(columns[name] for name in names), strict=True)]
    pictures = [of_chart(chart) for chart in steady.charts(directory)]
    return Section("Friction curve", (), [shortened(head, rows)], pictures, browse.of_curve(directory))


def of_sweep(directory: Path) -> Section:
    """What the cases have come to."""
    rows = sweep_table.read(directory / "sweep.csv")
    used = [name for name in (rows[0] if rows else ()) if any(not _empty(row[name]) for row in rows)]
    table = shortened(used, [[cell(row[name]) for name in used] for row in rows])
    told = list(filter(None, [theory_settings.describe(directory)]))
    return Section("Sweep", told, [table], [of_chart(chart) for chart in sweep.charts(directory)])


def of_study(directory: Path) -> Section:
    """Settings, their errors and costs."""
    with (directory / "study.csv").open(newline="") as file:
        rows: list[Mapping[str, str]] = list(csv.DictReader(file))
    names = [name for name in (rows[0] if rows else ()) if name != "fingerprint"]
    table = shortened(names, [[_short(row[name]) for name in names] for row in rows])
    told = directory / "study.txt"
    sentences = told.read_text(errors="replace").splitlines() if told.is_file() else ["The study is not finished."]
    return Section("What accuracy costs", sentences, [table], list(_study_pictures(directory)))


def _study_pictures(directory: Path) -> Iterator[Picture]:
    for name, caption in STUDY_PICTURES.items():
        if (directory / name).is_file():
            yield Picture(uri_of((directory / name).read_bytes(), "image/png"), caption)


def shortened(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """A table that can be read: its first rows, if there are too many."""
    more = f"the first {MOST_ROWS} of {len(rows)} rows; all are in the data" if len(rows) > MOST_ROWS else ""
    return Table(head, rows[:MOST_ROWS], more)


def number(value: float) -> str:
    """In few digits; a dash for what is not known."""
    return "–" if math.isnan(value) else f"{value:.{DIGITS}g}"


def cell(value: object) -> str:
    """A number in few digits, or a word."""
    return number(value) if isinstance(value, float) else str(value)


def _empty(value: object) -> bool:
    return value == "" or value != value


def _short(text: str) -> str:
    try:
        return number(float(text)) if text else "–"
    except ValueError:
        return text
