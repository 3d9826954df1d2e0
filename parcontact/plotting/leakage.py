"""A picture of leakage: where the fluid flows through the gap, and how much over load or time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from ..leakage.flow import Flow, Map
from . import style, units
from .style import Panel

DECADES = 3  # of the flow that are told apart by colour
LONG = 100.0  # ratio of times, beyond which their axis is logarithmic


def draw(
    path: Path,
    size: tuple[float, float],
    gap: Map,
    flows: Sequence[Flow],
    fluxes: Sequence[Map],
    instant: str,
    rows: Sequence[Any],
) -> Path:
    """Draw the flow along x and along y on the map of the gap at an instant, and K of all instants."""

    def flow_map(axis: str, flow: Flow, flux: Map) -> Panel:
        def panel(axes: Axes) -> None:
            _draw_flow(axes, size, gap, flow, flux)
            axes.set_title(f"along {axis}" if flow.percolates else f"along {axis}: closed, no path")

        return panel

    def over(axes: Axes) -> None:
        columns = {name: np.array([getattr(row, name) for row in rows]) for name in rows[0]._fields}
        over_time = np.unique(columns["pressure"]).size < np.unique(columns["time"]).size
        name, unit = ("time", "s") if over_time else ("pressure", "Pa")
        for number, direction in enumerate("xy"):
            conductivity = np.where(columns[f"flow_{direction}"] > 0.0, columns[f"flow_{direction}"], np.nan)
            closed = np.count_nonzero(np.isnan(conductivity))
            label = f"along {direction}" + f", closed at {closed} of {len(rows)} instants" * bool(closed)
            axes.plot(columns[name], conductivity, marker=".", label=label, **style.line(number))
        axes.set_yscale("log")
        units.label(axes.xaxis, name, unit)
        axes.set_ylabel("K [m³]")
        axes.set_title("conductivity of the gap")
        times = columns[name][columns[name] > 0.0]
        if over_time and times.size and times.max() > LONG * times.min():
            axes.set_xscale("log")
        axes.legend()

    with style.drawing():
        circled = ", constriction circled" * any(flow.percolates for flow in flows)
        title = f"flow through the gap, {instant}\ncontact black{circled}"
        curve = [over] if len(rows) > 1 and any(row.constriction > 0.0 for row in rows) else []
        maps = [flow_map(axis, flow, flux) for axis, flow, flux in zip("xy", flows, fluxes, strict=True)]
        return style.save(style.figure_of(title, [maps, curve] if curve else [maps]), path)


def _draw_flow(axes: Axes, size: tuple[float, float], gap: Map, flow: Flow, flux: Map) -> None:
    """Draw where a fluid flows through a gap, as a share of the largest flow, and circle the constriction."""
    axes.set_facecolor("k")
    look: dict[str, Any] = {"extent": (0.0, size[0], 0.0, size[1]), "origin": "lower", "interpolation": "nearest"}
    axes.imshow(np.where(gap > 0.0, gap, np.nan), cmap="Greys_r", alpha=0.5, **look)
    if flow.position is not None:
        most = float(np.nanpercentile(flux, 99.9))
        drawn = axes.imshow(flux / most, cmap="viridis", norm=LogNorm(10.0**-DECADES, 1.0), **look)
        axes.figure.colorbar(drawn, ax=axes, shrink=0.7, label="flow over its largest")
        row, column = flow.position
        cell = size[0] / gap.shape[1], size[1] / gap.shape[0]
        axes.plot((column + 0.5) * cell[0], (row + 0.5) * cell[1], "o", mfc="none", mec="r", ms=11, mew=1.5)
    axes.grid(False)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        units.label(axis, name, "m")


def flux(gap: Map, pressure: Map, size: tuple[float, float]) -> Map:
    """Return the magnitude of g^3 grad p in wet cells, NaN elsewhere, over the largest; in single precision."""
    slopes = []
    for axis, length in ((0, size[1]), (1, size[0])):
        faces = np.nan_to_num(np.diff(pressure, axis=axis)) * (pressure.shape[axis] / length)  # none into a wall
        none = np.zeros_like(np.take(pressure, [0], axis))
        slopes.append(0.5 * (np.concatenate([none, faces], axis) + np.concatenate([faces, none], axis)))
    found = np.where(np.isfinite(pressure), gap**3 * np.hypot(*slopes), np.nan)
    most = np.nanmax(found, initial=0.0)
    return np.asarray(found / most if most > 0.0 else found, dtype=np.float32)
