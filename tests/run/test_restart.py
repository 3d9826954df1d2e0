"""A run that was cut into pieces is the run that was not, to the last bit, on any number of ranks."""

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from mpi4py import MPI
from restarting import ELASTIC, FASTER, PRESS, ROUGH, SCENES, SLIDE, TOUCH, Bench, cut, maps, part_way, rows, same

from parcontact.__main__ import main
from parcontact.errors import InputError
from parcontact.files import checkpoint, run, tables
from parcontact.files.hdf5 import read_budget
from parcontact.files.run import chosen_by_accuracy
from parcontact.job import Job
from parcontact.results import info


def cut_anywhere(bench: Bench, data: dict[str, Any], apart: int = 1) -> None:
    """Cut after every step, or only after those that are `apart`, and after the last but one; on more ranks after 3."""
    whole = bench.where / "whole"
    assert bench.run(data, whole) == 0
    total = len(rows(whole)) - 1
    assert total >= 8
    every = sorted({*range(0, total, apart), total - 1})
    for step in every if bench.comm.size == 1 else (1, total // 2, total - 1):
        part = cut(bench, whole, step)
        assert bench.run(data, part) == 0
        if bench.comm.rank == 0:
            same(whole, part, total)


@pytest.mark.mpi(2)
@pytest.mark.parametrize("name", SCENES)
def test_cut_anywhere(bench: Bench, name: str) -> None:
    """k steps, and the other N - k after a restart, equal all N at once; for every k of one scene, that of the initial
    state too, and for some k of the others."""
    cut_anywhere(bench, bench.job(name), {"viscoelastic": 1, "chosen": 16}.get(name, 8))


@pytest.mark.mpi(2)
def test_a_finished_run_of_chosen_steps_has_nothing_to_do(bench: Bench) -> None:
    """The same command a second time ends with 0 and changes no file."""
    out = bench.where / "out"
    assert bench.run(bench.job("chosen"), out) == 0
    bench.comm.Barrier()
    before = {path: path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}
    bench.comm.Barrier()
    assert bench.run(bench.job("chosen"), out) == 0
    assert {path: path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()} == before


def test_the_error_budget_is_that_of_the_whole_run(bench: Bench) -> None:
    """Also after a restart: what the files and the log say are the means of all rows of measures.csv in which the
    surface slides, over the distance; of friction in proportion to it."""
    data = bench.job("viscoelastic")
    whole = bench.where / "whole"
    assert bench.run(data, whole) == 0
    part = cut(bench, whole, 9)
    assert bench.run(data, part) == 0
    table = tables.read_columns(part / "measures.csv")
    slid, friction, errors, area = (
        np.array(column)[1:]
        for column in (
            np.diff(table["distance"], prepend=0.0),
            table["friction"],
            table["error_friction"],
            table["error_area"],
        )
    )
    slides = slid > 0.0
    weight = (slid * friction)[slides]
    for out in (whole, part):
        with h5py.File(out / "fields.h5") as file:
            budget = read_budget(file)
        assert budget["accuracy"] == 0.01
        assert budget["friction"]["total"] == pytest.approx((weight @ errors[slides]) / weight.sum(), rel=1e-12)
        mean = (slid @ area) / slid.sum()
        assert budget["contact_area_corrected"]["total"] == pytest.approx(mean, rel=1e-12)
        said = f"estimated error of friction: {100 * budget['friction']['total']:.3g} % ("
        lines = (out / "run.log").read_text().splitlines()
        assert said in [line for line in lines if "error of friction" in line][-1]
        assert (
            f"error of friction: solver {100 * budget['friction']['solver']:.2g} %"
            in info.describe_path(out / "fields.h5")[0]
        )
        with h5py.File(max(out.glob("checkpoint/*.h5"), key=lambda path: path.stat().st_mtime)) as file:
            assert read_budget(file) == budget


@pytest.mark.mpi(4)
@pytest.mark.parametrize(("first", "second"), [(2, 3), (3, 1), (1, 4)])
@pytest.mark.parametrize("name", ["viscoelastic", "free"])
def test_other_ranks(
    comm: MPI.Intracomm, communicators: list[MPI.Intracomm], shared_path: Path, first: int, second: int, name: str
) -> None:
    """A run goes on with another number of ranks to the result of one rank, but for the solver's tolerance."""
    if max(first, second) > comm.size:
        pytest.skip("needs more ranks")
    groups = {group.size: Bench(group, shared_path) for group in communicators}
    out, whole = shared_path / "out", shared_path / "whole"
    data = Bench(comm, shared_path).job(name, numerics={"tolerance": 1e-9})
    if 1 in groups:
        assert groups[1].run(data, whole) == 0
    if first in groups:
        assert groups[first].run(data, out, until=1.2e-3) == 0
    comm.Barrier()
    if second in groups:
        assert groups[second].run(data, out) == 0
    comm.Barrier()
    if comm.rank == 0:
        for one, other in zip(rows(whole), rows(out), strict=True):
            for key in ("time", "distance", "force_x", "contact_area", "approach", "work", "dissipated"):
                assert float(one[key]) == pytest.approx(float(other[key]), rel=1e-6, abs=1e-12)
        contents = checkpoint.inspect(out / f"checkpoint/step-{len(rows(out)) - 1}.h5")
        assert [link.ranks for link in contents.chain] == [first, second]
    comm.Barrier()


# -- from which checkpoint a run goes on, and which are kept ----------------------------------------------------------


def damage(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-9] ^= 4
    path.write_bytes(data)


def newer(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"format 2", b"format 3", 1))


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5000])


