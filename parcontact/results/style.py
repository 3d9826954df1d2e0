"""Style and units of pictures.

* Style of all pictures: readable at a width of 8 cm, in colours for colour-blind readers.
* Units of axes with a prefix that suits the numbers: 1.04 kPa, not 0.00104167 MPa.
"""

import math
import textwrap
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.container import BarContainer
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import (
    FixedFormatter,
    FixedLocator,
    FuncFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
)
from matplotlib.transforms import ScaledTranslation

from ..files import files
from ..printed import LONG_TIME, TIMES, prefixed, printable

Draw = Callable[[Axes], None]  # draws one panel

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito 2008, no yellow
DASHES = ("-", "--", "-.", ":")  # with the colours, for black and white prints
MARKERS = "os^DvP*X<>"  # marks of lines of one colour, in the same order
BLUE, RED, GREEN, *_ = COLORS
GREY = "0.4"
SEQUENCE, LIGHTEST = "viridis", 0.9  # colour map for quantities in an order, such as instants, and its used part
WIDTH, HEIGHT = 5.8, 2.25  # width of a picture, height of a row of panels [inch]
COLUMNS, MANY_PANELS = (2, 3), 8  # panels per row of few and of many panels, and the most panels that are few
LINE = 68  # most letters in a line of a title
DPI, SMALL = 200, 8  # points per inch of a picture; size of small letters [points]
RC: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlepad": 9,  # above the highest label of the vertical axis
    "axes.titlesize": 10,
    "axes.formatter.useoffset": False,
    "font.size": 10,
    "grid.alpha": 0.25,
    "legend.fontsize": 9,
    "legend.title_fontsize": 9,
    "legend.borderpad": 0.2,
    "legend.framealpha": 0.7,
    "legend.edgecolor": "none",
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.5,
    "lines.markersize": 4,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
FEW_ENTRIES = 2, 4  # most entries of a legend inside a narrow panel and a wide one
INSIDE = 0.5  # most width of a legend inside a panel, over that of the panel
NARROW = 3.5  # width below which a panel is narrow [inch]
ROOM, LETTER = 0.45, 0.075  # width of an entry of a legend without its name, and mean width of a letter [inch]
MARGIN = 0.2  # least width of a panel that a legend below it leaves free [inch]
UNDER_AXES, GAP = 0.5, 0.05  # height of the labels below axes, and around a legend [inch]
MARKED = {"png": "Software", "pdf": "Creator", "svg": "Creator"}  # key of the metadata that names the program


@contextmanager
def drawing(settings: Mapping[Any, Any] = RC) -> Iterator[None]:
    """Draw with these settings and Matplotlib's defaults; a user's matplotlibrc is ignored. Letters that the font lacks
    become boxes without a warning."""
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        mpl.rcdefaults()
        mpl.rcParams.update(settings)
        yield


def save_figure(figure: Figure, path: Path, kind: str = "png") -> Path:
    """Write a png, pdf or svg marked with the name of this program, and return the path; replaces only marked files."""
    with files.replaced(path, files.is_marked) as file:
        figure.savefig(file, dpi=DPI, format=kind, metadata={MARKED[kind]: files.MARK})
    return path


def plain(text: str, most: int = 1000) -> str:
    """Return a text shortened to `most` letters, with dollar signs escaped and control characters as their codes, which
    neither fonts nor XML have."""
    text = printable(text).replace("\t", " ")
    return (text if len(text) <= most else text[: most - 1] + "…").replace("$", r"\$")


def colors(count: int) -> list[str]:
    """Return `count` different colours for curves. If there are more curves than colours for colour-blind readers, the
    colours go from dark to light."""
    return list(COLORS[:count]) if count <= len(COLORS) else sequence(count)


def sequence(count: int) -> list[str]:
    """Return `count` colours from dark to light, for quantities in an order."""
    return [to_hex(colormaps[SEQUENCE](share)) for share in np.linspace(0.0, LIGHTEST, count)]


def mix(color: str, white: float) -> str:
    """Return a colour mixed with white; `white` is its share."""
    red, green, blue = (part + white * (1.0 - part) for part in to_rgb(color))
    return to_hex((red, green, blue))


def line(number: int, count: int = 0) -> dict[str, Any]:
    """Return colour and dashes of line `number` (counted from 0) of `count` lines, as arguments of Matplotlib."""
    return {"color": colors(max(count, number + 1))[number], "linestyle": DASHES[number % len(DASHES)]}


