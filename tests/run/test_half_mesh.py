"""The run on half the mesh: what its difference says of the mesh, and that it stops and goes on like any run."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from marching import marched
from mpi4py import MPI
from numpy.typing import NDArray
from restarting import Bench

from parcontact import job as jobs
from parcontact.errors import JobError, RunError
from parcontact.history.timeline import Timeline
from parcontact.job import Job
from parcontact.parallel.slab import Slab
from parcontact.physics.budget import CORRECTED_ORDER, ErrorBudget, Parts, compared_with_half_mesh
from parcontact.physics.mesh_error import WAVES_ORDER
from parcontact.run import half_mesh, runner
from parcontact.run.half_mesh import HalfMesh, place_of
from parcontact.run.run import STOPPED_EARLY, Options
from parcontact.scene import choices
from parcontact.storage import tables

Json = dict[str, Any]
Series = NDArray[np.float64]
ROUGH: Json = {"shape": "rough", "hurst": 0.8, "long_wavelength": 5e-4, "short_wavelength": 2.5e-4, "rms_slope": 0.02}
SOLID: Json = {"model": "zener", "modulus_inf": 0.3e6, "branches": [{"modulus": 2.5e6, "relaxation_time": 1e-3}]}
PRESS: Json = {"pressure": 1e4, "duration": 1e-3, "time_step": 2e-4}
SLIDE: Json = {"pressure": 1e4, "velocity": 0.1, "distance": 5e-4, "cells_per_step": 1}


def data(points: int = 32, check: bool = True, **changes: Any) -> Json:
    return {
        "grid": {"points": points, "size": 1e-3},
        "surface": ROUGH,
        "material": SOLID,
        "history": [PRESS, SLIDE],
        "output": {"mesh_check": check},
        **changes,
    }


def run(job: Json, out: Path, comm: MPI.Intracomm = MPI.COMM_SELF) -> int:
    return Bench(comm, out.parent).run(job, out)


def columns(out: Path, *names: str) -> list[Series]:
    table = tables.read(out / "measures.csv")
    return [np.array(table[name]) for name in names]


@pytest.mark.mpi(2)
def test_the_mesh_part_is_the_difference(comm: MPI.Intracomm, shared_path: Path) -> None:
    """Of another run with the same time steps, made here on its own, over 2^p - 1; the other parts are as they were.

    At rest friction may be noise, and the two views of it may differ by more than what 8 cells per wave make.
    """
    half = [PRESS, {**SLIDE, "cells_per_step": 0.5}]
    assert run(data(), shared_path / "checked", comm) == 0
    assert run(data(check=False), shared_path / "plain", comm) == 0
    assert run(data(points=16, check=False, history=half), shared_path / "half", comm) == 0
    if comm.rank:
        return
    assert not (shared_path / "plain" / half_mesh.DIRECTORY).exists()
    names = ("friction", "contact_area_corrected", "error_friction", "error_area")
    friction, area, *estimates = (column[1:] for column in columns(shared_path / "plain", *names))
    coarse = (column[1:] for column in columns(shared_path / "half", *names[:2]))
    errors = (column[1:] for column in columns(shared_path / "checked", *names[2:]))
    estimated = mesh_parts(data(check=False))
    for values, other, order, error, estimate, mesh in zip(
        (friction, area), coarse, (WAVES_ORDER, CORRECTED_ORDER), errors, estimates, estimated, strict=True
    ):
        apart = np.abs(values - other) / values / (2.0**order - 1.0)
        known = ~np.isnan(estimate)
        assert known.all()
        assert np.array_equal(~np.isnan(error), known)
        assert (error - estimate + mesh)[known] == pytest.approx(apart[known], rel=5e-3)  # less of what edges lose


def mesh_parts(job: Json) -> tuple[Series, Series]:
    """Return the mesh part of the errors of friction and area in each step of a job."""
    budgets = [row.errors for row in marched(Job.model_validate(job))[1] if row.errors]
    friction = [budget.friction.mesh for budget in budgets if budget.friction]
    return np.array(friction), np.array([budget.area.mesh for budget in budgets if budget.friction])


def test_it_is_honest(tmp_path: Path) -> None:
    """With 8 cells per shortest wave: half to five times the mean error in a slide, which is the difference to four
    times the mesh, with the same time steps; that is itself wrong by a thirtieth of it (the order is 2.5)."""
    slide = {**SLIDE, "distance": 1e-3}
    assert run(data(history=[slide]), tmp_path / "run") == 0
    assert run(data(history=[slide], check=False), tmp_path / "plain") == 0
    friction, error = columns(tmp_path / "run", "friction", "error_friction")
    (estimate,) = columns(tmp_path / "plain", "error_friction")
    _, rows = marched(Job.model_validate(data(128, False, history=[{**slide, "cells_per_step": 4}])))
    exact = np.array([row.measures.friction for row in rows])
    late = slice(-32, None)
    estimated, _ = mesh_parts(data(history=[slide], check=False))
    mesh = (friction[late] * (error[late] - estimate[late] + estimated[late])).mean()
    assert 0.5 < mesh / np.abs(friction - exact)[late].mean() < 5.0


def test_it_stops_and_goes_on(tmp_path: Path) -> None:
    """A stop file of the run ends that on half the mesh too; afterwards there is nothing to be seen of it."""
    assert run(data(), tmp_path / "whole") == 0
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / "stop").touch()
    assert run(data(), tmp_path / "cut") == STOPPED_EARLY
    table = tables.read(tmp_path / "cut" / half_mesh.DIRECTORY / "measures.csv")
    assert len(table["step"]) == 1
    assert "run again" in (tmp_path / "cut" / "run.log").read_text().splitlines()[-1]
    assert run(data(), tmp_path / "cut") == 0
    for names in (("friction",), ("error_friction",), ("error_area",)):
        one, other = (columns(tmp_path / name, *names)[0] for name in ("whole", "cut"))
        assert np.array_equal(one, other, equal_nan=True)


def test_a_run_of_another_job_is_made_anew(tmp_path: Path) -> None:
    """What is below the directory of a run is that run's."""
    assert run(data(), tmp_path / "run") == 0
    other = data(numerics={"integrator": "backward-euler"})
    path = tmp_path / "run.yaml"
    path.write_text(yaml.safe_dump(other))
    loaded = jobs.load(path, [f"output.directory={tmp_path / 'run'}"])
    options = Options(quiet=True, restart="never")
    assert runner.run(loaded, Slab.alone(32, 32), options) == 0
    resolved = (tmp_path / "run" / half_mesh.DIRECTORY / "job.resolved.yaml").read_text()
    assert "backward-euler" in resolved


