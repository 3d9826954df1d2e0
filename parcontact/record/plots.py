"""A picture of a run, finished or not: what was measured over time, distance or load, and the last saved maps.

Which panels there are follows from the job: friction if the surface slides, energies if they were asked for, curves
over the load if all stages are single solves, pressures along a line through a sphere beside Hertz's.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from ..errors import InputError
from . import steady_plot
from .pictures.histories import histories, numbers
from .pictures.maps import maps
from .pictures.run import Panel, Run

PICTURE = "picture.png"
STYLE: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "font.size": 9,
    "grid.alpha": 0.25,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
}


def plot(directory: Path) -> Path:
    """Draw the run in a directory; returns the picture's path. Raises InputError where there is no run."""
    if not (directory / "measures.csv").is_file():
        steady = directory / "steady.csv"
        if steady.is_file():
            return steady_plot.plot(steady)
        raise InputError(f"{directory} holds no run: it has no measures.csv")
    run = Run(directory)
    with rc_context(STYLE):
        title = run.job.title or directory.name
        figure = _figure(title if run.curves else f"{title}\n{numbers(run)}", [list(histories(run)), maps(run)])
        figure.savefig(directory / PICTURE, dpi=150)
    return directory / PICTURE


def _figure(title: str, groups: Sequence[Sequence[Panel]]) -> Figure:
    """Groups of panels below each other, each in even rows of at most three."""
    rows = [row for group in groups for row in _rows(group)]
    figure = Figure(figsize=(11.5, 0.6 + 3.0 * len(rows)), layout="constrained")
    figure.suptitle(title, fontsize=11)
    for part, panels in zip(figure.subfigures(len(rows) or 1, 1, squeeze=False)[:, 0], rows, strict=False):
        for panel, axes in zip(panels, part.subplots(1, len(panels), squeeze=False)[0], strict=True):
            panel(axes)
    return figure


def _rows(group: Sequence[Panel]) -> list[Sequence[Panel]]:
    count = -(-len(group) // 3)
    return [group[len(group) * row // count : len(group) * (row + 1) // count] for row in range(count)]
