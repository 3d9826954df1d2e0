"""Friction curves: what steady.csv holds, over velocity, or over pressure where that is what changes.

At several temperatures there is a line for each, and friction over a_T v besides, where the lines of all are one.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..job.resolved import STEADY_RESOLVED, shown_job
from ..parallel.slab import Array
from . import style, units
from .charts import FRACTION, Axis, Chart, Series
from .run import box, table

TABLE, THEORY = "steady.csv", "steady_theory.csv"
SAME = 1e-6  # relative: values that are the same but for rounding
REDUCED = Axis("shift factor × velocity", "m/s")


def charts(directory: Path, over: str = "") -> list[Chart]:
    """Panels of a table of steady states; none if it holds no state yet, or is not to be drawn over `over`."""
    if over in ("time", "distance"):
        return []
    columns = table(directory / TABLE, ("velocity", "pressure", "friction", "contact_area"))
    if not columns["velocity"].size:
        return []
    area = box(directory)  # of a free scene
    load = columns["pressure"] * (area or 1.0)
    name, unit = ("force", "N") if area else ("pressure", "Pa")
    along, other = (Axis("sliding velocity", "m/s"), columns["velocity"]), (Axis(name, unit), load)
    if over == "load" or (not over and len(distinct(columns["velocity"])) < 2 <= len(distinct(load))):
        along, other = other, along
    if "temperature" in columns and len(distinct(columns["temperature"])) > 1:
        other = Axis("temperature", "°C"), columns["temperature"]
    contact = columns.get("contact_area_corrected", columns["contact_area"]) * (area or 1.0)
    shown = (
        ("friction", Axis("friction coefficient"), columns["friction"]),
        ("area", Axis("contact area", "m²") if area else Axis(FRACTION), contact),
    )
    found = []
    for (key, axis, values), title in zip(shown, ("steady, at", ""), strict=True):
        lines = [*_lines(along[1], other, values, columns.get(f"error_{key}"))]
        lines += _theory(directory, key, along[0], other)
        found.append(Chart(f"steady {key}", along[0], axis, lines, log_x=True, legend_title=title))
    if other[0].name == "temperature" and along[0].unit == "m/s":
        reduced = columns["shift_factor"] * columns["velocity"]
        error = columns.get("error_friction")
        lines = [*_lines(reduced, other, columns["friction"], error), *_theory(directory, "friction", REDUCED, None)]
        found.append(Chart("steady master", REDUCED, shown[0][1], lines, log_x=True))
    return found


def title(directory: Path) -> str:
    """Of the job, with the pressure or force if there is one for all points."""
    job = shown_job(directory / STEADY_RESOLVED) if (directory / STEADY_RESOLVED).is_file() else None
    columns, area = table(directory / TABLE, ("pressure",)), box(directory)
    pressures = distinct(columns["pressure"])
    load = units.text(pressures[0] * (area or 1.0), "N" if area else "Pa") if len(pressures) == 1 else ""
    name = (job.title if job else "") or "steady sliding"
    return f"{name}: {load}" if load else name


def _lines(x: Array, other: tuple[Axis, Array], y: Array, error: Array | None) -> list[Series]:
    found = []
    for number, (value, rows) in enumerate(_groups(x, other)):
        look = {**style.line(number), "marker": "o"}
        own = error[rows] if error is not None else None
        found.append(Series(_named(value, other[0].unit), x[rows], y[rows], look, own))
    return found


def _theory(directory: Path, key: str, along: Axis, other: tuple[Axis, Array] | None) -> list[Series]:
    """Thin lines of Persson's theory, if it is there: as many as there are of the simulation, one over a_T v."""
    if along.unit != "m/s" or not (directory / THEORY).is_file():
        return []
    columns = table(directory / THEORY, ("velocity", "pressure", "friction", "contact_area", "shift_factor"))
    y = columns["friction" if key == "friction" else "contact_area"]
    x: Array
    if other is None:
        x = np.asarray(columns["shift_factor"] * columns["velocity"], dtype=float)
        groups = [np.argsort(x, kind="stable")]
    else:
        name = "temperature" if other[0].unit == "°C" else "pressure"
        x = columns["velocity"]
        groups = [rows for _, rows in _groups(x, (other[0], columns[name]))]
    looks: list[dict[str, Any]] = [
        {"color": style.GREY if other is None else style.line(number)["color"], "linestyle": ":"}
        for number in range(len(groups))
    ]
    names = ["theory", *[""] * len(groups)]
    return [Series(name, x[rows], y[rows], look) for name, rows, look in zip(names, groups, looks, strict=False)]


def _groups(x: Array, other: tuple[Axis, Array]) -> Iterator[tuple[float, NDArray[np.intp]]]:
    """Each value of the other quantity with its rows, in the order of x."""
    for value in distinct(other[1]):
        rows = np.flatnonzero(np.abs(other[1] - value) <= SAME * max(abs(value), 1.0 if other[0].unit == "°C" else 0.0))
        yield value, rows[np.argsort(x[rows], kind="stable")]


def _named(value: float, unit: str) -> str:
    """A value with its unit; degrees have no prefixes."""
    return f"{value:g} {unit}" if unit == "°C" else units.text(value, unit)


def distinct(values: Sequence[float] | Array) -> list[float]:
    """Sorted values; those that differ by round-off only are one."""
    found: list[float] = []
    for value in sorted(float(value) for value in values):
        if not found or value - found[-1] > SAME * abs(value):
            found.append(value)
    return found
