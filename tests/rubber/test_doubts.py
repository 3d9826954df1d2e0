"""Tables that are not of one rubber, or in other units than they say; fits that miss; use beyond what was measured."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import parcontact as pc
from parcontact.errors import InputError
from parcontact.job import Flat, Job, Rough, Sphere, Wave
from parcontact.job.surfaces import wave_numbers
from parcontact.march.sanity import doubt_band
from parcontact.rubber import compound, moduli
from parcontact.rubber.series import Weigh
from parcontact.rubber.shift import WLF, Factors, read_shift

from . import measured


def sweep(path: Path, head: str, columns: list[np.ndarray]) -> Path:
    rows = zip(*columns, strict=True)
    path.write_text("\n".join([head, *(",".join(f"{value:.10g}" for value in row) for row in rows)]) + "\n")
    return path


FREQUENCY = np.geomspace(1e-4, 1e7, 45)  # Hz
MODULUS = measured.complex_modulus(2 * np.pi * FREQUENCY)
STORAGE, LOSS = MODULUS.real / 1e6, MODULUS.imag / 1e6  # MPa


# -- temperatures ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [1.0, 0.4])
def test_temperatures_near_to_each_other_are_sets_of_their_own(tmp_path: Path, step: float) -> None:
    """Ten in steps of a degree or less, at each of which the same frequencies were measured."""
    temperatures = tuple(step * np.arange(10.0))
    found = moduli.read_moduli(measured.write_sweeps(tmp_path / "rubber.csv", temperatures=temperatures))
    assert [each.temperature for each in found.sets] == pytest.approx(temperatures)
    assert all(each.at.size == measured.FREQUENCIES.size for each in found.sets)


def test_temperatures_that_waver_and_touch_are_refused(tmp_path: Path) -> None:
    rows = [FREQUENCY, STORAGE, LOSS, np.linspace(20.0, 25.0, FREQUENCY.size)]
    with pytest.raises(InputError, match="temperatures from 20 to 25 C cannot be separated"):
        moduli.read_moduli(sweep(tmp_path / "rubber.csv", "f[Hz],G'[MPa],G''[MPa],T[C]", rows))


# -- units and orders --------------------------------------------------------------------------------------------------

DEGREES = np.full(FREQUENCY.size, 40.0)
FALLING = np.geomspace(9.0, 1.0, FREQUENCY.size)
ODD: dict[str, tuple[str, list[np.ndarray], str]] = {
    "MPa under Pa": ("f[Hz],G'[Pa],G''[Pa]", [FREQUENCY, STORAGE, LOSS], "Pa, below 3000 Pa, softer than a gel"),
    "Pa under GPa": ("f[Hz],G'[GPa],G''[GPa]", [FREQUENCY, STORAGE * 1e6, LOSS * 1e6], "above 1e+13 Pa"),
    "C under K": ("f[Hz],G'[MPa],G''[MPa],T[K]", [FREQUENCY, STORAGE, LOSS, DEGREES], "is -233.1 C, below -150 C"),
    "one column twice": ("f[Hz],G'[MPa],G'[MPa],G''[MPa]", [FREQUENCY, STORAGE, LOSS, LOSS], "G_stor is given twice"),
    "two rates": ("f[Hz],omega[rad/s],G'[MPa],G''[MPa]", [FREQUENCY, FREQUENCY, STORAGE, LOSS], "mean the same"),
    "600 decades": ("f[Hz],G'[MPa],G''[MPa]", [FREQUENCY**30, STORAGE, LOSS], "span 330 decades"),
    "a rising relaxation": ("t[s],G_relax[MPa]", [FREQUENCY, FALLING[::-1]], "rises with time, from 1e+06 to 9e+06 Pa"),
}


@pytest.mark.parametrize("case", ODD)
def test_what_no_rubber_is(tmp_path: Path, case: str) -> None:
    head, columns, sentence = ODD[case]
    with pytest.raises(InputError) as failure:
        moduli.read_moduli(sweep(tmp_path / "rubber.csv", head, columns))
    assert sentence in str(failure.value)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("Frequency (Hz),Storage Modulus (MPa),Loss Modulus (MPa)", [FREQUENCY, 3 * STORAGE, 3 * LOSS]),
        ("Angular Frequency [rad/s],G' (MPa),G'' (MPa)", [2 * np.pi * FREQUENCY, STORAGE, LOSS]),
        ("f (Hz),Shear storage modulus (MPa),Tan Delta", [FREQUENCY, STORAGE, LOSS / STORAGE]),
        ("f[Hz],G''[MPa],tan_del[-]", [FREQUENCY, LOSS, LOSS / STORAGE]),
    ],
)
def test_headers_of_instruments(tmp_path: Path, head: str, columns: list[np.ndarray]) -> None:
    """Words with units in brackets of either kind; a modulus that tan delta stands for. Ten digits are written."""
    (one,) = moduli.read_moduli(sweep(tmp_path / "rubber.csv", head, columns)).sets
    assert one.at == pytest.approx(2 * np.pi * FREQUENCY, rel=1e-9)
    assert one.storage == pytest.approx(1e6 * STORAGE, rel=1e-9)
    assert one.loss == pytest.approx(1e6 * LOSS, rel=1e-9)


# -- misfit and scatter ------------------------------------------------------------------------------------------------


def test_sweeps_that_do_not_overlap(tmp_path: Path) -> None:
    """A fitted law joins sweeps of three decades at -20 and 60 C as it likes; one that is given is not judged."""
    path = measured.write_sweeps(tmp_path / "rubber.csv", temperatures=(-20.0, 60.0))
    (text,) = compound.fitted(path, 0.5, None, "wlf", 0.05).doubts()
    assert text.startswith("the sweeps at -20 and 60 C do not overlap")
    assert "measure at a temperature in between" in text
    known = WLF(measured.C1, measured.C2, measured.REFERENCE)
    assert compound.fitted(path, 0.5, None, known, 0.05).doubts() == []
    whole = measured.write_sweeps(tmp_path / "whole.csv")
    assert compound.fitted(whole, 0.5, None, "wlf", 0.05).doubts() == []


def test_one_frequency_is_no_sweep(tmp_path: Path) -> None:
    """Such as a table over strain; a fit to it is one branch at this frequency."""
    rows = [np.full(4, 10.0), np.linspace(2.0, 2.1, 4), np.full(4, 0.3)]
    found = compound.fitted(sweep(tmp_path / "rubber.csv", "f[Hz],G'[MPa],G''[MPa]", rows), 0.5, None, "wlf", 0.05)
    assert any(text.startswith("all its points are at one frequency, 10 Hz") for text in found.doubts())


@pytest.mark.parametrize(("unit", "says"), [("GPa", "more than rubber has as a glass"), ("Pa", "softer than any")])
def test_moduli_of_no_rubber(tmp_path: Path, unit: str, says: str) -> None:
    """The rubber's 1 GPa as a thousand of them; a plateau of 1 MPa and a glass of 1 GPa as 1 and 1000 Pa times 50."""
    scale = 1.0 if unit == "GPa" else 50.0
    path = sweep(tmp_path / "rubber.csv", f"f[Hz],G'[{unit}],G''[{unit}]", [FREQUENCY, scale * STORAGE, scale * LOSS])
    (text,) = compound.fitted(path, 0.5, None, "wlf", 0.05).doubts()
    assert says in text