def test_a_run_on_half_the_mesh_that_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run goes on with estimates, and says so."""

    def fail(job: Job, slab: Slab) -> HalfMesh:
        raise RunError("no table")

    monkeypatch.setattr(HalfMesh, "read", fail)
    assert run(data(), tmp_path / "run") == 0
    assert "failed, and its errors are estimated: no table" in capsys.readouterr().err
    assert run(data(check=False), tmp_path / "plain") == 0
    one, other = (columns(tmp_path / name, "error_friction")[0] for name in ("run", "plain"))
    assert np.array_equal(one, other, equal_nan=True)


def test_loads_without_duration_are_compared_one_by_one(tmp_path: Path) -> None:
    """All are at one time: the third with the third."""
    loads = [{"pressure": pressure} for pressure in (1e3, 1e4, 5e4)]
    elastic = {"model": "elastic", "shear_modulus": 1e6}
    assert run(data(material=elastic, history=loads), tmp_path / "run") == 0
    (area,) = columns(tmp_path / "run", "contact_area_corrected")
    (half,) = columns(tmp_path / "run" / half_mesh.DIRECTORY, "contact_area_corrected")
    timeline = Timeline.of(Job.model_validate(data(history=loads)))
    assert [place_of(timeline, step) for step in range(4)] == [0, 1, 2, 3]
    (error,) = columns(tmp_path / "run", "error_area")
    apart = np.abs(area - half)[1:] / area[1:]
    assert np.all(error[1:] >= apart)  # that, and what the solver adds
    assert error[1:] == pytest.approx(apart, abs=5e-3)  # numerics.tolerance


def test_between_the_instants_of_the_other_run() -> None:
    friction = [0.0, 0.1, 0.3]
    half = HalfMesh([0.0, 0.0, 2.0], friction, [0.0, 0.2, 0.6], True)
    assert [half._at(friction, 0.0, place) for place in (0, 1, 5)] == [0.0, 0.1, 0.1]
    assert half._at(friction, 1.0, 0) == pytest.approx(0.2)
    assert half._at(half.area, 1.0, 0) == pytest.approx(0.4)
    assert half._at(friction, 2.0 * (1 + 1e-12), 0) == 0.3


def test_other_time_steps_are_not_taken_for_the_mesh() -> None:
    """Friction 4 % too small by the steps there, and 1 % here, both by the budget, beside 0.1 % by the solver and 1 %
    by the mesh there for 2^-2.5 % here: of what is left, the difference is the mesh's. Without a budget there, all."""
    here = Parts(1e-3, 0.01, 0.0, 0.01 * 2.0**-WAVES_ORDER)
    budget = ErrorBudget(here, Parts(0.0, 0.0, 0.0, 0.0))
    there = Parts(1e-3, 0.04, 0.0, 0.01)
    exact, mesh = 0.1, 0.03
    frictions = exact / 1.01, exact * (1.0 - mesh) / 1.04
    for error, expected in ((there.total, mesh), (np.nan, 1.0 - frictions[1] / frictions[0])):
        found = compared_with_half_mesh(budget, (frictions[0], 0.5), (frictions[1], 0.5), True, error).friction
        assert found is not None
        assert found.mesh == pytest.approx(expected / (2.0**WAVES_ORDER - 1.0))
        assert (found.solver, found.time) == (here.solver, here.time)


