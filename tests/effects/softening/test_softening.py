"""Softening of filled rubber: strains of waves, the fixed point, bands, and what is refused.

The reference is a half space whose modulus varies with depth, found self-consistently by finite elements along the
depth (homogeneous body 7e-4 off), for `f = 0.1 + 0.9/(1 + x^1.2)`, `g = 0.2 + 1.6 x^0.6/(1 + x^1.2)`, x = strain/0.01.
"""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from parcontact import job as jobs
from parcontact.bands.road_sliding import RoadSliding
from parcontact.effects.softening.effect import Softened, StrainTable
from parcontact.effects.softening.steady import doubts_of_points, strains_at_octaves
from parcontact.errors import InputError, JobError
from parcontact.march import sanity, scene
from parcontact.march.steady import Point, SteadySliding
from parcontact.parallel.slab import Slab
from parcontact.physics.convolution import wavenumbers
from parcontact.results import band_charts, prediction
from parcontact.theory.persson import GAMMA

Json = dict[str, Any]
X = np.geomspace(1e-4, 1e4, 250)
TABLE = [[0.01 * x, 0.1 + 0.9 / (1 + x**1.2), 0.2 + 1.6 * x**0.6 / (1 + x**1.2)] for x in X.tolist()]
NONE = [[1e-6, 1.0, 1.0], [10.0, 1.0, 1.0]]
LENGTH, SPEED, SPRING = 1e-3, 1.0, 1e6
WAVENUMBER = 2 * math.pi / LENGTH
BRANCH = 0.6 / 0.7 * SPRING  # G''/G' = 0.3 at omega tau = 1
RUBBER = {
    "model": "zener",
    "modulus_inf": SPRING,
    "branches": [{"modulus": BRANCH, "relaxation_time": 1 / (WAVENUMBER * SPEED)}],
}
FULL = 6.0 * (SPRING + BRANCH)  # [Pa] times k A: a pressure of full contact


def wave(slope: float, table: list[list[float]] | None, **changes: Any) -> jobs.Job:
    """One wave in full contact; `slope` is k A."""
    data = {
        "grid": {"points": [32, 1], "size": [LENGTH, LENGTH / 32]},
        "surface": {"shape": "wave", "amplitude": slope / WAVENUMBER, "waves": [1, 0]},
        "material": RUBBER,
        "steady": {"velocities": [SPEED], "pressures": [FULL * slope]},
        "numerics": {"accuracy": 1e-3},
    }
    return jobs.load({**data, **({"softening": {"table": table}} if table else {}), **changes})


def solved(job: jobs.Job, start: float | None = None, comm: MPI.Intracomm = MPI.COMM_SELF) -> Point:
    sliding = SteadySliding(scene.set_up(job, Slab(comm, *job.grid.points)))
    if start is not None:
        loop = sliding.loops[0]  # heat comes after it
        loop.softened = replace(loop.softened, strains=(start,) * len(loop.softened.strains))
    assert job.steady is not None
    assert job.steady.pressures is not None
    return sliding.solve((SPEED, 0.0), job.steady.pressures[0])


@pytest.mark.parametrize(
    ("slope", "loss"),
    [(1e-3, 0.48128), (0.01, 0.95454), (0.05, 0.85867), (0.1, 0.70004), (0.3, 0.48532), (1.0, 0.34408)],
)
def test_loss_of_one_wave(slope: float, loss: float) -> None:
    """Against finite elements along the depth: 5 %, as one strain stands for all depths (-3.0 to 1.7 %)."""
    found = solved(wave(slope, TABLE))
    unsoftened = slope**2 * 0.5 * BRANCH / (FULL * slope)  # (k A)^2 G''/p0
    assert found.friction / unsoftened == pytest.approx(loss, rel=0.05)
    assert found.effects["softening"] == pytest.approx(math.sqrt(3 / 8) * slope, rel=2e-3)  # (3) of `strain`
    whole = FULL * slope * found.friction * SPEED * LENGTH**2 / 32
    assert sum(found.dissipated) == pytest.approx(whole, rel=1e-6)  # [W] counts softened branches


