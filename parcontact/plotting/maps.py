"""Maps of the last saved instant."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from ..errors import InputError
from ..job import Cylinder, Sphere
from ..parallel.slab import Array
from . import lines, units
from .run import Fields, Panel, Run


class Look(NamedTuple):
    """How a map is drawn: its unit, its colours, and that of points which have no value."""

    unit: str
    colors: str
    blank: str = "0.92"
    note: str = ""


LOOKS = {
    "pressure": Look("Pa", "inferno"),
    "gap": Look("m", "Blues_r", "k", "contact black"),
    "displacement": Look("m", "viridis"),
    "height": Look("m", "cividis", note="up is into the body"),
}
STRIP = 8  # points across: a map as narrow as this is drawn as a line


def maps(run: Run, at: str = "") -> list[Panel]:
    """Panels of the last saved instant, or of the one that is asked for; none if nothing was saved. Raises InputError
    where nothing is saved at the instant that is asked for."""
    try:
        with h5py.File(run.directory / "fields.h5", "r", locking=False) as file:
            return list(_panels(run, Fields(file, at)))
    except (OSError, KeyError):
        if at:
            raise InputError(
                f"--at {at}: {run.directory} holds no maps; output: {{fields: [...]}} saves them"
            ) from None
        return []


def _panels(run: Run, fields: Fields) -> Iterator[Panel]:
    names = ("pressure", "gap", "displacement", "height")
    pressure, gap, displacement, height = (fields.last(name) for name in names)
    if not fields.saved:
        return
    if min(fields.x.size, fields.y.size) <= STRIP:
        if pressure is not None:
            yield lines.strips(run, fields)
        return
    rounds = [shape for shape in run.job.surface if isinstance(shape, Sphere | Cylinder)]
    if pressure is not None and len(run.job.surface) == 1 and rounds:
        yield lines.profiles(run, fields, rounds[0])
    last = fields.shown[-1]
    instant = run.instant(int(fields.steps[last]), float(fields.times[last]))
    window = _window(pressure)
    beside = displacement if gap is None else None  # one of both says enough
    found = {"pressure": pressure, "gap": gap, "displacement": beside, "height": height}
    for name, values in found.items():
        if values is not None:
            yield _map(fields, shown(name, values, pressure), name, instant, window)


def shown(name: str, values: Array, pressure: Array | None) -> Array:
    """A map as it is drawn: pressures where there are any, gaps where there is no contact, none of them negative."""
    if name == "pressure":
        return np.where(values > 0.0, values, np.nan)
    if name == "gap":
        closed = values <= 0.0 if pressure is None else pressure > 0.0
        return np.where(closed, np.nan, np.maximum(values, 0.0))
    return values


def _window(pressure: Array | None) -> tuple[slice, slice]:
    """The rows and columns around a contact that fills only a part of the box; else all of them."""
    window = (slice(None), slice(None))
    if pressure is None or not (pressure > 0.0).any():
        return window
    cut = []
    for axis in (1, 0):
        touched = np.flatnonzero((pressure > 0.0).any(axis=axis))
        margin = (touched[-1] - touched[0]) // 2 + 3
        cut.append(slice(max(touched[0] - margin, 0), touched[-1] + margin + 1))
    whole = pressure[cut[0], cut[1]].size > 0.5 * pressure.size
    return window if whole else (cut[0], cut[1])


def _map(
    fields: Fields,
    values: Array,
    name: str,
    instant: str,
    window: tuple[slice, slice],
) -> Panel:
    x, y, look = fields.x, fields.y, LOOKS[name]
    label, (scaled,) = units.scaled(look.unit, values)
    title = name + (f" ({look.note})" if look.note else "") + f"\n{instant}"
    length, (right, top) = units.scaled("m", edges(x), edges(y))

    def draw(axes: Axes) -> None:
        axes.set_facecolor(look.blank)
        axes.grid(False)
        part = scaled[window]
        columns, lines = slice(window[1].start, _edge(window[1])), slice(window[0].start, _edge(window[0]))
        limits = colour_range(part)
        cells = right[columns], top[lines], part
        mesh = axes.pcolormesh(*cells, cmap=look.colors, norm=norm(limits), rasterized=True)
        axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]", title=title, aspect="equal")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
        beyond = "max" if np.nanmax(part, initial=-np.inf) > limits[1] else "neither"
        add_colorbar(axes, mesh, f"{name} [{label}]", limits, extend=beyond, shrink=0.9)

    return draw


def edges(points: Array) -> Array:
    """Of cells that begin at points of equal spacing."""
    return np.append(points, 2 * points[-1] - points[-2])


def _edge(part: slice) -> int | None:
    return None if part.stop is None else part.stop + 1


def colour_range(values: Array) -> tuple[float, float]:
    """Of the colours: from 0 if nothing is negative; a few very high points do not darken all others.

    Where no point has a value the range is empty, from inf to -inf.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return np.inf, -np.inf
    most, highest = float(np.percentile(finite, 99.5)), float(finite.max())
    return min(float(finite.min()), 0.0), highest if highest < 1.4 * most else most


def norm(limits: tuple[float, float]) -> Normalize:
    """The colours of a range, which may be one number or empty."""
    low, high = limits
    return Normalize(low, high) if high > low else Normalize(high, high + 1.0) if high == low else Normalize(0.0, 1.0)


def add_colorbar(axes: Axes, mesh: QuadMesh, label: str, limits: tuple[float, float], **look: Any) -> None:
    """What colours mean: of one number that alone, of none nothing, for a scale would be made up."""
    low, high = limits
    if low <= high:
        bar = axes.figure.colorbar(mesh, ax=axes, label=label, **look)
        if low == high:
            bar.set_ticks([low])
