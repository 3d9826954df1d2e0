"""Fits against a rubber whose truth is known: series, shifts, and the material file."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from parcontact import job as jobs
from parcontact.errors import InputError
from parcontact.rubber import compound, series, superposition, tables
from parcontact.rubber.shift import WLF, Arrhenius, Factors

from . import measured

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


def test_fewer_branches_are_worse(tmp_path: Path) -> None:
    """The error asked for is met, by fewer branches the larger it is."""
    path = measured.write_sweeps(tmp_path / "rubber.csv")
    sizes = []
    for asked in (0.3, 0.1, 0.02, 0.005):
        made = compound.fitted(path, 0.5, None, LAW, asked).series
        assert made.error <= np.hypot(asked, made.best)
        sizes.append(made.moduli.size)
    assert sizes == sorted(sizes)
    assert sizes[0] < sizes[-1]
    assert np.all(made.moduli > 0.0)


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
    free = superposition.superpose(tables.read(warm), 20.0, "free", "none").shift
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
    found = superposition.superpose(tables.read(tmp_path / "arrhenius.txt"), 20.0, "arrhenius", "none").shift
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
        superposition.superpose(tables.read(path), reference, "wlf", "none")


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
    from parcontact.effects.relaxation import relaxation_of

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
        ("{model: dma, path: rubber.csv, temperature: -100}", "material.temperature is beyond the shift"),
        ("{model: dma, path: rubber.csv, reference: 200}", "must lie within -20 and 60 C, got 200"),
        ("{model: dma, path: rubber.csv, error: 0}", "material.error must be a positive"),
        ("{model: zener, modulus_inf: 1.0e6, temperature: 40}", "has no effect without material.shift"),
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
