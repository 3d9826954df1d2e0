"""`parcontact fit` as a user calls it: files made and kept, laws given, bad input in one sentence."""

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from conftest import Main
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.special import gamma

from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.results import inputs
from parcontact.rubber import compound
from parcontact.rubber.series import PronySeries, Vertical, Weigh
from parcontact.rubber.shift import WLF, Arrhenius, Factors, read_shift

from . import measured
from .bodies import BROAD, DENSE, STEEP, TEN, Body, noisy, write
from .measured import Array

JOB = """
grid: {points: 32, size: 1.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [4, 0]}
material: {include: rubber}
history: [{pressure: 1.0e4, velocity: 1.0e6, distance: 1.0e-3, cells_per_step: 1}]
"""


def test_one_temperature_has_no_shift(tmp_path: Path, main: "Main") -> None:
    """No shift is fitted to a table of one temperature, and a message says so; constants may be given."""
    measured.write_sweeps(tmp_path / "one.csv", temperatures=(20.0,))
    _, out, _ = main("fit", "one.csv", "--shift", "wlf")
    assert "No shift: it takes several temperatures, or given constants, as --shift wlf:C1,C2." in out
    _, out, _ = main("fit", "one.csv", "--shift", "wlf:8.86,101.6", "--reference", "20")
    assert "Horizontal shift, given" in out
    assert "No shift" not in out


@pytest.mark.rendered
def test_a_table_becomes_a_material(tmp_path: Path, main: "Main") -> None:
    """The file is included by a job, the picture has a picture's size, and frequencies beyond the data are stated."""
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
    assert matplotlib.image.imread(tmp_path / "materials" / "rubber.png").shape[1] == 1160
    assert main(*words)[0] == 0  # its own files are made anew
    code, _, err = main("fit", "rubber.csv", "--poisson", "-1")
    assert code == 2
    assert "must be a Poisson ratio above -1 and up to 0.5, got '-1'" in err
    (tmp_path / "mine.yaml").write_text("title: mine\n")
    code, _, err = main("fit", "rubber.csv", "--out", "mine.yaml")
    assert code == 2
    assert err.startswith("parcontact: mine.yaml exists and was not written by parcontact fit")
    assert (tmp_path / "mine.yaml").read_text() == "title: mine\n"


def moduli(tmp_path: Path, head: str, given: tuple[int, int], drawn: "list[Figure]") -> tuple[str, dict[str, Array]]:
    """What the first panel of the picture of a fit shows, for a table with two columns: storage [MPa], loss [MPa] and
    tan delta of one sweep are 0, 1 and 2."""
    g = measured.complex_modulus(2 * np.pi * measured.FREQUENCIES)
    columns = (1e-6 * g.real, 1e-6 * g.imag, g.imag / g.real)
    rows = zip(measured.FREQUENCIES, columns[given[0]], columns[given[1]], strict=True)
    (tmp_path / "rubber.csv").write_text("\n".join([head, *(f"{f:.9g} {a:.9g} {b:.9g}" for f, a, b in rows)]) + "\n")
    made = compound.fitted(tmp_path / "rubber.csv", 0.25, None, "wlf", 0.05)
    inputs.draw_compound(made, tmp_path / "rubber.png")
    axes = drawn[-1].axes[0]
    return axes.get_ylabel(), {str(one.get_label()): np.asarray(one.get_ydata()) for one in axes.get_lines()}


@pytest.mark.parametrize(
    ("head", "given", "label", "names"),
    [
        ("f[Hz] E'[MPa] E''[MPa]", (0, 1), "Young's modulus [MPa]", ["E' measured", "E'' measured"]),
        ("f[Hz] G'[MPa] G''[MPa]", (0, 1), "shear modulus [MPa]", ["G' measured", "G'' measured"]),
        ("f[Hz] E'[MPa] tan_del[-]", (0, 2), "Young's modulus [MPa]", ["E' measured", "E'' = E' tan δ measured"]),
        ("f[Hz] G''[MPa] tan_del[-]", (1, 2), "shear modulus [MPa]", ["G' = G'' / tan δ measured", "G'' measured"]),
    ],
)
def test_the_picture_shows_what_was_measured(
    tmp_path: Path, drawn: "list[Figure]", head: str, given: tuple[int, int], label: str, names: list[str]
) -> None:
    """Moduli of the table itself, whatever Poisson's ratio divides Young's by, and a fit of 5 % next to them."""
    shown, lines = moduli(tmp_path, head, given, drawn)
    assert shown == label
    truth = measured.complex_modulus(2 * np.pi * measured.FREQUENCIES)
    for name, values in zip(names, (truth.real, truth.imag), strict=True):
        np.testing.assert_allclose(lines[name], values, rtol=1e-6)
        fitted = lines[f"{name[:3].strip()} fitted"]
        assert np.median(fitted) == pytest.approx(np.median(values), rel=0.1)


