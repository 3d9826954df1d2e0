"""Fits against a rubber whose truth is known: series, shifts, and the material file."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.job.meaning import modulus_after
from parcontact.rubber import compound, series
from parcontact.rubber import moduli as measured_moduli
from parcontact.rubber.shift import WLF, Arrhenius, Density, Factors, log_vertical, read_shift

from . import measured
from .bodies import Array, branches, noisy, write

LAW = WLF(measured.C1, measured.C2, measured.REFERENCE)


def sum_of(made: compound.Compound, omega: measured.Array) -> np.ndarray:
    """G* of a fit, from the definition."""
    iwt = 1j * omega[:, None] * made.series.times
    return np.asarray(made.series.modulus_inf + (made.series.moduli * iwt / (1.0 + iwt)).sum(axis=1))


def test_noisy_sets_at_five_temperatures(tmp_path: Path) -> None:
    """2 % of noise: G* within 2 % rms over the measured band of 11 decades, constants of the shift within 5 %, and no
    more than two and a half branches in a decade."""
    path = measured.write_sweeps(tmp_path / "rubber.csv", noise=0.02)
    made = compound.fitted(path, 0.5, 20.0, "wlf", 0.02)
    assert isinstance(made.shift, WLF)
    assert_allclose([made.shift.C1, made.shift.C2], [measured.C1, measured.C2], rtol=0.05)
    omega = np.geomspace(made.series.band[0], made.series.band[1], 400)
    assert np.sqrt(np.mean(np.abs(sum_of(made, omega) / measured.complex_modulus(omega) - 1.0) ** 2)) < 0.02
    assert made.series.moduli.size <= 28
    assert 0.017 < made.series.scatter < 0.023  # the noise, as 200 numbers know it


def test_no_branch_is_negligible() -> None:
    """A branch of 1e-5 of the storage modulus at its frequency is left out, one of 1e-2 is not."""
    times = np.array([1e-3, 1e-2])
    left = [series._negligible(np.array([9e6, share * 1e6]), times, 1e6)[1] < share * 1e6 for share in (1e-5, 1e-2)]
    assert left == [False, True]


def test_a_relaxation(tmp_path: Path) -> None:
    """In the time domain, without noise, to 1 %."""
    t = np.geomspace(1e-4, 1e3, 60)
    lines = [f"{a:.10g} {g:.10g}" for a, g in zip(t, measured.relaxation(t), strict=True)]
    path = tmp_path / "rubber.txt"
    path.write_text("t[s] G_relax[Pa]\n" + "\n".join(lines))
    made = compound.fitted(path, 0.5, None, "wlf", 0.005)
    assert made.shift is None
    fitted = made.series.modulus_inf + (made.series.moduli * np.exp(-t[:, None] / made.series.times)).sum(axis=1)
    assert_allclose(fitted, measured.relaxation(t), rtol=0.01)


def test_a_fluid_has_no_spring(tmp_path: Path) -> None:
    """One Maxwell branch: its moduli tend to 0 at low rates, and so does the fit, to 1 %."""
    omega = np.geomspace(1e-3, 1e3, 60)
    z = 1j * omega * 0.1
    moduli = 1e6 * z / (1.0 + z)
    path = tmp_path / "fluid.txt"
    rows = "\n".join(f"{w:.10g} {g.real:.10g} {g.imag:.10g}" for w, g in zip(omega, moduli, strict=True))
    path.write_text("omega[rad/s] G'[Pa] G''[Pa]\n" + rows)
    made = compound.fitted(path, 0.5, None, "wlf", 0.01)
    assert made.series.modulus_inf < 1.0
    assert_allclose(sum_of(made, omega), moduli, rtol=0.02)


def test_other_laws(tmp_path: Path) -> None:
    """Free factors where the sets overlap: those of the truth to 0.02 decades of 5; Arrhenius where it holds: energy
    to 1 %."""
    warm = measured.write_sweeps(tmp_path / "warm.csv", temperatures=(0.0, 10.0, 20.0, 35.0, 60.0))
    free = series.superpose(measured_moduli.read_moduli(warm), 20.0, "free", "none").shift
    assert isinstance(free, Factors)
    expected = [measured.log_factor(t) for t in free.temperatures]
    assert_allclose(free.logs, expected, atol=0.02)
    law = Arrhenius(2.0e5, 20.0)
    lines = ["omega[rad/s] G'[Pa] G''[Pa] T[C]"]
    for temperature in (0.0, 20.0, 40.0):
        omega = 2 * np.pi * measured.FREQUENCIES
        moduli = measured.complex_modulus(omega * 10.0 ** law.log_factor(temperature))
        lines += [f"{w:.10g} {g.real:.10g} {g.imag:.10g} {temperature:g}" for w, g in zip(omega, moduli, strict=True)]
    (tmp_path / "arrhenius.txt").write_text("\n".join(lines))
    found = series.superpose(measured_moduli.read_moduli(tmp_path / "arrhenius.txt"), 20.0, "arrhenius", "none").shift
    assert isinstance(found, Arrhenius)
    assert found.energy == pytest.approx(law.energy, rel=0.01)


def test_shift_laws() -> None:
    """By their definitions, 0 at the reference, and refused where they end."""
    assert LAW.log_factor(20.0) == 0.0
    assert LAW.log_factor(-20.0) == pytest.approx(8.86 * 40.0 / 61.6, rel=1e-14)
    with pytest.raises(InputError, match=r"below -81\.6 C"):
        LAW.log_factor(-82.0)
    warm = Arrhenius(1e5, 20.0).log_factor(30.0)
    assert warm == pytest.approx(1e5 / 8.314462618 / np.log(10) * (1 / 303.15 - 1 / 293.15), rel=1e-12)
    factors = Factors((0.0, 10.0, 30.0), (2.0, 1.0, -1.0), 20.0)
    assert [factors.log_factor(t) for t in (0.0, 5.0, 20.0, 25.0)] == pytest.approx([2.0, 1.5, 0.0, -0.5])
    with pytest.raises(InputError, match="0 to 30 C"):
        factors.log_factor(31.0)


@pytest.mark.parametrize(
    ("temperatures", "reference", "sentence"),
    [((20.0,), 20.0, "sweeps at two temperatures"), ((0.0, 20.0), 30.0, "must lie within 0 and 20 C, got 30")],
)
def test_sets_that_have_no_shift(
    tmp_path: Path, temperatures: tuple[float, ...], reference: float, sentence: str
) -> None:
    path = measured.write_sweeps(tmp_path / "rubber.csv", temperatures=temperatures)
    with pytest.raises(InputError, match=sentence):
        series.superpose(measured_moduli.read_moduli(path), reference, "wlf", "none")


def test_free_factors_need_an_overlap(tmp_path: Path) -> None:
    """Sweeps of three decades, nine decades from one another."""
    path = measured.write_sweeps(tmp_path / "rubber.csv", temperatures=(-45.0, 20.0))
    with pytest.raises(InputError, match="the sweeps do not shift onto one another"):
        compound.fitted(path, 0.5, 20.0, "free", 0.05)


JOB = """
grid: {{points: 32, size: 1.0e-3}}
surface: {{shape: wave, amplitude: 1.0e-6, waves: [4, 0]}}
material: {material}
history: [{{pressure: 1.0e4, velocity: 0.1, distance: 1.0e-4, cells_per_step: 1}}]
"""


def load(tmp_path: Path, material: str) -> jobs.Job:
    path = tmp_path / "job.yaml"
    path.write_text(JOB.format(material=material))
    return jobs.load(path)


def test_a_material_file_and_a_table_in_a_job_are_the_same(tmp_path: Path) -> None:
    """At any temperature: the file holds seven digits, also of C1 and C2, which are those of log a_T = 2."""
    from parcontact.effects.branches import relaxation_of

    path = measured.write_sweeps(tmp_path / "rubber.csv", noise=0.02)
    (tmp_path / "materials").mkdir()
    made = compound.fitted(path, 0.5, 20.0, "wlf", 0.05)
    text = made.text()
    (tmp_path / "materials" / "rubber.yaml").write_text(text)
    assert all(line.startswith("#") for line in text.splitlines()[:5])
    assert yaml.safe_load(text)["shift"]["law"] == "wlf"
    for temperature in ("", ", temperature: 50"):
        included = relaxation_of(load(tmp_path, f"{{include: rubber{temperature}}}").material)
        dma = f"{{model: dma, path: rubber.csv, reference: 20, error: 0.05{temperature}}}"
        fitted = relaxation_of(load(tmp_path, dma).material)
        assert included.modulus_inf == pytest.approx(fitted.modulus_inf, rel=1e-6)
        assert_allclose(included.moduli, fitted.moduli, rtol=1e-6)
        assert_allclose(included.relaxation_times, fitted.relaxation_times, rtol=1e-6)
    assert made.shift is not None
    assert_allclose(included.relaxation_times, made.series.times * 10.0 ** made.shift.log_factor(50.0), rtol=3e-6)


@pytest.mark.parametrize(
    ("material", "sentence"),
    [
        ("{model: dma}", "material.path is missing"),
        ("{model: dma, path: none.csv}", "must be an existing file"),
        ("{model: dma, path: ~nosuchuser/rubber.csv}", "material.path must be the name of a file, got"),
        ("{model: dma, path: /dev/null}", "material.path must be an existing file, got '/dev/null'"),
        ("{model: dma, path: bad.csv}", "cannot be fitted"),
        ("{model: dma, path: rubber.csv, temperature: -100}", "material.temperature is outside of the shift"),
        ("{model: dma, path: rubber.csv, reference: 200}", "must lie within -20 and 60 C, got 200"),
        ("{model: dma, path: rubber.csv, error: 0}", "material.error must be a positive"),
        ("{model: zener, modulus_inf: 1.0e6, temperature: 40}", "needs material.shift"),
        (
            "{model: zener, modulus_inf: 1.0e6, shift: {law: wlf, C1: 8, C2: 100, reference: 20}, temperature: -90}",
            "below -80 C",
        ),
        ("{model: zener, modulus_inf: 1.0e6, shift: {law: wlf, C1: 8, reference: 20}}", "material.shift.C2 is missing"),
        ("{model: zener, modulus_inf: 1.0e6, shift: {law: vft}}", "must be wlf | arrhenius | factors, got 'vft'"),
        (
            "{model: zener, modulus_inf: 1e6, shift: {law: factors, temperatures: [9, 0], logs: [0, 1], reference: 5}}",
            "must be at least two rising temperatures",
        ),
        ("{model: zener, modulus_inf: 1.0e6, band: [10, 1]}", "must be a lower and a higher frequency"),
        (
            "{model: zener, modulus_inf: 1.0e6, temperatures: [80, 20]}",
            "must be the lowest and the highest temperature",
        ),
    ],
)
def test_mistakes_in_a_job(tmp_path: Path, material: str, sentence: str) -> None:
    measured.write_sweeps(tmp_path / "rubber.csv")
    (tmp_path / "bad.csv").write_text("1 2 3\n")
    with pytest.raises(jobs.JobError) as failure:
        load(tmp_path, material)
    (line,) = failure.value.mistakes
    assert sentence in line
    assert ":4:" in line


# -- the vertical shift: moduli of rubber go with density times temperature, or constants of the shift come -----------

# twelve decades of a rubber in shear at 20 C, with the WLF constants of that temperature
RUBBER = branches(
    2e6, 1e6 * np.array([12.0, 18.0, 20.0, 15.0, 9.0, 5.0, 3.0, 1.5, 0.8, 0.4]), 10.0 ** np.arange(-7.0, 3.0)
)
C1, C2, REFERENCE, MIDDLE = 8.0, 110.0, 20.0, 10.0
TEMPERATURES = np.arange(-30.0, 51.0, 10.0)
FREQUENCIES = np.geomspace(0.1, 100.0, 13)


def density_factor(temperature: float, reference: float = REFERENCE) -> float:
    """rho T over that at a reference, of natural rubber: rho = 0.93 - 5.5e-4 (T - 20 C)."""
    rho, there = (0.93 - 5.5e-4 * (t - 20.0) for t in (temperature, reference))
    return rho * (temperature + 273.15) / (there * (reference + 273.15))


def own_factor(temperature: float) -> float:
    """b_T of a crystallising compound that was made up: it stiffens in the cold."""
    return float(10.0 ** (0.15 * np.tanh((20.0 - temperature) / 15.0)))


def sweeps(path: Path, vertical: str) -> Path:
    """Young's moduli with a noise of 0.5 and 1 %, by a law of b_T."""
    rows: list[Array] = []
    for number, temperature in enumerate(TEMPERATURES):
        above = temperature - REFERENCE
        omega = 2 * np.pi * FREQUENCIES * 10.0 ** (-C1 * above / (C2 + above))
        laws = {"density": density_factor(temperature), "none": 1.0, "own": own_factor(temperature)}
        moduli = 3e-6 * laws[vertical] * RUBBER.modulus(omega)
        storage, loss = noisy(moduli.real, 0.005, number), noisy(moduli.imag, 0.01, 50 + number)
        rows.append(np.array([np.full(13, temperature), FREQUENCIES, storage, loss]))
    return write(path, "T[C] f[Hz] E'[MPa] E''[MPa]", *np.hstack(rows))


