"""Which instants a picture shows: the maps of one that is asked for, and early ones on a logarithmic axis."""

from pathlib import Path

import numpy as np
import pytest
from drawing import ELASTIC, MAPS, WAVE, ZENER, asked, ran
from matplotlib.figure import Figure

LOADS = "history: [{pressure: 1.0e3}, {pressure: 2.0e3}, {pressure: 3.0e3}]\n"
CREEP = "history: [{pressure: 1.0e3, duration: 1.0e-2, time_step: 2.0e-3}]\n"
GROWING = CREEP.replace("time_step: 2.0e-3", "time_step: {first: 1.0e-6, growth: 1.8}")
SLIDE = ", {pressure: 1.0e3, velocity: 0.1, distance: 1.0e-3, cells_per_step: 0.5}]\n"


def title_and_highest(figure: Figure) -> tuple[str, float]:
    """Of the map of pressures."""
    axes = next(axes for axes in figure.axes if axes.get_title().startswith("pressure"))
    return axes.get_title(), float(np.max(np.ma.filled(np.ma.asarray(axes.images[0].get_array()), 0.0)))


@pytest.mark.parametrize(("at", "time"), [("3", "4 ms"), ("0.0072", "8 ms"), ("8e-3", "8 ms")])
def test_the_maps_of_an_instant(tmp_path: Path, drawn: list[Figure], at: str, time: str) -> None:
    """A whole number is a step (the first is the jump of the load), another a time, of which the nearest maps are
    drawn; pressures of a body that creeps fall."""
    out = ran(tmp_path, WAVE + ZENER + CREEP + MAPS)
    assert asked(out, "--at", at) == asked(out) == 0
    (title, highest), (last_title, last) = map(title_and_highest, drawn)
    assert title == f"pressure\n{time}, 1 kPa"
    assert last_title == "pressure\n10 ms, 1 kPa"
    assert highest > last > 0.0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--at", "7"], "--at 7: no map is saved after step 7; the nearest steps with maps are 1, 2, 3"),
        (["--at", "1.5"], "--at 1.5: maps are saved from 0 to 0 s"),
        (["--at", "1", "--movie", "gap"], "leave it out with --movie or --compare"),
    ],
)
def test_no_such_instant(tmp_path: Path, capfd: pytest.CaptureFixture[str], words: list[str], sentence: str) -> None:
    out = ran(tmp_path, WAVE + ELASTIC + LOADS + MAPS)
    capfd.readouterr()
    assert asked(out, *words) == 2
    assert sentence in capfd.readouterr().err
    assert not (out / "picture.png").exists()


def test_a_run_without_maps_has_none_of_an_instant(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = ran(tmp_path, WAVE + ELASTIC + LOADS)
    assert asked(out, "--at", "1") == 2
    assert "has no maps; save them by output: {fields: [...]}" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("history", "words", "scale"),
    [
        (CREEP, [], "linear"),
        (GROWING, [], "log"),
        (GROWING, ["--log", "none"], "linear"),
        (GROWING, ["--log", "y"], "log"),
        (GROWING.replace("]\n", SLIDE), ["--over", "time"], "linear"),
    ],
)
def test_the_axis_of_time_follows_the_steps(
    tmp_path: Path, drawn: list[Figure], history: str, words: list[str], scale: str
) -> None:
    """Logarithmic where half of the steps lie in the first twentieth of the time; a slide after them needs none."""
    assert asked(ran(tmp_path, WAVE + ZENER + history), *words) == 0
    assert {axes.get_xscale() for axes in drawn[0].axes} == {scale}