def test_what_edges_lose_is_of_the_first_order() -> None:
    """The mesh's part is all of it, or half: the difference is all of the error, or 1 + (2^2.5 - 1) of its halves."""
    for edges, times in ((0.02, 2.0), (0.04, 2.0), (0.01, 0.5 * (2.0 + 2.0**WAVES_ORDER))):
        budget = ErrorBudget(Parts(0.0, 0.0, 0.0, 0.02, edges=edges), Parts(0.0, 0.0, 0.0, 0.0))
        found = compared_with_half_mesh(budget, (0.1, 0.5), (0.09, 0.5), True).friction
        assert found is not None
        assert found.mesh == pytest.approx(0.1 / (times - 1.0))
        assert found.edges == pytest.approx(edges / 0.02 * found.mesh)


def test_chosen_steps_are_twice_as_long(tmp_path: Path) -> None:
    """On half the mesh: about half as many, with the tolerance and the folded branches of the run, and about an eighth
    of its work, operator calls times points. The mesh part is still half to five times the mean error, here the
    difference to four times the mesh, both in steps that are far shorter."""
    slide = {"pressure": 1e4, "velocity": 0.3, "distance": 1e-3}
    job = data(64, history=[slide])
    half = half_mesh.job_on_half_mesh(Job.model_validate(job))
    assert half.numerics.accuracy == pytest.approx(3.2e-2)
    assert (half.numerics.tolerance, half.numerics.branch_error) == (5e-3, 1e-3)
    assert run(job, tmp_path / "run") == 0
    (mine, theirs) = (columns(tmp_path / name, "operator_calls")[0] for name in ("run", "run/half_mesh"))
    assert len(theirs) < 0.65 * len(mine)
    assert theirs.sum() < 0.65 * mine.sum()
    time, friction, error = columns(tmp_path / "run", "time", "friction", "error_friction")
    _, rows = marched(Job.model_validate({**job, "output": {}}))
    parts = [row.errors.friction if row.errors else None for row in rows]
    others = np.array([each.total - each.mesh if each else np.nan for each in parts])
    late = time > 0.5 * time[-1]
    mesh = (friction * (error - others))[late].mean()
    fine, finer = (friction_at(time[late], points, slide) for points in (64, 256))
    assert 0.5 < mesh / np.abs(fine - finer).mean() < 5.0


def friction_at(times: Series, points: int, slide: Json) -> Series:
    """Of a slide in steps of a 256th of the box."""
    _, rows = marched(Job.model_validate(data(points, False, history=[{**slide, "cells_per_step": points / 256}])))
    return np.interp(times, [row.time for row in rows], [row.measures.friction for row in rows])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"grid": {"points": 33, "size": 1e-3}}, "needs even numbers of grid.points, got [33, 33]"),
        ({"surface": {**ROUGH, "short_wavelength": 1e-4}}, "must be at least two cells"),
        ({"surface": {"shape": "wave", "amplitude": 1e-6, "waves": [12, 0]}}, "must be within -8 and 8 waves"),
    ],
)
def test_scenes_that_have_no_half(changes: Json, said: str) -> None:
    with pytest.raises((JobError, ValueError), match="mesh_check") as caught:
        Job.model_validate({**data(), **changes})
    assert said in str(caught.value)


def test_half_of_a_line() -> None:
    line = Job.model_validate(data(grid={"points": [32, 1], "size": [1e-3, 1e-3]}))
    half = half_mesh.job_on_half_mesh(line)
    assert half.grid.points == (16, 1)
    assert not half.output.mesh_check
    assert half.output.directory == line.output.directory / "half_mesh"
    assert (half.surface, half.material) == (line.surface, line.material)
    assert [stage.cells_per_step for stage in half.history] == [None, 0.5]
    assert [step.dt for step in Timeline.of(half)] == [step.dt for step in Timeline.of(line)]


@pytest.mark.parametrize("reach", ["auto", 2e-6])
def test_the_range_of_adhesion_is_that_of_the_run(reach: float | str) -> None:
    """`auto` would be longer on cells of twice the side, which is other physics."""
    whole = jobs.load(data(adhesion={"work": 0.01, "range": reach}))
    halved = half_mesh.job_on_half_mesh(whole)
    assert choices(halved).adhesion == choices(whole).adhesion
