"""`parcontact plot`: a picture with the panels that a job has."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from mpi4py import MPI
from PIL import Image

from parcontact import job
from parcontact.__main__ import main
from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.record import measures, plots
from parcontact.record.pictures import style, units
from parcontact.run import runner

WAVE = """
grid: {points: 32, size: 2.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 1]}
"""
STRIP = WAVE.replace("points: 32", "points: [32, 4]").replace("[1, 1]", "[1, 0]")
SPHERE = """
grid: {points: 32, size: 2.0e-3, boundary: free}
surface: {shape: sphere, radius: 1.0e-2}
numerics: {tolerance: 1.0e-6}
"""
ELASTIC = "material: {model: elastic, shear_modulus: 1.0e6}\n"
ZENER = """
material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e6, relaxation_time: 1.0e-3}]}
"""
MAPS = "output: {fields: [pressure, gap]}\n"
ENERGY = "output: {energy: true, fields: [pressure, displacement]}\n"
LOADS = "history: [{pressure: 1.0e3}, {pressure: 2.0e3}]\n"
SLIDE = "history: [{pressure: 1.0e3, velocity: 0.1, distance: 1.0e-3, cells_per_step: 1}]\n"
CREEP = (
    "history: [{force: 0.1, duration: 1.0e-2, time_step: 2.0e-3}, {force: 0, duration: 2.0e-3, time_step: 1.0e-3}]\n"
)

FRICTION, FRACTION, AREA = "friction coefficient", "contact area /\nnominal area", "contact area [mm²]"
GAP, PEAK, ENERGIES = "mean gap [µm]", "highest pressure [kPa]", "energy [µJ]"
Y, LINE = "y [mm]", "pressure [kPa]"
KINDS = {
    "loads": (WAVE + ELASTIC + LOADS + MAPS, [FRACTION, GAP.replace("µ", "n"), PEAK, Y, Y]),
    "loads of a strip": (STRIP + ELASTIC + LOADS + MAPS, [FRACTION, GAP.replace("µ", "n"), PEAK, LINE]),
    "sliding": (WAVE + ZENER + SLIDE, [FRICTION, FRACTION, GAP.replace("µ", "n"), PEAK]),
    "creep": (SPHERE + ZENER + CREEP + ENERGY, [AREA, "approach [µm]", PEAK, "force [mN]", ENERGIES, LINE, Y, Y]),
    "Hertz": (SPHERE + ELASTIC + "history: [{force: 0.1}]\n" + MAPS, [LINE, Y, Y]),
    "numbers only": (SPHERE + ELASTIC + "history: [{force: 0.1}]\n", []),
    "flat": (WAVE.replace("1.0e-6", "0.0") + ELASTIC + LOADS, [FRACTION, PEAK]),
}


def ran(tmp_path: Path, text: str) -> Path:
    """The output directory of a job."""
    path = tmp_path / "job.yaml"
    path.write_text(text)
    loaded = job.load(path, [f"output.directory={tmp_path / 'out'}"])
    assert runner.run(loaded, Slab(MPI.COMM_SELF, *loaded.grid.points), runner.Options(quiet=True)) == 0
    return tmp_path / "out"


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that have been saved."""
    figures: list[Figure] = []
    draw = Figure.savefig

    def save(figure: Figure, *args: object, **options: object) -> None:
        figures.append(figure)
        draw(figure, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Figure, "savefig", save)
    return figures


def panels(figure: Figure) -> list[str]:
    """The y axes of all panels, without those of the colours."""
    return [axes.get_ylabel() for axes in figure.axes if axes.get_xlabel()]


@pytest.mark.parametrize("kind", KINDS)
def test_panels(tmp_path: Path, drawn: list[Figure], kind: str) -> None:
    text, expected = KINDS[kind]
    picture = plots.plot([ran(tmp_path, text)])[0]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert panels(drawn[0]) == expected


def test_hertz_beside_the_sphere(tmp_path: Path, drawn: list[Figure]) -> None:
    """The computed pressures lie on Hertz's line, to 2 % of the highest at 7 cells per radius but for the edge."""
    plots.plot([ran(tmp_path, KINDS["Hertz"][0])])
    computed, hertz = drawn[0].axes[0].get_lines()
    assert hertz.get_label() == "Hertz"
    x, p = np.array(computed.get_xdata()), np.array(computed.get_ydata())
    exact = np.interp(x, np.array(hertz.get_xdata()), np.array(hertz.get_ydata()), left=0.0, right=0.0)
    inside = exact > 0.5 * exact.max()
    assert inside.sum() > 8
    assert np.abs(p - exact)[inside].max() < 0.02 * exact.max()


def test_peak_of_friction_is_named(tmp_path: Path, drawn: list[Figure]) -> None:
    stop = SLIDE.replace("}]", "}, {pressure: 1.0e3, duration: 5.0e-3, time_step: 5.0e-4}]")
    plots.plot([ran(tmp_path, WAVE + ZENER + stop)])
    texts = [text.get_text() for text in drawn[0].axes[0].texts]
    assert any(" at " in text and text.endswith("ms") for text in texts)
    assert "stage 1" in texts


