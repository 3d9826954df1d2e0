"""`parcontact plot` as users ask for it: panels, axes, formats, comparisons, movies, and what cannot be drawn."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from drawing import (
    AREA,
    ELASTIC,
    FRACTION,
    FRICTION,
    KINDS,
    PEAK,
    SLIDE,
    SPHERE,
    WAVE,
    ZENER,
    asked,
    entries,
    panels,
    ran,
    touching,
)
from matplotlib.figure import Figure

from parcontact.files import tables
from parcontact.results import style
from parcontact.results.panels import Axis, Line, Panel, draw

BACK = SLIDE.replace("}]", "}, {name: back, pressure: 1.0e3, velocity: -0.1, distance: 1.0e-3, cells_per_step: 1}]")
CURVE = "velocity,pressure,friction,contact_area\n"
POINTS = [(v, p, 0.1 * v, 0.2) for p in (1041.66666, 2.5e5) for v in (0.001, 0.1, 10.0)]


def curve(directory: Path, points: Sequence[Sequence[float]] = POINTS) -> Path:
    """A directory with a friction curve."""
    directory.mkdir(exist_ok=True)
    rows = [",".join(map(repr, point)) + "\n" for point in points]
    (directory / "steady.csv").write_text(CURVE + "".join(rows))
    return directory


def test_wide_names_of_stages_do_not_touch(tmp_path: Path, drawn: list[Figure]) -> None:
    """Letters differ in width; and a dollar is no beginning of a formula."""
    stages = ", ".join(
        f"{{name: MAXIMUM $^W{k}, pressure: {k + 1}.0e3, duration: 1.0, time_step: 1.0}}" for k in range(4)
    )
    assert asked(ran(tmp_path, f"title: a $^ b$\n{WAVE}{ELASTIC}history: [{stages}]\n")) == 0
    assert len([name for name in entries(drawn[0]) if name.startswith("MAXIMUM")]) == 4
    assert touching(drawn[0]) == []


@pytest.mark.rendered
def test_pictures_are_xml(tmp_path: Path) -> None:
    """Whatever characters title and names of stages have; and no letter that the font lacks makes a warning."""
    texts = [r"\e[31m", r"\t", r"\0", r"\ud800", r"\uffff", r"\x85", "轮胎"]
    stages = ", ".join(f'{{name: "{text} a", pressure: 1.0e3, duration: 1.0, time_step: 1.0}}' for text in texts)
    out = ran(tmp_path, f'title: "{" ".join(texts)}"\n{WAVE}{ELASTIC}history: [{stages}]\n')
    assert asked(out, "--format", "svg") == 0
    assert len(list(ElementTree.parse(out / "picture.svg").iter())) > 100
    assert asked(out, out, "--compare", "--out", tmp_path / "both.png") == 0


@pytest.mark.rendered
@pytest.mark.parametrize("zeros", ["", "closed"])
@pytest.mark.parametrize("log", ["x", "y", "x,y"])
@pytest.mark.parametrize(
    ("x", "y", "shown"),
    [
        ((0.0, 0.0), (1.0, 2.0), "y"),
        ((1.0, 2.0), (0.0, 0.0), "x"),
        ((-1.0, 2.0), (1.0, -2.0), "x y"),  # positive on both axes, but at no common point
        ((1.0, 2.0), (1.0, 2.0), "x y x,y"),
        ((1e5, 1e5 * (1.0 + 4e-16)), (0.3, 0.3), "x y x,y"),  # one load, of which one result is rounded
    ],
)
def test_logarithmic_axes_without_a_point(
    tmp_path: Path, x: tuple[float, ...], y: tuple[float, ...], shown: str, log: str, zeros: str
) -> None:
    """A panel that has points for the logarithmic axes has them, another keeps linear axes; it is drawn either way."""
    figure = Figure()
    line = Line("", np.array(x), np.array(y))
    with style.drawing():
        axes = figure.add_subplot()
        chart = Panel("leakage", Axis("load", "Pa"), Axis("K", "m³"), [line], zeros=zeros)
        draw(chart, axes, log.split(","))
        style.save_figure(figure, tmp_path / "picture.png")
    logs = set(log.split(",")) | ({"y"} if zeros else set())
    there = ",".join(sorted(logs)) in shown.split(" ")
    expected = ["log" if there and axis in logs else "linear" for axis in "xy"]
    assert [axes.get_xscale(), axes.get_yscale()] == expected


@pytest.mark.parametrize("kind", ["loads", "creep", "sliding"])
def test_labels_do_not_touch(tmp_path: Path, drawn: list[Figure], kind: str) -> None:
    assert asked(ran(tmp_path, KINDS[kind][0])) == 0
    assert touching(drawn[0]) == []


@pytest.mark.parametrize("stages", [3, 9])
def test_narrow_stages_keep_their_names(tmp_path: Path, drawn: list[Figure], stages: int) -> None:
    """A hundredth of the time each, and yet each is named once, and no name touches another text."""
    short = [
        f"{{name: short stage {k}, pressure: {k + 1}.0e3, duration: 1.0e-5, time_step: 1.0e-5}}" for k in range(stages)
    ]
    text = ", ".join([*short, "{name: long, pressure: 1.0e3, duration: 1.0e-3, time_step: 2.0e-4}"])
    assert asked(ran(tmp_path, WAVE + ELASTIC + f"history: [{text}]\n")) == 0
    assert entries(drawn[0]) == [*(f"short stage {k}" for k in range(stages)), "long"]
    assert touching(drawn[0]) == []


def test_reversal_shows_both_signs(tmp_path: Path, drawn: list[Figure]) -> None:
    """Its magnitude would have a cusp at 0."""
    assert asked(ran(tmp_path, WAVE + ZENER + BACK)) == 0
    friction = drawn[0].axes[0].get_lines()[0].get_ydata()
    assert np.min(friction) < -0.5 * np.max(friction)
    assert drawn[0].axes[0].get_ylim()[0] < np.min(friction)


def test_a_spike_at_the_start_does_not_flatten_the_rest(tmp_path: Path, drawn: list[Figure]) -> None:
    """A load at once meets the modulus of the first instant: that height is stated, and the rest fills the panel, in
    the unit that suits it. Where steps grow, as after most jumps, the axis of time is logarithmic, and nothing is
    cut."""
    stiff = "material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e8, relaxation_time: 1.0e-6}]}\n"
    for name, steps in (("even", "2.5e-4"), ("growing", "{first: 1.0e-7, growth: 1.5}")):
        (tmp_path / name).mkdir()
        load = f"history: [{{force: 0.1, duration: 1.0e-2, time_step: {steps}}}]\n"
        assert asked(ran(tmp_path / name, SPHERE.replace("points: 32", "points: 64") + stiff + load)) == 0
    even, growing = (figure.axes[2] for figure in drawn)
    assert (even.get_xscale(), growing.get_xscale()) == ("linear", "log")
    assert (even.get_ylabel(), growing.get_ylabel()) == (PEAK, PEAK.replace("k", "M"))
    values = np.array(even.get_lines()[0].get_ydata())
    assert values.max() > 3.0 * values[-1]
    assert values[-1] < even.get_ylim()[1] < 2.0 * values[-1]
    assert f"{1e-6 * values.max():.3g} MPa" in even.texts[0].get_text()
    assert not growing.texts


def test_run_and_curve_in_one_directory(tmp_path: Path, drawn: list[Figure]) -> None:
    out = curve(ran(tmp_path, KINDS["sliding"][0]))
    assert asked(out) == 0
    assert panels(drawn[0]) == [*KINDS["sliding"][1], FRICTION, FRACTION]


def test_job_of_another_verb(tmp_path: Path, drawn: list[Figure]) -> None:
    """What is known of the stages may be wrong: the rows are drawn all the same."""
    out = ran(tmp_path, KINDS["creep"][0])
    path = out / "job.resolved.yaml"
    data = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump({**data, "history": [{"pressure": 1.0e5}]}))
    assert asked(out) == 0
    data["steady"] = {"velocities": [1.0], "pressures": [1.0e5]}
    path.write_text(yaml.safe_dump({key: value for key, value in data.items() if key != "history"}))
    assert asked(out) == 0
    assert len(drawn) == 2
    assert panels(drawn[1])[:3] == KINDS["creep"][1][:3]


def test_loads_of_curves_have_prefixes(tmp_path: Path, drawn: list[Figure]) -> None:
    assert asked(curve(tmp_path)) == 0
    assert entries(drawn[0]) == ["1.04 kPa", "250 kPa"]
    assert touching(drawn[0]) == []


@pytest.mark.parametrize("points", [POINTS[:1], POINTS[:3:2], []])
def test_curve_of_few_points(tmp_path: Path, drawn: list[Figure], points: Sequence[Sequence[float]]) -> None:
    """Any warning is an error here."""
    assert asked(curve(tmp_path, points)) == 0
    assert len(panels(drawn[0])) == (2 if points else 0)
    assert touching(drawn[0]) == []


@pytest.mark.rendered
@pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_formats(tmp_path: Path, kind: str, start: bytes) -> None:
    out = curve(tmp_path)
    assert asked(out, "--format", kind) == 0
    assert (out / f"picture.{kind}").read_bytes().startswith(start)
    assert asked(out, "--out", tmp_path / f"other.{kind}") == 0
    assert (tmp_path / f"other.{kind}").read_bytes().startswith(start)


def test_panels_axes_and_scales(tmp_path: Path, drawn: list[Figure]) -> None:
    """In the order asked for; over velocity, what each stage has come to; logarithmic where asked for."""
    faster = SLIDE.replace("}]", "}, {pressure: 1.0e3, velocity: 0.2, distance: 1.0e-3, cells_per_step: 1}]")
    out = ran(tmp_path, WAVE + ZENER + faster)
    assert asked(out, "--panels", "pressure,friction", "--over", "time", "--log", "x,y") == 0
    assert panels(drawn[0]) == [PEAK, FRICTION]
    assert [(axes.get_xlabel(), axes.get_xscale(), axes.get_yscale()) for axes in drawn[0].axes] == [
        ("time [s]", "log", "log")
    ] * 2
    assert asked(out, "--panels", "friction", "--over", "velocity") == 0
    line = drawn[1].axes[0].get_lines()[0]
    table = tables.read_columns(out / "measures.csv")
    last = [table["distance"].index(value) for value in sorted(table["distance"]) if value <= 1.0001e-3][-1]
    assert np.array(line.get_xdata()).tolist() == [0.1, 0.2]
    assert drawn[1].axes[0].get_xlabel() == "sliding velocity [mm/s]"
    assert np.array(line.get_ydata()).tolist() == [table["friction"][last], table["friction"][-1]]


def test_comparison(tmp_path: Path, drawn: list[Figure]) -> None:
    """A line for each run in its own colour, named after its directory; a free scene's area is another measure."""
    runs = []
    for name, text in (
        ("slow", KINDS["sliding"][0]),
        ("other", SPHERE + ZENER + SLIDE.replace("pressure: 1.0e3", "force: 0.1")),
    ):
        (tmp_path / name).mkdir()
        runs.append(ran(tmp_path / name, text).rename(tmp_path / f"{name} run"))
    assert asked(*runs, "--compare", "--out", tmp_path / "both.png") == 0
    first = drawn[0].axes[0].get_lines()
    assert [line.get_label() for line in first] == ["slow run", "other run"]
    assert [line.get_color() for line in first] == list(style.COLORS[:2])
    assert entries(drawn[0]) == ["slow run", "other run"]
    assert {FRACTION, AREA} < set(panels(drawn[0]))
    assert touching(drawn[0]) == []