HOT: Json = {  # slides for 2 s, and is 7 K warmer then
    "material": {**RUBBER, "shift": {"law": "wlf", "C1": 10.0, "C2": 80.0, "reference": 20.0}},
    "thermal": {"conductivity": 0.2, "diffusivity": 1e-7, "feedback": "mean", "distance": 2.0},
}


@pytest.mark.parametrize("more", [{}, HOT])
def test_fixed_point_does_not_depend_on_its_start(more: Json) -> None:
    """Strains of 1e-3 and 0.3 lead to one friction, to the stated error of the rounds, a fifth of the accuracy; with
    heat that of the temperature, 2e-3."""
    low, high = (solved(wave(0.3 if more else 0.05, TABLE, **more), start) for start in (1e-3, 0.3))
    assert low.friction == pytest.approx(high.friction, rel=2e-3 if more else 1e-3)
    if more:
        assert low.friction < 0.5 * low.effects["thermal"].friction_cold


def test_two_starts_of_bands_with_heat() -> None:
    """One fixed point of strains and temperatures: starts meet to a fifth of the accuracy."""
    data: Json = {
        "surface": {**ROUGH, "rms_slope": 0.4, "short_wavelength": 4e-5},
        "material": {"include": "synthetic_tyre", "shift": HOT["material"]["shift"]},
        "bands": {"samples": 1, "count": 2, "points": 32, "waves": 2},
        "steady": {"velocities": [SPEED], "pressures": [1e6]},
        "numerics": {"accuracy": 0.1},
        "softening": {"table": TABLE},
        "thermal": {**HOT["thermal"], "distance": 0.1},
    }
    found = []
    for start in (1e-3, 0.3):
        bands = RoadSliding(jobs.load(data), Slab.alone(1, 1))
        strains: Any = bands.loops[0]
        strains._strains = np.full(2, start)
        found.append(bands.solve((SPEED, 0.0), 1e6))
    assert found[0].friction == pytest.approx(found[1].friction, rel=0.02)
    assert found[0].friction < 0.9 * found[0].effects["thermal"].friction_cold


def test_factors_of_one_change_no_digit() -> None:
    """Measures, friction and calls are those of a job without the section: factors do not change, so one round is
    enough."""
    plain, softened = (solved(rough(table)) for table in (None, NONE))
    assert softened.measures == plain.measures
    assert softened.friction == plain.friction
    assert softened.operator_calls == plain.operator_calls


ROUGH = {
    **{"shape": "rough", "hurst": 0.8, "rms_slope": 0.2, "long_wavelength": 5e-4, "short_wavelength": 6e-5},
    **{"seed": 2, "amplitudes": "fixed"},
}


def rough(table: list[list[float]] | None, scale: float = 1.0, points: int = 48) -> jobs.Job:
    """A rough surface in partial contact, all lengths and the velocity times `scale`."""
    surface = {**ROUGH, **{name: scale * ROUGH[name] for name in ("long_wavelength", "short_wavelength")}}  # type: ignore[operator]
    data: Json = {
        "grid": {"points": points, "size": 1e-3 * scale},
        "surface": surface,
        "material": {"include": "synthetic_tyre"},
        "steady": {"velocities": [SPEED], "pressures": [4e5]},
        "numerics": {"tolerance": 1e-6, "accuracy": 1e-2},
    }
    return jobs.load({**data, **({"softening": {"table": table}} if table else {})})


def test_strains_do_not_depend_on_lengths() -> None:
    """All lengths, and with them the velocity, ten times as large: the same strains; to the tolerance of the solves."""
    small, large = rough(TABLE), rough(TABLE, 10.0)
    first = solved(small)
    second = SteadySliding(scene.set_up(large, Slab.alone(48, 48))).solve((10.0 * SPEED, 0.0), 4e5)
    assert second.effects["softening"] == pytest.approx(first.effects["softening"], rel=1e-4)
    assert second.friction == pytest.approx(first.friction, rel=1e-4)


