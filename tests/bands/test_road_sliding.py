"""Surfaces in bands: one band against the steady solver on one grid, full contact against its closed form."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mpi4py import MPI

from parcontact import job as jobs
from parcontact.__main__ import main
from parcontact.bands.band import Band, PressureLadder, Rung
from parcontact.bands.choice import cut_bands, spectrum_of
from parcontact.bands.road_sliding import LEAST_METHOD, LEAST_OF_AREA, RoadSliding
from parcontact.effects.branches import relaxation_of
from parcontact.errors import JobError, RunError
from parcontact.files import tables
from parcontact.march import curve
from parcontact.march.budget import ErrorParts, advice
from parcontact.march.scene import set_up
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Array, Slab
from parcontact.physics.prony import complex_modulus
from parcontact.physics.records import Measures

LONG, SHORT = 4e-3, 5e-4
ROUGH = {
    **{"shape": "rough", "hurst": 0.8, "long_wavelength": LONG, "short_wavelength": SHORT, "rms_slope": 0.2},
    **{"seed": 3, "amplitudes": "fixed"},
}
JOB: dict[str, Any] = {
    "surface": ROUGH,
    "material": {"include": "synthetic_tyre"},
    "steady": {"velocities": [0.1], "pressures": [1e6]},
    "numerics": {"tolerance": 1e-4},
}


def sliding(changes: dict[str, object], comm: MPI.Intracomm = MPI.COMM_SELF) -> RoadSliding:
    return RoadSliding(jobs.load({**JOB, "bands": {"samples": 1}, **changes}), Slab(comm, 1, 1))


@pytest.mark.parametrize("pressure", [1e5, 2e6])
def test_one_band_is_steady_on_one_grid(pressure: float) -> None:
    """On the same heights friction and area agree with the steady solver to the tolerance of both, 1e-3."""
    found = sliding({"surface": {**ROUGH, "short_wavelength": 1e-3}, "bands": {"count": 1, "points": 64, "samples": 1}})
    bands, band = found.solve((0.1, 0.0), pressure), Band(found.job, found.cut, 0, 0).setup
    heights = band.surface.heights((0.0, 0.0), band.slab.empty()) * band.units.height
    on_grid = jobs.load({**JOB, "surface": heights, "grid": {"points": 64, "size": 4 * LONG}})
    grid = SteadySliding(set_up(on_grid, Slab.alone(64, 64))).solve((0.1, 0.0), pressure)
    assert bands.friction == pytest.approx(grid.friction, rel=1e-3)
    assert bands.measures.contact_area == pytest.approx(grid.measures.contact_area, rel=3e-3)  # of some 500 points
    assert bands.measures.friction == pytest.approx(grid.measures.friction, rel=1e-2)  # by slopes: of first order
    assert bands.measures.mean_gap == pytest.approx(grid.measures.mean_gap, rel=1e-3)
    assert bands.dissipated == pytest.approx(grid.dissipated, rel=2e-3, abs=0.0)
    assert (bands.errors.friction or bands.errors.area).method == 0.0


@pytest.mark.parametrize("points", [[1024, 1], [128, 128]], ids=["profile", "map"])
def test_the_surface_of_a_band_has_the_slope_of_the_spectrum(points: list[int]) -> None:
    """By the transform of its heights; 1e-3: a wave has the spectrum of its cell, which is summed at a few points."""
    job = jobs.load({**JOB, "bands": {"samples": 1, "count": 1, "points": points}})
    band = Band(job, cut_bands(job), 0, 0)
    grid = band.setup.grid
    waves = np.fft.fft2(band.heights * band.setup.units.height) / band.heights.size
    qx, qy = (2.0 * np.pi * np.fft.fftfreq(n, d) for n, d in ((grid.nx, grid.dx), (grid.ny, grid.dy)))
    slope = np.sqrt(np.sum(np.abs(waves) ** 2 * (qx[None, :] ** 2 + qy[:, None] ** 2)))
    assert slope == pytest.approx(ROUGH["rms_slope"], rel=1e-3)


def full_contact(job: jobs.Job, speed: float, pressure: float) -> float:
    """`mu = 1/(p0 v) int Phi |q| w G''(w) d2q/(4 pi^2)`, w = q v cos, of an incompressible half space."""
    spectrum = spectrum_of(job)
    edges = np.geomspace(2 * np.pi / spectrum.longest, 2 * np.pi / spectrum.shortest, 2001)
    q, dq = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
    angle = (np.arange(400) + 0.5) * 2 * np.pi / 400
    omega = q[:, None] * speed * np.cos(angle)
    loss = complex_modulus(np.abs(omega), *relaxation_of(job.material)).imag * np.abs(omega)
    power = 2.0 * np.sum(spectrum.phi(q) * q * q * dq * loss.mean(axis=1)) / (2 * np.pi)
    return float(power / (pressure * speed))


@pytest.mark.parametrize("count", [1, 2, 3, 6])
def test_full_contact_is_the_closed_form(count: int) -> None:
    """Each wave loses on its own. What is left are the directions of the few waves of a box: 0.2 %."""
    changes = {
        "surface": {**ROUGH, "short_wavelength": SHORT if count == 6 else 2 * SHORT, "rms_slope": 0.02},
        "bands": {"count": count, "samples": 1},
    }
    found = sliding(changes)
    point = found.solve((0.1, 0.0), 1e7)
    assert point.friction == pytest.approx(full_contact(found.job, 0.1, 1e7), rel=2e-3)
    assert point.measures.contact_area == pytest.approx(1.0, abs=1e-5)  # of the interpolation between rungs


def test_errors_of_full_contact_are_positive() -> None:
    """Some rungs have weights below 0, as the interpolation is cubic; errors of rungs do not subtract."""
    waves = {"hurst": 0.5, "long_wavelength": 6.28e-4, "short_wavelength": 3.14e-5, "rms_slope": 0.0055, "seed": 0}
    surface, bands = {"shape": "rough", **waves}, {"count": 2, "points": [1024, 1], "samples": 1}
    errors = sliding({"surface": surface, "bands": bands}).solve((0.1, 0.0), 1e6).errors
    assert errors.friction is not None
    assert min(*errors.friction, *errors.area) >= 0.0


@pytest.mark.mpi(2, 3)
def test_ranks_agree() -> None:
    """Whole contacts on other ranks: friction and area to the last digits but those of transforms."""
    changes = {"bands": {"count": 2, "samples": 2}, "numerics": {"tolerance": 5e-2}}
    alone, together = sliding(changes), sliding(changes, MPI.COMM_WORLD)
    one, other = alone.solve((0.1, 0.0), 1e6), together.solve((0.1, 0.0), 1e6)
    assert other.friction == pytest.approx(one.friction, rel=1e-9)
    assert other.measures.contact_area == pytest.approx(one.measures.contact_area, rel=1e-9)
    assert together.rows((0.1, 0.0)) == [pytest.approx(row, rel=1e-9, nan_ok=True) for row in alone.rows((0.1, 0.0))]


SHIFTED = {"include": "synthetic_tyre", "shift": {"law": "wlf", "C1": 8.86, "C2": 101.6, "reference": 20.0}}
THERMAL = {"conductivity": 0.2, "diffusivity": 1e-7, "distance": 0.02}


@pytest.mark.parametrize("feedback", ["none", "mean"])
def test_heat_of_one_band_is_that_of_one_grid(feedback: str) -> None:
    """The flash temperature within 3 %, to which a fixed point with feedback is found, and friction within 0.1 %."""
    job = {"material": SHIFTED, "thermal": {**THERMAL, "feedback": feedback}, "numerics": {"tolerance": 1e-3}}
    one = {"surface": {**ROUGH, "short_wavelength": 1e-3}, "bands": {"count": 1, "points": 64, "samples": 1}}
    found = sliding({**job, **one})
    bands, band = found.solve((1.0, 0.0), 1e6), Band(found.job, found.cut, 0, 0).setup
    heights = band.surface.heights((0.0, 0.0), band.slab.empty()) * band.units.height
    on_grid = jobs.load({**JOB, **job, "surface": heights, "grid": {"points": 64, "size": 4 * LONG}})
    grid = SteadySliding(set_up(on_grid, Slab.alone(64, 64))).solve((1.0, 0.0), 1e6)
    assert bands.effects["thermal"].mean == pytest.approx(
        grid.effects["thermal"].mean, rel=0.03 if bands.effects["thermal"].rounds > 1 else 2e-3
    )
    assert bands.friction == pytest.approx(grid.friction, rel=1e-3)
    assert (bands.effects["thermal"].rounds > 1) == (feedback == "mean")


def test_finer_bands_are_warmer() -> None:
    """Each feels the heat of all coarser scales too, and its own feedback: less friction than that of cold rubber."""
    job = {"material": SHIFTED, "thermal": {**THERMAL, "feedback": "mean"}, "numerics": {"tolerance": 1e-2}}
    found = sliding({**job, "bands": {"count": 3, "points": 40, "samples": 1}})
    point = found.solve((1.0, 0.0), 1e6)
    rises = [row[-1] for row in found.rows((1.0, 0.0))]
    assert 0.0 < rises[0] < rises[1] < rises[2]
    assert point.friction < point.effects["thermal"].friction_cold
    assert rises[0] < point.effects["thermal"].mean < rises[2]


def with_table_to(highest: float) -> RoadSliding:
    """Rubber of two bands whose factors, a tenth for 12.5 K, end at a temperature [deg C]."""
    rows = {"temperatures": [0.0, highest], "logs": [1.6, -0.08 * (highest - 20.0)]}
    material = {"include": "synthetic_tyre", "shift": {"law": "factors", **rows, "reference": 20.0}}
    job = {"material": material, "thermal": {**THERMAL, "feedback": "mean"}, "numerics": {"tolerance": 1e-2}}
    return sliding({**job, "bands": {"count": 2, "points": 40, "samples": 1}})


def test_trial_temperatures_of_bands_stay_within_the_shift() -> None:
    """A table that ends 1 K above the hottest band gives the state of a table that reaches far, whose trials were
    hotter; each fixed point is found to 3 %. Of one that ends below, a sentence names velocity and temperature."""
    far = with_table_to(400.0)
    expected = far.solve((1.0, 0.0), 1e6)
    hottest = max(row[-1] for row in far.rows((1.0, 0.0)))
    near = with_table_to(20.0 + hottest + 1.0)
    assert near.solve((1.0, 0.0), 1e6).friction == pytest.approx(expected.friction, rel=0.03)
    assert max(row[-1] for row in near.rows((1.0, 0.0))) == pytest.approx(hottest, rel=0.06)
    with pytest.raises(RunError, match=r"at 1 m/s under 1e\+06 Pa and 20 C.*above 21 C, where the shift"):
        with_table_to(21.0).solve((1.0, 0.0), 1e6)


def test_a_measured_map_is_the_coarsest_band(tmp_path: Path) -> None:
    """Its waves down to the longest of the spectrum, as measured; a wave of the map that is shorter is taken out, and
    slopes add up as squares."""
    points, side = 128, 4 * LONG
    x = np.arange(points) * side / points
    long, short = 2 * np.pi * 8 / side, 2 * np.pi * 40 / side
    heights = 1e-4 * np.cos(long * x)[None, :] * np.cos(long * x)[:, None] + 1e-6 * np.cos(short * x)[None, :]
    np.save(tmp_path / "road.npy", heights)
    road = {"shape": "topography", "path": str(tmp_path / "road.npy"), "unit": "m", "size": [side, side]}
    fine = {**ROUGH, "long_wavelength": LONG / 4, "short_wavelength": LONG / 16, "rms_slope": 0.1}
    road |= {"detrend": "mean", "periodic": "none"}
    job = jobs.load({**JOB, "surface": [road, fine], "bands": {"samples": 1}})
    found = RoadSliding(job, Slab.alone(1, 1))
    assert found.cut.count == 2
    assert found.cut.wavelengths(0) == pytest.approx((side, LONG / 4))
    assert found.cut.rms_slope(0) == pytest.approx(1e-4 * long / np.sqrt(2), rel=2e-3)  # of the resampling
    assert found.cut.rms_slope(1, 0) == pytest.approx(np.hypot(found.cut.rms_slope(0), 0.1), rel=1e-4)
    band = Band(job, found.cut, 0, 0).setup
    own = band.surface.heights((0.0, 0.0), band.slab.empty()) * band.units.height
    waves = np.abs(np.fft.rfft2(own)) / own.size
    assert waves[8, 8] == pytest.approx(2.5e-5, rel=1e-2)
    assert waves[0, 17:].max() < 1e-3 * waves[8, 8]  # it has 5e-7 in the map, which two cells cannot show
    point = found.solve((0.1, 0.0), 1e6)
    rows = found.rows((0.1, 0.0))
    assert sum(row[6] for row in rows) == pytest.approx(point.friction, rel=1e-12)
    assert rows[0][7] > rows[1][7] > 0.0


def test_a_cut_off_leaves_steep_waves_out() -> None:
    """Down to the wavelength from which the rms slope is larger, which is then that of all."""
    full, cut = sliding({"bands": {"count": 2, "samples": 1}}), sliding({"bands": {"cutoff_slope": 0.15, "count": 2}})
    assert full.cut.rms_slope(1, 0) == pytest.approx(0.2, rel=1e-3)
    assert cut.cut.rms_slope(1, 0) == pytest.approx(0.15, rel=2e-3)
    assert cut.cut.spectrum.shortest == pytest.approx(full.cut.spectrum.steep_beyond(0.15))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"history": [{"pressure": {"from": 1e4, "to": 1e5}, "duration": 1.0}]}, "must be the same pressure"),
        ({"history": [{"pressure": 1e5}, {"pressure": 2e5}]}, "must be the same pressure"),
        ({"history": [{"force": 1.0}]}, "boxes of their own: give a pressure"),
        ({"history": [{"pressure": 1e5, "velocity": [0, 1], "distance": 1e-3}]}, "must be along x"),
        ({"history": [{"pressure": 1e5, "duration": 1.0, "time_step": 0.1}]}, "follow their own cells"),
        ({"history": [{"pressure": 1e5}], "output": {"energy": True}}, "the work on finer bands is in no band"),
        (
            {"history": [{"pressure": 1e5}], "thermal": {"conductivity": 0.2, "diffusivity": 1e-7}},
            "thermal cannot be used with bands and a history",
        ),
        (
            {"history": [{"pressure": 1e5}], "interface": {"shear_stress": 1e5, "stick": True}, "steady": None},
            "interface.stick cannot be used with bands and a history",
        ),
        ({"grid": {"points": 64, "size": 1e-2}}, "takes at most one of grid | bands, got grid and bands"),
        ({"adhesion": {"work": 0.05, "range": 1e-7}}, "adhesion cannot be used with bands"),
        ({"surface": {"shape": "sphere", "radius": 1e-2}}, "must be rough in a job with bands"),
        ({"output": {"fields": ["pressure"]}}, "no grid has all waves"),
        ({"bands": "all"}, "bands must be auto, or a mapping with count, points and waves, got 'all'"),
        ({"bands": {"counts": 3}}, "did you mean count?"),
    ],
)
def test_what_does_not_go_with_bands(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(JobError, match=re.escape(sentence)) as found:
        jobs.load({**JOB, "bands": "auto", **changes})
    assert "on cells of" not in str(found.value)  # a job in bands has no grid


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"adhesion": {"work": 0.05, "range": 1e-7}}, "adhesion cannot be used with bands: they are coupled"),
        ({"material": {"include": "synthetic_tyre", "hardness": 1e7}}, "material.hardness cannot be used with bands"),
    ],
)
def test_what_no_history_in_bands_has_is_one_mistake(changes: dict[str, object], sentence: str) -> None:
    history = [{"pressure": 1e5}, {"pressure": 1e5, "velocity": 1.0, "distance": 1e-3}]
    with pytest.raises(JobError, match=re.escape(sentence)) as found:
        jobs.load({**JOB, "bands": "auto", "steady": None, "history": history, **changes})
    assert len(found.value.mistakes) == 1


def test_a_curve_that_was_killed_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Points that are there are not solved again; lines of bands.csv without their point in steady.csv, and a line that
    was not finished, are replaced."""
    monkeypatch.chdir(tmp_path)
    job = {**JOB, "bands": {"count": 2, "points": 24, "samples": 1}, "numerics": {"tolerance": 5e-2}}
    Path("job.yaml").write_text(yaml.safe_dump({**job, "surface": {**ROUGH, "short_wavelength": 1e-3}}))
    assert main(["steady", "job.yaml", "--velocities", "0.1", "--quiet"]) == 0
    first = Path("out/job/bands.csv").read_text()
    row = first.splitlines()[1].split(",")
    with Path("out/job/bands.csv").open("a") as file:
        file.write(",".join(["0.2", *row[1:]]) + "\n0.2,1e6")
    assert main(["steady", "job.yaml", "--velocities", "0.1,0.2", "--quiet"]) == 0
    lines = Path("out/job/bands.csv").read_text().splitlines()
    assert lines[:3] == first.splitlines()
    assert [line.split(",")[0] for line in lines[1:]] == ["0.1", "0.1", "0.2", "0.2"]
    found, of_bands = tables.read_columns(Path("out/job/steady.csv")), tables.read_columns(Path("out/job/bands.csv"))
    for k, friction in enumerate(found["friction"]):
        assert sum(of_bands["friction"][2 * k : 2 * k + 2]) == pytest.approx(friction, rel=1e-12)
    assert len(tables.read_columns(Path("out/job/bands_theory.csv"))["friction"]) == 4
    assert main(["report", "out/job"]) == 0
    assert "bands.csv" in Path("out/job/report.html").read_text()


