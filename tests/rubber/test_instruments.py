"""Tables as instruments and laboratories write them: each is read as what it is, or refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest
from conftest import Main
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.rubber import compound, moduli
from parcontact.rubber.shift import WLF

from . import measured
from .bodies import write

STORAGE, LOSS = np.array([0.3, 0.35, 0.45]), np.array([0.03, 0.06, 0.12])  # MPa at 0.1, 1 and 10 Hz
ABSOLUTE, ANGLE = np.hypot(STORAGE, LOSS), np.degrees(np.arctan2(LOSS, STORAGE))
RATES = np.array([0.1, 1.0, 10.0])
DEGREES = np.full(3, 20.0)


def rows(head: str, *columns: np.ndarray, mark: str = ",") -> str:
    lines = (mark.join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([head, *lines]) + "\n"


SHEAR = {  # what is written, and its encoding
    "a quote for two primes": (rows("f\tG'\tG\"\nHz\tMPa\tMPa", RATES, STORAGE, LOSS, mark="\t"), "utf-8"),
    "the same between commas": (rows("f,G',G\"\nHz,MPa,MPa", RATES, STORAGE, LOSS), "utf-8"),
    "quoted quotes": (rows('"f [Hz]","G\' [MPa]","G"" [MPa]"', RATES, STORAGE, LOSS), "utf-8"),
    "quotes in brackets": (rows("f[Hz] G'[MPa] G\"[MPa]", RATES, STORAGE, LOSS, mark=" "), "utf-8"),
    "absolute value and angle": (
        rows("Frequency (Hz)\t|G*| (MPa)\tdelta (deg)", RATES, ABSOLUTE, ANGLE, mark="\t"),
        "utf-8",
    ),
    "the same in words": (
        rows("Frequency (Hz),Complex shear modulus (MPa),Phase angle (°)", RATES, ABSOLUTE, ANGLE),
        "latin-1",
    ),
    "radians": (rows("f[Hz] G*[MPa] delta[rad]", RATES, ABSOLUTE, np.radians(ANGLE), mark=" "), "utf-8"),
    "absolute value and tangent": (rows("f[Hz],|G*|[MPa],tan(delta)", RATES, ABSOLUTE, LOSS / STORAGE), "utf-8"),
    "storage and angle": (rows("f[Hz],G'[MPa],phase angle[deg]", RATES, STORAGE, ANGLE), "utf-8"),
    "Latin-1": (rows("f (Hz),G' (MPa),G'' (MPa),Temperature (°C)", RATES, STORAGE, LOSS, DEGREES), "latin-1"),
    "UTF-16": (rows("f (Hz),G' (MPa),G'' (MPa),Temperature (°C)", RATES, STORAGE, LOSS, DEGREES), "utf-16"),
    "lines of a laboratory": (
        "Sample: SBR, 50 phr\nOperator;me\n\nDate\t2024-01-01\n" + rows("f[Hz],G'[MPa],G''[MPa]", RATES, STORAGE, LOSS),
        "utf-8",
    ),
    "columns of other things": (
        rows("f[Hz],G'[MPa],Torque[uNm],G''[MPa],Status", RATES, STORAGE, RATES, LOSS, RATES).replace(
            "0.1,0.3", "0.1,0.3"
        ),
        "utf-8",
    ),
}


@pytest.mark.parametrize("form", SHEAR)
def test_shear_moduli(tmp_path: Path, form: str) -> None:
    """All forms mean the same three points; ten digits are written."""
    path, (text, encoding) = tmp_path / "table.csv", SHEAR[form]
    path.write_bytes(text.encode(encoding))
    found = moduli.read_moduli(path)
    (one,) = found.sets
    assert not found.tension
    assert found.doubts == ()
    assert_allclose(one.at, 2 * np.pi * RATES, rtol=1e-9)
    assert_allclose(one.storage, 1e6 * STORAGE, rtol=1e-9)
    assert_allclose(one.loss, 1e6 * LOSS, rtol=1e-9)


def test_columns_that_are_not_read_may_hold_anything(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("f[Hz],G'[MPa],Status,G''[MPa]\n0.1,3,ok,1\n1,4,,1\n10,5,end,1\n")
    (one,) = moduli.read_moduli(path).sets
    assert_allclose(one.storage, [3e6, 4e6, 5e6], rtol=1e-12)


def test_words_of_a_rheometer(tmp_path: Path) -> None:
    """Moduli without a letter over rad/s are of shear, with a warning that names the factor of Young's; over Hz, and
    with the letter E, they are Young's, without one."""
    head = '"Angular Frequency (rad/s)","Storage Modulus (MPa)","Loss Modulus (MPa)"'
    for text, shear in (
        (head, True),
        (head.replace("Angular Frequency (rad/s)", "Frequency (Hz)"), False),
        (head.replace("Storage Modulus", "E'").replace("Loss Modulus", "E''"), False),
    ):
        path = tmp_path / "table.csv"
        path.write_text(rows(text, RATES, STORAGE, LOSS))
        found = moduli.read_moduli(path)
        assert found.tension == (not shear)
        assert found.sets[0].storage[0] == pytest.approx(3e5 if shear else 1e5, rel=1e-12)
        assert [("of shear (G) or tension (E)" in doubt, "3 times too stiff" in doubt) for doubt in found.doubts] == (
            [(True, True)] if shear else []
        )
    path.write_text(rows("Time (s),Creep compliance (1/MPa)", RATES, np.array([0.1, 0.15, 0.2])))
    (doubt,) = moduli.read_moduli(path).doubts
    assert "of shear (J) or tension (D): it is taken for J" in doubt


