"""The same contact on any number of ranks.

Ranks add their sums in another order and transform in other blocks: fields solved to 1e-11 of the surface's height
agree to 1e-9 of their largest value, on grids that divide evenly and on others, and with more ranks than rows.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np
import pytest
from csv_rows import rows
from mpi4py import MPI

from parcontact import job
from parcontact.march import scene
from parcontact.march.loop import March, run_steps
from parcontact.parallel.slab import Slab

if TYPE_CHECKING:
    from conftest import RunParcontact

JOB = """
grid: {points: [60, 60], size: [1.0e-3, 8.0e-4]}
surface:
  - {shape: rough, hurst: 0.8, long_wavelength: 4.0e-4, short_wavelength: 1.0e-4, rms_height: 1.0e-6, seed: 4}
  - {shape: sphere, radius: 2.0e-2}
material: {model: elastic, poisson: 0.5, shear_modulus: 1.0e6}
history: [{pressure: 5.0e3}, {pressure: 2.0e4}]
numerics: {tolerance: 1.0e-11}
output: {fields: [pressure, displacement, gap, height]}
"""
ROWS = "surface={shape: wave, amplitude: 1.0e-6, waves: [3, 1], phase: 0.3}"  # of 3 rows: no rough wave would fit
GRIDS = {
    "even": [],
    "free": ["grid.boundary=free"],
    "odd": ["grid.points=[45, 37]"],
    "odd, free": ["grid.points=[37, 45]", "grid.boundary=free"],
    "few rows": ["grid.points=[64, 3]", ROWS],
    "one row": ["grid.points=[64, 1]", ROWS.replace("[3, 1]", "[3, 0]")],
}
FIELDS = ("pressure", "displacement", "gap", "height")


def solved(path: Path, comm: MPI.Intracomm, *overrides: str) -> March:
    """A march at the end of a job, on the ranks of `comm`."""
    loaded = job.load(path, overrides)
    done = March(scene.build(loaded, Slab(comm, *loaded.grid.points)))
    run_steps(done, [])
    return done


@pytest.fixture
def path(shared_path: Path, comm: MPI.Intracomm) -> Path:
    path = shared_path / "job.yaml"
    if comm.rank == 0:
        path.write_text(JOB)
    comm.barrier()
    return path


@pytest.mark.mpi(4)
@pytest.mark.parametrize("grid", GRIDS)
def test_fields_do_not_depend_on_the_ranks(path: Path, communicators: list[MPI.Intracomm], grid: str) -> None:
    alone = solved(path, MPI.COMM_SELF, *GRIDS[grid])
    for comm in communicators:
        together = solved(path, comm, *GRIDS[grid])
        rows = together.scene.slab.rows
        for name in FIELDS:
            expected = alone.field(name)
            found = together.field(name)
            assert found.shape == expected[rows].shape
            assert np.abs(found - expected[rows]).max(initial=0.0) <= 1e-9 * np.abs(expected).max()
        assert together.row.measures.contact_area == alone.row.measures.contact_area


@pytest.mark.mpi
def test_all_ranks_see_the_same_row(path: Path, comm: MPI.Intracomm) -> None:
    """To the last bit: what a rank decides by it, all decide."""
    row = solved(path, comm).row
    assert len({repr((other.measures, other.iterations, other.certificate)) for other in comm.allgather(row)}) == 1


def test_files_of_more_ranks_than_rows(path: Path, tmp_path: Path, run_parcontact: "RunParcontact") -> None:
    """As a user runs it, on more ranks than rows, against this process alone."""
    settings = [word for override in GRIDS["few rows"] for word in ("--set", override)]
    process = run_parcontact([path, "--quiet", "--out", tmp_path / "out", *settings], ranks=4)
    assert process.returncode == 0, process.stderr
    alone = solved(path, MPI.COMM_SELF, *GRIDS["few rows"])
    with h5py.File(tmp_path / "out" / "fields.h5") as file:
        for name in FIELDS:
            expected, found = alone.field(name), file[name][-1]
            assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()
    row = rows(tmp_path / "out" / "measures.csv")[-1]
    for column in ("pressure", "contact_area", "max_pressure"):
        value = getattr(alone.row.measures, column)
        assert abs(float(row[column]) - value) <= 1e-9 * value