class Killed(BaseException):
    """The end of a process, which nothing catches."""


def test_a_point_that_was_killed_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed twice within a point with heat, whose temperatures take rounds: all numbers to rounding, and no
    contact is solved twice but those of the band that was being solved."""
    monkeypatch.chdir(tmp_path)
    job = {**JOB, "material": SHIFTED, "thermal": {**THERMAL, "feedback": "mean"}, "numerics": {"tolerance": 0.2}}
    job |= {"surface": {**ROUGH, "short_wavelength": 1e-3}, "bands": {"count": 2, "points": 20, "samples": 1}}
    Path("job.yaml").write_text(yaml.safe_dump(job))
    calls, killed_at, solve = [0], [0], Band.solve

    def counted(self: Band, *given: Any) -> Rung:
        calls[0] += 1
        if calls[0] == killed_at[0]:
            raise Killed
        return solve(self, *given)

    monkeypatch.setattr(Band, "solve", counted)
    command = ["steady", "job.yaml", "--velocities", "0.1", "--quiet"]
    assert main([*command, "--out", "whole"]) == 0
    whole, calls[0] = calls[0], 0
    for killed_at[0] in (whole // 2, whole - 5):
        with pytest.raises(Killed):
            main(command)
        kept = len(Path("out/job/bands.part").read_text().splitlines()) - 1  # the first one names the program
        lost = killed_at[0] - kept
        with Path("out/job/bands.part").open("a") as file:
            file.write('["a line that was not fini')
    killed_at[0] = 0
    assert main(command) == 0
    assert 0 < lost <= 2 * 14  # of both runs
    assert calls[0] == whole + lost
    assert not Path("out/job/bands.part").exists()
    for name in ("bands.csv", "steady.csv"):
        one, other = (tables.read_columns(Path(place) / name) for place in ("whole", "out/job"))
        for column in set(one) - {"seconds"}:
            assert other[column] == pytest.approx(one[column], rel=1e-12, nan_ok=True)


def test_weights_of_a_ladder() -> None:
    """They keep the load, also beyond both ends, to rounding; f(p) = p times a cubic in log p is right in between, and
    f(p)/p is level beyond."""
    ladder = PressureLadder.over(1e5, 3e5)
    rungs = ladder.rungs
    chance = np.random.default_rng(1)
    inside = np.asarray(rungs[0] * (rungs[-1] / rungs[0]) ** chance.random((20, 20)), np.float64)
    weights, above = ladder.weights_of_rungs(inside)
    assert above == 0.0
    assert weights @ rungs == pytest.approx(inside.mean(), rel=1e-14)

    def cubic(p: Array) -> Array:
        x = np.log(p / 1e5)
        return np.asarray(p * (2.0 - 0.3 * x + 0.1 * x**2 + 0.05 * x**3))

    assert weights @ cubic(rungs) == pytest.approx(cubic(inside).mean(), rel=1e-12)
    beyond = np.array([[0.0, 0.1 * rungs[0], 2.0 * rungs[-1], rungs[3]]])
    weights, above = ladder.weights_of_rungs(beyond)
    assert weights @ rungs == pytest.approx(beyond.mean(), rel=1e-14)
    level = 0.1 * cubic(rungs[:1]).sum() + 2.0 * cubic(rungs[-1:]).sum() + cubic(rungs[3:4]).sum()
    assert weights @ cubic(rungs) == pytest.approx(level / 4, rel=1e-12)
    assert above == pytest.approx(2.0 * rungs[-1] / beyond.sum(), rel=1e-14)


@pytest.mark.parametrize(
    ("bands", "said"),
    [
        ({"waves": 1, "points": 64}, "bands.waves must be a whole number of at least 2"),
        ({"points": 1}, "needs 128 points or more along a side, got 1$"),
        ({"points": 10**7}, "points need at least .* GB of memory on all ranks together"),
        ({"points": [64, 1]}, "needs 128 points or more along a side, got 64$"),
    ],
)
@pytest.mark.parametrize("verb", ["check", "steady"])
def test_bands_without_room_for_their_waves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], bands: dict[str, Any], said: str, verb: str
) -> None:
    """One wave along the box, of which the cell of wavenumbers reaches 0; one point; a profile of 16 waves, 2 octaves
    and 2 cells per shortest wave: 128 points."""
    surface = {**ROUGH, "short_wavelength": LONG / 4}
    path = tmp_path / "job.yaml"
    path.write_text(yaml.safe_dump({**JOB, "surface": surface, "bands": {"count": 1, **bands}}))
    assert main([verb, str(path)]) == 2
    assert re.search(said, capsys.readouterr().err, re.MULTILINE)


TWO_BRANCHES = {
    **{"model": "zener", "modulus_inf": 5e5},
    "branches": [{"modulus": 4e6, "relaxation_time": 1e-2}, {"modulus": 2e8, "relaxation_time": 1e-6}],
}


@pytest.mark.parametrize("pressure", [1.5e5, 6e5])
def test_the_stated_error_of_the_area_covers_the_mesh(pressure: float) -> None:
    """Bands with 4 cells per shortest wave, against two surfaces on one grid with 4 and 8, extrapolated to first order.
    One grid with 4 cells has most of the error of the mesh itself, and hides it. The two surfaces differ by 2 %."""
    rough = {**ROUGH, "hurst": 0.95, "long_wavelength": 1e-3, "short_wavelength": 1.25e-4}

    def area(bands: dict[str, int], seed: int) -> tuple[float, float]:
        numerics, surface = {"tolerance": 1e-3, "accuracy": 0.1}, {**rough, "seed": seed}
        found = sliding({"surface": surface, "material": TWO_BRANCHES, "bands": bands, "numerics": numerics})
        point = found.solve((0.48, 0.0), pressure)
        return point.measures.contact_area_corrected, point.errors.area.total

    def extrapolated(seed: int) -> float:
        coarse, fine = (area({"count": 1, "samples": 1, "points": points}, seed)[0] for points in (128, 256))
        return 2.0 * fine - coarse

    (found, stated), exact = area({"count": 2, "samples": 4}, 20), np.mean([extrapolated(seed) for seed in (20, 1)])
    assert 0.05 < found / exact - 1.0 < stated * found / exact


def test_errors_of_the_area_by_the_grids_of_all_bands_add_up() -> None:
    """Each band divides the area that the coarser ones leave: not the one of the finest band alone."""
    found = sliding({"surface": {**ROUGH, "short_wavelength": 1e-4}, "bands": {"count": 2, "samples": 1}})
    point = found.solve((0.1, 0.0), 1e6)
    grids = [result.errors[5] / result.contact_area_corrected for result in found._results]
    assert min(grids) > 0.001
    assert point.errors.area.mesh == pytest.approx(sum(grids), rel=1e-12)


def test_advice_on_small_spots_names_the_mesh_of_bands() -> None:
    """A job with bands has neither grid.points nor grid.size."""
    road = sliding({})
    measures = Measures(contact_area=0.1, contact_area_corrected=0.08)
    (doubt,) = curve.watch_contacts(road.setup, road.job).check_point(measures, "here")
    assert str(doubt).endswith("use more points in each band (bands.points) or a larger load")


def test_advice_on_the_coupling_of_bands_states_what_fewer_bands_leave() -> None:
    """The least errors of two or more bands: an accuracy below them takes a single band. A job with bands has no grid
    to refine: its mesh is `bands.points`."""
    mesh = advice(ErrorParts(0.01, 0.0, 0.0, 0.1, method=LEAST_OF_AREA), 0.1)
    assert mesh.endswith("try more points in each band (bands.points)")
    text = advice(ErrorParts(0.01, 0.0, 0.0, 0.03, method=LEAST_OF_AREA), 0.1)
    assert f"at least {LEAST_METHOD:.0%} in friction and {LEAST_OF_AREA:.0%} in a small area".replace("%", " %") in text
