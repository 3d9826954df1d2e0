"""Maps of saved instants: panels of one instant, and frames of all for movies and reports."""

import io
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from PIL import Image

from ..effects.contact_law import touching_of
from ..errors import InputError
from ..job import Job
from ..parallel.slab import Array
from . import lines, prefixes, style
from .plotted_run import Fields, PlottedRun

Window = tuple[slice, slice]


class Look(NamedTuple):
    """Style of a map: its unit, its colours, and the colour of points without a value."""

    unit: str
    colors: str
    blank: str = "0.92"
    note: str = ""


LOOKS = {
    "pressure": Look("Pa", "inferno"),
    "gap": Look("m", "Blues_r", "k", " (contact black)"),
    "displacement": Look("m", "viridis"),
    "height": Look("m", "cividis", note=" (up is into the body)"),
    "fluid_pressure": Look("Pa", "viridis", "k", " (contact black)"),
    "temperature": Look("K", "hot", note=" rise"),
    "traction": Look("Pa", "inferno"),
    "slip": Look("", "viridis", note=": traction over its bound"),
}
TRACTIONS = ("traction_x", "traction_y")
STICK_MAPS = ("traction", "slip")  # drawn from both components and the pressure
OUTSIDE = ("gap", "fluid_pressure")  # drawn outside of contact
ROUNDING = 1e-6  # rounding: of a pressure, over the highest
TENSION = "RdBu_r"  # colours of pressures of both signs
STRIP = 8  # most points across of a map that is drawn as a line
BAR = 0.9  # height of a bar of colours over that of its map
WIDE = 2.0  # width over height of maps of which each has a row
TICKS = 5  # most intervals of ticks, fixed so that the layout does not change
BRIGHTEST, OUTLIER = 99.5, 1.4  # percentile, and the ratio to it above which points do not set the colour range


def map_panels(run: PlottedRun, at: str = "") -> tuple[list[list[style.Panel]], list[style.Panel]]:
    """Return groups of panels, of pressures on a line and of wide maps, and panels of the other saved maps of one
    instant, or of tractions on a line.

    The default instant is the last one; for contacts that end in detachment, the pull-off or the largest load. Raises
    InputError if nothing is saved at the instant `at`.
    """
    try:
        with run.open_maps() as file:
            fields = Fields(file, at, until=run.telling_step)
            narrow = min(fields.x.size, fields.y.size) <= STRIP
            pressures = list(lines.line_panels(run, fields, narrow)) if fields.read("pressure") is not None else []
            if narrow:
                return [pressures], list(lines.traction_panels(run, fields))
            found = list(_panels(run, fields)) if fields.saved else []
            wide = run.job.grid.lx > WIDE * run.job.grid.ly
            return ([pressures, *([one] for one in found)], []) if wide else ([pressures], found)
    except (OSError, KeyError):
        if at:
            message = f"--at {at}: {run.path} has no maps; save them by output: {{fields: [...]}}"
            raise InputError(message) from None
        return [], []


def _panels(run: PlottedRun, fields: Fields) -> Iterator[style.Panel]:
    found = {name: fields.read(name) for name in (*LOOKS, *TRACTIONS)}
    pressure, (x, y) = found["pressure"], (found.pop(name) for name in TRACTIONS)
    if pressure is not None and x is not None and y is not None:
        found["traction"], found["slip"] = stick_maps(np.hypot(x, y), pressure, run.job)
    if found["gap"] is not None:
        del found["displacement"]  # displacement and gap show the same
    instant = run.instant(int(fields.steps[fields.chosen]), float(fields.times[fields.chosen]))
    for name, values in found.items():
        if values is not None:
            yield _panel(fields, name, mask(name, values, pressure, run.job), instant, _find_window(pressure))


def _panel(fields: Fields, name: str, values: Array, instant: str, window: Window) -> style.Panel:
    rows, columns = window
    part = values[window]
    limits = find_range(part)

    def draw(axes: Axes) -> None:
        beyond = "max" if np.nanmax(part, initial=-np.inf) > limits[1] else "neither"
        show = _draw_map(axes, name, (fields.x[columns], fields.y[rows]), limits, extend=beyond)
        show(part)
        axes.set_title(f"{_words(name)}{LOOKS[name].note}\n{instant}")

    return draw


def _words(name: str) -> str:
    return name.replace("_", " ")


def mask(name: str, values: Array, pressure: Array | None, job: Job) -> Array:
    """Return a map for drawing, NaN at points without a value.

    Pressures are drawn where they are positive, with adhesion everywhere; gaps outside of contact, or where they are
    positive if there are no pressures; the pressure of a fluid outside of contact.
    """
    if name == "pressure":
        return values if (values < 0.0).any() else np.where(values > 0.0, values, np.nan)
    if name == "gap":
        closed = values <= 0.0 if pressure is None else touching_of(job, pressure, values)
        return np.where(closed, np.nan, np.maximum(values, 0.0))
    if name == "fluid_pressure" and pressure is not None:  # the rest of the pressure is that of contact
        return np.where(pressure - values > ROUNDING * np.abs(pressure).max(), np.nan, values)
    return values


def stick_maps(traction: Array, pressure: Array, job: Job) -> tuple[Array, Array]:
    """Return the sizes of tractions where there is pressure, and their ratios to the bound of traction, which are 1
    where points slip. The bound is the coefficient times the pressure, or for a shear strength the largest traction."""
    touching, coefficient = pressure > 0.0, job.section("interface").coefficient
    bound = np.full(pressure.shape, traction.max()) if coefficient is None else coefficient * pressure
    share = np.divide(traction, bound, out=np.zeros_like(traction), where=bound > 0.0)
    return np.where(touching, traction, np.nan), np.where(touching, share, np.nan)