@pytest.mark.mpi(2, 3)
def test_ranks_agree(comm: MPI.Intracomm) -> None:
    """To the tolerance of the solves, 1e-6, times the few hundred steps from which it grows."""
    alone, together = solved(rough(TABLE)), solved(rough(TABLE), comm=comm)
    assert_allclose(
        [together.friction, together.effects["softening"]], [alone.friction, alone.effects["softening"]], rtol=3e-4
    )


def sum_over_waves(setup: scene.Setup, heights: NDArray[Any], octaves: Softened) -> NDArray[Any]:
    """sum_j 12 (k_j A_j)^2 r^2/(1 + r)^5, r = k_j/q, in the middle of each octave that has waves; NaN elsewhere."""
    q = np.hypot(*wavenumbers(setup.fft, setup.size))
    waves = setup.fft.forward(heights) * (setup.units.height / setup.units.length / setup.slab.points)
    slopes = (2.0 * setup.fft.multiplicity * np.abs(waves) ** 2 * q**2).ravel()  # (k A)^2
    found = []
    for number in range(len(octaves.strains)):
        own = (octaves.octave(q).ravel() == number) & (slopes > 1e-12 * slopes.max())
        middle = np.exp(np.average(np.log(q.ravel()[own]), weights=slopes[own])) if own.any() else np.nan
        ratio = q.ravel() / middle
        found.append(math.sqrt(float((12 * slopes * ratio**2 / (1 + ratio) ** 5).sum())) if own.any() else math.nan)
    return np.array(found)


def test_strains_of_full_contact_are_sums_over_waves() -> None:
    """Many waves with independent phases: 5 %, from the phases of one surface and one wavenumber for an octave."""
    setup = scene.set_up(rough(TABLE, points=96), Slab.alone(96, 96))
    heights = setup.surface.heights((0.0, 0.0), setup.slab.empty())
    octaves = Softened(StrainTable((1e-3, 1.0), (1.0, 1.0), (1.0, 1.0)), max(setup.size), (0.02,) * 7)
    found = strains_at_octaves(setup, octaves, heights, (SPEED, 0.0)).of_octaves(np.full(7, np.nan))
    expected = sum_over_waves(setup, heights, octaves)
    there = np.isfinite(expected)
    assert there.sum() >= 3
    assert_allclose(found[there], expected[there], rtol=0.05)
    (sentence,) = sanity.describe_waves(rough(TABLE, points=96))  # numbers in two digits
    said = [float(number) for number in re.findall(r"([\d.]+) down to", sentence)]
    assert_allclose(said, expected[there], rtol=0.08)


def test_strain_of_one_wave_is_said() -> None:
    """sqrt(3/8) k A = 0.061, with f and g of the table there; nothing for a flat surface."""
    x = math.sqrt(3 / 8) * 10.0
    f, g = 0.1 + 0.9 / (1 + x**1.2), 0.2 + 1.6 * x**0.6 / (1 + x**1.2)
    end = f"0.061 down to 500 µm (f {f:.2g}, g {g:.2g})"
    assert sanity.describe_waves(wave(0.1, TABLE)) == [f"softening: strains of waves in full contact {end}"]
    assert sanity.describe_waves(wave(0.1, TABLE, surface={"shape": "flat"})) == []


