"""An effect of a user's own, with a section of the job, a map, memory and a column: the one that the manual shows."""

import pickle
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import pytest
import yaml
from csv_rows import Rows, rows
from marched_jobs import begun, marched
from mpi4py import MPI
from numpy.testing import assert_allclose
from restarting import Bench

from parcontact import __main__, job
from parcontact.door import memory
from parcontact.errors import InputError
from parcontact.job import Job, JobError
from parcontact.march import choices, scene
from parcontact.march.steady import SteadySliding
from parcontact.parallel.slab import Slab

from .tread_wear import forget, install, shown

pytestmark = pytest.mark.mpi(2)

NX, NY, COEFFICIENT = 24, 10, 1e-12
PRESS = {"pressure": 1e5, "duration": 1e-3, "time_step": 5e-4}
SLIDE = {"pressure": 1e5, "velocity": 0.2, "distance": 0.5e-3, "cells_per_step": 1}
DATA: dict[str, Any] = {
    "grid": {"points": [NX, NY], "size": [1e-3, 0.4e-3]},
    "surface": [{"shape": "wave", "amplitude": 4e-6, "waves": waves} for waves in ([2, 0], [1, 1])],
    "material": {"modulus_inf": 1e6, "model": "zener", "branches": [{"modulus": 1e6, "relaxation_time": 1e-3}]},
    "history": [PRESS, SLIDE],
    "numerics": {"tolerance": 1e-10},
}
WEAR = {**DATA, "wear": {"coefficient": COEFFICIENT}}