def test_run_that_goes_on(tmp_path: Path, drawn: list[Figure]) -> None:
    """A row that is being written does not count, nor do maps that are not there yet."""
    out = ran(tmp_path, KINDS["creep"][0])
    with (out / "measures.csv").open("a") as file:
        file.write("9,0.5,0.1")
    with h5py.File(out / "fields.h5", "r+") as fields:
        fields["t"][3:] = np.nan
    plots.plot([out])
    assert panels(drawn[0]) == KINDS["creep"][1]
    (out / "fields.h5").write_bytes(b"")
    plots.plot([out])
    assert panels(drawn[1]) == KINDS["creep"][1][:-3]


def test_moved_heights_are_not_needed(tmp_path: Path) -> None:
    np.save(tmp_path / "road.npy", np.random.default_rng(1).normal(size=(32, 32)))
    surface = WAVE.replace(
        "{shape: wave, amplitude: 1.0e-6, waves: [1, 1]}", "{shape: file, path: road.npy, scale: 1.0e-7}"
    )
    out = ran(tmp_path, surface + ELASTIC + LOADS)
    (tmp_path / "road.npy").unlink()
    assert plots.plot([out])[0].exists()


def test_directory_without_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no measures\.csv"):
        plots.plot([tmp_path])
    (tmp_path / "measures.csv").write_text("step\n")
    with pytest.raises(InputError, match=r"job\.resolved\.yaml cannot be read"):
        plots.plot([tmp_path])


@pytest.mark.parametrize(("largest", "label"), [(3.2e-5, "µm"), (999.9, "m"), (1e3, "km"), (2e-12, "nm"), (0.0, "m")])
def test_prefixes(largest: float, label: str) -> None:
    found, (values,) = units.scaled("m", np.array([np.nan, largest, -0.5 * largest]))
    assert found == label
    assert values[1] * units.size_of(label, "m") == pytest.approx(largest)


# -- as a user asks for them ------------------------------------------------------------------------------------------


BACK = SLIDE.replace("}]", "}, {name: back, pressure: 1.0e3, velocity: -0.1, distance: 1.0e-3, cells_per_step: 1}]")
CURVE = "velocity,pressure,friction,contact_area\n"
POINTS = [(v, p, 0.1 * v, 0.2) for p in (1041.66666, 2.5e5) for v in (0.001, 0.1, 10.0)]


def asked(*words: str | Path) -> int:
    return main(["plot", *map(str, words)])


def curve(directory: Path, points: Sequence[Sequence[float]] = POINTS) -> Path:
    """A directory with a friction curve."""
    directory.mkdir(exist_ok=True)
    rows = [",".join(map(repr, point)) + "\n" for point in points]
    (directory / "steady.csv").write_text(CURVE + "".join(rows))
    return directory


