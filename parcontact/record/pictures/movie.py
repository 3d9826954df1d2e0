"""A movie of a map over its saved instants, as a GIF with one range of colours."""

from pathlib import Path

import h5py
import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ...errors import InputError
from ...parallel.slab import Array
from .. import hdf5
from . import maps, style, units
from .run import Fields

FRAMES = 200  # at most: instants in between are left out
SECONDS = 8.0  # for which it plays, unless its frames are too few
FASTEST, SLOWEST = 20, 2  # frames per second
UNITS = {"pressure": "Pa"}  # all other maps are lengths [m]


def make(directory: Path, name: str, target: Path) -> Path:
    """Draw all saved instants of a map; returns the movie's path. Raises InputError where there is none."""
    path = directory / "fields.h5"
    try:
        with h5py.File(path, "r", locking=False) as file:
            fields = Fields(file)
            there = [key for key in ("pressure", "displacement", "gap", "height") if key in file]
            if name not in there or not fields.saved:
                raise InputError(f"{path} holds no map of {name}: {', '.join(there) or 'nothing'} was saved")
            _make(fields, name, target)
    except hdf5.FAILURES as error:
        raise InputError(f"no movie from {path}: {hdf5.reason(error)}") from error
    return target


def _make(fields: Fields, name: str, target: Path) -> None:
    count = min(len(fields.saved), FRAMES)
    chosen = [fields.saved[int(k)] for k in np.linspace(0, len(fields.saved) - 1, count)]
    unit = UNITS.get(name, "m")
    ranges = [maps.colour_range(_map(fields, name, index)) for index in chosen]
    low, high = min(lowest for lowest, _ in ranges), max(highest for _, highest in ranges)
    label, _ = units.scaled(unit, np.array([low, high]))
    writer = PillowWriter(fps=min(max(round(count / SECONDS), SLOWEST), FASTEST))
    figure = Figure(figsize=(4.5, 4.0), layout="constrained")
    axes = figure.subplots()
    size = units.size_of(label, unit)
    draw = _Line if min(fields.x.size, fields.y.size) <= maps.STRIP else _Image
    frame = draw(axes, fields, (low / size, high / size), units.labelled(name, label), blank=name == "pressure")
    with writer.saving(figure, str(target), dpi=110):
        for index in chosen:
            frame.show(_map(fields, name, index) / size)
            axes.set_title(f"{name} at {units.text(float(fields.file['t'][index]), 's')}, step {fields.steps[index]}")
            writer.grab_frame()


def _map(fields: Fields, name: str, index: int) -> Array:
    values: Array = fields.file[name][index]
    return values


class _Image:
    """A map in colours."""

    def __init__(self, axes: Axes, fields: Fields, limits: tuple[float, float], label: str, blank: bool) -> None:
        self.blank = blank
        length, (x, y) = units.scaled("m", maps.edges(fields.x), maps.edges(fields.y))
        axes.set_facecolor("0.92")
        axes.grid(False)
        empty = np.zeros((y.size - 1, x.size - 1))
        self.mesh = axes.pcolormesh(x, y, empty, cmap="inferno" if blank else "viridis", norm=Normalize(*limits))
        axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]", aspect="equal")
        axes.figure.colorbar(self.mesh, ax=axes, label=label)

    def show(self, values: Array) -> None:
        self.mesh.set_array(np.where(values > 0.0, values, np.nan) if self.blank else values)


class _Line:
    """A map so narrow that it is a line."""

    def __init__(self, axes: Axes, fields: Fields, limits: tuple[float, float], label: str, blank: bool) -> None:
        self.lies = fields.x.size > fields.y.size
        length, (along,) = units.scaled("m", fields.x if self.lies else fields.y)
        (self.line,) = axes.plot(along, np.zeros_like(along), color=style.BLUE)
        axes.set(xlabel=f"{'x' if self.lies else 'y'} [{length}]", ylabel=label)
        axes.set_ylim(limits[0], limits[0] + 1.05 * (limits[1] - limits[0]))

    def show(self, values: Array) -> None:
        self.line.set_ydata(values[0] if self.lies else values[:, 0])
