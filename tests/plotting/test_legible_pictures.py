"""Every kind of picture is legible with many of everything, and what makes one illegible is found."""

import shutil
from collections.abc import Callable
from pathlib import Path

import legible
import pytest
from matplotlib.figure import Figure

from . import many

TWELVE = [f"band {number}" for number in range(12)]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return many.write_run(tmp_path_factory.mktemp("run"))


@pytest.mark.parametrize("draw", many.KINDS, ids=lambda draw: draw.__name__)
def test_pictures_with_many_of_everything(tmp_path: Path, run: Path, draw: Callable[[Path], None]) -> None:
    shutil.copytree(run, tmp_path / "run")
    with legible.watch_pictures() as figures:
        draw(tmp_path)
    assert figures


def two_panels() -> Figure:
    """Return a legible figure of two panels."""
    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    for axes in figure.subplots(1, 2):
        axes.plot([0.0, 1.0], [0.0, 1.0], label="a line")
        axes.set(xlabel="time [s]", ylabel="pressure [Pa]")
    return figure


def put_legend_over_neighbour(figure: Figure) -> None:
    """Put a legend of 12 entries into the first panel, which reaches into the second."""
    axes = figure.axes[0]
    for number, name in enumerate(TWELVE):
        axes.plot([0.0, 1.0], [0.0, number], label=name, color=(number / 12, 0.0, 0.0))
    axes.legend(ncols=4).set_in_layout(False)


def put_legend_inside(figure: Figure) -> None:
    """Put a legend of 12 entries inside its own panel."""
    axes = figure.axes[0]
    for number, name in enumerate(TWELVE):
        axes.plot([0.0, 1.0], [0.0, number], label=name, color=(number / 12, 0.0, 0.0))
    axes.legend(fontsize=4)


def collapse_axes(figure: Figure) -> None:
    """Put a legend that is wider than the figure beside the panels."""
    figure.axes[0].legend([50 * "wide name "], loc="upper left", bbox_to_anchor=(1.0, 1.0))


def make_axes_narrow(figure: Figure) -> None:
    figure.set_layout_engine("none")
    figure.axes[0].set_position((0.2, 0.2, 0.1, 0.7))


def make_axes_low(figure: Figure) -> None:
    figure.set_layout_engine("none")
    figure.axes[0].set_position((0.2, 0.2, 0.2, 0.08))


def crowd_ticks(figure: Figure) -> None:
    figure.axes[0].set_xticks([0.0, 0.01], ["one label", "another label"])


def move_text_off(figure: Figure) -> None:
    figure.text(0.95, 0.5, "a text that does not fit").set_in_layout(False)


def move_legend_off(figure: Figure) -> None:
    figure.legend(["a line"], loc="upper left", bbox_to_anchor=(0.95, 0.95)).set_in_layout(False)


def repeat_color(figure: Figure) -> None:
    figure.axes[0].plot([0.0, 1.0], [1.0, 0.0], label="another line", color="C0")
    figure.axes[0].legend()


def put_legends_over_each_other(figure: Figure) -> None:
    for _ in range(2):
        figure.legend(["a line"], loc="upper center").set_in_layout(False)


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (put_legend_over_neighbour, "covers the axes 'pressure [Pa]'"),
        (put_legend_inside, "covers the axes 'pressure [Pa]'"),
        (collapse_axes, "matplotlib warns: constrained_layout not applied because axes sizes collapsed to zero"),
        (make_axes_narrow, "axes 'pressure [Pa]' fill 0.100 x 0.700 of the figure"),
        (make_axes_low, "axes 'pressure [Pa]' fill 0.200 x 0.080 of the figure"),
        (crowd_ticks, "texts overlap: 'one label' and 'another label'"),
        (move_text_off, "a text leaves the figure: 'a text that does not fit'"),
        (move_legend_off, "the legend ['a line'] leaves the figure"),
        (repeat_color, "two entries of the legend ['a line', 'another line'] look the same"),
        (put_legends_over_each_other, "two legends overlap"),
    ],
)
def test_a_fault_is_found(tmp_path: Path, spoil: Callable[[Figure], None], fault: str) -> None:
    figure = two_panels()
    legible.assert_legible(figure)
    spoil(figure)
    assert [found for found in legible.find_faults(figure) if fault in found]
    with pytest.raises(AssertionError, match="picture 1: "), legible.watch_pictures():
        figure.savefig(tmp_path / "picture.png")
