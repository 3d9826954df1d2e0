"""Leakage of a run: the flow through the gaps that it has saved, as leak.csv and a picture."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from .. import scene
from ..errors import InputError
from ..job.resolved import RESOLVED, shown_job
from ..leakage.flow import Leak, Map, leak
from ..parallel.mpi import MPI
from ..parallel.slab import Slab
from ..plotting import leakage
from ..plotting.run import Fields, Run
from ..storage import files, hdf5, tables

TABLE, PICTURE = "leak.csv", "leak.png"
NEEDS = "leakage needs the gap and where contact is: output: {fields: [pressure, gap]} saves both"


class Instant(NamedTuple):
    """One row of leak.csv.

    `flow_x` and `flow_y` are the conductivities K [m^3], `share_x` and `share_y` these over K of the surface that just
    touches; `constriction` [m] is the smallest gap on the widest path.
    """

    time: float
    pressure: float
    contact_area: float
    flow_x: float
    flow_y: float
    percolates_x: int
    percolates_y: int
    constriction: float
    share_x: float
    share_y: float


class Gaps:
    """The saved gaps of a run, 0 in contact; those of the instant that is asked for, else all."""

    def __init__(self, directory: Path, at: str = "") -> None:
        if not (directory / "measures.csv").is_file():
            raise InputError(f"{directory} is no output directory of a run; those of a sweep are in its cases/")
        self.directory, self.job = directory, shown_job(directory / RESOLVED)
        self.size, self.periodic = self.job.grid.size, self.job.grid.boundary == "periodic"
        self.columns = tables.read(directory / "measures.csv")
        try:
            with self._open() as file:
                if not {"gap", "pressure"} <= set(file):
                    raise InputError(f"{directory / 'fields.h5'}: {NEEDS}")
                self.fields = Fields(file, at)
                self.shown = self.fields.shown
        except hdf5.FAILURES as error:
            raise InputError(f"{directory / 'fields.h5'} cannot be read: {hdf5.reason(error)}; {NEEDS}") from None
        if not self.shown:
            raise InputError(f"{directory}: no map is saved yet")

    def _open(self) -> h5py.File:
        return h5py.File(self.directory / "fields.h5", "r", locking=False)

    def read(self, index: int) -> Map:
        """Return the gap [m] at a saved instant."""
        with self._open() as file:
            gap, pressure = file["gap"][index], file["pressure"][index]
        return np.where(pressure > 0.0, 0.0, np.maximum(gap, 0.0))

    def bare(self) -> Map:
        """Return the gap [m] of the undeformed surface that just touches; 0 where heights came from a file, which is
        not read again and shows as flat."""
        if any(part.shape == "flat" for part in self.job.surface):
            return np.zeros(self.job.grid.points[::-1])
        setup = scene.set_up(self.job, Slab(MPI.COMM_SELF, *self.job.grid.points))
        heights = setup.surface.heights((0.0, 0.0), setup.slab.empty()) * setup.units.height
        return np.asarray(heights.max() - heights, dtype=float)

    def row(self, index: int, found: Leak, bare: Leak) -> Instant:
        """Return the row of a saved instant."""
        rows = np.flatnonzero(self.columns["step"] == self.fields.steps[index])
        row = {name: float(self.columns[name][rows[-1]]) if rows.size else np.nan for name in Instant._fields[1:3]}
        return Instant(
            float(self.fields.times[index]),
            row["pressure"],
            row["contact_area"],
            found.flow_x,
            found.flow_y,
            int(found.along_x.percolates),
            int(found.along_y.percolates),
            found.constriction,
            found.flow_x / bare.flow_x if bare.flow_x else np.nan,
            found.flow_y / bare.flow_y if bare.flow_y else np.nan,
        )


def write(directory: Path, at: str, comm: MPI.Intracomm) -> Iterator[str]:
    """Solve for the flow of the saved instants, each on one rank, and write leak.csv and leak.png; collective.

    Returns, on root, what to say. Raises InputError for a directory without gaps.
    """
    gaps = Gaps(directory, at)
    gaps.shown = comm.bcast(gaps.shown)  # a run that goes on may have saved more since another rank has looked
    bare = leak(gaps.bare(), gaps.size, gaps.periodic) if comm.rank == 0 else None
    mine = {index: leak(gaps.read(index), gaps.size, gaps.periodic) for index in gaps.shown[comm.rank :: comm.size]}
    drawn = max((index for index, one in mine.items() if one.constriction > 0.0), default=-1)
    drawn = comm.allreduce(drawn, MPI.MAX)
    drawn = gaps.shown[-1] if drawn < 0 else drawn
    found = comm.gather({index: one if index == drawn else _without_maps(one) for index, one in mine.items()})
    if found is None or bare is None:
        return
    leaks = {index: one for part in found for index, one in part.items()}
    rows = [gaps.row(index, leaks[index], bare) for index in gaps.shown]
    lines = [",".join(Instant._fields), *(",".join(repr(value) for value in row) for row in rows)]
    files.write(directory / TABLE, "\n".join(lines) + "\n")
    run = Run(directory)
    instant = run.instant(int(gaps.fields.steps[drawn]), float(gaps.fields.times[drawn]))
    picture = leakage.draw(directory / PICTURE, gaps.size, gaps.read(drawn), leaks[drawn], instant, rows)
    yield f"leakage at {len(rows)} {'instant' if len(rows) == 1 else 'instants'}: {directory / TABLE}"
    yield f"picture: {picture}"


def _without_maps(found: Leak) -> Leak:
    """Return a flow without its maps of pressure, which only the picture needs."""
    none = np.empty((0, 0))
    return Leak(replace(found.along_x, pressure=none), replace(found.along_y, pressure=none))