def of_another_job(path: Path) -> None:
    shutil.copy(path.parents[2] / "other" / "checkpoint" / path.name, path)


FAULTS = [
    (damage, "is damaged"),
    (newer, "of a newer parcontact"),
    (truncate, "is damaged: it has 5000 bytes instead of"),
    (of_another_job, "belongs to another job: surface.0.seed was 4, is 3"),
]


@pytest.mark.parametrize(("fault", "message"), FAULTS)
def test_falls_back(
    bench: Bench, capfd: pytest.CaptureFixture[str], fault: Callable[[Path], None], message: str
) -> None:
    """A checkpoint that will not do is passed over with one message; without a good one nothing is done."""
    data = bench.job("viscoelastic")
    bench.run(bench.job("viscoelastic", surface={"seed": 4}), bench.where / "other")
    out, whole = part_way(bench, data), bench.where / "whole"
    bad = [out / "checkpoint" / f"step-{step}.h5" for step in (5, 6)]
    for path in bad:
        fault(path)
    capfd.readouterr()
    assert bench.run(data, out) == 0
    warnings = [line for line in capfd.readouterr().err.splitlines() if "skipped" in line]
    assert len(warnings) == 2
    assert all(message in line and str(path) in line for line, path in zip(warnings, reversed(bad), strict=True))
    same(whole, out, len(rows(whole)) - 1)
    for path in (out / "checkpoint").glob("step-*.h5"):
        fault(path)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(InputError) as raised:
        bench.run(data, out)
    assert message in str(raised.value)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_restart_from_a_path(bench: Bench) -> None:
    """From an earlier checkpoint of the same directory, whose later ones are put aside; or from another directory."""
    data, whole = bench.job("viscoelastic"), bench.where / "whole"
    out = part_way(bench, data)
    total = len(rows(whole)) - 1
    assert bench.run(data, out, restart=str(out / "checkpoint" / "step-3.h5"), until=0.0007) == 0
    assert [row["step"] for row in rows(out)] == ["0", "1", "2", "3", "4", "5"]
    aside = sorted(path.name for path in (out / "checkpoint").glob("*.aside"))
    assert aside == [f"step-{step}.h5.aside" for step in (4, 5, 6)]
    assert bench.run(data, out) == 0
    same(whole, out, total)
    new = bench.where / "new"
    assert bench.run(data, new, restart=str(whole / "checkpoint" / "step-6.h5")) == 0
    assert rows(new) == rows(whole)[7:]
    assert maps(new / f"checkpoint/step-{total}.h5") == maps(whole / f"checkpoint/step-{total}.h5")


# -- which settings a run may change when it goes on, and which are refused -------------------------------------------

REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"grid": {"points": [20, 16]}}, "grid.points was [20, 14], is [20, 16]"),
    ({"grid": {"size": [2e-3, 7e-4]}}, "grid.size was [0.001, 0.0007], is [0.002, 0.0007]"),
    ({"surface": {"seed": 4}}, "surface.0.seed was 3, is 4"),
    ({"surface": {**ROUGH, "rms_slope": None, "rms_height": 1e-6}}, "surface.0.rms_slope was 0.02, is None"),
    ({"material": {"modulus_inf": 2e6}}, "material.modulus_inf was 1000000.0, is 2000000.0"),
    ({"material": ELASTIC}, "material.model was zener, is elastic"),
    ({"body": {"thickness": 1e-3}}, "body.thickness was None, is 0.001"),
    ({"numerics": {"integrator": "backward-euler"}}, "numerics.integrator was exponential, is backward-euler"),
    ({"numerics": {"kernel": "love"}}, "numerics.kernel was spectral, is love"),
    ({"numerics": {"precision": "mixed"}}, "numerics.precision was double, is mixed"),
    (
        {"history": [{**PRESS, "pressure": 2e5}, SLIDE, FASTER]},
        "step 1 of the 6 completed ones had pressure 100000.0, but has pressure 200000.0 (history.0.pressure was "
        "100000.0, is 200000.0); to change what follows, end the running stage at t = 0.00125 s",
    ),
    (
        {"history": [PRESS, {**SLIDE, "velocity": 0.3}, FASTER]},
        "step 6 of the 6 completed ones ended at t = 0.00125 s, but ends at 0.00116666",
    ),
    ({"history": [PRESS]}, "step 6 of the 6 completed ones ended at t = 0.00125 s, but ends at 0.0015"),
    ({"history": [TOUCH]}, "6 steps were completed, but the job has 1 up to t = 0.00125 s"),
]


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bench, Path]:
    """A run that was stopped after its sixth step, and where it is."""
    bench = Bench(MPI.COMM_SELF, tmp_path_factory.mktemp("stopped"))
    return bench, part_way(bench, bench.job("viscoelastic"))


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_refused(stopped: tuple[Bench, Path], changes: dict[str, Any], message: str) -> None:
    """Another problem, or another past: both values are shown, and nothing is written."""
    bench, out = stopped
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(InputError) as raised:
        bench.run(bench.job("viscoelastic", **changes), out)
    assert max(of_one.count(message) for of_one in str(raised.value).split("step-")) == 1  # for each checkpoint
    assert "give --restart never to start from the beginning" in str(raised.value)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_changed_step_of_the_same_history(stopped: tuple[Bench, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps may differ although no key of the history does: no empty list of keys is shown."""
    bench, out = stopped
    monkeypatch.setattr(run, "find_changed_step", lambda contents, job: "step 1 differs")
    with pytest.raises(InputError, match="step 1 differs; to change what follows"):
        bench.run(bench.job("viscoelastic"), out)


def test_results_beyond_a_shorter_history(bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    """Steps that are chosen go on in the last stage by --until, so a stage made shorter has results: that is said."""
    slide = {"pressure": 1e5, "velocity": 0.2, "distance": 2e-4}
    out = bench.where / "longer"
    assert bench.run(bench.job("viscoelastic", history=[slide]), out) == 0
    shorter = bench.job("viscoelastic", history=[{**slide, "distance": 1e-4}])
    path = out.with_suffix(".yaml")
    path.write_text(yaml.safe_dump(shorter))
    assert main([str(path), "--out", str(out)]) == 0
    said = "finished before, at t = 0.001 s, beyond the end of the history at t = 0.0005 s"
    assert said in capsys.readouterr().out


def test_other_settings(bench: Bench) -> None:
    """Tolerance, outputs, checkpoints and what is still to come may change; measures go on with the new columns."""
    out = part_way(bench, bench.job("viscoelastic"))
    changes = {
        "title": "another",
        "numerics": {"tolerance": 1e-6},
        "output": {"fields": ["gap"], "every": 4, "branch_dissipation": False},
        "checkpoint": {"every": 100, "keep": 1},
        "history": [PRESS, SLIDE, {**SLIDE, "name": "back", "velocity": -0.2}, TOUCH],
    }
    changed = bench.job("viscoelastic", **changes)
    assert bench.run(changed, out) == 0
    assert bench.run(changed, bench.where / "afresh") == 0
    found, afresh, old = rows(out), rows(bench.where / "afresh"), rows(bench.where / "whole")
    assert [row["step"] for row in found] == [row["step"] for row in afresh]
    assert found[:7] == [{key: row[key] for key in found[0]} for row in old[:7]]
    assert float(found[-1]["friction"]) == pytest.approx(float(afresh[-1]["friction"]), rel=0.05)
    with h5py.File(out / "fields.h5") as file:
        assert file["step"][...].tolist() == [*range(1, 7), 8, 12, len(found) - 1]
        assert np.isnan(file["gap"][6:]).sum() == 0
    assert [path.name for path in (out / "checkpoint").iterdir()] == [f"step-{len(found) - 1}.h5"]
    contents = checkpoint.inspect(out / "checkpoint" / f"step-{len(found) - 1}.h5")
    assert [(link.from_step, "another" in link.job) for link in contents.chain] == [(0, False), (6, True)]


def test_later_energies(bench: Bench) -> None:
    """Energies count from the start: they cannot begin half-way, but they can end there."""
    silent = {"energy": False, "branch_dissipation": False}
    out = part_way(bench, bench.job("viscoelastic", output=silent))
    with pytest.raises(InputError, match=r"does not have energy/.*: output\.energy was off"):
        bench.run(bench.job("viscoelastic"), out)
    other = cut(bench, bench.where / "whole", 6)
    assert bench.run(bench.job("viscoelastic", output=silent), other) == 0


def test_surface_file(bench: Bench) -> None:
    """A file of heights may move, but not change."""
    heights = 1e-6 * np.random.default_rng(0).random((14, 20))
    np.save(bench.where / "heights.npy", heights)
    surface = {"shape": "file", "path": str(bench.where / "heights.npy")}
    out = part_way(bench, bench.job("viscoelastic", surface=[surface]))
    np.save(bench.where / "moved.npy", heights)
    moved = bench.job("viscoelastic", surface=[{**surface, "path": str(bench.where / "moved.npy")}])
    np.save(bench.where / "heights.npy", 2 * heights)
    with pytest.raises(InputError, match=r"surface\.0\.content was .*, is "):
        bench.run(bench.job("viscoelastic", surface=[surface]), out)
    assert bench.run(moved, out) == 0


# -- what a run advises where it is more wrong than asked for ---------------------------------------------------------


@pytest.mark.parametrize(
    ("slide", "numerics", "parts"),
    [
        ({}, {}, {"solver", "time", "folded"}),
        ({"cells_per_step": 1}, {}, {"solver", "folded"}),
        ({}, {"accuracy": 0.03, "tolerance": 1e-4}, {"time", "folded"}),
        ({}, {"tolerance": 1e-4, "branch_error": 0.0}, {"time"}),
        ({}, {"tolerance": 5e-3, "branch_error": 1e-3}, {"time"}),  # given, though they are what would be chosen
    ],
)
def test_what_a_smaller_accuracy_would_help(slide: dict[str, Any], numerics: dict[str, Any], parts: set[str]) -> None:
    """The settings that it has chosen; steps are those of the slide, whatever a press has."""
    data = {
        "grid": {"points": 16, "size": 1e-3},
        "surface": {"shape": "flat"},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [
            {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-4},
            {"pressure": 1e4, "velocity": 0.1, "distance": 1e-4, **slide},
        ],
        "numerics": numerics,
    }
    assert chosen_by_accuracy(Job.model_validate(data)) == parts


def test_no_error_is_stated_where_the_box_cuts_a_contact_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps at the edge have no error, and the end says so; a step inside has one."""
    data = {
        "grid": {"points": 32, "size": 1e-3, "boundary": "free"},
        "surface": {"shape": "sphere", "radius": 1e-2},
        "material": {"model": "elastic", "shear_modulus": 1e6},
        "history": [{"force": 0.01}, {"force": 1.0}],
    }
    (tmp_path / "job.yaml").write_text(json.dumps(data))
    monkeypatch.chdir(tmp_path)
    for force, inside, name in ((1.0, False, "edge"), (0.011, True, "room")):
        assert main(["job.yaml", "--set", f"history.1.force={force}", "--set", f"output.directory={name}"]) == 0
        out = capsys.readouterr().out
        assert ("no error is stated for steps whose contact reaches the edge of the box" in out) != inside
        errors = tables.read_columns(tmp_path / name / "measures.csv")["error_area"]
        assert [math.isnan(error) for error in errors] == [True, False, not inside]
