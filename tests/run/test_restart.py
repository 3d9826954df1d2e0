"""A run that was cut into pieces is the run that was not, to the last bit, on any number of ranks."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from restarting import FASTER, SCENES, SLIDE, Bench, cut, rows, same

from parcontact.storage import checkpoint, tables
from parcontact.storage.provenance import read_budget
from parcontact.summary import info


def cut_anywhere(bench: Bench, data: dict[str, Any], everywhere: bool = True) -> None:
    whole = bench.where / "whole"
    assert bench.run(data, whole) == 0
    total = len(rows(whole)) - 1
    assert total >= 8
    every = range(total) if everywhere else (0, 2, total - 1)
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
    cut_anywhere(bench, bench.job(name), name == "viscoelastic")


def test_cut_after_steady_start(bench: Bench) -> None:
    data = bench.job("viscoelastic", history=[SLIDE, FASTER], output={"energy": False, "branch_dissipation": False})
    initial = {"state": "steady", "velocity": 0.2, "pressure": 1e5}
    cut_anywhere(bench, data | {"initial": initial}, everywhere=False)


def test_the_error_budget_is_that_of_the_whole_run(bench: Bench) -> None:
    """Also after a restart: what the files and the log say are the means of all rows of measures.csv in which the
    surface slides, over the distance; of friction in proportion to it."""
    data = bench.job("viscoelastic")
    whole = bench.where / "whole"
    assert bench.run(data, whole) == 0
    part = cut(bench, whole, 9)
    assert bench.run(data, part) == 0
    table = tables.read(part / "measures.csv")
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
            in info.describe(out / "fields.h5")[0]
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
