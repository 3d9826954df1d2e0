"""`parcontact plot`: a picture with the panels that a job has."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure
from mpi4py import MPI

from parcontact import job
from parcontact.errors import InputError
from parcontact.parallel.slab import Slab
from parcontact.record import plots
from parcontact.record.pictures.run import scaled, size_of
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

FRICTION, FRACTION, AREA = "friction coefficient", "contact area / nominal area", "contact area [mm²]"
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
    picture = plots.plot(ran(tmp_path, text))
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert panels(drawn[0]) == expected


def test_hertz_beside_the_sphere(tmp_path: Path, drawn: list[Figure]) -> None:
    """The computed pressures lie on Hertz's line, to 2 % of the highest at 7 cells per radius but for the edge."""
    plots.plot(ran(tmp_path, KINDS["Hertz"][0]))
    computed, hertz = drawn[0].axes[0].get_lines()
    assert hertz.get_label() == "Hertz"
    x, p = np.array(computed.get_xdata()), np.array(computed.get_ydata())
    exact = np.interp(x, np.array(hertz.get_xdata()), np.array(hertz.get_ydata()), left=0.0, right=0.0)
    inside = exact > 0.5 * exact.max()
    assert inside.sum() > 8
    assert np.abs(p - exact)[inside].max() < 0.02 * exact.max()


def test_peak_of_friction_is_named(tmp_path: Path, drawn: list[Figure]) -> None:
    stop = SLIDE.replace("}]", "}, {pressure: 1.0e3, duration: 5.0e-3, time_step: 5.0e-4}]")
    plots.plot(ran(tmp_path, WAVE + ZENER + stop))
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
    plots.plot(out)
    assert panels(drawn[0]) == KINDS["creep"][1]
    (out / "fields.h5").write_bytes(b"")
    plots.plot(out)
    assert panels(drawn[1]) == KINDS["creep"][1][:-3]


def test_moved_heights_are_not_needed(tmp_path: Path) -> None:
    np.save(tmp_path / "road.npy", np.random.default_rng(1).normal(size=(32, 32)))
    surface = WAVE.replace(
        "{shape: wave, amplitude: 1.0e-6, waves: [1, 1]}", "{shape: file, path: road.npy, scale: 1.0e-7}"
    )
    out = ran(tmp_path, surface + ELASTIC + LOADS)
    (tmp_path / "road.npy").unlink()
    assert plots.plot(out).exists()


def test_directory_without_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no measures\.csv"):
        plots.plot(tmp_path)
    (tmp_path / "measures.csv").write_text("step\n")
    with pytest.raises(InputError, match=r"job\.resolved\.yaml cannot be read"):
        plots.plot(tmp_path)


@pytest.mark.parametrize(("largest", "label"), [(3.2e-5, "µm"), (999.9, "m"), (1e3, "km"), (2e-12, "nm"), (0.0, "m")])
def test_prefixes(largest: float, label: str) -> None:
    found, (values,) = scaled("m", np.array([np.nan, largest, -0.5 * largest]))
    assert found == label
    assert values[1] * size_of(label, "m") == pytest.approx(largest)