@pytest.mark.parametrize(("change", "share"), [(1e-4, 0.01), (0.1, 1.0)])
def test_noise_does_not_fill_a_panel(change: float, share: float) -> None:
    """An approach that varies by 0.01 % varies by the mesh: it fills 1 % of the axis. A creep fills all of it."""
    axes = Figure().add_subplot()
    values = 1.5e-6 * (1.0 - change * np.array([0.0, 1.0, 0.0, 1.0]))
    line = Line("", np.arange(4.0), values, style.line(0))
    draw(Panel("approach", Axis("time", "s"), Axis("approach", "m"), [line], bottom=False), axes)
    low, high = axes.get_ylim()
    assert 1.5e-6 * change / (high - low) == pytest.approx(share, rel=0.15)


def test_slow_and_fast_slides_are_compared_over_their_way(tmp_path: Path, drawn: list[Figure]) -> None:
    """Over time the fast one would take a hundredth of the axis; of slides of similar times nothing changes."""
    press, runs = "{pressure: 1.0e3, duration: 1.0e-4, time_step: 1.0e-4}", []
    for speed in (0.1, 0.2, 10.0):
        (tmp_path / f"{speed:g}").mkdir()
        slide = f"{{pressure: 1.0e3, velocity: {speed}, distance: 2.5e-4, cells_per_step: 1}}"
        runs.append(ran(tmp_path / f"{speed:g}", f"{WAVE}{ZENER}history: [{press}, {slide}]\n"))
    for chosen, label in ((runs[:2], "time [ms]"), (runs, "distance slid [µm]")):
        assert asked(*chosen, "--compare", "--panels", "area", "--out", tmp_path / "both.png") == 0
        assert drawn.pop().axes[0].get_xlabel() == label


