"""`parcontact plot`: a picture with the panels that a job has."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from drawing import ELASTIC, FRACTION, KINDS, PEAK, SLIDE, SPHERE, WAVE, ZENER, panels, ran
from matplotlib.figure import Figure

from parcontact.errors import InputError
from parcontact.files import tables
from parcontact.results import info, plots, prediction


@pytest.mark.parametrize("kind", KINDS)
def test_panels(tmp_path: Path, drawn: list[Figure], kind: str) -> None:
    text, expected = KINDS[kind]
    picture = plots.plot([ran(tmp_path, text)])[0]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert panels(drawn[0]) == expected


def test_sphere_is_drawn_with_hertz(tmp_path: Path, drawn: list[Figure]) -> None:
    """The computed pressures lie on Hertz's line, to 2 % of the highest at 7 cells per radius but for the edge."""
    plots.plot([ran(tmp_path, KINDS["Hertz"][0])])
    computed, hertz = drawn[0].axes[0].get_lines()
    assert hertz.get_label() == "Hertz"
    x, p = np.array(computed.get_xdata()), np.array(computed.get_ydata())
    exact = np.interp(x, np.array(hertz.get_xdata()), np.array(hertz.get_ydata()), left=0.0, right=0.0)
    inside = exact > 0.5 * exact.max()
    assert inside.sum() > 8
    assert np.abs(p - exact)[inside].max() < 0.02 * exact.max()
    (tmp_path / "layer").mkdir()
    plots.plot([ran(tmp_path / "layer", KINDS["Hertz"][0] + "body: {thickness: 1.0e-3}\n")])
    assert len(drawn[1].axes[0].get_lines()) == 1  # no theory of a half space


def test_no_panel_of_friction_that_is_0(tmp_path: Path, drawn: list[Figure]) -> None:
    """A flat surface slides without friction."""
    plots.plot([ran(tmp_path, WAVE.replace("1.0e-6", "0.0") + ZENER + SLIDE)])
    assert panels(drawn[0]) == [FRACTION, PEAK]


def test_theory_is_drawn_with_a_run(tmp_path: Path, drawn: list[Figure]) -> None:
    """Where theory.csv is, friction and contact area have its line, over what the run is drawn over."""
    out = ran(tmp_path, WAVE + ZENER + SLIDE)
    text = "time,distance,pressure,friction,contact_area\n0.0,0.0,1e3,0.0,0.5\n1.0,2e-3,1e3,0.25,0.75\n"
    (out / "theory.csv").write_text(text)
    plots.plot([out])
    friction, area, *others = drawn[0].axes
    lines = {axes.get_ylabel(): {str(line.get_label()): line for line in axes.get_lines()} for axes in (friction, area)}
    for found, values in zip(lines.values(), ([0.0, 0.25], [0.5, 0.75]), strict=True):
        assert np.allclose(found["theory"].get_ydata(), values)
        assert np.allclose(np.array(found["theory"].get_xdata())[0], 0.0)
        assert "simulation" in found
    assert not any(line.get_label() == "theory" for axes in others for line in axes.get_lines())
    prediction.write_settings(out, info.TheorySettings(0.5, "lattice"))
    plots.plot([out])
    assert (
        drawn[1].get_suptitle().splitlines()[-1]
        == "Persson's theory: gamma 0.5, for the waves of the surface in its box"
    )


def test_a_directory_above_that_of_a_run(tmp_path: Path) -> None:
    out = ran(tmp_path, KINDS["creep"][0])
    with pytest.raises(InputError, match=rf"has neither a run nor a friction curve: .*; did you mean {out}\?$"):
        plots.plot([out.parent])


def test_theory_is_drawn_with_a_run_with_an_interface(tmp_path: Path, drawn: list[Figure]) -> None:
    """The friction that the theory is of, without that of the interface, has a line of its own."""
    out = ran(tmp_path, WAVE + ZENER + SLIDE + "interface: {shear_stress: 1.0e3}\n")
    (out / "theory.csv").write_text("time,distance,pressure,friction,contact_area\n0.0,0.0,1e3,0.0,0.5\n")
    plots.plot([out])
    lines = {str(line.get_label()): np.array(line.get_ydata()) for line in drawn[0].axes[0].get_lines()}
    assert np.all(lines["simulation"][1:] > lines["without interface"][1:])
    saved = tables.read_columns(out / "measures.csv")["friction_viscous"]
    assert np.allclose(lines["without interface"], saved[-len(lines["without interface"]) :])


def test_run_that_goes_on(tmp_path: Path, drawn: list[Figure]) -> None:
    """A row that is being written does not count, nor do maps that are not there yet; a file of maps that was cut
    off is refused."""
    out = ran(tmp_path, KINDS["creep"][0])
    with (out / "measures.csv").open("a") as file:
        file.write("9,0.5,0.1")
    with h5py.File(out / "fields.h5", "r+") as fields:
        fields["t"][3:] = np.nan
    plots.plot([out])
    assert panels(drawn[0]) == KINDS["creep"][1]
    (out / "fields.h5").write_bytes(b"")
    with pytest.raises(InputError, match=r"fields\.h5 cannot be read: it is not an HDF5 file, or incomplete"):
        plots.plot([out])
    (out / "fields.h5").unlink()
    plots.plot([out])
    assert panels(drawn[1]) == KINDS["creep"][1][:-3]


