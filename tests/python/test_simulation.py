"""The public Python interface: as good as the command line, on one rank and on several, and without files."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import short_job
import yaml
from csv_rows import rows as rows_of
from mpi4py import MPI
from short_job import STEPS

import parcontact as pc
from parcontact.__main__ import main
from parcontact.printed import per_cent

ROOT = Path(__file__).parents[2]
JOB: dict[str, Any] = {**short_job.JOB, "numerics": {"tolerance": 1e-8}}
WORLD = MPI.COMM_WORLD


@pytest.fixture(autouse=True)
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def numbers(row: Any) -> dict[str, float]:
    """But for the wall time."""
    return {name: value for name, value in row.items() if name != "seconds" and value == value}


def test_steps_are_rows_of_measures_csv(nowhere: Path) -> None:
    """To the last digit those of the command line; nothing is written."""
    rows = list(pc.Simulation(JOB, comm=MPI.COMM_SELF).steps())
    assert list(nowhere.iterdir()) == []
    (nowhere / "job.yaml").write_text(yaml.safe_dump(JOB))
    assert main(["job.yaml", "--quiet"]) == 0
    written = rows_of(nowhere / "out" / "job" / "measures.csv")
    assert [row.step for row in rows] == list(range(STEPS + 1))
    for row, line in zip(rows, written, strict=True):
        assert list(row) == list(line)
        assert numbers(row) == {name: float(text) for name, text in line.items() if text and name != "seconds"}
    assert rows[-1].friction == rows[-1]["friction"] == float(written[-1]["friction"]) > 0.0


def test_errors_are_those_that_a_run_says(nowhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No error is known before the first step; in the end the parts add up to the total of the command line."""
    run = pc.Simulation(JOB, comm=MPI.COMM_SELF)
    assert run.errors == {}
    run.run()
    (nowhere / "job.yaml").write_text(yaml.safe_dump(JOB))
    assert main(["job.yaml"]) == 0
    out = capsys.readouterr().out
    for name, said in (("friction", "friction"), ("contact_area_corrected", "the corrected contact area")):
        parts = run.errors[name]
        assert sum(parts[part] for part in ("solver", "time", "folded", "mesh")) == pytest.approx(parts["total"])
        assert f"estimated error of {said}: {per_cent(parts['total'], 3)} (" in out


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"grid": {"points": 0, "size": 1.0}}, "grid.points must be a positive whole number of points, got 0"),
        ({"gird": 1}, "gird is not a known key; did you mean grid?"),
        ({"title": "x", 5: 1}, "the job has a key that is not a text, 5"),
        ({"title": object()}, "title must be numbers, texts, lists or mappings, got <object object"),
        ({"history": [{"pressure": "much"}]}, "history.0.pressure must be"),
        ({"title": 3}, "title must be text"),
    ],
)
def test_mistakes_name_the_key(change: dict[Any, Any], said: str) -> None:
    with pytest.raises(pc.JobError) as caught:
        pc.Simulation({**JOB, **change}, comm=MPI.COMM_SELF)
    assert str(caught.value).startswith(said)
    assert isinstance(caught.value, pc.InputError)
    assert len(caught.value.mistakes) == 1


def test_wrong_values_of_set() -> None:
    with pytest.raises(pc.JobError, match=r"^set grid\.points: grid.points must be a positive whole number"):
        pc.Simulation(JOB, {"grid.points": -1}, MPI.COMM_SELF)


def test_a_mapping_that_holds_itself() -> None:
    data: dict[str, Any] = dict(JOB)
    data["grid"] = data
    with pytest.raises(pc.JobError, match="is nested too deeply"):
        pc.Simulation(data, comm=MPI.COMM_SELF)


def test_the_job_is_not_changed() -> None:
    before = repr(JOB)
    pc.Simulation(JOB, {"grid.points": 8}, MPI.COMM_SELF)
    assert repr(JOB) == before


