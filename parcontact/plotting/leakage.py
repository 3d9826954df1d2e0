"""A picture of leakage: where the fluid flows through the gap, and how much over load or time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from ..leakage.flow import Leak, Map
from . import style, units

DECADES = 3  # of the flow that are told apart by colour
LONG = 100.0  # ratio of times, beyond which their axis is logarithmic


def draw(path: Path, size: tuple[float, float], gap: Map, found: Leak, instant: str, rows: Sequence[Any]) -> Path:
    """Draw the flow of the direction that leaks more on the map of the gap at an instant, and K of all instants."""
    along_x = found.flow_x >= found.flow_y
    flow = found.along_x if along_x else found.along_y

    def flow_map(axes: Axes) -> None:
        ends = (0.0, size[0], 0.0, size[1])
        axes.set_facecolor("k")
        look: dict[str, Any] = {"extent": ends, "origin": "lower", "interpolation": "nearest"}
        axes.imshow(np.where(gap > 0.0, gap, np.nan), cmap="Greys_r", alpha=0.5, **look)
        speed = _flux(gap, flow.pressure, size)
        if np.isfinite(speed).any():
            most = float(np.nanpercentile(speed, 99.9))
            drawn = axes.imshow(speed / most, cmap="viridis", norm=LogNorm(10.0**-DECADES, 1.0), **look)
            axes.figure.colorbar(drawn, ax=axes, shrink=0.9, label="flow over its largest")
            row, column = flow.position or (0, 0)
            cell = size[0] / gap.shape[1], size[1] / gap.shape[0]
            axes.plot((column + 0.5) * cell[0], (row + 0.5) * cell[1], "o", mfc="none", mec="r", ms=11, mew=1.5)
        axes.grid(False)
        for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
            units.label(axis, name, "m")
        state = "constriction circled" if flow.percolates else "no path from end to end"
        axes.set_title(f"flow along {'x' if along_x else 'y'}, {instant}\ncontact black, {state}")

    def over(axes: Axes) -> None:
        columns = {name: np.array([getattr(row, name) for row in rows]) for name in rows[0]._fields}
        over_time = np.unique(columns["pressure"]).size < np.unique(columns["time"]).size
        name, unit = ("time", "s") if over_time else ("pressure", "Pa")
        for number, direction in enumerate("xy"):
            conductivity = np.where(columns[f"flow_{direction}"] > 0.0, columns[f"flow_{direction}"], np.nan)
            axes.plot(columns[name], conductivity, marker=".", label=f"along {direction}", **style.line(number))
        axes.set_yscale("log")
        units.label(axes.xaxis, name, unit)
        axes.set_ylabel("K [m³]")
        axes.set_title("conductivity of the gap")
        times = columns[name][columns[name] > 0.0]
        if over_time and times.size and times.max() > LONG * times.min():
            axes.set_xscale("log")
        axes.legend()

    with style.drawing():
        panels = [flow_map, over] if len(rows) > 1 else [flow_map]
        return style.save(style.figure_of("", [panels]), path)


def _flux(gap: Map, pressure: Map, size: tuple[float, float]) -> Map:
    """Return the magnitude of g^3 grad p in wet cells, NaN elsewhere."""
    slopes = []
    for axis, length in ((0, size[1]), (1, size[0])):
        faces = np.nan_to_num(np.diff(pressure, axis=axis)) * (pressure.shape[axis] / length)  # none into a wall
        none = np.zeros_like(np.take(pressure, [0], axis))
        slopes.append(0.5 * (np.concatenate([none, faces], axis) + np.concatenate([faces, none], axis)))
    return np.asarray(np.where(np.isfinite(pressure), gap**3 * np.hypot(*slopes), np.nan))
