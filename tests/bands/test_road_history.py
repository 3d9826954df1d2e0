"""Histories of surfaces in bands: one band against a run on its grid, full contact against linear theory, steady
sliding at the end, and stops."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_jobs import column, marched
from mpi4py import MPI

from parcontact import job as jobs
from parcontact.__main__ import main
from parcontact.bands import band, cascade, road_history
from parcontact.bands.band import Band
from parcontact.bands.road_history import RoadHistory, RungTask
from parcontact.bands.road_sliding import RoadSliding
from parcontact.files import stopping, tables
from parcontact.files.recorder import StepRow
from parcontact.files.road_run import ended, sum_up_errors
from parcontact.job.history import Timeline
from parcontact.job.yaml_text import dump
from parcontact.parallel.slab import Array, Slab
from parcontact.results import info, prediction

LONG = 4e-3
ROUGH = {
    **{"shape": "rough", "hurst": 0.8, "long_wavelength": LONG, "short_wavelength": LONG / 4, "rms_slope": 0.2},
    **{"seed": 3, "amplitudes": "fixed"},
}
ZENER = {"model": "zener", "modulus_inf": 1e6, "branches": [{"modulus": 3e6, "relaxation_time": 1e-3}]}
SLIDE = {"pressure": 1e5, "velocity": 1.0, "distance": 1.5 * LONG}
JOB: dict[str, Any] = {
    **{"surface": ROUGH, "material": ZENER, "numerics": {"tolerance": 2e-3}},
    **{"bands": {"count": 2, "points": 20, "samples": 1}},
    "history": [{"pressure": 1e5, "duration": 0.01}, SLIDE],
}


@pytest.fixture
def few_rungs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coarse ladders, for what does not depend on them."""
    monkeypatch.setattr(band, "RUNGS", 5)


def history(comm: MPI.Intracomm = MPI.COMM_SELF, **changes: Any) -> RoadHistory:
    return RoadHistory(jobs.load({**JOB, **changes}), Slab(comm, 1, 1))


def rows_of(road: RoadHistory) -> list[StepRow]:
    road.march(lambda *of_round: None)
    return [row for row, _ in road.records()]


def test_one_band_is_a_run_on_its_grid() -> None:
    """With the same heights and steps: to the tolerance of solves, 1e-5, over the share in contact. A band
    leaves out the force across the sliding, which is 0 on average."""
    changes: dict[str, Any] = {"bands": {"count": 1, "points": 32, "samples": 1}, "numerics": {"tolerance": 1e-5}}
    road = history(**changes)
    rows = rows_of(road)
    heights, grid = on_a_grid(road, 0)
    stages = [
        {"pressure": 1e5, "velocity": part.speed, "duration": part.seconds, "time_step": part.time_step}
        for part, _ in Band(road.job, road.cut, 0, 0).parts
    ]
    _, direct = marched({**JOB, **changes, "surface": heights, "grid": grid, "bands": None, "history": stages})
    slid, found = column(direct, "distance"), column(rows, "distance")
    for name in ("friction_x", "contact_area", "contact_area_corrected", "max_pressure"):
        expected = np.interp(found, slid, column(direct, name))
        assert column(rows, name)[found > 0.0] == pytest.approx(expected[found > 0.0], rel=1e-3)


@pytest.mark.parametrize("count", [1, 2])
def test_full_contact_is_linear_theory_over_time(count: int) -> None:
    """Friction of the waves of each band, which add up: to 3 %, by steps of half a cell."""
    rest, slide = ({**stage, "pressure": 3e6} for stage in JOB["history"])
    of_bands = {"count": count, "points": 40 if count == 1 else 24, "samples": 1}
    road = history(surface={**ROUGH, "rms_slope": 0.01}, history=[rest, slide], bands=of_bands)
    rows = rows_of(road)
    found = column(rows, "distance")
    there, expected = found > LONG / 50, np.zeros(len(rows))
    for number in range(count):
        heights, grid = on_a_grid(road, number)
        steps = [{**rest, "time_step": 1e-3}, {**slide, "cells_per_step": 0.1}]
        whole = jobs.load({**JOB, "surface": heights, "history": steps, "bands": None, "grid": grid})
        theory = list(prediction.predict(whole, Slab.alone(*whole.grid.points), 1.0, "lattice"))
        expected += np.interp(found, [row.distance for row in theory], [row.friction for row in theory])
    assert column(rows, "friction")[there] == pytest.approx(expected[there], rel=0.03)
    assert column(rows, "contact_area")[there] == pytest.approx(1.0, abs=1e-4)


def on_a_grid(road: RoadHistory, number: int) -> tuple[Array, dict[str, Any]]:
    """The heights [m] of a band, and its grid."""
    setup = Band(road.job, road.cut, number, 0).setup
    heights = np.asarray(setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height)
    return heights, {"points": setup.grid.nx, "size": setup.grid.lx}