def test_pictures(tmp_path: Path) -> None:
    """f G' and g G'' over strain with the strains of a curve, and the strain of each band over its shortest wave."""
    data = wave(0.1, TABLE).resolved()
    (tmp_path / "steady.resolved.yaml").write_text(data)
    head = "velocity,pressure,temperature,friction,contact_area,strain_amplitude"
    (tmp_path / "steady.csv").write_text(f"{head}\n1,1e5,,0.1,1,0.06\n2,1e5,,0.1,1,\n")
    more = ",band,long_wavelength,short_wavelength"
    (tmp_path / "bands.csv").write_text(
        f"{head}{more}\n1,1e5,,0.1,1,0.06,0,1e-3,1e-4\n1,1e5,,0.1,1,0.08,1,1e-4,1e-5\n"
        "2,1e5,,0.1,1,,0,1e-3,1e-4\n2,1e5,,0.1,1,,1,1e-4,1e-5\n"
    )
    *_, moduli, _, _, strains = band_charts.panels_of_curve(tmp_path)
    storage, at, loss, _ = moduli.series
    assert_allclose(np.interp(TABLE[100][0], storage.x, storage.y), TABLE[100][1], rtol=0.02)
    assert_allclose(np.interp(TABLE[100][0], loss.x, loss.y), TABLE[100][2], rtol=0.02)
    assert at.x.tolist() == [0.06]  # the other state has no friction
    assert (strains.key, strains.series[0].x.tolist(), strains.series[0].y.tolist()) == (
        "bands strain",
        [1e-5, 1e-4],
        [0.08, 0.06],
    )
    (tmp_path / "steady.resolved.yaml").write_text(data.replace("softening:", "hardening:"))  # not of this version
    assert "steady softening" not in [chart.key for chart in band_charts.panels_of_curve(tmp_path)]


def test_the_theory_is_refused() -> None:
    job = rough(TABLE)
    assert not prediction.has_spectrum(job)
    with pytest.raises(InputError, match="the theory excludes softening"):
        prediction.foretell(job, GAMMA, "continuum")


TIMES = 10.0 ** np.arange(-12.0, 6.0, 0.5)
POWER_LAW = {  # G' ~ omega^0.15, G''/G' = tan(0.15 pi/2)
    "model": "zener",
    "modulus_inf": 1.0,
    "branches": [{"modulus": 3e4 * (1e-3 / t) ** 0.15, "relaxation_time": t} for t in TIMES.tolist()],
}


@pytest.mark.parametrize(
    ("hurst", "slope", "ratio"), [*((0.8, 0.03, 0.950), (0.8, 0.3, 0.484)), *((0.5, 0.1, 0.657), (0.5, 1.0, 0.331))]
)
def test_bands_in_full_contact(hurst: float, slope: float, ratio: float) -> None:
    """Three decades of waves, slope spectrum q^(2 - 2H), one strain a band: softened over unsoftened friction within
    3 % of finite elements along the depth. On profiles, whose spectrum has an exponent less by one."""
    frictions = []
    for table in (None, TABLE):
        data: Json = {
            "surface": {
                **{"shape": "rough", "hurst": max(hurst - 0.5, 1e-3), "rms_slope": slope, "seed": 1},
                **{"long_wavelength": 1e-3, "short_wavelength": 1e-6},
            },
            "material": POWER_LAW,
            "bands": {"samples": 1, "count": 4, "points": [192, 1], "waves": 8},
            "steady": {"velocities": [SPEED], "pressures": [1e8]},
            "numerics": {"accuracy": 0.02},
        }
        job = jobs.load({**data, **({"softening": {"table": table}} if table else {})})
        frictions.append(RoadSliding(job, Slab.alone(1, 1)).solve((SPEED, 0.0), 1e8).friction)
    assert frictions[1] / frictions[0] == pytest.approx(ratio, rel=0.03)


