"""The headline of a report: a sentence with the main results of a job and their errors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from ..effects.adhesion import pull_off
from ..effects.leakage import results as leak_stop
from ..job import Job
from ..job.resolved import RESOLVED, shown_job
from ..printed import quantity, with_error
from ..storage import marker, read_back
from . import slide, sweep_table

SWEPT = (  # results of a sweep in order of preference: column, words, unit, column of the error
    ("pull_off", "the pull-off force", "N", "pull_off_error"),
    ("mu_dyn", "the mean friction", "", "mu_dyn_error"),
    ("friction", "friction", "", slide.ERRORS[0]),
    (slide.CORRECTED, "the contact area over the nominal area", "", slide.ERRORS[1]),
)

Columns = Mapping[str, Sequence[float]]


def find_headline(directory: Path) -> str:
    """Return the headline of an output directory: a sentence for each of its run, friction curve, sweep and study."""
    parts = {"measures.csv": _run, "steady.csv": _curve, "sweep.csv": _sweep, "study.txt": _study}
    return " ".join(filter(None, (part(directory) for name, part in parts.items() if (directory / name).is_file())))


def _run(directory: Path) -> str:
    """Return friction, pull-off force, leakage and contact area of a run, as far as its job determines them."""
    if not (directory / RESOLVED).is_file():
        return ""
    job = shown_job(directory / RESOLVED)
    columns = read_back.read_results(directory / "measures.csv")
    if not columns["time"]:
        return ""
    detached = bool(marker.detached(directory))
    parts = [*_friction(job, columns), *_pull_off(job, columns, detached), *_leakage(directory, columns)]
    return _to_sentence([*parts, _area(job, columns, detached)])


def _friction(job: Job, columns: Columns) -> Iterator[str]:
    """Yield the friction of the slide, if it is defined."""
    found, errors = slide.measure_slide(job.history, columns), slide.absolute_errors(job.history, columns, job.grid.dx)
    if found is None or math.isnan(found.mu_dyn):
        return
    mean, peak = (with_error(getattr(found, name), errors.get(name, math.nan)) for name in ("mu_dyn", "mu_max"))
    yield f"the mean friction is {mean} and the highest {peak}"


def _pull_off(job: Job, columns: Columns, detached: bool) -> Iterator[str]:
    """Yield the force of the last pull-off and its error, where that is known."""
    lost = [pull for pull in pull_off.find(columns, detached) if pull.lost is not None]
    if lost:
        box = job.grid.lx * job.grid.ly
        force, within = -lost[-1].pressure * box, lost[-1].error(job.numerics.tolerance) * box
        known = "" if math.isnan(within) else f" ± {quantity(within, 'N', 2)}"
        yield f"the pull-off force is {quantity(force, 'N', 4)}{known}"


def _leakage(directory: Path, columns: Columns) -> Iterator[str]:
    """Yield the last conductivities, from `leak.csv` with their errors, else from the run."""
    table = directory / "leak.csv"
    columns = read_back.read_results(table) if table.is_file() else columns
    stops = [text for text in leak_stop.describe_leak_stop(directory) if " between " in text]
    known = [row for row, flow in enumerate(columns.get("flow_x", ())) if flow == flow]
    if known:
        row = known[-1]
        closed = [axis for axis in "xy" if not columns[f"flow_{axis}"][row]]
        flows = [_flow(columns, row, axis) for axis in "xy" if axis not in closed]
        yield from [f"the conductivity of the gap is {' and '.join(flows)}"] * bool(flows)
        yield from [f"contact closes the gap along {' and '.join(closed)}"] * bool(closed)
        yield from stops


def _flow(columns: Columns, row: int, axis: str) -> str:
    flow, error = columns[f"flow_{axis}"][row], _error(columns, f"error_{axis}", row)
    return f"{with_error(flow, flow * error)} m³ along {axis}"


def _area(job: Job, columns: Columns, detached: bool) -> str:
    """Return the mean contact area of the slide; without a slide the area in the row chosen by
    `pull_off.choose_row`."""
    if (found := slide.measure_slide(job.history, columns)) is not None:
        error = slide.absolute_errors(job.history, columns, job.grid.dx).get("contact_area", math.nan)
        return f"the mean contact area is {_size(job, found.contact_area_corrected, error)}"
    row = pull_off.choose_row(columns, detached)
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
    columns = read_back.read_results(directory / "steady.csv")
    if not columns["velocity"]:
        return ""
    best = max(range(len(columns["friction"])), key=columns["friction"].__getitem__)
    friction, speed, pressure = (columns[name][best] for name in ("friction", "velocity", "pressure"))
    highest = with_error(friction, friction * _error(columns, slide.ERRORS[0], best))
    place = f"at {quantity(speed, 'm/s')} and {quantity(pressure, 'Pa')}"
    return _to_sentence([f"the highest friction of the curve is {highest}, {place}"])


def _sweep(directory: Path) -> str:
    """Return a sentence on the range of the first result of `SWEPT` that the cases have; '' without any."""
    rows = sweep_table.read_cases(sweep_table.results(directory))
    for name, words, unit, error in SWEPT:
        known = sorted((row for row in rows if math.isfinite(row.get(name, math.nan))), key=itemgetter(name))
        if known and known[-1][name]:
            ends = [f"{_with_unit(row, name, unit, error)} (case {row['case']:g})" for row in (known[0], known[-1])]
            return _to_sentence([f"{words} of the cases is from {ends[0]} to {ends[1]}"])
    return ""


def _study(directory: Path) -> str:
    """Return the first sentence of a study, on its accuracy."""
    read_back.refuse_cut(directory / "study.txt")
    return (directory / "study.txt").read_text(errors="replace").partition("\n")[0]


def _with_unit(row: Mapping[str, Any], name: str, unit: str, error: str) -> str:
    value, within = row[name], row.get(error, math.nan)
    within = abs(value) * within if error in slide.ERRORS else within
    if not unit:
        return with_error(value, within)
    return quantity(value, unit, 4) + (f" ± {quantity(within, unit, 2)}" if within > 0.0 else "")


def _error(columns: Columns, name: str, row: int) -> float:
    """Return an error of a row, NaN if the table has none."""
    return columns[name][row] if name in columns else math.nan


def _to_sentence(parts: Sequence[str]) -> str:
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."
