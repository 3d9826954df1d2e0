"""Leakage of runs: the table, the picture, the columns of a run, mistakes, and when random contacts close."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from csv_rows import rows as table
from mpi4py import MPI

import parcontact as pc
from parcontact import __main__
from parcontact.effects.leakage import over_time
from parcontact.effects.leakage.flow import flow_mesh_error, solve_flow
from parcontact.results import report_sections

POINTS = 64
PRESS = {"pressure": {"from": 1e4, "to": 8e4}, "duration": 1.0, "time_step": 0.25}


def job(directory: Path, **changes: Any) -> dict[str, Any]:
    return {
        "grid": {"points": POINTS, "size": 1e-3},
        "surface": {
            "shape": "rough",
            "hurst": 0.8,
            "long_wavelength": 2.5e-4,
            "short_wavelength": 1.25e-4,
            "rms_slope": 0.1,
        },
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [PRESS],
        "leakage": {"every": 2},
        "output": {"directory": str(directory), "fields": ["pressure", "gap"]},
    } | changes


def run(comm: MPI.Intracomm, where: Path, **changes: Any) -> Path:
    """The output directory of a run on all ranks."""
    path, out = where / "job.yaml", where / "out"
    if comm.rank == 0:
        given = {key: value for key, value in job(out, **changes).items() if value is not None}
        path.write_text(yaml.safe_dump(given))
    comm.Barrier()
    assert __main__.main([str(path), "--quiet"]) == 0
    comm.Barrier()
    return out


@pytest.mark.mpi
@pytest.mark.rendered
def test_table_picture_and_columns_of_a_run(comm: MPI.Intracomm, shared_path: Path) -> None:
    """The saved gaps and the run itself give the same flow, in single and in double precision of the maps; K falls with
    the load, and is that of `pc.leak`."""
    out = run(comm, shared_path)
    assert __main__.main(["leak", str(out)]) == 0
    comm.Barrier()
    rows, steps = table(out / "leak.csv"), table(out / "measures.csv")
    assert {row["time"] for row in rows} == {row["time"] for row in steps}
    flows = [float(row["flow_x"]) for row in rows if float(row["pressure"]) > 0.0]
    assert flows == sorted(flows, reverse=True)
    assert all(row["flow_x"] == "" for row in steps[1::2])
    index, gaps = len(rows) - 2, over_time.Gaps(out)
    gap = gaps.read(gaps.shown[index])
    along = {"x": pc.leak(gap, gaps.size).along_x, "y": pc.leak(gap, gaps.size).along_y}
    for axis, flow in along.items():
        assert float(rows[index][f"constriction_{axis}"]) == pytest.approx(flow.constriction, rel=1e-12)
        error = flow_mesh_error(gap, flow, gaps.size, axis)
        assert float(rows[index][f"error_{axis}"]) == pytest.approx(error, rel=1e-9)
    of_run = {row["time"]: row for row in steps if row["flow_x"]}
    assert of_run
    for time, row in of_run.items():
        of_gap = next(one for one in rows if float(one["time"]) == float(time) and one["pressure"] == row["pressure"])
        for name in ("flow_x", "flow_y", "constriction"):
            assert float(row[name]) == pytest.approx(float(of_gap[name]), rel=1e-5)
    assert (out / "leak.png").stat().st_size > 10_000
    bare = over_time.Gaps(out).bare()
    touching = pc.leak(bare, (1e-3, 1e-3))
    assert float(rows[-1]["share_x"]) == pytest.approx(float(rows[-1]["flow_x"]) / touching.flow_x)


def test_a_report_has_the_leakage_at_the_end(tmp_path: Path) -> None:
    """The table has the last flow, which is calculated at every second step, and no friction, as nothing slides."""
    out = run(MPI.COMM_SELF, tmp_path, history=[PRESS, {**PRESS, "pressure": {"from": 8e4, "to": 2e4}}])
    last = [row for row in table(out / "measures.csv") if row["flow_x"]][-1]
    section = report_sections.describe_run(out)
    assert "conductivity K over time" in [caption for _, caption in section.pictures]
    shown = {row[0]: row[1] for row in section.tables[0].rows}
    assert "friction" not in shown
    for name in ("flow_x", "flow_y", "constriction"):
        assert shown[name.replace("_", " ")] == report_sections.format_cell(float(last[name]))


def test_a_contact_on_twice_the_points_is_within_the_error(comm: MPI.Intracomm) -> None:
    """Its K differs by a third of what half of the points tell, in the median of three loads and both directions; here
    by less than all of it each time, and by more than a twentieth in the mean."""
    flows: dict[tuple[int, str], list[tuple[float, float]]] = {}
    for points in (POINTS, 2 * POINTS):
        loads = [{"pressure": load} for load in (2e4, 3e4, 4e4)]
        scene = pc.Simulation({**job(Path("out"), grid={"points": points, "size": 1e-3}), "history": loads}, comm=comm)
        for row in scene.steps():
            gap, size = np.where(scene.field("pressure") > 0.0, 0.0, scene.field("gap").clip(0.0)), (1e-3, 1e-3)
            for axis in "xy" if row.step else "":
                flow = solve_flow(gap, size, axis)
                error = flow_mesh_error(gap, flow, size, axis)
                flows.setdefault((row.step, axis), []).append((flow.conductivity, error))
    assert len(flows) == 6
    shares = [abs(coarse / fine - 1.0) / error for (coarse, error), (fine, _) in flows.values()]
    assert max(shares) < 1.0
    assert np.mean(shares) > 0.05


def test_stages_without_a_gap_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every second of three gaps leaves out the end of the first stage, and of the third none: the end is saved."""
    history = [{"name": name, "pressure": load} for name, load in (("first", 1e4), ("second", 2e4), ("third", 3e4))]
    output = {"directory": str(tmp_path / "out"), "fields": ["pressure", "gap"], "every": 2}
    out = run(MPI.COMM_SELF, tmp_path, leakage=None, history=history, output=output)
    capsys.readouterr()
    assert __main__.main(["leak", str(out)]) == 0
    assert "no gap is saved at the end of first: output: {every: 1}" in capsys.readouterr().out