RIGHT = C1 * C2 / (C2 + MIDDLE - REFERENCE), C2 + MIDDLE - REFERENCE  # the constants at another reference


def test_moduli_that_go_with_density_and_temperature(tmp_path: Path) -> None:
    """C1 and C2 at the middle temperature, 8.8 and 100 K, to 3 %; without b_T they were 11 and 5 % off. b_T to 2 %,
    although the expansion is that of any rubber. All is stated."""
    made = compound.fitted(sweeps(tmp_path / "table.txt", "density"), 0.5, None, "wlf", 0.02)
    assert isinstance(made.shift, WLF)
    assert made.shift.reference == MIDDLE
    assert_allclose([made.shift.C1, made.shift.C2], RIGHT, rtol=0.03)
    assert isinstance(made.shift.vertical, Density)
    for temperature in TEMPERATURES:
        b = 10.0 ** log_vertical(made.shift, float(temperature))
        assert b == pytest.approx(density_factor(float(temperature), MIDDLE), rel=0.02)
    assert made.doubts() == []
    assert "# Horizontal shift, fitted: WLF with C1 = 8." in made.text()
    assert "# Vertical shift: density times temperature, with an expansion of 0.0006 1/K; a_T = " in made.text()
    assert "and b_T = 0.879 at -30 C, a_T = " in made.text()
    without = compound.fitted(tmp_path / "table.txt", 0.5, None, "wlf", 0.02, vertical="none")
    assert isinstance(without.shift, WLF)
    assert abs(without.shift.C1 / RIGHT[0] - 1.0) > 0.08