def contradiction(path: Path, factor: float = 3.0) -> Path:
    """A loss modulus that is a given number of times what the storage modulus asks for (Kramers-Kronig)."""
    return sweep(path, "f[Hz],G'[MPa],G''[MPa]", [FREQUENCY, STORAGE, factor * LOSS])


def test_moduli_that_contradict_each_other(tmp_path: Path) -> None:
    """The misfit is not stated as scatter, of which there is none; either modulus alone is met to 2 %."""
    path = contradiction(tmp_path / "rubber.csv")
    made = compound.fitted(path, 0.5, None, "wlf", 0.02)
    assert made.series.best > 0.2
    assert made.series.scatter < 0.02  # four points per decade are not quite smooth
    poor, torn = made.doubts()
    assert poor.startswith("the fit misses the moduli by ")
    assert "contradict each other (Kramers-Kronig)" in torn
    goals: dict[Weigh, np.ndarray] = {"storage": STORAGE, "loss": 3 * LOSS}
    for weigh, goal in goals.items():
        one = compound.fitted(path, 0.5, None, "wlf", 0.02, weigh)
        assert one.series.error < 0.02
        flows = ["flows like a liquid" in text for text in one.doubts()]
        assert flows == ([] if weigh == "storage" else [True])  # three times the loss leave nothing for the spring
        times, moduli = one.series.times, one.series.moduli
        iwt = 2j * np.pi * FREQUENCY[:, None] * times
        value = one.series.modulus_inf + (moduli * iwt / (1.0 + iwt)).sum(axis=1)
        part = value.real if weigh == "storage" else value.imag
        assert np.sqrt(np.mean(np.log(part / (1e6 * goal)) ** 2)) < 0.02


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ([FREQUENCY, LOSS, STORAGE], "seem to be exchanged"),
        ([FREQUENCY, STORAGE, STORAGE[::-1] ** 3], "the best fit misses"),
    ],
)
def test_tables_that_no_fit_meets(tmp_path: Path, columns: list[np.ndarray], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        compound.fitted(sweep(tmp_path / "rubber.csv", "f[Hz],G'[MPa],G''[MPa]", columns), 0.5, None, "wlf", 0.02)


# -- shifts ------------------------------------------------------------------------------------------------------------


def test_shift_factors_as_pyvisco_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "factors.csv"
    path.write_text("T,log_aT\nC, -\n40,-1\n20,0\n0,2\n", encoding="utf-8-sig")
    assert read_shift(str(path), None) == Factors((0.0, 20.0, 40.0), (2.0, 0.0, -1.0), 20.0)


@pytest.mark.parametrize("text", ["arrhenius:1e9", "arrhenius:-5", "wlf:-8,100", "wlf:8,1e5"])
def test_constants_that_no_rubber_has(text: str) -> None:
    with pytest.raises(InputError, match=r"must be (0.001 to 10000|1000 to 1e\+07)"):
        read_shift(text, 20.0)


# -- the measured range ------------------------------------------------------------------------------------------------


def rubber(velocity: float, **more: Any) -> Job:
    """Waves of 0.25 mm, which pass with v/0.25 mm."""
    shift = {"law": "wlf", "C1": 8.86, "C2": 101.6, "reference": 20.0}
    branches = [{"modulus": 1e6, "relaxation_time": 1e-3}]
    body = {"model": "zener", "modulus_inf": 1e6, "branches": branches, "shift": shift}
    slide = {"pressure": 1e4, "velocity": velocity, "distance": 1e-4, "cells_per_step": 1}
    measured_at = {"band": [1.0, 1e4], "temperatures": [-20.0, 60.0]}
    wave = {"shape": "wave", "amplitude": 1e-6, "waves": [4, 0]}
    material = {**body, **measured_at, **more}
    return Job.model_validate(
        {"grid": {"points": 32, "size": 1e-3}, "surface": wave, "material": material, "history": [slide]}
    )


def test_a_job_within_the_measured_range() -> None:
    assert list(doubt_band(rubber(0.1))) == []
    assert list(doubt_band(rubber(0.1), [20.0, 60.0])) == []
    assert list(doubt_band(rubber(1e3, band=None))) == []


def test_a_job_beyond_the_measured_frequencies() -> None:
    """100 m/s over 0.25 mm are 4e5 Hz, 1.6 decades above 1e4; at -20 C reduced by a_T, 10^5.8 there."""
    (text,) = map(str, doubt_band(rubber(100.0)))
    assert "excites 4e+05 to 4e+05 Hz" in text
    assert "1.6 decades above the measured 1 to 1e+04 Hz" in text
    (cold,) = map(str, doubt_band(rubber(0.1, temperature=-20.0)))
    assert "decades above" in cold
    (slow,) = map(str, doubt_band(rubber(1e-5)))
    assert "1.4 decades below" in slow


def test_wave_numbers_of_shapes() -> None:
    """Waves have their own; roughness its shortest and longest; round shapes and files those of box and cells."""
    grid = rubber(0.1).grid
    rough = Rough(hurst=0.8, long_wavelength=2e-4, short_wavelength=1e-4, rms_slope=0.1)
    assert wave_numbers(rough, grid) == pytest.approx((2 * np.pi / 2e-4, 2 * np.pi / 1e-4))
    assert wave_numbers(Sphere(radius=1e-2), grid) == pytest.approx((2 * np.pi / 1e-3, np.pi / (1e-3 / 32)))
    assert wave_numbers(Wave(amplitude=1e-6, waves=(3, -4)), grid) == pytest.approx((5 * 2 * np.pi / 1e-3,))
    assert wave_numbers(Flat(), grid) == ()


def test_a_job_says_its_temperature() -> None:
    """The reference where it gives none; a_T by the formula of Williams, Landel and Ferry."""
    assert rubber(0.1).facts == (
        "material: at 20 C, the reference of its shift; the job gives no material.temperature",
    )
    shift_factor = 10.0 ** (-8.86 * 20.0 / 121.6)
    assert rubber(0.1, temperature=40.0).facts == (f"material: at 40 C (a_T = {shift_factor:.4g}, reference 20 C)",)
    assert rubber(0.1, shift=None).facts == ()


def test_temperatures_beyond_the_measured_ones() -> None:
    job = rubber(0.1, band=None)
    (text,) = map(str, doubt_band(job, [-60.0, -40.0, 20.0, 120.0]))
    assert text.startswith("material: -60, -40, 120 C is outside of the measured -20 to 60 C")
    (own,) = map(str, doubt_band(rubber(0.1, band=None, temperature=80.0)))
    assert own.startswith("material: 80 C is outside")


def test_a_curve_from_python_warns_at_its_own_temperatures() -> None:
    """They are not those of the job, whose material has its reference."""
    with warnings.catch_warnings(record=True, action="always") as stated:
        pc.steady(rubber(0.1, band=None), velocities=[0.1], pressures=[1e4], temperatures=[-40.0])
    beyond = "material: -40 C is outside of the measured -20 to 60 C"
    assert [str(one.message).startswith(beyond) for one in stated].count(True) == 1


def test_temperatures_that_look_like_kelvin(tmp_path: Path) -> None:
    """Each key is named with its value, the limit and the value in deg C; 200 C, the limit, is not."""
    shift = {"law": "arrhenius", "energy": 5e4, "reference": 293.15}
    material = {
        "model": "zener",
        "modulus_inf": 1e6,
        "branches": [{"modulus": 3e6, "relaxation_time": 1e-3}],
        "shift": shift,
        "temperature": 313.15,
    }
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
        "material": material,
        "steady": {"velocities": [1.0], "pressures": [1e4], "temperatures": [253.15, 353.15]},
    }
    found = {doubt.place: str(doubt) for doubt in Job.model_validate(data).doubts if doubt.kind == "kelvin"}
    assert found.keys() == {"material.temperature", "material.shift.reference", "steady.temperatures"}
    assert "313.15 C is hotter than rubber endures (limit: 200 C)" in found["material.temperature"]
    assert found["material.temperature"].endswith("in kelvin, give 40")
    assert found["steady.temperatures"].endswith("give 80")
    sound = data | {
        "material": material | {"shift": shift | {"reference": 20.0}, "temperature": 200.0},
        "steady": {"velocities": [1.0], "pressures": [1e4]},
    }
    job = Job.model_validate(sound)
    assert not [doubt for doubt in job.doubts if doubt.kind == "kelvin"]
    (given,) = (doubt for doubt in doubt_band(job, [293.15]) if doubt.kind == "kelvin")
    assert str(given).startswith("temperatures: 293.15 C")