def test_a_falling_compliance(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a compliance falls with time"):
        moduli.read_moduli(write(tmp_path / "table.txt", "t[s] J(t)[1/MPa]", RATES, np.array([3.0, 2.0, 1.0])))


def temperature_sweep(path: Path, law: WLF, step: float = 2.0) -> Path:
    """Shear moduli at 1 Hz, of the rubber that other tests measure, from -20 to 60 C."""
    temperatures = np.arange(-20.0, 61.0, step)
    logs = np.array([law.log_factor(float(t)) for t in temperatures])
    g = measured.complex_modulus(2 * np.pi * 10.0**logs)
    return write(path, "f[Hz] T[C] G'[Pa] tan_delta", np.ones(temperatures.size), temperatures, g.real, g.imag / g.real)


def test_a_temperature_sweep_at_one_frequency(tmp_path: Path, main: "Main") -> None:
    """With the shift given it is a master curve, 5 % right over 8 decades; without, one sentence."""
    law = WLF(measured.C1, measured.C2, measured.REFERENCE)
    path = temperature_sweep(tmp_path / "table.txt", law)
    series = compound.fitted(path, 0.5, None, law, 0.02).series
    low, high = series.band
    assert np.log10(high / low) == pytest.approx(law.log_factor(-20.0) - law.log_factor(60.0), rel=1e-9)
    omega = np.geomspace(low * 10**0.5, high / 10**0.5, 100)
    right = measured.complex_modulus(omega)
    assert_allclose(series.modulus(omega).real, right.real, rtol=0.05)
    assert_allclose(series.modulus(omega).imag, right.imag, rtol=0.05)
    code, _, err = main("fit", path)
    assert code == 2
    assert "a temperature sweep does not show how times shift with temperature; give the shift" in err
    assert main("fit", path, "--shift", "wlf:8.86,101.6", "--reference", "20", "--out", tmp_path / "made.yaml")[0] == 0
    code, _, err = main("fit", path, "--shift", "wlf:8.86,30", "--reference", "20")
    assert (code, "table.txt: -20 C is below -10 C, where the WLF law" in err) == (2, True)


def test_a_short_sweep_is_left_out(tmp_path: Path) -> None:
    """One row at a temperature of its own: that row is lost, with a warning, and the others are fitted."""
    path = measured.write_sweeps(tmp_path / "table.csv")
    whole = compound.fitted(path, 0.5, None, "wlf", 0.05)
    path.write_text(path.read_text() + "1,3,0.3,90\n")
    made = compound.fitted(path, 0.5, 20.0, "wlf", 0.05)
    assert made.doubts() == ["the sweep at 90 C is left out: it has less than 3 rows (1)"]
    assert made.measured.temperatures == whole.measured.temperatures
    assert_allclose(made.series.moduli, whole.series.moduli, rtol=1e-12)


@pytest.mark.parametrize("kind", ["G", "GT", "t", "J"])
@pytest.mark.filterwarnings("error")
def test_random_tables_are_fitted_or_refused(tmp_path: Path, kind: str) -> None:
    """Few rows, one rate, rubbers without relaxation, noise of 0 to 100 %: a fit has finite positive numbers, and what
    cannot be fitted is one sentence. Numpy's warnings are errors."""
    dice = np.random.default_rng(7)
    fits = 0
    for _ in range(20):
        count, decades, noise = (
            int(dice.integers(1, 20)),
            dice.choice([0.0, 1.0, 4.0]),
            dice.choice([0.0, 0.01, 0.1, 1.0]),
        )
        at, times = (
            np.geomspace(1e-3, 1e-3 * 10.0**decades, count),
            10.0 ** dice.uniform(-6, 4, int(dice.integers(0, 5))),
        )
        moduli, spring = 10.0 ** dice.uniform(5, 8, times.size), float(dice.choice([1e3, 1e6]))
        head = {"G": "omega[rad/s] G'[Pa] G''[Pa]", "GT": "T[C] omega[rad/s] G'[Pa] G''[Pa]"}
        decay = spring + np.exp(-at[:, None] / times) @ moduli
        g = spring * (1 + 1e-3j) + (moduli * 1j * at[:, None] * times / (1 + 1j * at[:, None] * times)).sum(axis=1)
        columns = {"t": [decay], "J": [1.0 / decay]}.get(kind, [g.real, g.imag])
        columns = [each * (1.0 + noise * dice.standard_normal(count)) for each in columns]
        degrees = [np.sort(dice.choice([0.0, 10.0, 11.0, 30.0], count))] if kind == "GT" else []
        path = write(tmp_path / "table.txt", head.get(kind, f"t[s] {kind}"), *degrees, at, *columns)
        path.write_text(path.read_text().replace("t[s] t", "t[s] G(t)[Pa]").replace("t[s] J", "t[s] J(t)[1/Pa]"))
        try:
            made = compound.fitted(path, 0.5, None, "wlf", 0.02)
        except InputError:
            continue
        fits += 1
        numbers = [made.series.modulus_inf, made.series.error, *made.series.moduli, *made.series.loss_errors]
        assert np.isfinite(numbers).all()
        assert (np.array(numbers) >= 0.0).all()
        assert "nan" not in made.text()
    assert fits > 2


# -- tables of moduli: both forms and all units mean the same, and what will not do is one sentence with its ----------

ROWS = [(0.1, 3.0, 0.3), (1.0, 3.6, 0.6), (10.0, 4.5, 0.9)]  # Hz, MPa, MPa: Young's moduli


def text(head: str, scale: tuple[float, ...] = (1.0, 1.0, 1.0), mark: str = ",") -> str:
    return "\n".join([head, *(mark.join(f"{v * s!r}" for v, s in zip(row, scale, strict=True)) for row in ROWS)]) + "\n"


SAME = {
    "pyvisco": text("f,E_stor,E_loss\nHz,MPa,MPa"),
    "semicolons": text("f;E_stor;E_loss\nHz;MPa;MPa", mark=";"),
    "brackets": text("f[Hz] E'[MPa] E''[MPa]", mark=" "),
    "spaced brackets": text("f [Hz], E' [MPa], E'' [MPa]"),
    "primes": text("f[Hz] E′[MPa] E″[MPa]", mark="\t"),
    "angular": text("omega[rad/s] E'[Pa] E''[kPa]", (2 * np.pi, 1e6, 1e3)),
    "shear": text("f[Hz] G'[MPa] G''[MPa]", (1.0, 1 / 3, 1 / 3)),
    "comments": "# a rubber\n\n" + text("f,E_stor,E_loss\nHz,GPa,GPa", (1.0, 1e-3, 1e-3)),
    "another order": text("f,E_stor,E_loss\nHz,MPa,MPa").replace("0.1,3.0,0.3\n", "") + "0.1,3.0,0.3\n",
    "a mark of byte order": "\ufeff" + text("f,E_stor,E_loss\nHz,MPa,MPa"),
}


@pytest.mark.parametrize("form", SAME)
def test_all_forms_mean_the_same(tmp_path: Path, form: str) -> None:
    """One set, of shear, in SI and by rising rate; nu = 1/2 makes G a third of E."""
    path = tmp_path / "rubber.csv"
    path.write_text(SAME[form])
    found = moduli.read_moduli(path)
    (one,) = found.sets
    frequency, storage, loss = np.array(ROWS).T
    assert found.kind == "frequency"
    assert found.tension == (form != "shear")
    assert one.temperature is None
    assert_allclose(one.at, 2 * np.pi * frequency, rtol=1e-14)
    assert_allclose(one.storage, 1e6 * storage / 3, rtol=1e-14)
    assert_allclose(one.loss, 1e6 * loss / 3, rtol=1e-14)


@pytest.mark.parametrize("head", ["t[s] G_relax[kPa] T[K]", "t[s] G(t)[kPa] T[K]", "t G(t) T\ns kPa K"])
def test_relaxation(tmp_path: Path, head: str) -> None:
    path = tmp_path / "rubber.csv"
    path.write_text(f"{head}\n1.0 5 293.15\n0.1 9 293.15\n10 4 293.15\n")
    found = moduli.read_moduli(path)
    (one,) = found.sets
    assert found.kind == "time"
    assert one.temperature == pytest.approx(20.0, abs=1e-12)
    assert one.at.tolist() == [0.1, 1.0, 10.0]
    assert one.storage.tolist() == [9e3, 5e3, 4e3]
    assert one.loss.size == 0


def test_temperatures_are_sets(tmp_path: Path) -> None:
    """Rows of one temperature, however they are mixed and however it wavers within a degree, in rising order."""
    path = measured.write_sweeps(tmp_path / "rubber.csv")
    head, lines = path.read_text().splitlines()[:2], path.read_text().splitlines()[2:]
    pairs = [line.rsplit(",", 1) for line in lines]
    mixed = [f"{numbers},{float(temperature) + 0.2 * (n % 3 - 1)}" for n, (numbers, temperature) in enumerate(pairs)]
    path.write_text("\n".join([*head, *mixed[::2], *mixed[1::2]]))
    found = moduli.read_moduli(path)
    assert [round(each.temperature or 0.0) for each in found.sets] == list(measured.TEMPERATURES)
    assert all(each.at.size == measured.FREQUENCIES.size for each in found.sets)


GOOD = text("f,E_stor,E_loss\nHz,MPa,MPa")
BAD = {
    "nothing": ("", "is empty"),
    "comments only": ("# nothing\n", "is empty"),
    "no names": ("1,2,3\n4,5,6\n7,8,9\n10,11,12\n", ":1: names and units"),
    "no units": ("f,E_stor,E_loss\n1,2,3\n4,5,6\n7,8,9\n", ":1: names and units"),
    "no bracket": (text("f[Hz] E'[MPa] E''", mark=" "), ":1: E_loss must be a name with its unit"),
    "unknown unit of moduli": (GOOD.replace("MPa", "psi"), "unit of E_stor must be one of Pa, kPa, MPa, GPa, got"),
    "unknown unit of rates": (GOOD.replace("Hz", "rpm"), "unit of f must be one of Hz, rad/s, 1/s, got 'rpm'"),
    "empty unit": (GOOD.replace("Hz,MPa,MPa", ",MPa,MPa"), "unit of f must be one of"),
    "no loss": ("f,E_stor\nHz,MPa\n1,2\n2,3\n3,4\n", "it needs f or omega with E_stor and E_loss"),
    "no rate": ("E_stor,E_loss\nMPa,MPa\n1,2\n2,3\n3,4\n", "has no column f"),
    "no time": ("f,E_relax\nHz,MPa\n1,2\n2,3\n3,4\n", "has no column t"),
    "E' with G''": (text("f[Hz] E'[MPa] G''[MPa]", mark=" "), "it needs f or omega"),
    "a word": (GOOD.replace("3.6", "high"), ":4: E_stor must be a finite number, got 'high'"),
    "not a number": (GOOD.replace("3.6", "nan"), ":4: E_stor must be a finite number, got 'nan'"),
    "commas of both kinds": (GOOD.replace("3.6", "3,6"), ":4: 4 values where 3 columns are named"),
    "commas and points": (
        GOOD.replace(",", ";").replace("3.6", "3,6"),
        "some numbers have decimal commas, such as 3,6,",
    ),
    "thousands": ("f[Hz];E'[MPa];E''[MPa]\n1;3,000;1,000\n2;4,000;1,000\n", "3,000 may be 3000 or 3.000"),
    "endless": (GOOD.replace("3.6", "inf"), ":4: E_stor must be a finite number"),
    "negative storage": (GOOD.replace("3.6", "-3.6"), ":4: E_stor must be positive, got -3.6"),
    "negative loss": (GOOD.replace("0.6", "-0.6"), ":4: E_loss must be positive, got -0.6"),
    "a phase angle of degrees in rad": (
        "f[Hz] G*[MPa] delta[rad]\n1 2 0.5\n2 2 10\n3 2 1\n",
        ":3: delta must be below 90 degrees, got 10 rad, 573 degrees; is the unit right?",
    ),
    "zero rate": (GOOD.replace("0.1,", "0,"), ":3: f must be positive, got 0"),
    "a value too few": (GOOD.replace("1.0,3.6,0.6", "1.0,3.6"), ":4: 2 values where 3 columns are named"),
    "a value too many": (GOOD.replace("1.0,3.6", "1,0,3,6"), ":4: 5 values where 3 columns are named"),
    "two rows": ("f,E_stor,E_loss\nHz,MPa,MPa\n1,2,3\n4,5,6\n", "has 2 rows of numbers; at least 3"),
    "binary": ("\x00\x01\x02", "cannot be read as text: it holds bytes of 0"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_will_not_do(tmp_path: Path, case: str) -> None:
    content, sentence = BAD[case]
    path = tmp_path / "rubber.csv"
    path.write_text(content)
    with pytest.raises(InputError) as failure:
        moduli.read_moduli(path)
    assert sentence in str(failure.value)
    assert str(failure.value).startswith(str(path))
    assert "\n" not in str(failure.value)


def test_no_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.csv"):
        with pytest.raises(InputError, match="is not a file"):
            moduli.read_moduli(path)