def test_relaxations_at_several_temperatures(tmp_path: Path) -> None:
    """G(t) with a noise of 0.3 %: C1 and C2 to 4 %; without b_T C1 is a tenth and more off."""
    t, rows = np.geomspace(0.1, 300.0, 30), []
    for number, temperature in enumerate(TEMPERATURES):
        above = temperature - REFERENCE
        moduli = density_factor(temperature) * RUBBER.relaxation(t * 10.0 ** (C1 * above / (C2 + above)))
        rows.append(np.array([np.full(30, temperature), t, noisy(moduli, 0.003, number)]))
    path = write(tmp_path / "table.txt", "T[C] t[s] G(t)[Pa]", *np.hstack(rows))
    made = compound.fitted(path, 0.5, None, "wlf", 0.02)
    assert isinstance(made.shift, WLF)
    assert_allclose([made.shift.C1, made.shift.C2], RIGHT, rtol=0.04)
    without = compound.fitted(path, 0.5, None, "wlf", 0.02, vertical="none").shift
    assert isinstance(without, WLF)
    assert abs(without.C1 / RIGHT[0] - 1.0) > 0.1


@pytest.mark.parametrize("law", ["wlf", "free"])
def test_moduli_with_a_law_of_their_own(tmp_path: Path, law: str) -> None:
    """Free factors are found to 5 %, and a_T to 0.1 decades of 8; without them the constants are wrong, and stated
    so."""
    path = sweeps(tmp_path / "table.txt", "own")
    (text,) = compound.fitted(path, 0.5, None, "wlf", 0.02).doubts()[-1:]
    asked = "compare --vertical free" + (" and --shift free" if law == "wlf" else "")
    assert compound.fitted(path, 0.5, None, law, 0.02).doubts()[-1].endswith(asked)  # not for what is there already
    assert re.match(r"free vertical factors b_T would join the sweeps with a misfit of \S+ %, not 4\.\d %, and", text)
    made = compound.fitted(path, 0.5, None, law, 0.02, vertical="free")
    assert made.shift is not None
    assert isinstance(made.shift.vertical, Factors)
    for temperature in map(float, TEMPERATURES):
        right = own_factor(temperature) / own_factor(MIDDLE)
        assert 10.0 ** log_vertical(made.shift, temperature) == pytest.approx(right, rel=0.05)
        above = temperature - MIDDLE
        assert made.shift.log_factor(temperature) == pytest.approx(-RIGHT[0] * above / (RIGHT[1] + above), abs=0.1)


