"""Tables as instruments and laboratories write them: each is read as what it is, or refused in one sentence."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.testing import assert_allclose

from parcontact.errors import InputError
from parcontact.rubber import compound, tables
from parcontact.rubber.shift import WLF

from . import measured
from .bodies import write

if TYPE_CHECKING:
    from conftest import Main

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
    found = tables.read(path)
    (one,) = found.sets
    assert not found.tension
    assert found.doubts == ()
    assert_allclose(one.at, 2 * np.pi * RATES, rtol=1e-9)
    assert_allclose(one.storage, 1e6 * STORAGE, rtol=1e-9)
    assert_allclose(one.loss, 1e6 * LOSS, rtol=1e-9)


def test_columns_that_are_not_read_may_hold_anything(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("f[Hz],G'[MPa],Status,G''[MPa]\n0.1,3,ok,1\n1,4,,1\n10,5,end,1\n")
    (one,) = tables.read(path).sets
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
        found = tables.read(path)
        assert found.tension == (not shear)
        assert found.sets[0].storage[0] == pytest.approx(3e5 if shear else 1e5, rel=1e-12)
        assert [("of shear (G) or tension (E)" in doubt, "3 times too stiff" in doubt) for doubt in found.doubts] == (
            [(True, True)] if shear else []
        )
    path.write_text(rows("Time (s),Creep compliance (1/MPa)", RATES, np.array([0.1, 0.15, 0.2])))
    (doubt,) = tables.read(path).doubts
    assert "of shear (J) or tension (D): it is taken for J" in doubt


def test_a_falling_compliance(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a compliance falls with time"):
        tables.read(write(tmp_path / "table.txt", "t[s] J(t)[1/MPa]", RATES, np.array([3.0, 2.0, 1.0])))


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
