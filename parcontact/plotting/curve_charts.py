"""Charts of friction curves (steady.csv) over velocity, or over pressure if only that varies.

Several temperatures are separate lines; friction over a_T v shows them on one master curve.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..job.resolved import STEADY_RESOLVED, shown_job
from ..parallel.slab import Array
from . import band_charts, prefixes, style
from .charts import Axis, Chart, ChartLine
from .plotted_run import find_free_area, read_table, to_contact_area, to_load

TABLE, THEORY = "steady.csv", "steady_theory.csv"
NEEDED = ("velocity", "pressure", "friction", "contact_area")
THIN = 1.0  # tuning: width of lines of the theory [points]
COLD = "friction_cold"  # friction without feedback from heat
DIGITS = 6  # significant digits of values that count as equal


def chart_steady(directory: Path, over: str = "") -> list[Chart]:
    """Return panels of a table of steady states; none without states, or if `over` is not possible."""
    columns, area = read_table(directory / TABLE, NEEDED), find_free_area(directory)
    if over in ("time", "distance") or not columns["velocity"].size:
        return []
    axes = {
        "velocity": Axis("sliding velocity", "m/s"),
        "load": to_load(columns["pressure"], area)[0],
        "temperature": Axis("temperature", "°C"),
        "reduced": Axis("shift factor × velocity", "m/s"),
        "friction": Axis("friction coefficient"),
        "flash_temperature": Axis("flash temperature", "K"),
        "area": to_contact_area(columns["contact_area"], area)[0],
    }
    _add_derived(columns, area)
    x, by = "velocity", "load"
    if over == "load" or (not over and _count(columns[x]) < 2 <= _count(columns[by])):
        x, by = by, x
    warm = "temperature" in columns and _count(columns["temperature"]) > 1
    by = "temperature" if warm else by
    panels = [("steady friction", x, "friction", "steady, at"), ("steady area", x, "area", "")]
    if warm and x == "velocity":
        panels.append(("steady master", "reduced", "friction", ""))
    if "flash_temperature" in columns:
        panels.append(("steady flash", x, "flash_temperature", ""))
    theory = {}
    if x == "velocity" and COLD not in columns and (directory / THEORY).is_file():  # the theory has no feedback
        theory = read_table(directory / THEORY, (*NEEDED, "shift_factor"))
        _add_derived(theory, area)
    found = []
    for key, along, name, title in panels:
        series = list(_make_lines(columns, along, name, by, axes[by].unit))
        if name == "friction" and along == x and COLD in columns:
            series += _make_thin(columns | {name: columns[COLD]}, along, name, by, "without feedback", "--")
        series += _make_theory(theory, along, name, by) if theory and name in theory else ()
        found.append(Chart(key, axes[along], axes[name], series, log_x=True, legend_title=title))
    return found + (band_charts.chart_bands(directory) if x == "velocity" else [])


def steady_title(directory: Path) -> str:
    """Return the title of the job, with the pressure or force if it is the same at all points."""
    job = shown_job(directory / STEADY_RESOLVED) if (directory / STEADY_RESOLVED).is_file() else None
    axis, loads = to_load(read_table(directory / TABLE, ("pressure",))["pressure"], find_free_area(directory))
    name = (job.title if job else "") or "steady sliding"
    return f"{name}: {prefixes.quantity(loads[0], axis.unit)}" if _count(loads) == 1 else name


def _add_derived(columns: dict[str, Array], area: float) -> None:
    """Return the columns of a table with loads, corrected areas, and speeds at the reference temperature."""
    columns["load"] = to_load(columns["pressure"], area)[1]
    columns["area"] = to_contact_area(columns.get("contact_area_corrected", columns["contact_area"]), area)[1]
    if "shift_factor" in columns:
        columns["reduced"] = columns["shift_factor"] * columns["velocity"]


def _make_lines(columns: dict[str, Array], x: str, y: str, by: str, unit: str) -> Iterator[ChartLine]:
    """Yield a line for each value of the column `by`."""
    error = columns.get(f"error_{y}")
    groups = _round(columns[by])
    for number, value in enumerate(np.unique(groups)):
        rows = np.flatnonzero(groups == value)
        rows = rows[np.argsort(columns[x][rows], kind="stable")]
        shown = prefixes.quantity(value, unit), columns[x][rows], columns[y][rows], style.line(number) | {"marker": "o"}
        yield ChartLine(*shown, None if error is None else error[rows])


def _make_theory(columns: dict[str, Array], x: str, y: str, by: str) -> Iterator[ChartLine]:
    """Yield thin lines of Persson's theory, one per line of the simulation, or one over a_T v."""
    one = {"one": np.zeros_like(columns[x])} if x == "reduced" else {}
    yield from _make_thin(columns | one, x, y, "one" if one else by, "theory", ":", style.GREY if one else "")


def _make_thin(
    columns: dict[str, Array], x: str, y: str, by: str, label: str, dashes: str, color: str = ""
) -> Iterator[ChartLine]:
    """Yield thin lines, drawn in addition to the simulation; the first has the label."""
    for number, line in enumerate(_make_lines(columns, x, y, by, "")):
        own = {"color": color or style.line(number)["color"], "linestyle": dashes, "linewidth": THIN}
        yield ChartLine("" if number else label, line.x, line.y, own)


def _round(values: Array) -> Array:
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def _count(values: Array) -> int:
    """Return the number of values that differ by more than rounding."""
    return np.unique(_round(values)).size