def test_a_job_at_another_temperature(tmp_path: Path) -> None:
    """Moduli of the file are b_T times those at the reference, also those that checks use; a table in a job gives the
    same body."""
    from parcontact.effects.branches import relaxation_of

    made = compound.fitted(sweeps(tmp_path / "table.txt", "density"), 0.5, 20.0, "wlf", 0.05)
    (tmp_path / "rubber.yaml").write_text(made.text())
    warm = load(tmp_path, "{include: rubber, temperature: 50}").material
    b = (1.0 - 6e-4 * 30.0) * 323.15 / 293.15
    for material in (
        warm,
        load(tmp_path, "{model: dma, path: table.txt, error: 0.05, reference: 20, temperature: 50}").material,
    ):
        series = relaxation_of(material)
        assert series.modulus_inf == pytest.approx(b * made.series.modulus_inf, rel=1e-6)
        assert_allclose(series.moduli, b * made.series.moduli, rtol=1e-6)
        assert material.fitted.long_modulus == pytest.approx(series.modulus_inf, rel=1e-12)
        assert material.fitted.instant_modulus == pytest.approx(series.modulus_inf + series.moduli.sum(), rel=1e-12)
        assert modulus_after(material.fitted, 1e30) == pytest.approx(4.0 * series.modulus_inf, rel=1e-9)
    (fact,) = load(tmp_path, "{include: rubber, temperature: 50}").facts
    assert fact.endswith(f", b_T = {b:.4g}, reference 20 C)")