def figure_of(title: str, groups: Sequence[Sequence[Draw]], maps: Sequence[Draw] = ()) -> Figure:
    """Draw groups of panels below each other in even rows, then panels of maps, all of one size. Legends are placed by
    `place_legends`."""
    most = COLUMNS[sum(map(len, (*groups, maps))) > MANY_PANELS]
    width = WIDTH * most / COLUMNS[0]
    parts = [[(row, 1, len(row)) for row in _split_rows(group, most)] for group in groups if group]
    parts += [[(maps, -(-len(maps) // most), most)]] if maps else []
    heights = [HEIGHT * rows for part in parts for _, rows, _ in part]
    figure = Figure(figsize=(width, 1.0), layout="constrained")
    lines = wrap(title, int(LINE * width / WIDTH))
    if lines:
        figure.suptitle(lines, fontsize=11)
    grid, row = figure.add_gridspec(max(len(heights), 1), 1), 0
    for part in parts:
        drawn = [_draw_row(figure.add_subfigure(grid[row + k]), *each) for k, each in enumerate(part)]
        for k, extra in enumerate(place_legends(drawn)):
            heights[row + k] += extra
        row += len(part)
    grid.set_height_ratios(heights or [1.0])
    set_height(figure, 0.25 + 0.2 * (lines.count("\n") + 1) + sum(heights))
    return figure


def set_height(figure: Figure, height: float) -> None:
    """Set the height [inch] of a figure and fix its layout, so that Matplotlib does not compute it again to save the
    figure.

    The layout is computed twice, as the first layout at a new height keeps the margins of the old height.
    """
    layouts = 1 if height == figure.get_figheight() else 2
    figure.set_figheight(height)
    for _ in range(layouts):
        arrange(figure)
    figure.set_layout_engine(None)


def arrange(figure: Figure) -> None:
    """Set the positions of the axes of a figure by its layout engine, without drawing."""
    if figure.axes and (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)


def wrap(text: str, most: int) -> str:
    """Return a text in lines of at most `most` letters, with dollar signs escaped."""
    return plain("\n".join(part for given in text.split("\n") for part in textwrap.wrap(given, most) or [""]))


def _split_rows(group: Sequence[Draw], most: int) -> list[Sequence[Draw]]:
    count = -(-len(group) // most)
    return [group[len(group) * row // count : len(group) * (row + 1) // count] for row in range(count)]


def _draw_row(place: SubFigure, panels: Sequence[Draw], rows: int, columns: int) -> list[Axes]:
    grid = place.add_gridspec(rows, columns)
    found = [place.add_subplot(grid[divmod(number, columns)]) for number in range(len(panels))]
    for panel, axes in zip(panels, found, strict=True):
        panel(axes)
    return found


def place_legends(rows: Sequence[Sequence[Axes]]) -> list[float]:
    """Add the legends of panels in rows, and return the height that each row needs for its legends [inch].

    Entries that several panels share are placed once, below the last row. Other entries are placed in their panel, or
    below it if there are many.
    """
    found = ((axes, *axes.get_legend_handles_labels()) for row in rows for axes in row)
    entries = {axes: dict(zip(names, handles, strict=True)) for axes, handles, names in found}
    counts = Counter((name, _find_look(handle)) for own in entries.values() for name, handle in own.items())
    pairs = (pair for own in entries.values() for pair in own.items())
    shared = {name: handle for name, handle in pairs if counts[name, _find_look(handle)] > 1}
    heights = []
    for row in rows:
        own = [{name: handle for name, handle in entries[axes].items() if name not in shared} for axes in row]
        heights.append(max((_add_legend(axes, each) for axes, each in zip(row, own, strict=True) if each), default=0.0))
    if shared:
        figure = rows[-1][-1].figure
        heights[-1] += _add_below(figure, shared, _width(figure), loc="outside lower center")
    return heights


def _find_look(handle: Any) -> tuple[str, ...]:
    """Return colour, and dashes and marker if it has any, of an entry of a legend."""
    if hasattr(handle, "get_marker"):
        return to_hex(handle.get_color()), str(handle.get_linestyle()), str(handle.get_marker())
    patch = handle.patches[0] if hasattr(handle, "patches") else handle
    return (to_hex(patch.get_facecolor()),)


def _width(figure: Figure | SubFigure) -> float:
    return float(figure.bbox.width / figure.dpi)


def _add_legend(axes: Axes, entries: dict[str, Artist]) -> float:
    """Add the legend of a panel, below it where bars fill the panel; return the height that it needs there [inch]."""
    cell, bars = axes.get_subplotspec(), any(isinstance(one, BarContainer) for one in axes.containers)
    width = _width(axes.figure) / (cell.get_gridspec().ncols if cell else 1)
    few = len(entries) <= FEW_ENTRIES[width > NARROW] and ROOM + LETTER * max(map(len, entries)) < INSIDE * width
    if few and not bars:
        axes.legend(entries.values(), entries)
        return 0.0
    under = axes.transAxes + ScaledTranslation(0.0, -UNDER_AXES, axes.figure.dpi_scale_trans)
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": under, "borderaxespad": 0.0}
    return _add_below(axes, entries, width - MARGIN, **place)


def _add_below(owner: Axes | Figure | SubFigure, entries: dict[str, Artist], width: float, **place: Any) -> float:
    """Add a legend of a width [inch] in as many columns as fit, and return its height [inch]."""
    names = [wrap(name, int((width - ROOM) / LETTER)) for name in entries]
    longest = max(len(part) for name in names for part in name.split("\n"))
    columns = max(1, min(len(names), int(width / (ROOM + LETTER * longest))))
    legend = owner.legend(entries.values(), names, ncols=columns, columnspacing=1.0, **place)
    return float(legend.get_window_extent().height / legend.figure.dpi) + GAP


MARKS = {"1 ns": 1e-9, "1 µs": 1e-6, "1 ms": 1e-3, "1 s": 1.0, "1 min": 60.0, "1 h": 3600.0}
MARKS |= {"1 day": TIMES["days"], "1 year": TIMES["years"]}  # ticks of a logarithmic axis [s]
LETTER_OF_LABEL = 0.085  # width of a letter of a tick label [inch]
LONGEST, TALLEST = 4.0, 1.25  # most width over height of a map, and most height over width, without stretching
FEW_MARKS = 3  # least number of ticks
LONG_NUMBER, ROUNDING = 1e4, 1e-9  # least number that has a power of ten in labels; of its logarithm
FEW_DECADES = 1.5  # decades of a logarithmic axis below which minor ticks have labels
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def label(axis: Axis, name: str, unit: str) -> None:
    """Set the label of an axis of SI values, with ticks in the unit that suits its range."""
    shown, size = prefixed(unit, max(map(abs, axis.get_view_interval())))
    if shown in TIMES and axis.get_scale() == "linear":
        axis.set_major_locator(_RoundTimes(size))
    axis.set_label_text(f"{name} [{shown}]" if shown else name)
    axis.set_major_formatter(FuncFormatter(lambda value, _: _written(value / size)))


def _written(value: float) -> str:
    """Return the label of a tick: 20, or 2·10⁻⁵ for 2e-5 and 2·10⁴ for 20000."""
    text = f"{value:.10g}"
    if "e" not in text and abs(value) < LONG_NUMBER:
        return text.replace("-", "−")
    size = math.floor(math.log10(abs(value)) + ROUNDING)
    return f"{value / 10.0**size:.10g}·{_power_of_ten(size)}".removeprefix("1·").replace("-", "−")


def label_map(axes: Axes, size: tuple[float, float]) -> float:
    """Set the labels and the aspect of a map of a `size` [m], and return the height of the map divided by the height of
    its panel. The short side of a long map is stretched, and its label says so."""
    ratio = size[0] / size[1]
    stretched = "y" * bool(ratio > LONGEST) + "x" * bool(ratio < 1.0 / TALLEST)
    axes.set_aspect("auto" if stretched else "equal")
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        label(axis, f"{name}, stretched" if name == stretched else name, "m")
    return 1.0 if stretched else min(1.0, 1.0 / ratio)


def thin_log_ticks(axis: Axis) -> bool:
    """Set few ticks on a logarithmic axis. Return True if the axis has few decades or a single power of ten, and so
    ticks at 1, 2 and 5 times powers of ten; other axes have ticks at powers of ten only."""
    low, high = axis.get_view_interval()
    powers = math.floor(math.log10(high) + ROUNDING) - math.ceil(math.log10(low) - ROUNDING) + 1
    few = bool(powers < 2 or high < 10.0**FEW_DECADES * low)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=5))
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: _written(value) if few else _power_of_ten(round(math.log10(value))))
    )
    axis.set_minor_formatter(NullFormatter())
    return few


def _power_of_ten(exponent: int) -> str:
    """Return 10⁻³ for -3: plain letters are drawn in a tenth of the time of a formula."""
    return f"10{str(exponent).translate(RAISED)}"


def label_log_times(axis: Axis, name: str) -> bool:
    """Set the label of a logarithmic axis of long times with ticks at 1 s, 1 min, 1 h, ...; return False for other
    axes."""
    low, high = axis.get_view_interval()
    marks = {size: mark for mark, size in MARKS.items() if low <= size <= high}
    if high < LONG_TIME * TIMES["min"] or len(marks) < FEW_MARKS:
        return False
    marks = _thin_out(marks, axis.axes.get_position().width * axis.axes.figure.bbox.width / axis.axes.figure.dpi)
    axis.set_major_locator(FixedLocator(list(marks)))
    axis.set_major_formatter(FixedFormatter(list(marks.values())))
    axis.set_minor_locator(NullLocator())
    axis.set_label_text(name)
    return True


def _thin_out(marks: dict[float, str], width: float) -> dict[float, str]:
    """Return the ticks of a logarithmic axis of a `width` [inch] that do not overlap, from the longest time on."""
    kept, scale = dict[float, str](), width / math.log(max(marks) / min(marks))
    for size, mark in sorted(marks.items(), reverse=True):
        nearest = min(kept, default=math.inf)
        room = 0.5 * LETTER_OF_LABEL * (len(mark) + len(kept.get(nearest, ""))) + LETTER_OF_LABEL
        if scale * math.log(nearest / size) >= room:
            kept[size] = mark
    return dict(sorted(kept.items()))


class _RoundTimes(MaxNLocator):
    """Ticks at round numbers of a unit of time of `size` seconds."""

    def __init__(self, size: float) -> None:
        super().__init__("auto", steps=[1, 2, 5, 10])
        self._size = size

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Return times [s] from about `vmin` to `vmax` [s]."""
        found: Any = super().tick_values(vmin / self._size, vmax / self._size)
        return found * self._size
