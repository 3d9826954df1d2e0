"""Pictures of leakage: the flow through the gap, and conductivity as a function of load or time.

Marks show where contact closes the gap, or where the constriction is too narrow for continuum flow.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ...columns import UNITS
from ...parallel.slab import Array
from ...results import style
from ...results.panels import Axis, Colors, Line, Panel, picture
from ...results.plotted_run import Abscissa, PlottedRun
from . import FLOWS
from .flow import FloatMap, Flow

CONTINUUM = 1e-8  # physics: gap of about thirty molecules of water, the least for continuum flow [m]
THIN = "constriction\nunder 10 nm"
THIN_LOOK: dict[str, Any] = {"color": style.GREY, "linestyle": "none", "marker": "o", "mfc": "none", "ms": 8}


def is_thin(constriction: Any) -> Any:
    """Return True where a constriction [m] is open but too narrow for continuum flow. The shape is that of the
    argument."""
    return (constriction > 0.0) & (constriction < CONTINUUM)


def conductivity_panel(
    over: Axis,
    at: Array,
    flows: Mapping[str, Array],
    constrictions: Mapping[str, Array],
    log_x: bool = False,
    dotted: Mapping[str, Array] = MappingProxyType({}),
) -> Panel:
    """Return a panel of conductivities K [m^3] on the axis `over`. `at`, each array of `flows` and of `dotted`, and
    each array of `constrictions` [m] have the shape (n,). Marks show where the critical constriction of the same name
    is too narrow for continuum flow.

    K is 0 where contact closes the gap, and NaN where it is not known. Conductivities in `dotted` are drawn as dotted
    lines, with colours in the same order as those of `flows`.
    """
    lines, thin = list[Line](), list[Line]()
    for number, (name, flow) in enumerate(flows.items()):
        known = np.isfinite(flow)
        lines.append(Line(name, at[known], flow[known], style.line(number) | {"marker": "."}))
        narrow = known & (flow > 0.0) & is_thin(constrictions[name])
        if narrow.any():
            thin.append(Line(THIN * (not thin), at[narrow], flow[narrow], THIN_LOOK))
    for number, (name, flow) in enumerate(dotted.items()):
        lines.append(Line(name, at[flow > 0.0], flow[flow > 0.0], style.line(number) | {"linestyle": ":"}))
    return Panel("leakage", over, Axis("conductivity K", "m³"), lines + thin, log_x=log_x, zeros="closed")


RING: dict[str, Any] = {"marker": "o", "mfc": "none", "mec": "r", "ms": 11, "mew": 1.5}
SHARE = Axis("flow over its largest")
DECADES = 3  # decades of the flow on the colour scale
SAME = 1e-6  # rounding: relative difference below which pressures are the same
KEYS = ("leakage", "leak")  # names of panels for --panels
KINDS = ("flow", "constriction")  # kinds of columns per direction
LONG = 100.0  # ratio of times above which their axis is logarithmic


def panels(run: PlottedRun, along: Abscissa) -> Iterator[Panel]:
    """Yield the panel of a run's conductivities if the gap is open at any time. If the fluid carries a part of the
    load, also yield the panel of the leak against the fluid pressure."""
    columns = run.columns
    names = {name: label for name, label in FLOWS.items() if name in columns}
    if names and max(np.nanmax(columns[name], initial=0.0) for name in names) > 0.0:
        rows = slice(None) if along.rows is None else along.rows
        flows = {label: columns[name][rows] for name, label in names.items()}
        narrowest = dict.fromkeys(flows, columns["constriction"][rows])
        yield conductivity_panel(along.axis, along.values, flows, narrowest)
        if "fluid_pressure" in columns:
            yield from _leak_over_pressure(run)


def _leak_over_pressure(run: PlottedRun) -> Iterator[Panel]:
    """Yield the panel of the leak under the last load, against the high pressure of the fluid, if this pressure
    changes. A dotted line shows the leak if contact carries all of this load; it is left out if the run has no row with
    this contact."""
    section, columns = run.job.section("leakage"), run.columns
    load = columns["pressure"][-1]
    loaded = (np.abs(columns["pressure"] - load) <= SAME * abs(load)) & (columns["rounds"] > 0)
    high, low = (columns[f"{end}_pressure"] for end in ("high", "low"))
    flowing = loaded & (high > low)
    if flowing.sum() < 2 or not np.ptp(high[flowing]):
        return
    lines = [Line("total load", high[flowing], columns["flow_rate"][flowing], style.line(0) | {"marker": "."})]
    net = np.flatnonzero(loaded & (columns["fluid_pressure"] == 0.0) & (high == low))
    if net.size:
        ends = zip(high[flowing].tolist(), low[flowing].tolist(), strict=True)
        drops = (section.drop(each) for each in ends)
        alone = [drop.flow_rate(float(columns["flow_x"][net[0]]), *run.job.grid.size) for drop in drops]
        lines.append(Line("net load", high[flowing], np.array(alone), style.line(0) | {"linestyle": ":"}))
    axes = Axis("high pressure", "Pa"), Axis("leak", "m³/s")
    yield Panel("leak", *axes, lines, zeros="closed")


def draw_leakage(
    path: Path,
    size: tuple[float, float],
    gap: FloatMap,
    flows: Sequence[Flow],
    fluxes: Sequence[FloatMap],
    instant: str,
    rows: Sequence[Any],
    over: str = "",
) -> None:
    """Draw the flow along x and y on the map of the gap at an instant, and K of all instants, into the file `path`."""
    circled = ", constriction circled" * any(flow.percolates for flow in flows)
    title = f"flow through the gap, {instant}\ncontact black{circled}"
    curve = [panel_of(rows, over)] if any(row.constriction > 0.0 for row in rows[1:]) else []
    maps = [_flow_map(axis, size, gap, flow, flux) for axis, flow, flux in zip("xy", flows, fluxes, strict=True)]
    with style.drawing():
        style.save_figure(picture(title, [maps, curve] if curve else [maps]), path)


def panel_of(rows: Sequence[Any], over: str) -> Panel:
    """Return the panel of K against `over`, which is pressure or time. If `over` is '', K is drawn against time if
    successive instants have the same pressure, else against pressure.

    If the pressure stays constant over several instants, the panel against pressure shows only the last of these
    instants.
    """
    columns = {name: np.array([getattr(row, name) for row in rows]) for name in rows[0]._fields}
    pressure, time = columns["pressure"], columns["time"]
    same = SAME * float(np.nanmax(np.abs(pressure), initial=0.0))
    different = np.abs(np.diff(pressure)) > same
    over = over or ("pressure" if different.all() or not np.ptp(time) else "time")
    kept = np.append(different, True) if over == "pressure" else np.full(len(rows), True)
    at = columns[over][kept]
    flows, narrowest = ({f"along {axis}": columns[f"{name}_{axis}"][kept] for axis in "xy"} for name in KINDS)
    parts = columns["parts"][kept]  # shape (n, 0), or (n, 2, 2) if the fluid carries a part of the load
    dotted = {f"{name}, net load": parts[:, k, 0] for k, name in enumerate(flows)} if parts.size else {}
    flows = {name: parts[:, k, 1] for k, name in enumerate(flows)} if parts.size else flows
    later = at[at > 0.0]
    log_x = over == "time" and later.size > 0 and bool(later.max() > LONG * later.min())
    return conductivity_panel(Axis(over, UNITS[over]), at, flows, narrowest, log_x, dotted)


def _flow_map(axis: str, size: tuple[float, float], gap: FloatMap, flow: Flow, flux: FloatMap) -> Panel:
    """Return the panel of the flow through a gap, divided by its largest value, with a ring around the constriction."""
    ring, least, shown = list[Line](), 2.0, np.full_like(gap, np.nan)  # without a path no bar of colours
    if flow.position is not None:
        cell = zip(flow.position[::-1], size, gap.shape[::-1], strict=True)
        x, y = (np.array([(k + 0.5) * length / n]) for k, length, n in cell)
        ring.append(Line("", x, y, RING))
        most = float(np.nanpercentile(flux, 99.9)) or 1.0  # all the flow may be in fewer cells
        least, shown = 10.0**-DECADES, flux / most
    where = (0.0, size[0], 0.0, size[1])
    colors = Colors(shown, where, SHARE, least, 1.0, blank="k", log=True, behind=np.where(gap > 0.0, gap, np.nan))
    title = f"along {axis}" if flow.percolates else f"along {axis}: closed, no path"
    return Panel("flow", Axis("x", "m"), Axis("y", "m"), ring, title, colors=colors)


def flux(gap: FloatMap, pressure: FloatMap, size: tuple[float, float]) -> FloatMap:
    """Return the map of |g^3 grad p| in open cells, divided by its maximum, in single precision; NaN where no fluid
    flows."""
    slopes = []
    for axis, length in ((0, size[1]), (1, size[0])):
        faces = np.nan_to_num(np.diff(pressure, axis=axis)) * (pressure.shape[axis] / length)  # no flow into walls
        none = np.zeros_like(np.take(pressure, [0], axis))
        slopes.append(0.5 * (np.concatenate([none, faces], axis) + np.concatenate([faces, none], axis)))
    shape = gap / (np.nanmax(gap, initial=0.0) or 1.0)  # the cube of a small gap [m] underflows
    found = np.where(np.isfinite(pressure), shape**3 * np.hypot(*slopes), np.nan)
    most = np.nanmax(found, initial=0.0)
    return np.asarray(found / most if most > 0.0 else found, dtype=np.float32)
