"""Parts `start` and `checkpoint`: the command line, and what a checkpoint costs."""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from mpi4py import MPI
from runs import ROOT

from parcontact.job import Checkpoint
from parcontact.parallel.slab import Slab
from parcontact.physics.entries import Entry
from parcontact.storage import checkpoint
from parcontact.storage.checkpoint import Facts
from parcontact.storage.provenance import Link, Provenance

from .table import Line, compare, interleave, quartiles

PROGRAM = Path(sys.executable).with_name("parcontact")
TINY = ROOT / "jobs" / "westergaard.yaml"
BRANCHES = 12  # of the body that is saved


def start(_: int, rounds: int, __: argparse.Namespace) -> Iterator[Line]:
    """Wall times; the tiny job has five static solves on 1024 x 4 points."""
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory, "out")
        commands = {
            "import numpy": [sys.executable, "-c", "import numpy"],
            "parcontact --help": [PROGRAM, "--help"],
            "parcontact --version": [PROGRAM, "--version"],
            "parcontact check": [PROGRAM, "check", TINY],
            "a tiny job": [PROGRAM, TINY, "--quiet", "--restart", "never", "--out", out],
            "parcontact info": [PROGRAM, "info", out],
        }
        run = partial(subprocess.run, check=True, capture_output=True)
        calls = {name: partial(run, words) for name, words in commands.items()}
        yield from compare(interleave(calls, rounds, time.perf_counter, before=0), "import numpy")


def save(points: int, rounds: int, asked: argparse.Namespace) -> Iterator[Line]:
    """The state of a run by `numpy.tofile`, every rank into a file of its own, and as a checkpoint of all ranks; both
    wait until the disk (that of `--where`) has them; collective."""
    comm = MPI.COMM_WORLD
    slab = Slab(comm, points, points)
    where = Path(comm.bcast(tempfile.mkdtemp(dir=asked.where) if slab.root else None))
    names = ["contact/pressure", "contact/earlier pressure", "material/displacement"]
    names += [f"material/branch {k}" for k in range(BRANCHES)]
    rng = np.random.default_rng(comm.rank)
    entries = {name: Entry(rng.random(slab.shape)) for name in names}
    facts = Facts({}, Provenance((Link("", comm.size),)), step=1)

    def plain() -> None:
        with (where / f"rank{comm.rank}").open("wb") as file:
            for entry in entries.values():
                np.asarray(entry.value).tofile(file)
            file.flush()
            os.fsync(file.fileno())
        comm.Barrier()

    def whole() -> None:
        checkpoint.write(where / "step-1.h5", slab, facts, entries)
        comm.Barrier()

    def clear() -> None:
        for path in where.iterdir() if slab.root else ():
            path.unlink()
        comm.Barrier()

    turns = {"to clear 0": clear, "numpy.tofile": plain, "to clear 1": clear, "checkpoint": whole}
    times = interleave(turns, rounds, time.perf_counter)
    clear()
    if slab.root:
        where.rmdir()
    interval = 60.0 * (Checkpoint.model_validate({}).minutes or 0.0)
    bare, ours = times["numpy.tofile"], times["checkpoint"]
    yield Line("state", len(names) * slab.points * 8 / 1e6, "MB")
    yield Line("numpy.tofile, the fastest", min(bare), "s")
    yield Line("checkpoint, the fastest", min(ours), "s")
    yield quartiles("checkpoint over numpy.tofile", [b / a for a, b in zip(bare, ours, strict=True)])
    yield Line(f"share of the run time, every {interval:.0f} s", 100 * min(ours) / interval, "%")