def test_what_a_directory_has_is_named_where_nothing_can_be_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A curve has one key for its panels; a sweep is compared by its cases."""
    one = curve(tmp_path / "curve")
    assert asked(one, "--panels", "friction") == 2
    assert f"{one} has none of the panels friction; it has steady" in capsys.readouterr().err
    (tmp_path / "sweep.csv").write_text("case,history.0.velocity,state,mu_dyn\n0,0.1,done,0.1\n")
    assert asked(one, tmp_path, "--compare", "--out", tmp_path / "both.png") == 2
    assert f"is a sweep, which has nothing to compare; give its cases, {tmp_path}/cases/*" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "stated"),
    [
        (["--panels", "nonsense"], "there is no 'nonsense'"),
        (["--panels", "energy"], "none of the panels energy; it has area, "),
        (["--log", "z"], "there is no axis 'z'"),
        (["--out", "picture.docx"], "must end in .png, .pdf, .svg; or give --format"),
        (["--out", "nowhere/picture.png"], "cannot write nowhere/picture.png"),
        (["--movie", "height"], "no map of height; it has pressure, gap"),
        (["--movie", "gap", "--out", "gap.avi"], "must end in .gif or .mp4, got gap.avi"),
        (["--over", "distance"], "nothing can be drawn over distance"),
        (["--over", "velocity"], "no stage slides"),
        (["there", "--out", "one.png"], "--compare"),
    ],
)
def test_what_cannot_be_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], stated: str
) -> None:
    out = ran(tmp_path, KINDS["loads"][0])
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    assert asked(out, *words) == 2
    assert stated in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_cases_of_a_sweep_are_distinguished_by_their_keys(tmp_path: Path, drawn: list[Figure]) -> None:
    """Those that differ among the cases that are drawn."""
    (tmp_path / "cases").mkdir()
    cases = [curve(tmp_path / "cases" / f"{number:03d}", POINTS[:3]) for number in range(3)]
    rows = [
        f"{number},{velocity},{seed},done\n" for number, (velocity, seed) in enumerate([(0.1, 1), (0.1, 2), (10, 2)])
    ]
    (tmp_path / "sweep.csv").write_text("case,history.1.velocity,surface.0.seed,state\n" + "".join(rows))
    for chosen, expected in (
        (cases[:2], ["seed 1", "seed 2"]),
        (cases, ["velocity 100 mm/s, seed 1", "velocity 100 mm/s, seed 2", "velocity 10 m/s, seed 2"]),
    ):
        assert asked(*chosen, "--compare", "--out", tmp_path / "both.png") == 0
        assert entries(drawn.pop()) == [f"{name}, 1.04 kPa" for name in expected]


def test_curves_are_compared_by_what_differs_among_them(tmp_path: Path, drawn: list[Figure]) -> None:
    """A curve at one temperature has the mark of this temperature, as a curve at two has."""
    head = "velocity,pressure,temperature,friction,contact_area\n"
    for name, degrees in (("two", (10.0, 40.0)), ("one", (40.0,))):
        (tmp_path / name).mkdir()
        rows = [f"{v},1.0e5,{t},0.2,0.1\n" for t in degrees for v in (0.1, 1.0)]
        (tmp_path / name / "steady.csv").write_text(head + "".join(rows))
    pair = tmp_path / "two", tmp_path / "one"
    assert asked(*pair, "--compare", "--out", tmp_path / "both.png") == 0
    assert entries(drawn[0]) == ["two", "one", "10 °C", "40 °C"]
    marks = [line.get_marker() for line in drawn[0].axes[0].get_lines() if np.size(line.get_xdata()) == 2]
    assert marks == ["o", "s", "s"]


def test_table_without_a_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "steady.csv").write_text("velocity,pressure\n1.0,2.0\n")
    assert asked(tmp_path) == 2
    assert "has no column friction, contact_area" in capsys.readouterr().err


def test_unloaded_body(tmp_path: Path, drawn: list[Figure]) -> None:
    """Nothing is pressed: nothing to draw but zeros, and no warning."""
    rest = "history: [{approach: -1.0e-6, duration: 2.0, time_step: 1.0}]\n"
    assert asked(ran(tmp_path, SPHERE + ELASTIC + rest)) == 0
    assert panels(drawn[0])[1].startswith("approach")