@pytest.mark.parametrize(("hurst", "slope", "ratio"), [(0.8, 0.1, 0.698), (0.5, 1.0, 0.331)])
def test_octaves_on_one_grid_in_full_contact(hurst: float, slope: float, ratio: float) -> None:
    """The same spectra on one profile of four longest waves, with one strain an octave: within 3 % of finite elements.
    One longest wave would stand for an octave of them."""
    frictions = []
    for table in (None, TABLE):
        data: Json = {
            "grid": {"points": [16384, 1], "size": [4e-3, 1e-3 / 4096]},
            "surface": {
                **{"shape": "rough", "hurst": max(hurst - 0.5, 1e-3), "rms_slope": slope, "amplitudes": "fixed"},
                **{"long_wavelength": 1e-3, "short_wavelength": 1e-6, "seed": 1},
            },
            "material": POWER_LAW,
            "steady": {"velocities": [SPEED], "pressures": [1e8]},
            "numerics": {"accuracy": 0.02},
        }
        job = jobs.load({**data, **({"softening": {"table": table}} if table else {})})
        frictions.append(SteadySliding(scene.set_up(job, Slab.alone(16384, 1))).solve((SPEED, 0.0), 1e8).friction)
    assert frictions[1] / frictions[0] == pytest.approx(ratio, rel=0.03)


def test_partial_contact_in_bands_and_on_one_grid() -> None:
    """Friction of two bands, with a strain each, within the stated error of one grid of all waves with one per octave;
    softening raises friction, as the area grows."""
    data: Json = {
        "surface": {**ROUGH, "short_wavelength": 4e-5},
        "material": {"include": "synthetic_tyre"},
        "steady": {"velocities": [0.1], "pressures": [4e5]},
        "numerics": {"accuracy": 0.05},
        "softening": {"table": TABLE},
    }
    bands = RoadSliding(jobs.load({**data, "bands": {"samples": 1, "count": 2, "points": 96}}), Slab.alone(1, 1))
    banded = bands.solve((0.1, 0.0), 4e5)
    grid = {"grid": {"points": 128, "size": 1e-3}}
    one = SteadySliding(scene.set_up(jobs.load({**data, **grid}), Slab.alone(128, 128))).solve((0.1, 0.0), 4e5)
    data.pop("softening")
    hard = SteadySliding(scene.set_up(jobs.load({**data, **grid}), Slab.alone(128, 128))).solve((0.1, 0.0), 4e5)
    assert one.friction > 1.2 * hard.friction
    assert banded.friction == pytest.approx(one.friction, rel=banded.error_friction + one.error_friction)
    assert banded.effects["softening"] == pytest.approx(
        one.effects["softening"], rel=0.15
    )  # their waves differ in phases


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"history": [{"pressure": 1e5, "duration": 1e-3}]}, "history cannot be used with softening"),
        ({"initial": {"state": "steady", "velocity": 1.0, "pressure": 1e5}}, "initial cannot be used with softening"),
        ({"grid": {"points": 16, "size": 1e-3, "boundary": "free"}}, "must be periodic with softening"),
        ({"body": {"thickness": 1e-3}}, "body cannot be used with softening"),
        ({"material": {"model": "elastic", "shear_modulus": 1e6}}, "needs a material that relaxes"),
        ({"material": {**RUBBER, "poisson": 0.3}}, "must be at least 0.45 with softening"),
        ({"softening": {"table": []}}, "at least two rows"),
        ({"softening": {"table": [[0.1, 1, 1]]}}, "at least two rows"),
        ({"softening": {"table": [[0.1, 1, 1], [0.01, 1, 1]]}}, "rising strains"),
        ({"softening": {}}, "softening"),
        ({"softening": {"table": TABLE, "reference_strain": 0.1}}, "is for the path of a strain sweep"),
    ],
)
def test_refused(changes: Json, sentence: str) -> None:
    with pytest.raises(JobError, match=sentence):
        wave(0.1, TABLE, **changes)


SWEEPS = {
    "factors.csv": "strain,f,g\n0.001,1,1\n0.01,0.8,1.1\n0.1,0.5,0.6\n",
    "moduli.csv": "strain [%],G' (MPa),G'' (MPa)\n0.1,4,0.5\n1,3.2,0.55\n10,2,0.3\n",
    "german.csv": "Dehnung\ngamma;E'/MPa;E''/MPa;f/Hz\n0,001;12;1,5;10\n0,01;9,6;1,65;10\n0,1;6;0,9;10\n",
}


