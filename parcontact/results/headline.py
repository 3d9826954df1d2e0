"""The headline of a report: a sentence with the main results of a job and their errors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from ..job import Job
from ..job.added_sections import answers
from ..printed import quantity, stated_error, with_error
from . import cycles, slide
from .results import PLACES, Results, describe_end, read_cases, swept_keys

SWEPT = (  # results of a sweep, after those of capabilities: column, words, unit, column of the error
    ("mu_dyn", "the mean friction", "", "mu_dyn_error"),
    ("loss", "the loss of the last cycle", "J", "error_loss"),
    ("friction", "friction", "", slide.ERRORS[0]),
    (slide.CORRECTED, "the contact area over the nominal area", "", slide.ERRORS[1]),
)

SLIGHT = 1e-6  # rounding: relative difference below which loads count as constant
Columns = Mapping[str, Sequence[float]]


def find_headline(directory: Path) -> str:
    """Return the headline of an output directory: a sentence for each of its run, friction curve, sweep and study."""
    parts = {"measures.csv": _run, "steady.csv": _curve, "sweep.csv": _sweep, "study.txt": _study}
    return " ".join(filter(None, (part(directory) for name, part in parts.items() if (directory / name).is_file())))


def _run(directory: Path) -> str:
    """Return friction, results of capabilities and contact area of a run, as far as its job determines them."""
    run = Results(directory, "run")
    job, columns = run.job, run.table
    if job is None or not columns["time"]:
        return ""
    parts = [f"{text}{_describe_conditions(run)}" for text in _friction(job, columns)]
    for headline in answers("results", "headline"):
        parts += headline(run)
    if last := cycles.measure_last(job, columns):
        parts.append(f"the last cycle loses {quantity(last['loss'], 'J')} ± {stated_error(last['error_loss'])}")
    return _to_sentence([*parts, _area(job, run)])


def _describe_conditions(run: Results) -> str:
    """Return the load of a slide, if it is constant, and the temperature of the rubber, if it is known."""
    pairs = zip(run.table["pressure"], run.table["distance"], strict=True)
    loads = [pressure for pressure, slid in pairs if slid > 0.0]
    constant = run.job is not None and max(loads) - min(loads) <= SLIGHT * max(loads)
    load = f" under {_load(run.job, loads[-1])}" if run.job is not None and constant else ""
    return load + ("" if math.isnan(run.temperature) else f" at {run.temperature:g} °C")


def _friction(job: Job, columns: Columns) -> Iterator[str]:
    """Yield the friction of the slide, if it is defined."""
    found, errors = slide.measure_slide(job.history, columns), slide.absolute_errors(job.history, columns, job.grid.dx)
    if found is None or math.isnan(found.mu_dyn):
        return
    mean, peak = (with_error(getattr(found, name), errors.get(name, math.nan)) for name in ("mu_dyn", "mu_max"))
    yield f"the mean friction is {mean} and the highest {peak}"


def _area(job: Job, run: Results) -> str:
    """Return the mean contact area of the slide; without a slide the area in the telling row."""
    columns = run.table
    if (found := slide.measure_slide(job.history, columns)) is not None:
        if math.isnan(found.contact_area):
            return "the box cuts the contact off in the whole slide"
        error = slide.absolute_errors(job.history, columns, job.grid.dx).get("contact_area", math.nan)
        return f"the mean contact area is {_size(job, found.contact_area_corrected, error)}"
    row = run.telling_row
    area, when = columns[slide.CORRECTED][row], ""
    if len(columns["time"]) > 1:
        time = f"t = {quantity(columns['time'][row], 's', 4)}" if columns["time"][-1] else ""
        when = f" at {time or _load(job, columns['pressure'][row])}"
    return f"the contact area is {_size(job, area, area * _error(columns, slide.ERRORS[1], row))}{when}"


def _load(job: Job, pressure: float) -> str:
    """Return the force on the box of a free scene, else the mean pressure, as text."""
    free = job.grid.boundary == "free"
    return quantity(pressure * job.grid.lx * job.grid.ly, "N", 4) if free else quantity(pressure, "Pa", 4)


def _size(job: Job, share: float, error: float) -> str:
    """Return a contact area and its error as text: in m² in a free scene, else in per cent of the nominal area."""
    if job.grid.boundary != "free":
        return f"{with_error(100.0 * share, 100.0 * error)} % of the nominal area"
    box = job.grid.lx * job.grid.ly
    within = f" ± {quantity(error * box, 'm²', 2)}" if error > 0.0 else ""
    return f"{quantity(share * box, 'm²', 4)}{within}"


def _curve(directory: Path) -> str:
    """Return a sentence on the highest friction of a friction curve; '' without a point."""
    curve = Results(directory, "curve")
    if not curve.table["velocity"]:
        return ""
    best = curve.highest()
    friction = curve.table["friction"][best]
    highest = with_error(friction, friction * _error(curve.table, slide.ERRORS[0], best))
    return _to_sentence([f"the highest friction of the curve is {highest}, {curve.describe_place(best)}"])


def _sweep(directory: Path) -> str:
    """Return a sentence on the range of the first of the results that the cases have; '' without any."""
    rows = read_cases(Results(directory, "sweep").points)
    for name, words, unit, error in (*(one for some in answers("results", "SWEPT") for one in some), *SWEPT):
        known = sorted((row for row in rows if math.isfinite(row.get(name, math.nan))), key=itemgetter(name))
        if known and known[-1][name]:
            ends = [f"{_with_unit(row, name, unit, error)} (case {row['case']:g})" for row in (known[0], known[-1])]
            keys = [*swept_keys(rows), *(place for place in PLACES if place in rows[0])]
            end = describe_end(known[-1], known, keys) if "friction" in words else ""
            return _to_sentence([f"{words} of the cases is from {ends[0]} to {ends[1]}{end}"])
    return ""


def _study(directory: Path) -> str:
    """Return the first sentence of a study, on its accuracy."""
    return next(iter(Results(directory, "study").sentences_of_study), "")


def _with_unit(row: Mapping[str, Any], name: str, unit: str, error: str) -> str:
    value, within = row[name], row.get(error, math.nan)
    within = abs(value) * within if error in (*slide.ERRORS, "error_loss") else within
    if not unit:
        return with_error(value, within)
    return quantity(value, unit, 4) + (f" ± {quantity(within, unit, 2)}" if within > 0.0 else "")


def _error(columns: Columns, name: str, row: int) -> float:
    """Return an error of a row, NaN if the table has none."""
    return columns[name][row] if name in columns else math.nan


def _to_sentence(parts: Sequence[str]) -> str:
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."
