"""Friction curves: what steady.csv holds, over velocity, or over pressure where that is what changes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...parallel.slab import Array
from . import style, units
from .charts import FRACTION, Axis, Chart, Series
from .run import box, table

TABLE = "steady.csv"


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
    contact = columns["contact_area"] * (area or 1.0)
    shown = (
        ("friction", Axis("friction coefficient"), columns["friction"]),
        ("area", Axis("contact area", "m²") if area else Axis(FRACTION), contact),
    )
    return [
        Chart(
            f"steady {key}",
            along[0],
            axis,
            _lines(along[1], other, values),
            log_x=True,
            legend_title=title,
        )
        for (key, axis, values), title in zip(shown, ("steady, at", ""), strict=True)
    ]


def _lines(x: Array, other: tuple[Axis, Array], y: Array) -> list[Series]:
    found = []
    for number, value in enumerate(distinct(other[1])):
        rows = np.flatnonzero(np.abs(other[1] - value) <= 1e-6 * value)
        rows = rows[np.argsort(x[rows], kind="stable")]
        look = {**style.line(number), "marker": "o"}
        found.append(Series(units.text(value, other[0].unit), x[rows], y[rows], look))
    return found


def distinct(values: Sequence[float] | Array) -> list[float]:
    """Sorted values; those that differ by round-off only are one."""
    found: list[float] = []
    for value in sorted(float(value) for value in values):
        if not found or value - found[-1] > 1e-6 * value:
            found.append(value)
    return found
