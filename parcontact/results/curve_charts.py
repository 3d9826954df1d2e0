"""Charts of friction curves (steady.csv) over velocity, or over pressure if only that varies.

Several temperatures are separate lines; friction over a_T v shows them on one master curve.
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..job import load
from ..job.added_sections import answers
from ..job.resolved import STEADY_RESOLVED
from ..parallel.slab import Array
from . import band_charts, prefixes, style
from .charts import Axis, Chart, ChartLine
from .plotted_run import count_different, round_digits, to_contact_area, to_load
from .results import Results

THEORY = "steady_theory.csv"
NEEDED = ("velocity", "pressure", "friction", "contact_area")
COLD = "friction_cold"  # friction without feedback from heat
EMPTY = np.zeros(0)
THIN = {"theory": ":", "without feedback": "--"}  # dashes of thin lines, drawn in addition to the simulation


def chart_steady(directory: Path, over: str = "") -> list[Chart]:
    """Return panels of a table of steady states; none without states, or if `over` is not possible."""
    curve = Results(directory, "curve")
    columns, area = curve.table.arrays(NEEDED), curve.free_area
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
    if over == "load" or (not over and count_different(columns[x]) < 2 <= count_different(columns[by])):
        x, by = by, x
    several = [name for name in ("temperature", by) if name in columns and count_different(columns[name]) > 1]
    lines = {name: axes[name].unit for name in several or [by]}
    panels = [("steady friction", x, "friction"), ("steady area", x, "area")]
    if "temperature" in several and x == "velocity":
        panels.append(("steady master", "reduced", "friction"))
    if "flash_temperature" in columns:
        panels.append(("steady flash", x, "flash_temperature"))
    theory = {}
    if x == "velocity" and COLD not in columns and curve.has(THEORY):  # the theory has no feedback
        theory = curve.read(THEORY).arrays((*NEEDED, "shift_factor"))
        _add_derived(theory, area)
    found = []
    for key, along, name in panels:
        series = list(_make_lines(columns, along, name, lines))
        if name == "friction" and along == x and COLD in columns:
            series += _make_thin(columns | {name: columns[COLD]}, along, name, lines, "without feedback")
        if name in theory:
            one = along == "reduced" and "load" not in lines  # over a_T v the theory is one line
            series += _make_thin(theory, along, name, {} if one else lines, "theory")
        found.append(Chart(key, axes[along], axes[name], series, log_x=True))
    with suppress(InputError):  # files of the job no longer exist
        job = load(directory / STEADY_RESOLVED)
        found += [chart for panels_of in answers("pictures", "curve_panels") for chart in panels_of(job, columns)]
    return found + (band_charts.chart_bands(directory) if x == "velocity" else [])


def steady_title(directory: Path) -> str:
    """Return the title of the job, with the pressure or force if it is the same at all points."""
    curve = Results(directory, "curve")
    axis, loads = to_load(curve.table.arrays(("pressure",))["pressure"], curve.free_area)
    name = (curve.job.title if curve.job else "") or "steady sliding"
    return f"{name}: {prefixes.quantity(loads[0], axis.unit)}" if count_different(loads) == 1 else name


def _add_derived(columns: dict[str, Array], area: float) -> None:
    """Return the columns of a table with loads, corrected areas, and speeds at the reference temperature."""
    columns["load"] = to_load(columns["pressure"], area)[1]
    columns["area"] = to_contact_area(columns.get("contact_area_corrected", columns["contact_area"]), area)[1]
    if "shift_factor" in columns:
        columns["reduced"] = columns["shift_factor"] * columns["velocity"]


def _make_lines(columns: dict[str, Array], x: str, y: str, by: dict[str, str]) -> Iterator[ChartLine]:
    """Yield a line for each combination of the columns `by`, given with their units."""
    error = columns.get(f"error_{y}")
    places = np.array([round_digits(columns[name]) for name in by]).reshape(len(by), columns[x].size)
    values, groups = np.unique(places, axis=1, return_inverse=True)
    for number, place in enumerate(values.T):
        rows = np.flatnonzero(groups == number)
        rows = rows[np.argsort(columns[x][rows], kind="stable")]
        label = ", ".join(prefixes.quantity(value, unit) for value, unit in zip(place, by.values(), strict=True))
        look = style.line(number, values.shape[1]) | {"marker": "o"}
        yield ChartLine(label, columns[x][rows], columns[y][rows], look, None if error is None else error[rows])


def _make_thin(columns: dict[str, Array], x: str, y: str, by: dict[str, str], label: str) -> Iterator[ChartLine]:
    """Yield thin lines, drawn in addition to the simulation, and their entry of the legend."""
    look = {"color": style.GREY, "linestyle": THIN[label], "linewidth": band_charts.THIN}
    yield ChartLine(label, EMPTY, EMPTY, look)
    for line in _make_lines(columns, x, y, by):
        yield ChartLine("", line.x, line.y, look | ({"color": line.look["color"]} if by else {}))
