"""`parcontact fit` as a user calls it: files made and kept, laws given, bad input in one sentence."""

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.image
import numpy as np
import pytest

from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.plotting import compound as pictures
from parcontact.rubber import compound
from parcontact.rubber.shift import WLF, Arrhenius, Factors, given

from . import measured
from .measured import Array

if TYPE_CHECKING:
    from conftest import Main
    from matplotlib.figure import Figure

JOB = """
grid: {points: 32, size: 1.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [4, 0]}
material: {include: rubber}
history: [{pressure: 1.0e4, velocity: 1.0e6, distance: 1.0e-3, cells_per_step: 1}]
"""


@pytest.mark.rendered
def test_a_table_becomes_a_material(tmp_path: Path, main: "Main") -> None:
    """The file is included by a job, the picture has a picture's size, and frequencies beyond the data are told."""
    measured.write_sweeps(tmp_path / "rubber.csv", noise=0.02)
    job = tmp_path / "job.yaml"
    job.write_text(JOB.replace("{include: rubber}", "{model: elastic, shear_modulus: 1.0e6}"))
    words: list[str | Path] = ["fit", "rubber.csv", "--out", "materials/rubber.yaml", "--reference", "20", "--job", job]
    code, out, err = main(*words)
    assert code == 0, err
    assert "Estimated error of the loss modulus: " in out
    assert "times are in s at 20 C, where a job is that has no `temperature: T`" in out
    assert "warning: the job's frequencies reach 1.8 decades above the measured band" in out
    job.write_text(JOB)
    found = jobs.load(job).material
    assert isinstance(found, jobs.Zener)
    assert len(found.branches) >= 12  # one for each decade
    assert matplotlib.image.imread(tmp_path / "materials" / "rubber.png").shape[:2] == (900, 1200)
    assert main(*words)[0] == 0  # its own files are made anew
    code, _, err = main("fit", "rubber.csv", "--poisson", "-1")
    assert code == 2
    assert "must be a Poisson ratio above -1 and up to 0.5, got '-1'" in err
    (tmp_path / "mine.yaml").write_text("title: mine\n")
    code, _, err = main("fit", "rubber.csv", "--out", "mine.yaml")
    assert code == 2
    assert err.startswith("parcontact: mine.yaml is there and was not written by parcontact fit")
    assert (tmp_path / "mine.yaml").read_text() == "title: mine\n"


def moduli(tmp_path: Path, head: str, given: tuple[int, int], drawn: "list[Figure]") -> tuple[str, dict[str, Array]]:
    """What the first panel of the picture of a fit shows, for a table with two columns: storage [MPa], loss [MPa] and
    tan delta of one sweep are 0, 1 and 2."""
    g = measured.complex_modulus(2 * np.pi * measured.FREQUENCIES)
    columns = (1e-6 * g.real, 1e-6 * g.imag, g.imag / g.real)
    rows = zip(measured.FREQUENCIES, columns[given[0]], columns[given[1]], strict=True)
    (tmp_path / "rubber.csv").write_text("\n".join([head, *(f"{f:.9g} {a:.9g} {b:.9g}" for f, a, b in rows)]) + "\n")
    made = compound.fitted(tmp_path / "rubber.csv", 0.25, None, "wlf", 0.05)
    pictures.draw(made, tmp_path / "rubber.png")
    axes = drawn[-1].axes[0]
    return axes.get_ylabel(), {str(one.get_label()): np.asarray(one.get_ydata()) for one in axes.get_lines()}


@pytest.mark.parametrize(
    ("head", "given", "label", "names"),
    [
        ("f[Hz] E'[MPa] E''[MPa]", (0, 1), "Young's modulus [Pa]", ["E' measured", "E'' measured"]),
        ("f[Hz] G'[MPa] G''[MPa]", (0, 1), "shear modulus [Pa]", ["G' measured", "G'' measured"]),
        ("f[Hz] E'[MPa] tan_del[-]", (0, 2), "Young's modulus [Pa]", ["E' measured", "E'' = E' tan δ measured"]),
        ("f[Hz] G''[MPa] tan_del[-]", (1, 2), "shear modulus [Pa]", ["G' = G'' / tan δ measured", "G'' measured"]),
    ],
)
def test_the_picture_shows_what_was_measured(
    tmp_path: Path, drawn: "list[Figure]", head: str, given: tuple[int, int], label: str, names: list[str]
) -> None:
    """Moduli of the table itself, whatever Poisson's ratio divides Young's by, and a fit of 5 % beside them."""
    shown, lines = moduli(tmp_path, head, given, drawn)
    assert shown == label
    truth = measured.complex_modulus(2 * np.pi * measured.FREQUENCIES)
    for name, values in zip(names, (truth.real, truth.imag), strict=True):
        np.testing.assert_allclose(lines[name], values, rtol=1e-6)
        fitted = lines[f"{name[:3].strip()} fitted"]
        assert np.median(fitted) == pytest.approx(np.median(values), rel=0.1)


def test_laws_given(tmp_path: Path) -> None:
    assert given("wlf", None) == "wlf"
    assert given("wlf:8.86,101.6", 20.0) == WLF(8.86, 101.6, 20.0)
    assert given("arrhenius:1.2e5", 20.0) == Arrhenius(1.2e5, 20.0)
    path = tmp_path / "factors.csv"
    path.write_text("T[C],log_aT\n# of a laboratory\n40,-1\n20, 0\n0,2\n")
    assert given(str(path), None) == Factors((0.0, 20.0, 40.0), (2.0, 0.0, -1.0), 20.0)


@pytest.mark.parametrize(
    ("text", "reference", "content", "sentence"),
    [
        ("wlf:8,100", None, "", "needs --reference"),
        ("wlf:8", 20.0, "", "must be of the form wlf:C1,C2"),
        ("arrhenius:much", 20.0, "", "must be of the form arrhenius:J/mol"),
        ("none.csv", None, "", "or a readable file"),
        ("factors.csv", None, "", "a table of T"),
        ("factors.csv", None, "T[K],log_aT\n0,1\n1,2\n", "a table of T"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n", "a table of T"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n1\n", "each row must hold"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n1,nan\n", "each row must hold"),
        ("factors.csv", None, "T[C],log_aT,log_bT\n0,1,0\n1,0\n", "each row must hold"),
        ("factors.csv", None, "T[C],log_aT,other\n0,1,0\n1,0,0\n", "a table of T"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n0,2\n", "has two factors"),
        ("factors.csv", 50.0, "T[C],log_aT\n0,1\n20,0\n", "50 C is outside"),
    ],
)
def test_laws_that_will_not_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, reference: float | None, content: str, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "factors.csv").write_text(content)
    with pytest.raises(InputError) as failure:
        given(text, reference)
    assert sentence in str(failure.value)