def test_a_slide_comes_to_the_steady_bands() -> None:
    """Friction and area within the sum of both stated errors, and of 5 %; the solves take few operator calls."""
    road = history(bands={"count": 2, "points": 24, "samples": 2})
    last = rows_of(road)[-1]
    job = jobs.load({**JOB, "bands": {"count": 2, "points": 24, "samples": 2}, "history": [], "steady": STEADY})
    point = RoadSliding(job, Slab.alone(1, 1)).solve((1.0, 0.0), 1e5)
    pairs = (
        (last.measures.friction, point.friction, last.error_friction + point.error_friction),
        (
            last.measures.contact_area_corrected,
            point.measures.contact_area_corrected,
            last.error_area + point.error_area,
        ),
    )
    for found, expected, stated in pairs:
        assert found == pytest.approx(expected, rel=min(stated, 0.05))
    assert np.mean(road.track(0, 0)[0].operator_calls) <= 15.0


@pytest.mark.usefixtures("few_rungs")
def test_rungs_that_remember_another_pressure_state_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """It fades with the imprint of a rest: rubber stiffens, and the mean pressure on the fine band rises. Steady
    sliding has none. A slide that ends before the fine band settles states at least what a longer one does."""

    own = road_history.MEMORY

    def memory(**changes: Any) -> tuple[Array, Array]:
        road = history(**changes)
        slips = [row.distance for row in rows_of(road)]
        each = []
        for share in (own, 0.0):
            monkeypatch.setattr(road_history, "MEMORY", share)
            parts = [row.errors.friction if row.errors else None for row, _ in road.records()]
            each.append([part.method if part and slip else 0.0 for part, slip in zip(parts, slips, strict=True)])
        return np.array(slips), np.subtract(each[0], each[1])

    rest, slide = JOB["history"]
    start = {"state": "steady", "velocity": 1.0, "pressure": 1e5}
    slips, from_rest = memory()
    assert from_rest.max() > 0.03
    assert from_rest[-1] == pytest.approx(0.0, abs=1e-12)
    assert memory(initial=start, history=[slide])[1].max() < 0.1 * from_rest.max()
    short_slips, short = memory(history=[rest, {**slide, "distance": LONG / 8}])
    assert (short - np.interp(short_slips, slips, from_rest)).min() > -1e-3


@pytest.mark.parametrize("slip", [0.7 * LONG, 1.5 * LONG])
def test_slides_settle_with_steps_of_half_a_cell(slip: float) -> None:
    """Then the surface has moved by a whole cell since the step before the last, and its pressures are the start: of
    bands from 1 cm to 10 um, steps of 0.495 cells take 3 times as many calls on the lowest rungs."""
    for number in (0, 1):
        job = Band((road := history(history=[{**SLIDE, "distance": slip}])).job, road.cut, number, 0).setup.job
        cells = [step.position[0] / job.grid.dx for step in Timeline(job.history, job.grid)]
        moved = np.diff(cells)
        settling = moved > 0.5 - 1e-9
        assert moved.max() < 0.5 + 1e-9
        assert np.count_nonzero(settling) == np.argmin(settling[::-1]) > 1


STEADY = {"velocities": [1.0], "pressures": [1e5]}


@pytest.mark.usefixtures("few_rungs")
def test_rests_bracket_and_stops_age() -> None:
    """The longer a rest, the higher the peak, also of a rest between two slides."""
    peaks = []
    for seconds in (None, 3e-4, 0.03):
        rest = {"pressure": 1e5, **({"duration": seconds} if seconds else {})}
        peaks.append(column(rows_of(history(history=[rest, SLIDE])), "friction").max())
    assert peaks[0] < peaks[1] < peaks[2]
    start = {"state": "steady", "velocity": 1.0, "pressure": 1e5}
    stop = {"pressure": 1e5, "duration": 0.03}
    rows = rows_of(history(initial=start, history=[{**SLIDE, "distance": LONG / 8}, stop, SLIDE]))
    after = [row.measures.friction for row in rows if row.distance > LONG / 8]
    assert max(after) == pytest.approx(peaks[2], rel=0.1)  # at another place of the surface
    assert rows[0].measures.friction == pytest.approx(rows[-1].measures.friction, rel=0.08)