def test_gap_and_pressure_must_have_been_saved(
    comm: MPI.Intracomm, shared_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = run(comm, shared_path, leakage=None, output={"directory": str(shared_path / "out"), "fields": ["gap"]})
    assert __main__.main(["leak", str(out)]) == 2
    assert "output: {fields: [pressure, gap]}" in capsys.readouterr().err
    assert not (out / "leak.csv").exists()


def test_what_is_no_run_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert __main__.main(["leak", str(tmp_path)]) == 2
    assert "is no output directory of a run; those of a sweep are in its cases/" in capsys.readouterr().err


def saved_heights(where: Path) -> Path:
    x = (np.arange(POINTS) + 0.5) / POINTS
    np.save(where / "heights.npy", 1e-6 * np.cos(8 * np.pi * x) * np.cos(4 * np.pi * x)[:, None])
    return where / "heights.npy"


def test_shares_of_measured_heights(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """K over that of the heights that just touch; without the file the shares are empty, and it is said why."""
    path = saved_heights(tmp_path)
    out = run(MPI.COMM_SELF, tmp_path, leakage=None, surface={"shape": "file", "path": str(path)})
    assert __main__.main(["leak", str(out)]) == 0
    heights = np.load(path)
    touching = pc.leak(heights.max() - heights, (1e-3, 1e-3))
    for row in table(out / "leak.csv"):
        for axis, bare in (("x", touching.flow_x), ("y", touching.flow_y)):
            assert float(row[f"share_{axis}"]) == pytest.approx(float(row[f"flow_{axis}"]) / bare, rel=1e-6)
    path.unlink()
    capsys.readouterr()
    assert __main__.main(["leak", str(out)]) == 0
    assert "share_x and share_y are left empty" in capsys.readouterr().out
    assert {row["share_x"] for row in table(out / "leak.csv")} == {""}


@pytest.mark.mpi
def test_a_gap_that_is_no_number_is_refused_by_all_ranks(
    comm: MPI.Intracomm, shared_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = run(comm, shared_path, leakage=None)
    if comm.rank == 0:
        with h5py.File(out / "fields.h5", "r+") as file:
            file["gap"][1, 3, 4] = np.nan
    comm.Barrier()
    assert __main__.main(["leak", str(out)]) == 2
    stated = capsys.readouterr().err
    assert comm.rank > 0 or "maps after step 2 are incomplete or not finite" in stated
    assert not (out / "leak.csv").exists()


def test_random_contacts_close_between_40_and_45_percent() -> None:
    """The contact area in the mean of 20 surfaces and both directions, and twice its standard error. Elastic contacts
    close between the last open load and the first closed one, which are 4 % apart."""
    closed_at = []
    for seed in range(1, 21):
        waves = {"long_wavelength": 1.25e-4, "short_wavelength": 6.25e-5}
        surface = {"shape": "rough", "hurst": 0.8, **waves, "rms_slope": 0.1, "seed": seed}
        press = {"pressure": {"from": 5e4, "to": 1.1e5}, "duration": 1.0, "time_step": 1 / 16}
        scene = {**job(Path("out"), grid={"points": 128, "size": 1e-3}, surface=surface, history=[press])}
        del scene["output"]
        rows = list(pc.Simulation({**scene, "leakage": {}}, comm=MPI.COMM_SELF).steps())
        for name in ("flow_x", "flow_y"):
            before, first = next(pair for pair in pairwise(rows[1:]) if pair[1][name] == 0.0)
            closed_at.append(0.5 * (before.contact_area + first.contact_area))
    error = np.std(closed_at, ddof=1) / np.sqrt(len(closed_at))
    assert len(closed_at) == 40
    assert np.mean(closed_at) - 2.0 * error > 0.40
    assert np.mean(closed_at) + 2.0 * error < 0.45


def test_a_fluid(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The column flow_rate is that of K for a liquid; of a gas it is larger, as it slips; what lacks is said."""
    out = run(MPI.COMM_SELF, tmp_path)
    assert __main__.main(["leak", str(out), "--fluid", "1e-3", "--pressures", "2e5:1e5"]) == 0
    rows = table(out / "leak.csv")
    for row in rows:
        more = max(("x", "y"), key=lambda axis: float(row[f"constriction_{axis}"]))  # called at once
        expected = float(row[f"flow_{more}"]) / 12e-3 * 1e5  # the box is a square
        assert float(row["flow_rate"]) == pytest.approx(expected, rel=1e-12)
    assert __main__.main(["leak", str(out), "--fluid", "helium", "--pressures", "2e5:1e5"]) == 0
    assert "helium from 200 kPa to 100 kPa" in capsys.readouterr().out
    gas = [float(row["flow_rate"]) * 1.96e-5 / 1.5 for row in table(out / "leak.csv")]
    liquid = [float(row["flow_rate"]) * 1e-3 for row in rows]
    assert all(one > other for one, other in zip(gas, liquid, strict=True) if other)
    assert __main__.main(["leak", str(out), "--fluid", "water"]) == 2
    assert "--fluid and --pressures HIGH:LOW [Pa] go together" in capsys.readouterr().err
    assert __main__.main(["leak", str(out), "--fluid", "air", "--pressures", "1e5:0"]) == 0
    assert all(row["flow_rate"] == "" and float(row["mass_flow"]) >= 0.0 for row in table(out / "leak.csv"))
    assert "mg/s" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        __main__.main(["leak", str(out), "--fluid", "beer", "--pressures", "2e5:1e5"])
    assert "a fluid (water, air, nitrogen, helium) or a positive viscosity [Pa s]" in capsys.readouterr().err


def test_a_fast_gas_is_limited_by_inertia(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At 20 bar viscous flow exceeds its bound: a warning states both flows and their combination. Of a liquid
    there is none."""
    out = run(
        MPI.COMM_SELF, tmp_path, surface={**job(tmp_path)["surface"], "rms_slope": 1.0}, history=[{"pressure": 1e4}]
    )
    for fluid in ("air", "water"):
        assert __main__.main(["leak", str(out), "--fluid", fluid, "--pressures", "2e6:1e5"]) == 0
        text = capsys.readouterr().out
        assert ("inertia limits the flow" in text) is (fluid == "air")
        pattern = r"at most (\S+) mg/s.* would be (\S+) mg/s; expect some (\S+) mg/s"
        for bound, viscous, both in (map(float, flows) for flows in re.findall(pattern, text)):
            assert viscous > 0.2 * bound
            assert both == pytest.approx(viscous * bound / (viscous + bound), rel=0.01)  # three digits
