"""Maps in pictures, films and reports: one look, stated when and under what load, and no scale that is made up."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from drawing import ELASTIC, LOADS, SPHERE, STRIP, WAVE, ZENER, ran
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray
from PIL import Image

from parcontact.job import Job
from parcontact.results import maps, plots, report_sections
from parcontact.results.panels import show_colors
from parcontact.results.plotted_run import Fields, PlottedRun, label_frames

ALL = "output: {fields: [pressure, displacement, gap, height]}\n"
CREEP = "history: [{pressure: 1.0e3, duration: 2.0e-3, time_step: 2.0e-3}]\n"
UNLOAD = (
    "history: [{force: 0.1, duration: 1.0e-3, time_step: 1.0e-3}, {force: 0, duration: 1.0e-3, time_step: 1.0e-3}]\n"
)


def mesh(axes: Axes) -> AxesImage:
    (found,) = axes.images
    return found


def values(found: AxesImage) -> NDArray[np.float64]:
    return np.ma.filled(np.ma.asarray(found.get_array()), np.nan).ravel()


def maps_of(figure: Figure) -> dict[str, Axes]:
    """By their titles."""
    return {axes.get_title(): axes for axes in figure.axes if axes.images and axes.get_xlabel()}


def test_one_look(tmp_path: Path, drawn: list[Figure]) -> None:
    """Films and reports draw one map after the other as pictures do: the same colours of the same numbers, the same
    points without a value, in the same colour."""
    out = ran(tmp_path, WAVE + ELASTIC + LOADS + ALL)
    plots.plot([out])
    found = {title.split()[0]: axes for title, axes in maps_of(drawn[0]).items()}
    assert set(found) == {"pressure", "gap", "height"}
    run = PlottedRun(out)
    assert [label for _, label in report_sections.browse_run(run)[0][1]] == ["1 kPa (step 1)", "2 kPa (step 2)"]
    with h5py.File(out / "fields.h5") as file:
        for name, axes in found.items():
            list(maps.draw_frames(file, name, {1: ""}, run.job))
            film = drawn[-1].axes[0]
            ours, theirs = mesh(film), mesh(axes)
            assert ours.get_cmap().name == theirs.get_cmap().name == maps.LOOKS[name].colors
            assert film.get_facecolor() == axes.get_facecolor()
            assert (ours.norm.vmin, ours.norm.vmax) == (theirs.norm.vmin, theirs.norm.vmax)
            np.testing.assert_array_equal(values(ours), values(theirs))
            assert np.isnan(values(ours)).any() == (name != "height")


@pytest.mark.rendered
@pytest.mark.parametrize("scene", [WAVE, STRIP])
def test_frames_are_whole_pictures(tmp_path: Path, drawn: list[Figure], scene: str) -> None:
    """The last frame has the points of its figure drawn as a whole: nothing of earlier frames is left."""
    run = PlottedRun(ran(tmp_path, scene + ELASTIC + LOADS + ALL))
    with run.open_maps() as file:
        *_, frame = maps.draw_frames(file, "pressure", label_frames(run, file), run.job)
    drawn[-1].savefig(tmp_path / "whole.png")
    with Image.open(tmp_path / "whole.png") as whole:
        np.testing.assert_array_equal(np.asarray(whole.convert("RGB")), np.asarray(frame))


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        (WAVE + ELASTIC + LOADS, "2 kPa"),
        (WAVE + ZENER + CREEP, "2 ms, 1 kPa"),
        (SPHERE + ELASTIC + "history: [{force: 0.1}]\n", "100 mN"),
        (SPHERE + ELASTIC + "history: [{approach: 1.0e-5}]\n", "approach 10 µm"),
    ],
)
def test_when_and_under_what_load(tmp_path: Path, drawn: list[Figure], text: str, stated: str) -> None:
    """Time if there is any, and what is prescribed, in titles of maps as in those of films and reports."""
    out = ran(tmp_path, text + ALL)
    plots.plot([out])
    assert set(maps_of(drawn[0])) == {
        f"pressure\n{stated}",
        f"gap (contact black)\n{stated}",
        f"height (up is into the body)\n{stated}",
    }
    run = PlottedRun(out)
    with h5py.File(out / "fields.h5") as file:
        last, label = list(label_frames(run, file).items())[-1]
        assert label == f"{stated} (step {file['step'][last]})"


def test_lines_are_distinguished(tmp_path: Path, drawn: list[Figure]) -> None:
    """By time and load if both change; a load that all have is in the title."""
    (tmp_path / "strip").mkdir()
    plots.plot([ran(tmp_path, SPHERE + ZENER + UNLOAD + ALL), ran(tmp_path / "strip", STRIP + ZENER + CREEP + ALL)])
    titled = {axes.get_title(): axes for figure in drawn for axes in figure.axes}
    line, strip = titled["pressure on a line through the axis"], titled["pressure at the saved instants, 1 kPa"]
    assert {"1 ms, 100 mN", "2 ms, 0 N"} < {str(one.get_label()) for one in line.get_lines()}
    assert [str(one.get_label()) for one in strip.get_lines()][-1] == "2 ms"


@pytest.mark.parametrize(
    ("name", "text", "ticks"),
    [
        ("gap", WAVE + ELASTIC + "history: [{pressure: 1.0e5}]\n", None),
        ("pressure", SPHERE + ELASTIC + "history: [{force: 0.1}, {force: 0}]\n", None),
        ("displacement", SPHERE + ELASTIC + "history: [{force: 0.1}, {force: 0}]\n", [0.0]),
    ],
)
def test_no_scale_of_nothing(
    tmp_path: Path, drawn: list[Figure], name: str, text: str, ticks: list[float] | None
) -> None:
    """A gap where all is closed and pressures where nothing presses have no numbers; a displacement of zero has one."""
    out = ran(tmp_path, text + f"output: {{fields: [pressure, {name if name != 'pressure' else 'gap'}]}}\n")
    plots.plot([out], plots.PlotOptions(at=str(1 + text.count("}, {"))))  # the last step
    (axes,) = (axes for title, axes in maps_of(drawn[0]).items() if title.startswith(name))
    with h5py.File(out / "fields.h5") as file:
        list(maps.draw_frames(file, name, {len(file["step"]) - 1: ""}, PlottedRun(out).job))
        for found in (mesh(axes), mesh(drawn[-1].axes[0])):
            assert (found.colorbar is None) == (ticks is None)
            if found.colorbar is not None:
                assert list(found.colorbar.get_ticks()) == ticks


def test_contacts_that_stick_are_closed_where_their_gap_is_zero() -> None:
    """Pressures below 0, which only they have, are drawn; a rest of pressure where the gap is open closes nothing."""
    given = {"grid": {"points": 8, "size": 1e-3}, "surface": {"shape": "flat"}, "history": [{"pressure": 1e3}]}
    given["material"] = {"model": "elastic", "shear_modulus": 1e6}
    job = Job.model_validate(given)
    sticks = Job.model_validate({**given, "adhesion": {"work": 0.05, "range": 1e-7}})
    pressure, gap = np.array([[3.0, -2.0, 1e-6, -1e-9]]), np.array([[0.0, 0.0, 2e-6, 3e-6]])
    assert np.isnan(maps.mask("gap", gap, pressure, sticks)).tolist() == [[True, True, False, False]]
    assert np.array_equal(maps.mask("pressure", pressure, None, sticks), pressure)
    assert np.isnan(maps.mask("gap", gap, np.abs(pressure), job)).all()


def test_tractions_are_drawn_where_surfaces_touch() -> None:
    """A strength acts where they pull, too, and not at a rest of pressure; with a coefficient, and before the first
    motion, surfaces touch where there is pressure."""
    stick = {"interface": {"shear_stress": 2.0, "stick": True}}
    given = {"grid": {"points": 8, "size": 1e-3}, "surface": {"shape": "flat"}, "history": [{"pressure": 1e3}]}
    given["material"] = {"model": "elastic", "shear_modulus": 1e6}
    strength = Job.model_validate(given | stick)
    coefficient = Job.model_validate(given | {"interface": {"coefficient": 0.5, "stick": True}})
    pressure, traction = np.array([[3.0, -2.0, 1e-6, -1e-9]]), np.array([[2.0, 1.0, 0.0, 0.0]])
    for job, t, closed in (
        (strength, traction, [True, True, False, False]),
        (strength, 0.0 * traction, [True, False, True, False]),
        (coefficient, traction, [True, False, True, False]),
    ):
        assert [(~np.isnan(one)).tolist() for one in maps.stick_maps(t, pressure, job)] == [[closed], [closed]]
    assert maps.stick_maps(traction, pressure, strength)[1][0, :2].tolist() == [1.0, 0.5]


def test_tractions_of_a_strip_are_a_line_within_their_bounds(tmp_path: Path, drawn: list[Figure]) -> None:
    """A wave begins to slide: some points are at the bound, some below."""
    slide = "{pressure: 1.0e3, velocity: 0.1, distance: 1.2e-7, cells_per_step: 0.001}"
    stick = "interface: {coefficient: 0.5, stick: true}\noutput: {fields: [pressure, traction]}\n"
    out = ran(tmp_path, STRIP + ELASTIC + f"history: [{{pressure: 1.0e3}}, {slide}]\n" + stick)
    plots.plot([out])
    (axes,) = (one for one in drawn[0].axes if one.get_title().startswith("traction along x"))
    t, above, below = (np.asarray(line.get_ydata()) for line in axes.lines)
    with h5py.File(out / "fields.h5") as file:
        assert np.array_equal(t, file["traction_x"][-1, 0])
        assert np.array_equal(above, 0.5 * file["pressure"][-1, 0])
    assert np.array_equal(below, -above)
    at_bound = t[above > 0.0] > 0.999 * above[above > 0.0]
    assert at_bound.any()
    assert not at_bound.all()


def test_the_colours_of_pressures_that_pull_and_push_show_both() -> None:
    """Where most of the box is open, too: the range has the lowest, and the highest but for few, and 0 is white."""
    pressure = np.zeros((64, 64))
    pressure[8:12, 8:12], pressure[9:11, 9:11] = -2.0, 5.0
    assert maps.find_range(pressure) == (-2.0, 5.0)
    assert maps.find_range(-np.abs(pressure)) == (-5.0, 0.0)
    image = show_colors(Figure().subplots(), maps._colors("pressure", (np.arange(64.0),) * 2, pressure, (-2.0, 5.0)))
    assert image.norm(np.zeros(1)) == 0.5


HELD = "history: [{name: press, force: 0.1, duration: 1.0e-3, time_step: 2.0e-4}, %s]\n"


@pytest.mark.parametrize(
    ("then", "stated"),
    [
        ("{name: lift, force: 0, duration: 4.0e-4, time_step: 2.0e-4}", "1 ms, 100 mN"),  # the end of the largest load
        ("{name: half, force: 0.05, duration: 4.0e-4, time_step: 2.0e-4}", "1.4 ms, 50 mN"),  # contact holds
    ],
)
def test_maps_show_the_contact(tmp_path: Path, drawn: list[Figure], then: str, stated: str) -> None:
    out = ran(tmp_path, SPHERE + ZENER + HELD % then + "output: {fields: [pressure, gap, height]}\n")
    plots.plot([out])
    assert {title.split("\n")[1] for title in maps_of(drawn[0])} == {stated}
    for _, images, first in report_sections.browse_run(PlottedRun(out)):
        assert images[first][1].startswith(f"{stated} (step ")
    (lines,) = (axes for axes in drawn[0].axes if axes.get_title().startswith("pressure on a line"))
    legend = lines.get_legend()
    assert legend
    names = [text.get_text().split("\n") for text in legend.get_texts()][:5]  # then those of Hertz's
    assert [stage for stage, _ in names] == ["press"] * 3 + 2 * [then[7:].split(",")[0]]


def test_maps_of_a_pull_off(tmp_path: Path, drawn: list[Figure]) -> None:
    """The contact is pulled hardest in row 3, and lost in row 4; maps are there of all steps but that of row 3."""
    loads = "".join(f"{{pressure: {load}}}, " for load in (1e3, 2e3, 3e3, 4e3, 5e3))
    adhesion = "adhesion: {work: 0.01, range: 1.0e-5}\n"
    out = ran(tmp_path, WAVE + ELASTIC + adhesion + f"history: [{loads}]\noutput: {{fields: pressure}}\n")
    run = PlottedRun(out)
    for name, values in {"pressure": [0, 3, 1, -2, 0, 0], "approach": [0, -1, -2, -3, -4, -5]}.items():
        run.table[name] = [float(value) for value in values]
    run.table["contact_area"] = [0.0, 0.3, 0.2, 0.1, 0.0, 0.0]
    assert run.telling_step == 3
    with h5py.File(out / "fields.h5", "r+") as file:
        file["t"][2] = np.nan
        assert Fields(file).chosen == 4
        assert Fields(file, until=run.telling_step).chosen == 1
        assert Fields(file, "5", until=run.telling_step).chosen == 4  # what is asked for is drawn
