"""A saved map, one instant after the other, in one figure with one range of colours."""

from collections.abc import Sequence

import h5py
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..parallel.slab import Array
from . import maps, style, units


class Frames:
    """Maps of shape (instant, y, x) in a file, of which those with the indices `chosen` are to be shown.

    `figure` shows one at a time: the last for which `show` was called.
    """

    def __init__(self, file: h5py.File, name: str, chosen: Sequence[int], size: tuple[float, float] = (4.5, 4.0)):
        self.file, self.name, look = file, name, maps.LOOKS[name]
        ranges = [maps.colour_range(self._map(index)) for index in chosen]
        low, high = min(lowest for lowest, _ in ranges), max(highest for _, highest in ranges)
        label, _ = units.scaled(look.unit, np.array([low, high]))
        self.figure = Figure(figsize=size, layout="constrained")
        self.axes, self.scale = self.figure.subplots(), units.size_of(label, look.unit) if label else 1.0
        x, y, limits = file["x"][...], file["y"][...], (low / self.scale, high / self.scale)
        draw = _Line if min(x.size, y.size) <= maps.STRIP else _Image
        self._frame = draw(self.axes, (x, y), limits, units.labelled(name, label), look)
        self._is_laid_out = False

    def show(self, index: int, title: str) -> None:
        """Put the map of this index into the figure."""
        self._frame.show(self._map(index) / self.scale)
        self.axes.set_title(title)
        if not self._is_laid_out:  # once: the first frame has the place of all others
            self.figure.draw_without_rendering()
            self.figure.set_layout_engine("none")
            self._is_laid_out = True

    def _map(self, index: int) -> Array:
        pressure = self.file["pressure"][index] if self.name == "gap" and "pressure" in self.file else None
        return maps.shown(self.name, self.file[self.name][index], pressure)


class _Image:
    """A map in colours."""

    def __init__(
        self, axes: Axes, points: tuple[Array, Array], limits: tuple[float, float], label: str, look: maps.Look
    ) -> None:
        length, (x, y) = units.scaled("m", *(maps.edges(values) for values in points))
        axes.set_facecolor(look.blank)
        axes.grid(False)
        empty = np.zeros((y.size - 1, x.size - 1))
        self.mesh = axes.pcolormesh(x, y, empty, cmap=look.colors, norm=maps.norm(limits))
        axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]", aspect="equal")
        maps.add_colorbar(axes, self.mesh, label, limits)

    def show(self, values: Array) -> None:
        self.mesh.set_array(values)


class _Line:
    """A map so narrow that it is a line."""

    def __init__(
        self, axes: Axes, points: tuple[Array, Array], limits: tuple[float, float], label: str, look: maps.Look
    ) -> None:
        x, y = points
        self.lies = x.size > y.size
        length, (along,) = units.scaled("m", x if self.lies else y)
        (self.line,) = axes.plot(along, np.zeros_like(along), color=style.BLUE)
        axes.set(xlabel=f"{'x' if self.lies else 'y'} [{length}]", ylabel=label)
        if limits[1] > limits[0]:
            axes.set_ylim(limits[0], limits[0] + 1.05 * (limits[1] - limits[0]))
        else:  # a scale would be made up
            axes.set_yticks([limits[0]] if limits[1] == limits[0] else [0.0])

    def show(self, values: Array) -> None:
        self.line.set_ydata(np.nan_to_num(values[0] if self.lies else values[:, 0]))