@pytest.mark.parametrize("name", SWEEPS)
def test_files_of_strain_sweeps(tmp_path: Path, name: str) -> None:
    """Factors, moduli over a strain in per cent, and a file of an instrument with one frequency: the same table."""
    (tmp_path / name).write_text(SWEEPS[name])
    section = wave(0.1, None, softening={"path": str(tmp_path / name)}).section("softening")
    assert_allclose(section.made.strain, [1e-3, 1e-2, 0.1], rtol=1e-14)
    assert_allclose(section.made.storage, [1.0, 0.8, 0.5], rtol=1e-14)
    assert_allclose(section.made.loss, [1.0, 1.1, 0.6], rtol=1e-14)
    assert ("reference_strain is not given" in section.fact) == (name != "factors.csv")
    if name != "factors.csv":
        other = {"path": str(tmp_path / name), "reference_strain": 0.01}
        assert_allclose(
            wave(0.1, None, softening=other).section("softening").made.storage, [1.25, 1.0, 0.625], rtol=1e-14
        )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("strain,f,g\n0.1,1,1\n", "at least two rows"),
        ("strain,f,g\n0.1,1,1\n0.1,1,1\n", "positive and different"),
        ("strain,G'[MPa],G''[MPa],T[C]\n0.01,1,1,20\n0.1,1,1,40\n", "has one temperature, got 2, 20 to 40"),
        ("strain,G'[MPa],G''[MPa],f[Hz]\n0.01,1,1,1\n0.1,1,1,10\n", "has one frequency, got 2, 1 to 10 Hz"),
        ("strain,f,g\n0.1,1,1\n100,0.3,1\n", r"strains without a unit reach 100; write strain\[%\]"),
        ("strain[mm],f,g\n0.01,1,1\n0.1,1,1\n", "the unit of strain must be one of"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "sweep.csv").write_text(text)
    with pytest.raises(JobError, match=sentence):
        wave(0.1, None, softening={"path": str(tmp_path / "sweep.csv")})


def test_strains_of_bands_in_full_contact() -> None:
    """`check` says the strains that bands have in full contact: within 15 %, as waves of surfaces scatter."""
    data: Json = {
        "surface": {**ROUGH, "long_wavelength": 1e-3, "short_wavelength": 2e-5},
        "material": {"include": "synthetic_tyre"},
        "bands": {"samples": 1, "count": 2, "points": 128},
        "steady": {"velocities": [1e-3], "pressures": [1e9]},
        "numerics": {"accuracy": 0.1},
        "softening": {"table": NONE},
    }
    job = jobs.load(data)
    bands = RoadSliding(job, Slab.alone(1, 1))
    bands.solve((1e-3, 0.0), 1e9)
    (sentence,) = [text for text in bands.notes() if text.startswith("softening")]
    said = [float(number) for number in re.findall(r"([\d.e-]+) \(f 1, g 1\)", sentence)]
    assert_allclose(said, [row[-1] for row in bands.rows((1e-3, 0.0))], rtol=0.15)


def test_strains_outside_of_the_table_are_said(tmp_path: Path) -> None:
    """A sweep that ends at a strain of 1 %, and a wave of 6 %."""
    short = [row for row in TABLE if row[0] < 0.01]
    job = wave(0.1, short)
    (doubt,) = doubts_of_points([solved(job)], job)
    assert "the strain is 0.061 at 1 m/s, beyond the 1e-06 to 0.00964" in str(doubt)
    assert not list(doubts_of_points([solved(wave(0.1, TABLE))], wave(0.1, TABLE)))
    assert not list(doubts_of_points([solved(job).with_effect("softening", math.nan)], job))  # without friction
