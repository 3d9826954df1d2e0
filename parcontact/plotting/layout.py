"""Panels in one figure: rows of at most two beside each other, a title or one legend above them."""

from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from . import style
from .run import Panel

LINE = 68  # letters of a title
LEGEND_LINE = 0.2  # height of each line of a legend [inch]


def figure_of(title: str, groups: Sequence[Sequence[Panel]], legend: bool = False) -> Figure:
    """Groups of panels below each other, each in even rows; with `legend` one for all panels, under the title.

    Draw it within `style.RC`.
    """
    rows = [row for group in groups for row in _rows(group)]
    height = 0.25 + 0.2 * (title.count("\n") + 1) + style.HEIGHT * len(rows)
    figure = Figure(figsize=(style.WIDTH, height), layout="constrained")
    if title and not legend:
        figure.suptitle(style.plain(title), fontsize=11)
    drawn = []
    for part, panels in zip(figure.subfigures(len(rows) or 1, 1, squeeze=False)[:, 0], rows, strict=False):
        for panel, axes in zip(panels, part.subplots(1, len(panels), squeeze=False)[0], strict=True):
            panel(axes)
            drawn.append(axes)
    if legend and drawn:
        _legend_above(figure, drawn, title)
    return figure


def _rows(group: Sequence[Panel]) -> list[Sequence[Panel]]:
    count = -(-len(group) // style.COLUMNS)
    return [group[len(group) * row // count : len(group) * (row + 1) // count] for row in range(count)]


def _legend_above(figure: Figure, drawn: Sequence[Axes], title: str) -> None:
    """One legend of what all panels show, in place of theirs; the title of the figure is its own."""
    found: dict[str, Artist] = {}
    for axes in drawn:
        found |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
        if legend := axes.get_legend():
            legend.remove()
    columns = max(1, min(len(found), LINE // (8 + max(map(len, found)))))
    figure.set_figheight(figure.get_figheight() + LEGEND_LINE * -(-len(found) // columns))
    handles, names, title = list(found.values()), list(found), style.plain(title)
    figure.legend(handles, names, loc="outside upper center", ncols=columns, title=title, title_fontsize=11)