@pytest.mark.mpi
def test_fields_on_any_ranks(comm: MPI.Intracomm) -> None:
    """Rows of all ranks are the map; gap = displacement - height - approach; the mean pressure is the load."""
    run = pc.Simulation(JOB, comm=comm)
    for _ in run.steps():
        pass
    maps = {name: run.gather(name) for name in ("pressure", "displacement", "gap", "height")}
    assert run.field("pressure").shape == (run.rows.stop - run.rows.start, 16)
    assert run.finished
    if comm.rank:
        assert set(maps.values()) == {None}
    else:
        p, u, g, h = (np.asarray(values) for values in maps.values())
        assert p.shape == (12, 16)
        assert p.mean() == pytest.approx(1e4, rel=1e-12)
        assert np.allclose(g, u - h - run.row.approach, rtol=0.0, atol=1e-12 * 1e-6 * 10)
    own = maps["pressure"] if comm.rank == 0 else None
    assert np.array_equal(comm.bcast(own)[run.rows], run.field("pressure"))
    with pytest.raises(pc.InputError, match="there is no field 'presure'"):
        run.field("presure")


@pytest.mark.mpi
def test_save_and_restore(comm: MPI.Intracomm, shared_path: Path) -> None:
    """At once the same state, and then the same digits as without a stop."""
    whole = [numbers(row) for row in pc.Simulation(JOB, comm=comm).steps()]
    run = pc.Simulation(JOB, comm=comm)
    for row in run.steps():
        if row.step == 5:
            break
    run.save(shared_path / "state.h5")
    again = pc.Simulation.restore(shared_path / "state.h5", comm=comm)
    for name in ("pressure", "displacement", "gap", "height"):
        assert np.array_equal(again.field(name), run.field(name))
    assert dict(again.row).items() >= numbers(run.row).items() == whole[5].items()
    assert [*map(type, again.row.values())] == [*map(type, run.row.values())]
    rest = [numbers(row) for row in again.steps()]
    assert rest == whole[6:]
    assert not again.job.origin.names_directory
    assert [numbers(row) for row in run.steps()] == whole[6:]


def test_a_saved_state_is_a_checkpoint(nowhere: Path) -> None:
    """The command line goes on from it; a state of another job, or none, is refused."""
    (nowhere / "job.yaml").write_text(yaml.safe_dump(JOB))
    run = pc.Simulation("job.yaml", comm=MPI.COMM_SELF)
    steps = run.steps()
    for _ in range(4):
        next(steps)
    run.save("state.h5")
    assert main(["job.yaml", "--quiet", "--restart", "state.h5"]) == 0
    assert [int(row["step"]) for row in rows_of(nowhere / "out" / "job" / "measures.csv")][-1] == STEPS
    with pytest.raises(pc.InputError, match=r"grid.points was \[16, 12\], is \[8, 8\]"):
        pc.Simulation.restore("state.h5", {"grid.points": 8}, MPI.COMM_SELF)
    with pytest.raises(pc.InputError, match="incomplete or damaged"):
        pc.Simulation.restore("job.yaml", comm=MPI.COMM_SELF)


def test_run_with_files(nowhere: Path) -> None:
    """A job that names a directory runs as on the command line; run again it has nothing to do, and knows the end."""
    job = JOB | {"output": {"directory": "here", "fields": ["pressure"]}}
    first = pc.Simulation(job, comm=MPI.COMM_SELF)
    assert first.run().step == STEPS
    assert len(rows_of(nowhere / "here" / "measures.csv")) == STEPS + 1
    assert {"fields.h5", "job.yaml", "job.resolved.yaml", "checkpoint"} <= {
        path.name for path in (nowhere / "here").iterdir()
    }
    assert [path.name for path in nowhere.iterdir()] == ["here"]
    again = pc.Simulation(job, comm=MPI.COMM_SELF)
    assert again.run().step == STEPS
    assert np.array_equal(again.field("pressure"), first.field("pressure"))
    assert main([str(nowhere / "here" / "job.yaml"), "--quiet", "--out", "again"]) == 0
    assert len(rows_of(nowhere / "again" / "measures.csv")) == STEPS + 1
    begun = pc.Simulation(job, comm=MPI.COMM_SELF)
    next(begun.steps())
    with pytest.raises(pc.InputError, match="must come before the first of steps"):
        begun.run()


def test_a_failed_step_is_a_run_error() -> None:
    run = pc.Simulation(JOB, {"numerics": {"max_iterations": 1, "tolerance": 1e-12}}, MPI.COMM_SELF)
    steps = run.steps()
    next(steps)
    with pytest.raises(pc.RunError, match="max_iterations = 1"):
        list(steps)
    assert run.row.step == 0


