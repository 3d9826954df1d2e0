"""Checks of the machine: ranks, libraries, speed, and files that a run writes and reads."""

import math
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

import h5py
import numpy as np

from .. import capabilities, private
from ..job import Job, load
from ..parallel.root import on_root
from ..parallel.slab import Slab
from ..run import runner
from ..run.run import Options
from ..storage import header
from .bench import Bench
from .small_jobs import GLASSY, Json, crossed, sphere, zener

if TYPE_CHECKING:
    from mpi4py import MPI

PER_POINT = 1.2e-8  # time of an operator call per point on a machine of 2022 [s], for the share that is named
POINTS = 512  # tuning: points along each side of the contact that is timed
SLOW = 4.0  # tuning: time of an operator call above which a warning is given, over the usual time
SLOW_DISK = 50e6  # tuning: writing rate below which a warning is given [bytes/s]
TRIED_BYTES = 32 << 20  # tuning: size of the file that is written to measure the rate [bytes]
SAME = 1e-6  # accuracy: limit on the difference of pressures, over the largest pressure
STEPS = 4  # tuning: steps of the run whose files are read back


def describe_machine(comm: "MPI.Intracomm", where: Path) -> Iterator[str]:
    """Yield lines on ranks, libraries and times, and warnings; collective: all ranks must exhaust the iterator."""
    yield from header.lines(comm)
    yield f"HDF5 {h5py.version.hdf5_version}"
    cores = len(os.sched_getaffinity(0))
    here = sum(name == os.uname().nodename for name in comm.allgather(os.uname().nodename))
    if here > cores:
        yield f"warning: {here} ranks share {cores} cores of this machine"
    bench = Bench(comm)
    loads = [{"pressure": 1e4}, {"pressure": 1.1e4}]
    _, rows = bench.march(crossed(loads, POINTS, material=zener(GLASSY, [], []), numerics={"tolerance": 1e-6}))
    seconds, usual = rows[-1].seconds / rows[-1].operator_calls, PER_POINT * POINTS**2 / comm.size
    yield f"{POINTS} x {POINTS} points: {1e3 * seconds:.3g} ms per operator call"
    if seconds > SLOW * usual:
        yield f"warning: this is slow, {1e3 * usual:.2g} ms is usual; do other programs run, or too many threads?"
    rate = comm.bcast(_measure_write_rate(where))
    yield f"files: {rate / 1e6:.3g} MB/s in {where}"
    if rate < SLOW_DISK:
        yield f"warning: this is slow, {SLOW_DISK / 1e6:g} MB/s is usual; save fewer fields, or write to another disk"


def prepare_loops(comm: "MPI.Intracomm") -> str:
    """Run small jobs so that the loops that checks do not need are compiled too; return a line. Collective.

    The jobs slide steadily, slide in mixed precision, and adhere in both boundaries. Capabilities have loops of their
    own.
    """
    began = time.perf_counter()
    touch = {"pressure": 3e4, "duration": 1e-3, "time_step": 5e-4}
    slide = {"pressure": 3e4, "velocity": 0.03, "distance": 3e-5, "cells_per_step": 1}
    road = {"shape": "rough", "hurst": 0.9, "rms_slope": 0.02, "seed": 1}  # its steady sliding needs every solver
    road |= {"long_wavelength": 2.5e-4, "short_wavelength": 6.25e-5}
    rough: Json = {"grid": {"points": 32, "size": 1e-3}, "surface": road, "numerics": {"tolerance": 5e-3}}
    steady, energy = {"state": "steady", "velocity": 0.03, "pressure": 3e4}, {"energy": True}
    Bench(comm).march(crossed([slide], **rough, initial=steady))
    Bench(comm).march(crossed([touch, slide], **rough, output=energy))
    Bench(comm, "mixed").march(crossed([touch, slide], **rough))
    sticking: Json = {"adhesion": {"work": 1e-3, "range": 1e-6}}
    for adhesion in ({}, sticking):
        Bench(comm).march(crossed([touch], **adhesion, output=energy, numerics=rough["numerics"]))
        Bench(comm).march(sphere([touch], **adhesion, output=energy, numerics=rough["numerics"]))
    for compile_loops in capabilities.offers("effect", "compile_loops"):
        compile_loops()
    place = private.directory("compiled")
    kept = f"kept in {place}" if place else "not kept, as there is no private cache directory"
    return f"compiled loops: ready after {time.perf_counter() - began:.2g} s, {kept}"


def find_broken_files(comm: "MPI.Intracomm", where: Path) -> str:
    """Run a small job in two parts in a directory and compare its fields; return a message or ''. Collective."""
    place = Path(comm.bcast(tempfile.mkdtemp(prefix="doctor-", dir=where) if comm.rank == 0 else None))
    try:
        stage = {"pressure": 1e4, "duration": 1e-3, "time_step": 1e-3 / STEPS}
        output = {"directory": str(place / "out"), "fields": ["pressure"], "every": 1}
        given = Job.model_validate(crossed([stage], output=output, numerics={"tolerance": 1e-6}))
        on_root(comm, lambda: (place / "job.yaml").write_text(given.resolved()))
        job = load(place / "job.yaml")
        slab = Slab(comm, *job.grid.points)
        for until in (0.5e-3, None):
            runner.run_job(job, slab, Options(quiet=True, until=until))
        bench = Bench(comm)
        march, _ = bench.march(crossed([stage], numerics=job.numerics.model_dump()))
        expected = bench.whole(march, "pressure")
        with h5py.File(place / "out" / "fields.h5") as file:
            found = file["pressure"][-1]
        sound = np.allclose(found, expected, rtol=0.0, atol=SAME * expected.max())
        return (
            "" if comm.bcast(bool(sound)) else f"pressures in fields.h5 of a continued run are wrong; is {where} sound?"
        )
    finally:
        comm.Barrier()
        if comm.rank == 0:
            shutil.rmtree(place, ignore_errors=True)


def _measure_write_rate(directory: Path) -> float:
    """Return the writing rate [bytes/s] in the directory or its nearest existing parent, by a temporary file; NaN if
    that cannot be measured."""
    place = next(path for path in (directory.absolute(), *directory.absolute().parents) if path.is_dir())
    with suppress(OSError), TemporaryFile(dir=place) as file:
        data = os.urandom(TRIED_BYTES)
        began = time.perf_counter()
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
        return TRIED_BYTES / (time.perf_counter() - began)
    return math.nan