def touching(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts of a figure that overlap."""
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    hidden = {text for axis in figure.findobj(Axis) for text in _beyond(axis)}
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text not in hidden]
    return [(a, b) for (a, one), (b, other) in combinations(boxes, 2) if one.shrunk(0.9, 0.9).overlaps(other)]


def _beyond(axis: Axis) -> list[Text]:
    """Labels of ticks outside of the range that is shown, and those that are switched off."""
    low, high = sorted(axis.get_view_interval())
    room = 1e-6 * (high - low)
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    outside = [tick for tick in ticks if not low - room <= tick.get_loc() <= high + room]
    return [text for tick in ticks for text in (tick.label1, tick.label2) if tick in outside or not text.get_visible()]


@pytest.mark.parametrize("kind", ["loads", "creep", "sliding"])
def test_labels_do_not_touch(tmp_path: Path, drawn: list[Figure], kind: str) -> None:
    assert asked(ran(tmp_path, KINDS[kind][0])) == 0
    assert touching(drawn[0]) == []


@pytest.mark.parametrize("stages", [3, 9])
def test_narrow_stages_keep_their_names(tmp_path: Path, drawn: list[Figure], stages: int) -> None:
    """A hundredth of the time each, and yet each is named, and no name touches another text."""
    short = [
        f"{{name: short stage {k}, pressure: {k + 1}.0e3, duration: 1.0e-5, time_step: 1.0e-5}}" for k in range(stages)
    ]
    text = ", ".join([*short, "{name: long, pressure: 1.0e3, duration: 1.0e-3, time_step: 2.0e-4}"])
    assert asked(ran(tmp_path, WAVE + ELASTIC + f"history: [{text}]\n")) == 0
    named = [text.get_text() for text in drawn[0].axes[0].texts]
    assert named == [*(f"short stage {k}" for k in range(stages)), "long"]
    assert touching(drawn[0]) == []


def test_reversal_shows_both_signs(tmp_path: Path, drawn: list[Figure]) -> None:
    """Its magnitude would have a cusp at 0."""
    assert asked(ran(tmp_path, WAVE + ZENER + BACK)) == 0
    friction = drawn[0].axes[0].get_lines()[0].get_ydata()
    assert np.min(friction) < -0.5 * np.max(friction)
    assert drawn[0].axes[0].get_ylim()[0] < np.min(friction)


def test_a_spike_at_the_start_does_not_flatten_the_rest(tmp_path: Path, drawn: list[Figure]) -> None:
    """A load at once meets the modulus of the first instant: that height is told, and the rest fills the panel."""
    stiff = "material: {model: zener, modulus_inf: 1.0e6, branches: [{modulus: 1.0e8, relaxation_time: 1.0e-6}]}\n"
    load = "history: [{force: 0.1, duration: 1.0e-2, time_step: {first: 1.0e-7, growth: 1.5}}]\n"
    assert asked(ran(tmp_path, SPHERE.replace("points: 32", "points: 64") + stiff + load)) == 0
    axes = drawn[0].axes[2]
    assert axes.get_ylabel() == PEAK.replace("k", "M")
    values = np.array(axes.get_lines()[0].get_ydata())
    assert values.max() > 3.0 * values[-1]
    assert values[-1] < axes.get_ylim()[1] < 2.0 * values[-1]
    assert f"{values.max():.3g} MPa" in axes.texts[0].get_text()


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
    legend = drawn[0].axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["1.04 kPa", "250 kPa"]
    assert touching(drawn[0]) == []


def test_free_curve_in_areas_and_forces(tmp_path: Path, drawn: list[Figure]) -> None:
    """No nominal area: 0.2 of (2 mm)^2 is 0.8 mm^2, and a mean pressure of 250 kPa on it is 1 N."""
    out = curve(ran(tmp_path, KINDS["numbers only"][0]))
    (out / "measures.csv").unlink()
    assert asked(out) == 0
    assert panels(drawn[0]) == [FRICTION, AREA]
    assert drawn[0].axes[1].get_lines()[0].get_ydata() == pytest.approx(0.8)
    legend = drawn[0].axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["4.17 mN", "1 N"]


@pytest.mark.parametrize("points", [POINTS[:1], POINTS[:3:2], []])
def test_curve_of_few_points(tmp_path: Path, drawn: list[Figure], points: Sequence[Sequence[float]]) -> None:
    """Any warning is an error here."""
    assert asked(curve(tmp_path, points)) == 0
    assert len(panels(drawn[0])) == (2 if points else 0)
    assert touching(drawn[0]) == []


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
        ("time [ms]", "log", "log")
    ] * 2
    assert asked(out, "--panels", "friction", "--over", "velocity") == 0
    line = drawn[1].axes[0].get_lines()[0]
    table = measures.read(out / "measures.csv")
    last = [table["distance"].index(value) for value in sorted(table["distance"]) if value <= 1.0001e-3][-1]
    assert np.array(line.get_xdata()).tolist() == [100.0, 200.0]
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
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == ["slow run", "other run"]
    assert {FRACTION, AREA} < set(panels(drawn[0]))
    assert touching(drawn[0]) == []


@pytest.mark.parametrize("kind", ["loads", "loads of a strip"])
def test_movie(tmp_path: Path, kind: str) -> None:
    """A frame for each saved instant."""
    out = ran(tmp_path, KINDS[kind][0])
    assert asked(out, "--movie", "pressure") == 0
    with Image.open(out / "pressure.gif") as movie:
        assert getattr(movie, "n_frames", 1) == 2


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--panels", "nonsense"], "there is no 'nonsense'"),
        (["--panels", "energy"], "none of the panels energy"),
        (["--log", "z"], "there is no axis 'z'"),
        (["--out", "picture.docx"], "pictures are png, pdf, svg"),
        (["--out", "nowhere/picture.png"], "cannot write nowhere/picture.png"),
        (["--movie", "height"], "no map of height: pressure, gap"),
        (["--movie", "gap", "--out", "gap.mp4"], "must end in .gif"),
        (["--over", "distance"], "nothing to draw over distance"),
        (["--over", "velocity"], "the surface slides in no stage"),
        (["there", "--out", "one.png"], "--compare"),
    ],
)
def test_what_cannot_be_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    out = ran(tmp_path, KINDS["loads"][0])
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    assert asked(out, *words) == 2
    assert told in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("value", "unit", "told"),
    [
        (1041.67, "Pa", "1.04 kPa"),
        (999.96, "m", "1 km"),
        (2.5e-8, "m²", "0.025 mm²"),
        (3e-10, "m²", "300 µm²"),
        (0.3, "", "0.3"),
        (0.0, "s", "0 s"),
    ],
)
def test_numbers_with_prefixes(value: float, unit: str, told: str) -> None:
    assert units.text(value, unit) == told
