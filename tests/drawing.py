"""Jobs to draw, and what a drawn figure shows; for the tests of pictures."""

from itertools import combinations
from pathlib import Path

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from parcontact import job
from parcontact.__main__ import main
from parcontact.files import run
from parcontact.files.stopping import Options
from parcontact.parallel.slab import Slab

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
    assert run.run_job(loaded, Slab.alone(*loaded.grid.points), Options(quiet=True)) == 0
    return tmp_path / "out"


def asked(*words: str | Path) -> int:
    """The exit code of `parcontact plot` with these words."""
    return main(["plot", *map(str, words)])


def panels(figure: Figure) -> list[str]:
    """The y axes of all panels, without those of the colours."""
    return [axes.get_ylabel() for axes in figure.axes if axes.get_xlabel()]


def entries(figure: Figure) -> list[str]:
    """The entries of all legends of a figure."""
    return [text.get_text() for legend in figure.findobj(Legend) for text in legend.get_texts()]


def touching(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts of a figure that overlap."""
    boxes = [(text.get_text(), text.get_window_extent()) for text in _seen(figure)]
    return [(a, b) for (a, one), (b, other) in combinations(boxes, 2) if one.shrunk(0.9, 0.9).overlaps(other)]


def outside(figure: Figure) -> list[str]:
    """Texts of a figure that leave the page."""
    page = figure.bbox.padded(1)
    ends = [(text.get_text(), text.get_window_extent()) for text in _seen(figure)]
    return [text for text, box in ends if not (page.contains(box.x0, box.y0) and page.contains(box.x1, box.y1))]


def _seen(figure: Figure) -> list[Text]:
    if figure.stale:  # has changed since it was drawn
        figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    hidden = {text for axis in figure.findobj(Axis) for text in _beyond(axis)}
    return [text for text in texts if text not in hidden]


def _beyond(axis: Axis) -> list[Text]:
    """Labels of ticks outside of the range that is shown, and those that are switched off."""
    place = axis.get_transform().transform  # on a logarithmic axis the logarithm
    low, high = sorted(map(place, axis.get_view_interval()))
    room = 1e-6 * (high - low)
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    outside = [tick for tick in ticks if not low - room <= place(tick.get_loc()) <= high + room]
    return [text for tick in ticks for text in (tick.label1, tick.label2) if tick in outside or not text.get_visible()]