def test_xarray_opens_the_maps(nowhere: Path) -> None:
    """As the README says, with what scripts/setup installs: coordinates, units and values."""
    xarray = pytest.importorskip("xarray")
    run = pc.Simulation(JOB, {"output": {"directory": "out", "fields": ["pressure"], "every": 4}}, MPI.COMM_SELF)
    run.run()
    with xarray.open_dataset("out/fields.h5") as found:
        assert found.pressure.dims == ("t", "y", "x")
        assert found.pressure.attrs["units"] == "Pa"
        assert np.array_equal(found.pressure[-1], run.field("pressure"))
        assert found.x.values.tolist() == [1e-3 / 16 * i for i in range(16)]


def test_open(nowhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measures and maps with units; no map is read before it is used, and the file is not kept open."""
    xarray = pytest.importorskip("xarray")
    output = {"directory": "here", "fields": ["pressure", "gap"], "every": 4, "energy": True}
    run = pc.Simulation(JOB, {"output": {**output, "branch_dissipation": True}}, MPI.COMM_SELF)
    run.run()
    data = pc.open("here")
    assert isinstance(data, xarray.Dataset)
    assert data.friction.sel(step=STEPS) == run.row.friction
    assert data.pressure.attrs["units"] == "Pa"
    assert data.pressure_map.attrs["units"] == "Pa"
    assert data.pressure_map.dims == ("t", "y", "x")
    assert data.t.values[-1] == data.time.values[-1] == run.row.time
    assert np.array_equal(data.gap_map[-1], run.field("gap"))
    assert np.array_equal(data.pressure_map[:, 3:5, 7][-1], run.field("pressure")[3:5, 7])
    of_maps = data.friction.sel(step=data.map_step)
    assert of_maps[-1] == run.row.friction
    assert of_maps.time.values.tolist() == data.t.values.tolist()
    assert float(data.pressure_map.isel(t=-1).mean()) == pytest.approx(1e4)
    assert [name for name, variable in data.variables.items() if not variable.attrs.get("units")] == []
    expected = {"friction": "1", "step": "1", "map_step": "1", "dissipated_0": "J", "approach": "m", "x": "m", "t": "s"}
    assert {name: data[name].attrs["units"] for name in expected} == expected
    (nowhere / "here" / "fields.h5").rename("elsewhere.h5")
    with pytest.raises(FileNotFoundError):
        pc.open("here") and data.pressure_map.isel(t=0).load()
    with pytest.raises(pc.InputError, match="not the output directory of a run"):
        pc.open(nowhere)
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match="needs xarray, which is not installed: pip install xarray"):
        pc.open("here")


def test_the_example_of_the_readme(nowhere: Path, outside_mpi: dict[str, str]) -> None:
    """As it stands, in the project's directory but for its output."""
    (section,) = re.findall(r"^## From Python\n(.*?)^## ", (ROOT / "README.md").read_text(), re.M | re.S)
    (program,) = re.findall(r"```python\n(.*?)```", section, re.S)
    (nowhere / "jobs").symlink_to(ROOT / "jobs")
    words = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(words, env=outside_mpi, capture_output=True, text=True, cwd=nowhere)
    assert done.returncode == 0, done.stderr
    (error,) = re.findall(r"^estimated error of friction: (\S+) %$", done.stdout, re.M)
    assert 0.0 < float(error) < 10.0  # what its job asks for
    assert done.stderr == ""


# -- steady states, surfaces and materials from Python ----------------------------------------------------------------

MATERIAL: dict[str, Any] = {
    "model": "zener",
    "modulus_inf": 1e6,
    "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}],
}


def test_steady() -> None:
    """One wave in full contact: friction `Im G (q A)^2/(2 (1 - nu) p)`; the power lost is force times speed."""
    wave, load = 2 * np.pi / 1e-3, 1e5
    job = {
        "grid": {"points": [32, 4], "size": [1e-3, 1.25e-4]},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
        "material": MATERIAL,
        "history": [{"pressure": load}],
        "numerics": {"tolerance": 1e-10},
    }
    speeds = np.array([0.05, 0.2])
    curve = pc.steady(job, velocities=speeds, pressures=[load], comm=MPI.COMM_SELF)
    loss = pc.material(MATERIAL).complex_modulus(wave * speeds).imag
    # pressure has the amplitude |G| q A/(1 - nu); its part out of phase pushes, by the mean of p dh/dx
    expected = loss / (1 - 0.5) * (wave * 1e-6) ** 2 / 2 / load
    assert np.allclose(curve.friction, expected, rtol=1e-9)
    assert np.allclose(curve.contact_area, 1.0)
    assert curve.power.shape == (2, 1)
    assert np.allclose(curve.power.sum(axis=1), -curve.force_x * speeds, rtol=1e-9)
    assert curve.failures == ()
    assert np.array_equal(pc.steady(job, "0.05:0.2:2", load, comm=MPI.COMM_SELF).velocity, speeds)
    with pytest.raises(pc.InputError, match="no velocities"):
        pc.steady(job, comm=MPI.COMM_SELF)


def test_steady_at_temperatures() -> None:
    """Arrhenius: a_T = exp(Q/R (1/T - 1/T0)), and friction is that at the velocity a_T v; strings are refused."""
    job = {
        "grid": {"points": [32, 4], "size": [1e-3, 1.25e-4]},
        "surface": {"shape": "wave", "amplitude": 1e-6, "waves": [1, 0]},
        "material": {**MATERIAL, "shift": {"law": "arrhenius", "energy": 1e5, "reference": 20.0}},
        "numerics": {"tolerance": 1e-10},
    }
    curve = pc.steady(job, [0.05, 0.2], 1e5, [20.0, 40.0], comm=MPI.COMM_SELF)
    factor = np.exp(1e5 / 8.31446261815324 * (1 / 313.15 - 1 / 293.15))
    assert np.allclose(curve.temperature, [20.0, 20.0, 40.0, 40.0])
    assert np.allclose(curve.shift_factor, [1.0, 1.0, factor, factor], rtol=1e-12)
    shifted = pc.steady(job, [0.05 * factor, 0.2 * factor], 1e5, comm=MPI.COMM_SELF)
    assert np.allclose(curve.friction[2:], shifted.friction, rtol=1e-9)
    assert np.all(np.isnan(shifted.temperature))
    with pytest.raises(pc.InputError, match="temperatures"):
        pc.steady(job, [0.05], 1e5, "20:40:3", comm=MPI.COMM_SELF)


def test_material() -> None:
    """One branch: `G = G_inf + G_1 i w tau/(1 + i w tau)`, and its relaxation and creep at the ends."""
    material = pc.material(
        {"model": "zener", "modulus_inf": "1e6", "branches": [{"modulus": 3e6, "relaxation_time": 0.5}]}
    )
    omega = np.array([[0.1, 2.0], [10.0, 1e3]])
    turn = 1j * omega * 0.5
    assert np.allclose(material.complex_modulus(omega), 1e6 + 3e6 * turn / (1 + turn), rtol=1e-14)
    assert material.relaxation(0.0) == pytest.approx(4e6)
    assert material.relaxation(0.5) == pytest.approx(1e6 + 3e6 / np.e)
    assert material.creep([0.0, 1e6]) == pytest.approx([1 / 4e6, 1 / 1e6])
    assert material.poisson == 0.5
    assert pc.material({"model": "elastic", "shear_modulus": 2e6}).complex_modulus(1.0) == 2e6
    with pytest.raises(pc.JobError, match=r"material\.model must be"):
        pc.material({"model": "rubber"})


# -- types that a user's checker sees ---------------------------------------------------------------------------------


def test_annotations_of_rows_are_right() -> None:
    """Numbers of steps and counts are whole numbers."""
    row = next(pc.Simulation(JOB, comm=MPI.COMM_SELF).steps())
    whole = {name for name, kind in pc.Row.__annotations__.items() if kind == "int"}
    assert whole == {name for name, value in row.items() if isinstance(value, int)}
    with pytest.raises(AttributeError, match="measures have no 'frictionn'"):
        _ = row.frictionn  # type: ignore[attr-defined]


def test_names_are_those_that_are_exported() -> None:
    assert all(getattr(pc, name).__module__.startswith("parcontact.") for name in pc.__all__)
    assert set(pc._ROOMS) | {"InputError", "JobError", "RunError", "ParcontactWarning"} == set(pc.__all__)
