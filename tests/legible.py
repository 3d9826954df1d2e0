"""Find what makes a picture illegible: collapsed axes, texts off the page, covered panels, labels that overlap.

`assert_legible` judges one figure; within `watch_pictures` every figure that the program saves is judged.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from typing import Any

import pytest
from drawing import outside, touching
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from parcontact.results import style

NARROWEST, LOWEST = 1 / 8, 1 / 12  # least width and height of axes over those of the figure
MOST_INSIDE = 8  # most entries of a legend within its axes
ARRANGE = style.arrange  # which other tests leave out


def assert_legible(figure: Figure) -> None:
    """Fail with all faults of a figure."""
    faults = find_faults(figure)
    assert not faults, "\n".join(faults)


@contextmanager
def watch_pictures() -> Iterator[list[Figure]]:
    """Judge every figure that is saved within, and fail at the end with the faults of all; yields the figures."""
    from matplotlib.figure import Figure as Saved

    figures, faults, save = list[Figure](), list[str](), Saved.savefig

    def judge(figure: Figure, file: Any, **options: Any) -> None:
        if not any(figure is one for one in figures):  # frames of a movie are one figure
            figures.append(figure)
            faults.extend(f"picture {len(figures)}: {fault}" for fault in find_faults(figure))
        save(figure, file, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Saved, "savefig", judge)
        patch.setattr(style, "arrange", ARRANGE)
        yield figures
    for number, figure in enumerate(figures, 1):
        if figure.stale:  # has changed since it was saved: its last frame
            faults += [f"picture {number}: {fault}" for fault in find_faults(figure)]
    assert not faults, "\n".join(faults)


def find_faults(figure: Figure) -> list[str]:
    """Return what makes a figure illegible, as sentences."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        figure.draw_without_rendering()
        texts = [
            *(f"a text leaves the figure: {text!r}" for text in outside(figure)),
            *(f"texts overlap: {one!r} and {other!r}" for one, other in touching(figure)),
        ]
    return [
        *(f"matplotlib warns: {one.message}" for one in caught),
        *_find_small_axes(figure),
        *texts,
        *(fault for legend in _legends(figure) for fault in _judge_legend(figure, legend)),
        *("two legends overlap" for one, other in combinations(_legends(figure), 2) if _overlap(one, other)),
    ]


def _find_small_axes(figure: Figure) -> Iterator[str]:
    for axes in figure.axes:
        box = axes.get_window_extent()
        width, height = box.width / figure.bbox.width, box.height / figure.bbox.height
        is_bar_of_colours = hasattr(axes, "_colorbar")
        if not is_bar_of_colours and (width < NARROWEST or height < LOWEST):
            yield f"axes {_name(axes)} fill {width:.3f} x {height:.3f} of the figure"


def _legends(figure: Figure) -> list[Legend]:
    return [one for one in figure.findobj(Legend) if one.get_visible()]


def _judge_legend(figure: Figure, legend: Legend) -> Iterator[str]:
    names, box = [text.get_text() for text in legend.get_texts()], legend.get_window_extent()
    page = figure.bbox.padded(1)
    if not (page.contains(box.x0, box.y0) and page.contains(box.x1, box.y1)):
        yield f"the legend {names} leaves the figure"
    for axes in figure.axes:
        own = legend.axes is not None and axes.get_window_extent().bounds == legend.axes.get_window_extent().bounds
        if (not own or len(names) > MOST_INSIDE) and _overlap(legend, axes):
            yield f"the legend {names} covers the axes {_name(axes)}"
    looks = [_find_look(handle) for handle in legend.legend_handles]
    if len(set(looks)) < len(looks):
        yield f"two entries of the legend {names} look the same"


def _find_look(handle: Any) -> tuple[Any, ...]:
    if hasattr(handle, "get_marker"):
        marks = handle.get_linestyle(), str(handle._dash_pattern), handle.get_marker(), handle.get_linewidth()
        return to_hex(handle.get_color()), *marks
    return to_hex(handle.get_facecolor()), handle.get_hatch()


def _overlap(one: Any, other: Any) -> bool:
    return bool(one.get_window_extent().shrunk(0.98, 0.98).overlaps(other.get_window_extent()))


def _name(axes: Axes) -> str:
    return repr(axes.get_ylabel() or axes.get_title() or axes.get_xlabel())