def test_laws_given(tmp_path: Path) -> None:
    assert read_shift("wlf", None) == "wlf"
    assert read_shift("wlf:8.86,101.6", 20.0) == WLF(8.86, 101.6, 20.0)
    assert read_shift("arrhenius:1.2e5", 20.0) == Arrhenius(1.2e5, 20.0)
    path = tmp_path / "factors.csv"
    path.write_text("T[C],log_aT\n# of a laboratory\n40,-1\n20, 0\n0,2\n")
    assert read_shift(str(path), None) == Factors((0.0, 20.0, 40.0), (2.0, 0.0, -1.0), 20.0)


@pytest.mark.parametrize(
    ("text", "reference", "content", "sentence"),
    [
        ("wlf:8,100", None, "", "needs --reference"),
        ("wlf:8", 20.0, "", "must be of the form wlf:C1,C2"),
        ("wlf:8,100", -300.0, "", "--reference must be above -273.15 C, got -300"),
        ("arrhenius:much", 20.0, "", "must be of the form arrhenius:J/mol"),
        ("none.csv", None, "", "or a readable file"),
        ("factors.csv", None, "", "a table of T"),
        ("factors.csv", None, "T[F],log_aT\n0,1\n1,2\n", "the unit of T must be one of C,"),
        ("factors.csv", None, "T[C],aT\n0,1\n1,2\n", "a table of T"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n", "a table of T"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n1\n", ":3: 1 values where 2 columns"),
        ("factors.csv", None, "T[C],log_aT\n0,1\n1,nan\n", ":3: log_aT must be a finite number, got 'nan'"),
        ("factors.csv", None, "T[C],log_aT,log_bT\n0,1,0\n1,0\n", ":3: 2 values where 3 columns"),
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
        read_shift(text, reference)
    assert sentence in str(failure.value)


def glass(temperature: float) -> float:
    """log10 of a_T: WLF above -10 C, and Arrhenius below, as in a glass."""
    above = max(temperature, -10.0) - 20.0
    return -9.375 * above / (80.0 + above) + 0.11 * max(0.0, -10.0 - temperature)


@pytest.mark.parametrize("vertical", ["none", "free"])
def test_free_factors_below_a_glass_transition(tmp_path: Path, vertical: Vertical) -> None:
    """Sweeps that overlap by more than a decade with 0.3 % noise: factors to 0.3 decades where no WLF holds."""
    dice, lines = np.random.default_rng(2), ["T[C] f[Hz] G'[Pa] G''[Pa]"]
    f = np.geomspace(0.1, 31.6, 6)
    temperatures = np.arange(-50.0, 101.0, 10.0)
    for temperature in map(float, temperatures):
        g = measured.complex_modulus(2 * np.pi * f * 10.0 ** glass(temperature))
        for at, storage, loss in zip(
            f, g.real * dice.normal(1, 0.003, 6), g.imag * dice.normal(1, 0.003, 6), strict=True
        ):
            lines.append(f"{temperature} {at} {storage} {loss}")
    (tmp_path / "glass.txt").write_text("\n".join(lines))
    made = compound.fitted(tmp_path / "glass.txt", 0.5, 20.0, "free", 0.02, vertical=vertical)
    assert made.shift is not None
    assert_allclose([made.shift.log_factor(t) for t in temperatures], list(map(glass, temperatures)), atol=0.3)
    assert not any("overlap" in doubt for doubt in made.doubts())


def test_a_table_in_kelvin_that_says_degrees(tmp_path: Path, main: "Main") -> None:
    """A measurement of 253 to 333 K with the unit C gets a warning, and with the unit K none; a table of factors in
    kelvin does not reach the measurement."""
    path = measured.write_sweeps(tmp_path / "table.csv")
    head, *body = path.read_text().splitlines()
    unit, kelvin = body[0], [f"{line.rsplit(',', 1)[0]},{float(line.rsplit(',', 1)[1]) + 273.15}" for line in body[1:]]
    for name, units in (("C", unit), ("K", unit.replace("°C", "K"))):
        (tmp_path / f"{name}.csv").write_text("\n".join([head, units, *kelvin]))
    wrong = compound.fitted(tmp_path / "C.csv", 0.5, None, "wlf", 0.05).doubts()
    assert any(
        "333.15 C is hotter than rubber endures (limit: 200 C)" in doubt and "give 60" in doubt for doubt in wrong
    )
    assert not any("hotter" in doubt for doubt in compound.fitted(tmp_path / "K.csv", 0.5, None, "wlf", 0.05).doubts())
    (tmp_path / "factors.csv").write_text("T[C],log_aT\n250,3\n293.15,0\n340,-2\n")
    code, _, err = main("fit", path, "--shift", tmp_path / "factors.csv", "--out", tmp_path / "a.yaml")
    assert (code, "outside the shift factors" in err) == (2, True)


# -- the loss modulus that follows from a table, which friction depends on: also where it was not measured ------------


def miss(series: PronySeries, body: Body, low: float, high: float) -> Array:
    """The relative errors of the loss modulus between two frequencies [Hz], 20 in a decade."""
    omega = 2 * np.pi * np.geomspace(low, high, round(20 * np.log10(high / low)) + 1)
    return np.asarray(series.modulus(omega).imag / body.modulus(omega).imag - 1.0)


def relaxed(path: Path, body: Body, first: float, last: float, noise: float = 0.0) -> PronySeries:
    """The fit of G(t), with eight points in a decade."""
    t = np.geomspace(first, last, round(8 * np.log10(last / first)) + 1)
    made = compound.fitted(write(path, "t[s] G(t)[Pa]", t, noisy(body.relaxation(t), noise)), 0.5, None, "wlf", 0.02)
    series: PronySeries = made.series
    return series


def swept(path: Path, body: Body, low: float, high: float, weigh: Weigh, noise: float = 0.0) -> PronySeries:
    """The fit of moduli between two frequencies [Hz], with eight points in a decade."""
    f = np.geomspace(low, high, round(8 * np.log10(high / low)) + 1)
    g = body.modulus(2 * np.pi * f)
    table = write(path, "f[Hz] G'[Pa] G''[Pa]", f, noisy(g.real, noise), noisy(g.imag, noise, seed=2))
    series: PronySeries = compound.fitted(table, 0.5, None, "wlf", 0.02, weigh).series
    return series


def test_a_relaxation_of_seven_decades(tmp_path: Path) -> None:
    """One branch in each decade: 5 % from 1e-4 to 10 Hz, as was asked; four branches met G(t) to 2 % and the loss to
    44 %. A branch per decade is the least."""
    series = relaxed(tmp_path / "table.txt", TEN, 1e-3, 1e4)
    assert np.abs(miss(series, TEN, 1e-4, 10.0)).max() < 0.05
    assert series.moduli.size >= 7


@pytest.mark.parametrize("weigh", ["storage", "both", "loss"])
def test_moduli_of_six_decades(tmp_path: Path, weigh: Weigh) -> None:
    """The same body: 5 % from 1e-4 to 10 Hz, whichever modulus counts; from 100 Hz on its spectrum has an end."""
    series = swept(tmp_path / "table.txt", TEN, 1e-4, 100.0, weigh)
    assert np.abs(miss(series, TEN, 1e-4, 10.0)).max() < 0.05
    middle = np.array([2 * np.pi])
    assert series.modulus(middle)[0].real == pytest.approx(TEN.modulus(middle)[0].real, rel=0.02)


BODIES = {"dense": DENSE, "broad": BROAD, "steep": STEEP}


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("name", BODIES)
def test_other_bodies(tmp_path: Path, name: str, noise: float) -> None:
    """8 % inside the band of a relaxation (half a decade from its ends) and of storage moduli, with and without noise
    of 0.1 %. A noise of 1 % makes 10 to 20 %: that is in the data."""
    series = relaxed(tmp_path / "table.txt", BODIES[name], 1e-4, 1e3, noise)
    low, high = np.array(series.band) / (2 * np.pi)
    assert (low, high) == pytest.approx((1 / (2e3 * np.pi), 1 / (20 * 1e-4)))
    assert np.abs(miss(series, BODIES[name], low * 10**0.5, high / 10**0.5)).max() < 0.08
    series = swept(tmp_path / "table.txt", BODIES[name], 1e-3, 1e3, "storage", noise)
    assert np.abs(miss(series, BODIES[name], 1e-3 * 10**0.5, 1e3 / 10**0.5)).max() < 0.08


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
def test_the_stated_error(tmp_path: Path, noise: float) -> None:
    """Of four bodies and three kinds of tables, as two standard deviations: 4 of 5 true errors are smaller, all are
    less than twice as large, and the median is a sixth of it or more; at the ends, beyond which nothing is measured,
    3 of 4 are smaller."""
    inside, ends = [], []
    weights: tuple[Weigh, ...] = ("storage", "both")
    for number, body in enumerate((TEN, *BODIES.values())):
        path = tmp_path / f"{number}.txt"
        fits = [relaxed(path, body, 1e-4, 1e3, noise)]
        fits += [swept(path, body, 1e-3, 1e3, weigh, noise) for weigh in weights]
        for series in fits:
            low, high = np.array(series.band) / (2 * np.pi)
            inner = miss(series, body, low * 10**0.5, high / 10**0.5)
            inside.append(np.sqrt(np.mean(inner**2)) / series.loss_errors[0])
            both = zip((low, high), series.loss_errors[1:], strict=True)
            ends += [abs(miss(series, body, f, 1.01 * f)[0]) / stated for f, stated in both]
    assert np.mean(np.array(inside) < 1.0) >= 0.8
    assert np.median(inside) > 1 / 6
    assert np.max(inside) < 2.0
    assert np.mean(np.array(ends) < 1.0) >= 0.75


@pytest.mark.parametrize("power", [0.2, 0.4, 0.6])
def test_branches_faster_than_a_relaxation_count_in_the_stated_error(tmp_path: Path, power: float) -> None:
    """E(t) = 3 MPa + 20 MPa (t/s)^-n from 0.1 s on, whose loss modulus is 20 MPa Gamma(1-n) sin(n pi/2) (w s)^n: the
    table has nothing of the branches faster than 10 ms, which the loss modulus lacks at the upper end of the band. The
    error there is below the stated one, but above half of it. Inside the band it is below a tenth more than the stated
    one. Where the loss modulus was measured, these branches do not count: twice the 2 % of the fit at most."""
    scale = 20e6 * gamma(1.0 - power)

    def modulus(omega: Array) -> NDArray[np.complex128]:
        return np.asarray(3e6 + scale * (1j * omega) ** power)

    body = Body(lambda t: np.asarray(3e6 + 20e6 * t**-power), modulus)
    series = relaxed(tmp_path / "table.txt", body, 0.1, 1e4)
    low, high = np.array(series.band) / (2 * np.pi)
    inner = miss(series, body, low * 10**0.5, high / 10**0.5)
    assert np.sqrt(np.mean(inner**2)) < 1.1 * series.loss_errors[0]
    assert 0.5 < abs(miss(series, body, 0.99 * high, high)[-1]) / series.loss_errors[2] < 1.0
    assert swept(tmp_path / "table.txt", body, 1e-5, 0.5, "both").loss_errors[2] < 0.04


def test_a_table_with_a_loss_modulus_is_not_asked_for_it(tmp_path: Path) -> None:
    """With 3 % of noise the storage modulus hardly determines the loss modulus, which the table has."""
    f = np.geomspace(1e-3, 1e3, 49)
    g = TEN.modulus(2 * np.pi * f)
    table = write(tmp_path / "t.txt", "f[Hz] G'[Pa] G''[Pa]", f, noisy(g.real, 0.03), noisy(g.imag, 0.03, seed=2))
    (text,) = compound.fitted(table, 0.5, None, "wlf", 0.02, "storage").doubts()
    assert text.endswith("friction goes with it: leave out --weight storage")
    assert compound.fitted(table, 0.5, None, "wlf", 0.02).doubts() == []


def test_creep(tmp_path: Path) -> None:
    """J(t) of a standard solid in closed form, J_0 + J_1 (1 - exp(-t/lambda)): G* = 1/J* to 2 % in the band, also the
    loss; and the fit shows the same J(t). In tension D = J/3."""
    t, instant, delayed, time = np.geomspace(1e-3, 1e2, 41), 2e-7, 5e-7, 0.1
    compliance = instant + delayed * -np.expm1(-t / time)
    for head, factor in (("t[s] J(t)[1/Pa]", 1.0), ("t[s] D(t)[1/Pa]", 1.0 / 3.0), ("t[s] J(t)[1/MPa]", 1e6)):
        made = compound.fitted(write(tmp_path / "table.txt", head, t, factor * compliance), 0.5, None, "wlf", 0.01)
        low, high = made.series.band
        omega = np.geomspace(low, high, 50)
        right = 1.0 / (instant + delayed / (1.0 + 1j * omega * time))
        np.testing.assert_allclose(made.series.modulus(omega), right, rtol=0.02)
        peak = np.abs(omega * time - 1.0) < 1.0
        np.testing.assert_allclose(made.series.modulus(omega)[peak].imag, right[peak].imag, rtol=0.02)
        np.testing.assert_allclose(1.0 / made.series.response("creep", t), compliance, rtol=0.02)
        assert made.doubts() == []
