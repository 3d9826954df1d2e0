"""Style of all pictures: readable at a width of 8 cm, in colours for colour-blind readers."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from ..storage import files
from ..streams import printable

Panel = Callable[[Axes], None]  # draws one panel

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito 2008, no yellow
DASHES = ("-", "--", "-.", ":")  # with the colours, for black and white prints
BLUE, RED, GREEN, *_ = COLORS
GREY = "0.4"
SEQUENCE = "viridis"  # colour map for lines in an order, such as instants
WIDTH, HEIGHT = 5.8, 2.25  # width of a picture, height of a row of panels [inch]
COLUMNS = 2  # panels per row
LINE = 68  # most letters in a line of a title
LEGEND_LINE = 0.2  # height of each line of a legend [inch]
DPI = 200
RC: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
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
ABOVE: dict[str, Any] = {  # legend of a panel of half the width
    "loc": "lower center",
    "bbox_to_anchor": (0.5, 1.0),
    "ncols": 3,
    "columnspacing": 1.0,
    "handlelength": 1.4,
}
AT_SIDE: dict[str, Any] = {  # legend at the right of a full panel
    "loc": "upper left",
    "bbox_to_anchor": (1.0, 1.0),
    "borderaxespad": 0.0,
    "handlelength": 1.8,
}
BELOW: dict[str, Any] = {  # legend of a small picture
    "loc": "upper center",
    "bbox_to_anchor": (0.5, -0.22),
    "columnspacing": 1.0,
    "handlelength": 1.8,
}
MARKED = {
    "png": "Software",
    "pdf": "Creator",
    "svg": "Creator",
}  # key of the metadata that names the program, by format


@contextmanager
def drawing(settings: Mapping[Any, Any] = RC) -> Iterator[None]:
    """Draw with these settings and Matplotlib's defaults; a user's matplotlibrc is ignored. Letters that the font lacks
    become boxes without a warning."""
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        mpl.rcdefaults()
        mpl.rcParams.update(settings)
        yield


def save_figure(figure: Figure, path: Path, kind: str = "png", dpi: int = DPI) -> Path:
    """Write a png, pdf or svg with the name of this program in its metadata, and return its path; replaces such files
    only."""
    with files.replaced(path, files.is_marked) as file:
        figure.savefig(file, dpi=dpi, format=kind, metadata={MARKED[kind]: files.MARK})
    return path


def plain(text: str, most: int = 1000) -> str:
    """Return a text shortened to `most` letters, with dollar signs escaped and control characters as their codes, which
    neither fonts nor XML have."""
    text = printable(text).replace("\t", " ")
    return (text if len(text) <= most else text[: most - 1] + "…").replace("$", r"\$")


def line(number: int) -> dict[str, Any]:
    """Return colour and dashes of the line with this index."""
    return {"color": COLORS[number % len(COLORS)], "linestyle": DASHES[number % len(DASHES)]}


def figure_of(
    title: str, groups: Sequence[Sequence[Panel]], legend: bool = False, maps: Sequence[Panel] = ()
) -> Figure:
    """Draw groups of panels below each other in even rows, then `maps`, all of one size. With `legend` there is space
    for one legend of all panels under the title."""
    parts = [(row, 1, len(row)) for group in groups for row in _split_rows(group)]
    parts += [(maps, -(-len(maps) // COLUMNS), COLUMNS)] if maps else []
    heights = [rows for _, rows, _ in parts]
    height = 0.25 + 0.2 * (title.count("\n") + 1) + HEIGHT * sum(heights)
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    if title and not legend:
        figure.suptitle(plain(title), fontsize=11)
    places = figure.subfigures(len(parts), 1, squeeze=False, height_ratios=heights)[:, 0] if parts else ()
    for place, (panels, rows, columns) in zip(places, parts, strict=True):
        grid = place.add_gridspec(rows, columns)
        for number, panel in enumerate(panels):
            panel(place.add_subplot(grid[divmod(number, columns)]))
    if legend and parts:
        _put_legend_above(figure, title)
    return figure


def _split_rows(group: Sequence[Panel]) -> list[Sequence[Panel]]:
    count = -(-len(group) // COLUMNS)
    return [group[len(group) * row // count : len(group) * (row + 1) // count] for row in range(count)]


def _find_look(handle: Any) -> tuple[str, ...]:
    """Return colour, dashes and marker of a legend entry, to compare entries."""
    if hasattr(handle, "get_linestyle"):
        return to_hex(handle.get_color()), str(handle.get_linestyle()), str(handle.get_marker())
    return (to_hex(handle.patches[0].get_facecolor()),) if hasattr(handle, "patches") else (repr(handle),)


def _put_legend_above(figure: Figure, title: str) -> None:
    """Replace the legends of all panels by one above them, with the title of the figure, unless two names look the
    same."""
    found: dict[str, Artist] = {}
    for axes in figure.axes:
        found |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    if len(set(map(_find_look, found.values()))) < len(found):
        figure.suptitle(plain(title), fontsize=11)
        return
    for axes in figure.axes:
        if legend := axes.get_legend():
            legend.remove()
    columns = max(1, min(len(found), LINE // (8 + max(map(len, found), default=0))))
    figure.set_figheight(figure.get_figheight() + LEGEND_LINE * -(-len(found) // columns))
    place: dict[str, Any] = {"loc": "outside upper center", "ncols": columns, "title_fontsize": 11}
    figure.legend(list(found.values()), list(found), title=plain(title), **place)