@pytest.fixture
def installed(shared_path: Path, comm: MPI.Intracomm, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The directory in which the manual's effect is installed."""
    if comm.rank == 0:
        install(shared_path, shown())
    comm.Barrier()
    monkeypatch.syspath_prepend(str(shared_path))
    forget()
    yield shared_path
    forget()


def run(comm: MPI.Intracomm, where: Path, name: str, **options: Any) -> Rows:
    """Run the job with wear into a directory that all ranks see; the rows of measures.csv."""
    Bench(comm, where).run(WEAR, where / name, **options)
    comm.Barrier()
    return rows(where / name / "measures.csv")


def test_column_is_archards_law(installed: Path, comm: MPI.Intracomm) -> None:
    """Worn off in all: the constant times the mean pressure times the distance slid, to rounding."""
    march, rows = marched(WEAR, comm=comm)
    slab, (depth, _) = march.scene.slab, march.state.memories["wear"]
    worn = slab.sum(float(depth.sum()))[0] / slab.points
    assert_allclose(worn, COEFFICIENT * 1e5 * 0.5e-3, rtol=1e-12)
    assert [row.added[0] for row in rows[:4]] == [0.0] * 4  # nothing slides before
    assert rows[-1].added[0] == slab.reduce((), [float(depth.max(initial=0.0))])[0] > worn


def test_restart_on_another_number_of_ranks(installed: Path, comm: MPI.Intracomm) -> None:
    """What all ranks began one of them ends, and the other way round: the map and the column are those of a whole run.

    To the tolerance of a solve, 1e-10, times the few steps in which it matters.
    """
    alone = MPI.COMM_SELF
    depths, columns = {}, {}
    whole = run(comm, installed, "whole")
    for name, first, second in (("fewer", comm, alone), ("more", alone, comm)):
        for ranks, until in ((first, 2e-3), (second, None)):
            if ranks is comm or comm.rank == 0:
                run(ranks, installed, name, until=until)
            comm.Barrier()
    for name in ("whole", "fewer", "more"):
        with h5py.File(installed / name / "checkpoint" / "step-15.h5") as file:
            depths[name] = file["wear/depth"][()]
        columns[name] = [float(row["wear_depth"]) for row in rows(installed / name / "measures.csv")]
    assert len(whole) == len(columns["whole"]) == 16
    for name in ("fewer", "more"):
        assert_allclose(depths[name], depths["whole"], rtol=0, atol=1e-7 * depths["whole"].max())
        assert_allclose(columns[name], columns["whole"], rtol=1e-7)
    assert columns["whole"][-1] == depths["whole"].max() > 0.0


def test_a_job_reaches_other_ranks(installed: Path, comm: MPI.Intracomm) -> None:
    """A job with a section of an effect is one class, also for who unpickles it, and resolves to itself."""
    own = Job.model_validate(WEAR)
    assert pickle.loads(pickle.dumps(own)) == own == comm.bcast(own)
    assert isinstance(own, Job)
    assert own.section("wear").coefficient == COEFFICIENT
    again = Job.model_validate(yaml.safe_load(own.resolved()))
    assert again == own
    assert list(choices.choices(again).effects) == ["wear"]
    assert begun(DATA).scene.job.section("wear") is None


def test_mistakes_have_their_place(installed: Path, comm: MPI.Intracomm) -> None:
    """As in any section; a section of no effect is an unknown key."""
    path = installed / f"bad-{comm.rank}.yaml"
    for text, expected in {
        "wear: {coeficient: 1.0}": ":8: wear.coeficient is not a known key; did you mean coefficient?",
        "wear: {coefficient: -1.0}": ":21: wear.coefficient must be a positive coefficient of wear [1/Pa], got -1.0",
        "wear: 3": ":7: wear must be a mapping of keys, got 3",
        "ware: {}": ":1: ware is not a known key",
    }.items():
        path.write_text(f"{text}\n{yaml.safe_dump(DATA)}")
        with pytest.raises(JobError) as error:
            job.load(path)
        assert any(f"{path}:1{expected}" in mistake for mistake in error.value.mistakes), error.value.mistakes


def test_plan_tells_of_it(
    installed: Path, comm: MPI.Intracomm, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a user reads it."""
    if comm.size > 1:
        return
    monkeypatch.setenv("XDG_CACHE_HOME", str(installed / "cache"))
    (installed / "job.yaml").write_text(yaml.safe_dump(WEAR))
    assert __main__.main(["plan", str(installed / "job.yaml"), "--ranks", "1", "--seconds", "0.1"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^  on   wear +the job has a section wear$", said, re.M)
    assert re.search(r"^  wear +0.00192$", said, re.M)


SHEAR = """
    @staticmethod
    def shear(job):
        from parcontact.physics.surface import InterfaceFriction

        return InterfaceFriction(2e4)

    @staticmethod
    def maps"""


def test_its_shear_adds_to_that_of_others(shared_path: Path, comm: MPI.Intracomm, monkeypatch: Any) -> None:
    """Forces of two shear stresses on the area that touches, in a march and in steady sliding: 2e4 and 3e4 Pa make
    what 5e4 Pa make, to rounding."""
    if comm.rank == 0:
        install(shared_path, shown().replace("\n    @staticmethod\n    def maps", SHEAR, 1))
    comm.Barrier()
    monkeypatch.syspath_prepend(str(shared_path))
    forget()
    both = {**WEAR, "interface": {"shear_stress": 3e4}}
    alone = {**DATA, "interface": {"shear_stress": 5e4}}
    found, expected = (marched(data, comm=comm)[1][-1].measures for data in (both, alone))
    assert found.force_interface == pytest.approx(expected.force_interface, rel=1e-14)
    assert found.friction == pytest.approx(expected.friction, rel=1e-14)
    hot = {**WEAR, "thermal": {"conductivity": 0.2, "diffusivity": 1e-7}}
    maps = [entry for entry in marched(hot, comm=comm)[0].entries().values() if entry.is_map]
    assert memory.saved(Job.model_validate(hot)) == len(maps) * NY * (8 * NX + 4)  # with the spectrum of its heat
    slab = Slab(comm, NX, NY)
    setups = (scene.set_up(Job.model_validate(data), slab) for data in (both, alone))
    one, other = (SteadySliding(setup).solve((0.2, 0.0), 1e5) for setup in setups)
    assert one.friction == pytest.approx(other.friction, rel=1e-14)
    forget()


@pytest.mark.parametrize("name", ["contact", "energy", "plans"])
def test_names_of_parts_are_refused(shared_path: Path, comm: MPI.Intracomm, monkeypatch: Any, name: str) -> None:
    """An effect cannot take the place of a part of the run, also where the run has no such part: energies are off."""
    if comm.rank == 0:
        install(shared_path, shown().replace('Decision("wear"', f'Decision("{name}"'))
    comm.Barrier()
    monkeypatch.syspath_prepend(str(shared_path))
    forget()
    with pytest.raises(InputError, match=f"the effect {name} cannot be used: a run keeps a part of its own"):
        run(comm, shared_path, "taken")
    comm.Barrier()  # root removes what it has begun
    assert not (shared_path / "taken").exists()
    with pytest.raises(InputError, match=f"the effect {name} cannot be used"):
        memory.total_bytes(Job.model_validate(WEAR))
    forget()