def test_directory_without_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"neither measures\.csv nor"):
        plots.plot([tmp_path])
    (tmp_path / "measures.csv").write_text("step\n")
    with pytest.raises(InputError, match=r"job\.resolved\.yaml cannot be read"):
        plots.plot([tmp_path])


def test_load_over_approach_is_a_loop(tmp_path: Path, drawn: list[Figure]) -> None:
    """Every row in its order, there and back, and no panel of the approach over itself."""
    ramps = [
        f"{{approach: {{from: {a}, to: {b}}}, duration: 1.0e-3, time_step: 2.5e-4}}" for a, b in ((0, 2e-6), (2e-6, 0))
    ]
    out = ran(tmp_path, SPHERE + ZENER + f"history: [{', '.join(ramps)}]\n")
    plots.plot([out], plots.PlotOptions(over="approach"))
    assert "approach [µm]" not in panels(drawn[0])
    (axes,) = (axes for axes in drawn[0].axes if axes.get_ylabel().startswith("force"))
    x = np.array(axes.get_lines()[0].get_xdata())
    assert axes.get_xlabel() == "approach [µm]"
    assert x.size == 9
    assert np.all(np.diff(x[:5]) > 0)
    assert np.all(np.diff(x[4:]) < 0)


def test_a_contact_that_sticks_is_drawn_with_its_tension(tmp_path: Path, drawn: list[Figure]) -> None:
    """Approach, force and pressure go below 0, and all five energies are there, with their legend below the panel."""
    stick = "adhesion: {work: 0.05, range: 3.0e-6}\noutput: {energy: true, fields: [pressure]}\n"
    stages = "history: [{approach: {from: -4.0e-6, to: -1.0e-6}, duration: 1.0, time_step: 0.25}]\n"
    plots.plot([ran(tmp_path, SPHERE + ELASTIC + stick + stages)])
    found = {axes.get_ylabel().split(" [")[0]: axes for axes in drawn[0].axes if axes.get_lines()}
    for name in ("approach", "force", "pressure"):
        assert found[name].get_ylim()[0] < 0.0
        assert min(np.nanmin(np.array(line.get_ydata())) for line in found[name].get_lines()) < 0.0
    legend = found["energy"].get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == 5
    drawn[0].draw_without_rendering()
    assert legend.get_window_extent().y1 <= found["energy"].get_window_extent().y0


def test_a_slide_without_load_is_drawn_with_its_force(tmp_path: Path, drawn: list[Figure]) -> None:
    """Friction is not defined, and 0 in the table. A load that is the rounding of pressure and tension is 0 N."""
    stick = "adhesion: {work: 0.05, range: 3.0e-6}\ninterface: {shear_stress: 1.0e4, stick: true}\n"
    slide = "{force: 0.0, velocity: 1.0e-4, distance: 2.0e-5, cells_per_step: 0.5}"
    history = f"history: [{{force: 1.0e-3, duration: 1.0, time_step: 1.0}}, {slide}]\noutput: {{fields: [pressure]}}\n"
    out = ran(tmp_path, SPHERE + ELASTIC + stick + history)
    plots.plot([out])
    found = {axes.get_ylabel().split(" [")[0]: axes for axes in drawn[0].axes if axes.get_lines()}
    assert "friction coefficient" not in found
    force = np.array(found["tangential force"].get_lines()[0].get_ydata())
    assert np.allclose(force, -np.array(tables.read_columns(out / "measures.csv")["force_x"])[-force.size :], rtol=1e-2)
    assert any(axes.get_title().endswith(" s, 0 N") for axes in drawn[0].axes)
    assert "last row: pressure 0 Pa," in info.describe_files(out)[0]


def test_a_cycle_of_stick_is_drawn_as_a_loop(tmp_path: Path, drawn: list[Figure]) -> None:
    """Friction over the displacement, which returns; and the energy lost in slip is named."""
    stick = "interface: {coefficient: 0.5, stick: true}\noutput: {energy: true}\n"
    way = "{force: 0.1, velocity: %s1.0e-6, duration: 1.0, time_step: 0.5}"
    stages = f"history: [{{force: 0.1}}, {way % ''}, {way % '-'}]\n"
    plots.plot([ran(tmp_path, SPHERE + ELASTIC + stick + stages)])
    (loop,) = (axes for axes in drawn[0].axes if axes.get_xlabel() == "displacement along x [µm]")
    (line,) = loop.get_lines()
    assert np.array(line.get_xdata()) == pytest.approx([0.0, 5e-7, 1e-6, 5e-7, 0.0], abs=1e-18)
    friction = np.array(line.get_ydata())
    assert friction[0] == pytest.approx(0.0, abs=1e-5)
    assert friction[1] > friction[3]  # there and back
    (energy,) = (axes for axes in drawn[0].axes if axes.get_ylabel().startswith("energy"))
    legend = energy.get_legend()
    assert legend is not None
    assert "slip" in [text.get_text() for text in legend.get_texts()]


def test_a_load_is_not_drawn_over_itself(tmp_path: Path, drawn: list[Figure]) -> None:
    out = ran(tmp_path, SPHERE + ELASTIC + "history: [{force: {from: 0, to: 0.1}, duration: 1.0, time_step: 0.25}]\n")
    for over, there in (("time", 1), ("load", 0)):
        plots.plot([out], plots.PlotOptions(over=over))
        assert [axes.get_ylabel()[:5] for axes in drawn[-1].axes].count("force") == there