SHIFTED = (
    "{{model: zener, modulus_inf: 1e6, temperature: {}, "
    "shift: {{law: wlf, C1: 8, C2: 100, reference: 20, vertical: {}}}}}"
)
FACTORS = "{law: factors, temperatures: [0, 40], logs: [-0.1, 0.1]}"


def test_laws_in_a_job(tmp_path: Path) -> None:
    """By their definitions, and refused where they end."""
    half_way = load(tmp_path, SHIFTED.format(30, FACTORS)).material.fitted
    assert half_way.long_modulus == pytest.approx(1e6 * 10.0**0.05, rel=1e-12)
    density = load(tmp_path, SHIFTED.format(30, "{law: density, expansion: 5e-4}")).material.fitted
    assert density.long_modulus == pytest.approx(1e6 * (1 - 5e-3) * 303.15 / 293.15, rel=1e-12)
    for material, sentence in (
        (
            SHIFTED.format(50, FACTORS),
            "material.temperature is outside of the shift: 50 C is outside the shift factors",
        ),
        (SHIFTED.format(30, "{law: factors, temperatures: [0, null], logs: [0, 1]}"), "got nothing"),
        (SHIFTED.format(5, "{law: factors, temperatures: [0, 10], logs: [0, 1]}"), "vertical.temperatures must reach"),
        (
            SHIFTED.format(30, "{law: density, expansion: -1}"),
            "vertical.expansion must be a loss of density per kelvin",
        ),
        (SHIFTED.format(30, "{law: wlf}"), "must be density | factors, got 'wlf'"),
    ):
        with pytest.raises(jobs.JobError) as failure:
            load(tmp_path, material)
        (line,) = failure.value.mistakes
        assert sentence in line