@pytest.mark.usefixtures("few_rungs")
def test_an_elastic_body_has_no_friction_through_rests_and_slides() -> None:
    """Its area is that of the first instant throughout a rest, as it has no memory."""
    stop = {"pressure": 1e5, "duration": 0.03}
    elastic = {"model": "elastic", "shear_modulus": 1e6}
    rows = rows_of(history(material=elastic, history=[stop, {**SLIDE, "distance": LONG / 8}, stop]))[1:]
    areas = column(rows, "contact_area")
    assert areas[:51] == pytest.approx(areas[0], rel=1e-3)
    assert areas[-50:] == pytest.approx(areas[-1], rel=1e-3)
    assert column(rows, "friction").max() < 0.01
    for some in (rows[:51], rows):
        assert [text.split(":")[0] for text in sum_up_errors(some, (0.1, 0.1))] == ["error of contact area"]
    for accuracy, advised in ((1e-6, True), (10.0, False)):
        assert ["; try " in text for text in sum_up_errors(rows, (accuracy, accuracy))] == [advised]


class StoppedError(Exception):
    pass


@pytest.mark.usefixtures("few_rungs")
def test_a_stop_after_any_march(tmp_path: Path) -> None:
    """A run goes on with the next march to the same rows."""
    rows = rows_of(history())
    count = sum(map(len, history().tasks()))
    made = []
    for number in range(count + 1):
        road = history()
        road.keep_in(place(tmp_path))

        def after(task: RungTask, done: int, known: int, number: int = number) -> None:
            made.extend([task] * (done - known))
            if len(made) > number:
                raise StoppedError

        try:
            road.march(after)
        except StoppedError:
            continue
    assert len(made) == len(set(made)) == count
    for row, other in zip(rows, (row for row, _ in road.records()), strict=True):
        assert other.measures == row.measures or row.step == 0


def place(path: Path) -> Path:
    (path / "checkpoint").mkdir(exist_ok=True)
    return path


@pytest.mark.usefixtures("few_rungs")
@pytest.mark.mpi(2, 3)
def test_ranks_agree() -> None:
    """Each march is made on one rank, so that all digits agree."""
    alone, together = rows_of(history()), rows_of(history(MPI.COMM_WORLD))
    assert [row.measures for row in together[1:]] == [row.measures for row in alone[1:]]


@pytest.mark.usefixtures("few_rungs")
def test_files_and_a_shorter_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frictions of bands, with that of an interface, add up to that of measures.csv; a second run does nothing;
    `--until` ends the history; another velocity does not replace the results; `info` counts the marches of a run that
    was stopped."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(stopping, "age", lambda: 0.0)  # of this process, from which --wall counts
    rubbed = {**JOB, "interface": {"shear_stress": 1e5}, "history": [{"pressure": 1e5}, SLIDE]}
    Path("job.yaml").write_text(dump(rubbed))
    assert main(["job.yaml", "--quiet", "--wall", "01:00:00"]) == 0  # loops may be compiled meanwhile
    table, bands = (tables.read_columns(Path("out/job") / name) for name in ("measures.csv", "bands.csv"))
    friction = np.reshape(bands["friction"], (-1, 2)).sum(axis=1)
    assert np.abs(friction) == pytest.approx(np.array(table["friction"])[1:], abs=1e-12)
    assert np.reshape(bands["time"], (-1, 2))[:, 0] == pytest.approx(np.array(table["time"])[1:])
    parts = np.add(table["friction_viscous"], table["friction_interface"])
    assert parts == pytest.approx(np.array(table["friction"]), abs=1e-12)
    log = Path("out/job/run.log").read_text()
    ends = ("mu_max, the highest", "mu_dyn, the mean", "error of friction", "error of contact area", "done: results")
    assert [log.count(text) for text in ends] == [1] * 5
    assert sorted(ends, key=log.index) == list(ends)
    before = Path("out/job/measures.csv").stat().st_mtime_ns
    assert main(["job.yaml", "--quiet"]) == 0
    assert main(["job.yaml", "--quiet", "--set", "history.1.velocity=2.0"]) == 2
    assert Path("out/job/measures.csv").stat().st_mtime_ns == before
    assert main(["job.yaml", "--quiet", "--until", "1e-3"]) == 2  # nothing saved is lost
    assert Path("out/job/measures.csv").stat().st_mtime_ns == before
    assert main(["job.yaml", "--quiet", "--until", "1e-3", "--restart", "never"]) == 0
    assert tables.read_columns(Path("out/job/measures.csv"))["time"][-1] == pytest.approx(1e-3)
    job = ended(jobs.load("job.yaml"), 1e-3)
    assert [stage.seconds for stage in job.history] == [0.0, 1e-3]
    assert main(["job.yaml", "--quiet", "--restart", "never", "--wall", "00:00:01"]) == 3
    assert "not finished; finished marches: 1" in info.describe_path(Path("out/job"))[0]
    monkeypatch.setattr(cascade, "FIRST_LINE", "parcontact 0.0.0\n")
    assert main(["job.yaml", "--quiet", "--wall", "00:00:01"]) == 3
    assert "marches.json is not of parcontact" in Path("out/job/run.log").read_text()
    assert "finished marches: 1" in info.describe_path(Path("out/job"))[0]