def _find_window(pressure: Array | None) -> Window:
    """Return the rows and columns around a contact that fills only part of the box; else all."""
    whole = slice(None), slice(None)
    if pressure is None or not (pressure > 0.0).any() or (pressure < 0.0).any():
        return whole
    cut = []
    for axis in (1, 0):
        touched = np.flatnonzero((pressure > 0.0).any(axis=axis))
        margin = (touched[-1] - touched[0]) // 2 + 3
        cut.append(slice(max(touched[0] - margin, 0), touched[-1] + margin + 1))
    return whole if pressure[cut[0], cut[1]].size > 0.5 * pressure.size else (cut[0], cut[1])


def find_range(values: Array) -> tuple[float, float]:
    """Return the range of the colours; a few very high values do not extend it.

    It begins at 0 if no value is negative, and is symmetric if pressures have both signs. It is (inf, -inf) if no point
    has a value.
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return np.inf, -np.inf
    above = finite[finite > 0.0] if finite.min() < 0.0 < finite.max() else finite
    most, highest = float(np.percentile(above, BRIGHTEST)), float(above.max())
    return min(float(finite.min()), 0.0), highest if highest < OUTLIER * most else most


def _draw_map(
    axes: Axes, name: str, points: tuple[Array, Array], limits: tuple[float, float], **bar: Any
) -> Callable[[Array], None]:
    """Draw an empty colour map, and return a function that fills it. The scale of a single value has one tick."""
    look, (low, high) = LOOKS[name], limits
    if name == "pressure" and low < 0.0:  # white at pressure 0
        look, low, high = look._replace(colors=TENSION), min(low, -high), max(-low, high)
    width = 1.0 if high < low else (high - low or abs(high) or 1.0)
    norm = Normalize(low, low + width) if low <= high else Normalize(0.0, width)
    x, y = (np.append(along, 2 * along[-1] - along[-2]) for along in points)
    axes.set_facecolor(look.blank)
    axes.grid(False)
    empty = np.full((y.size - 1, x.size - 1), np.nan)
    mesh = axes.pcolormesh(x, y, empty, cmap=look.colors, norm=norm, rasterized=True)
    for axis, along in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        axis.set_major_locator(MaxNLocator(TICKS - (along == "x"), steps=[1, 2, 5, 10]))
    height = prefixes.label_map(axes, (x[-1] - x[0], y[-1] - y[0]))
    if low <= high:
        ticks = [low] if low == high else MaxNLocator(TICKS, steps=[1, 2, 5, 10])
        scale = axes.figure.colorbar(mesh, ax=axes, ticks=ticks, shrink=BAR * height, **bar).ax.yaxis
        prefixes.label(scale, _words(name), look.unit)
    return mesh.set_array


def _draw_line(
    axes: Axes, name: str, points: tuple[Array, Array], limits: tuple[float, float]
) -> Callable[[Array], None]:
    """Draw an empty line for a narrow map, and return a function that fills it."""
    lies = points[0].size > points[1].size
    along, (low, high) = points[0] if lies else points[1], limits
    (line,) = axes.plot(along, np.zeros_like(along), color=style.BLUE)
    if high > low:
        axes.set_ylim(low, low + 1.05 * (high - low))
    else:  # there are no values for a scale
        axes.set_yticks([low if high == low else 0.0])
    prefixes.label(axes.xaxis, "x" if lies else "y", "m")
    prefixes.label(axes.yaxis, _words(name), LOOKS[name].unit)
    return lambda values: line.set_ydata(np.nan_to_num(values[0] if lies else values[:, 0]))


def dataset_of(file: h5py.File, name: str) -> str:
    """Return the name of the data set of a map in a file, '' if there is none; temperatures may have two names."""
    return next((key for key in (f"{name}_map", name) if key in file and file[key].ndim > 1), "")


def drawn_maps(file: h5py.File) -> list[str]:
    """Return the names of the maps that can be drawn from a file of fields."""
    sticks = all(key in file for key in (*TRACTIONS, "pressure"))
    return [name for name in LOOKS if dataset_of(file, name) or (sticks and name in STICK_MAPS)]


def draw_frames(
    file: h5py.File,
    name: str,
    labels: Mapping[int, str],
    job: Job,
    size: tuple[float, float] = (4.5, 4.0),
    dpi: int = 110,
) -> Iterator[Image.Image]:
    """Draw a saved map of shape (instant, y, x) at each index that has a label, with one range of colours."""

    def read(index: int) -> Array:
        if name in STICK_MAPS:
            size = np.hypot(*(file[part][index] for part in TRACTIONS))
            return stick_maps(size, file["pressure"][index], job)[STICK_MAPS.index(name)]
        pressure = file["pressure"][index] if name in OUTSIDE and "pressure" in file else None
        return mask(name, file[dataset_of(file, name)][index], pressure, job)

    ranges = [find_range(read(index)) for index in labels]
    limits = min(low for low, _ in ranges), max(high for _, high in ranges)
    figure, x, y = Figure(figsize=size, layout="constrained"), file["x"][...], file["y"][...]
    axes = figure.subplots()
    fill = (_draw_line if min(x.size, y.size) <= STRIP else _draw_map)(axes, name, (x, y), limits)
    for index, label in labels.items():
        fill(read(index))
        axes.set_title(f"{_words(name)}, {label}")
        if figure.get_layout_engine() is not None:  # the layout of the first frame is kept for all
            style.arrange(figure)
            figure.set_layout_engine(None)
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=dpi)
        yield Image.open(png).convert("RGB")