@pytest.mark.parametrize(
    "text",
    [
        "T,log_aT,log_bT\nC,-,-\n-40,3,-0.1\n20,0,0\n60,-1.7,0.05\n",
        "T[C];log_aT;log_bT\n-40;3;-0.1\n20;0;0\n60;-1.7;0.05\n",
        "T [°C]\tlog_aT\tlog_bT\n60\t-1.7\t0.05\n20\t0\t0\n-40\t3\t-0.1\n",
        "T[C] log_aT log_bT\n-40 3 -0.1\n20 0 0\n60 -1.7 0.05\n",
    ],
)
def test_tables_of_both_shifts(tmp_path: Path, text: str) -> None:
    """Commas, semicolons, tabs or blanks; the column b_T is used, and that of a_T as ever."""
    path = tmp_path / "shifts.csv"
    path.write_text(text, encoding="latin-1")
    temperatures, vertical = (-40.0, 20.0, 60.0), (-0.1, 0.0, 0.05)
    expected = Factors(temperatures, (3.0, 0.0, -1.7), 20.0, Factors(temperatures, vertical, 20.0))
    assert read_shift(str(path), None) == expected


def test_a_table_of_both_shifts_in_a_fit(tmp_path: Path) -> None:
    """Known factors join the sweeps, and the file has both; nothing else is fitted."""
    a = [-C1 * (t - REFERENCE) / (C2 + t - REFERENCE) for t in TEMPERATURES]
    b = [np.log10(density_factor(t)) for t in TEMPERATURES]
    shifts = write(tmp_path / "shifts.txt", "T[C] log_aT log_bT", TEMPERATURES, np.array(a), np.array(b))
    law = read_shift(str(shifts), None)
    path = sweeps(tmp_path / "table.txt", "density")
    made = compound.fitted(path, 0.5, None, law, 0.02)
    assert made.shift == law
    assert made.series.best < 0.01
    assert "# Horizontal shift, given: 9 factors, log10: " in made.text()
    (tmp_path / "rubber.yaml").write_text(made.text())
    cold = load(tmp_path, "{include: rubber, temperature: -30}").material.fitted
    assert cold.long_modulus == pytest.approx(density_factor(-30.0) * made.series.modulus_inf, rel=1e-4)


def test_a_law_that_ends() -> None:
    with pytest.raises(InputError, match="beyond the density law"):
        Density(1e-2, 20.0).log_factor(130.0)
    assert Density(0.0, 20.0).log_factor(20.0) == 0.0
